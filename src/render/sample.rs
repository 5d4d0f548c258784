//! Prefiltered texture sampling. The twin of `shaders/sample.wgsl`.
//!
//! Textures are there in levels, four an octave, and a sample is bilinear on the level whose texels are the next smaller than a
//! pixel: three in four pixels to nearly one. Bilinear mixing blurs by itself; coarser levels cost features, finer ones flicker
//! (`tests/vision.rs`, `tests/shimmer.rs`). Coordinates and weights are fixed-point numbers and texels are mixed as integers, in the same order on both processors,
//! so that CPU and GPU agree to the bit once they agree on a coordinate. The GPU takes pixel after pixel; here a run of pixels
//! is sampled at once. Functions are inlined throughout, so that they run on the vector unit that their caller was compiled for.

use super::scene::{Material, MipLevel};
use super::texels::{Block, LookUp, Pair, Texels, pairs, whole};

pub(super) use super::texels::LANES;

/// Most rows of a column that are sampled at once.
pub(super) const RUN: usize = 240;
/// Most texels along v that a run of rows covers on a level, a power of two: at most four in three rows, for [`strip_footprint`]
/// sees to that.
const REACH: usize = 512;
/// Adding this rounds a number of magnitude below 2^22 to a whole one, which then stands in the low bits.
const ROUNDER: f32 = 12_582_912.0;

/// `x` rounded to the nearest whole number; its magnitude must be below 2^22.
#[inline(always)]
pub(super) fn round(x: f32) -> i32 {
    ((x + ROUNDER).to_bits() as i32).wrapping_sub(ROUNDER.to_bits() as i32)
}

/// What a pixel covers of an upright surface, in tiles along the axis that counts: `u_m` by `v_m`.
///
/// The texture is filtered the same along both axes. Taking the long side would blur surfaces that are seen at a flat angle,
/// the short side would let them flicker; half the long side is the compromise.
#[inline(always)]
pub(super) fn footprint(material: &Material, [u_m, v_m]: [f32; 2]) -> f32 {
    let (u, v) = (u_m * material.tiles_per_m[0], v_m * material.tiles_per_m[1]);
    (0.5 * u.max(v)).max(u.min(v))
}

/// The same where u is seen at a slant and v is not, and [`REACH`] asks that v is never undersampled.
#[inline(always)]
fn strip_footprint([u_per_m, v_per_m]: [f32; 2], [u_m, v_m]: [f32; 2]) -> f32 {
    (0.5 * (u_m * u_per_m)).max(v_m * v_per_m)
}

/// The level for a pixel that covers so much of a tile: 1.06 to 1.34 texels of it are a pixel. The logarithm is read off the bits
/// of the number, linear between powers of two: the same on all machines. It is up to 0.086 too small, for half of which the
/// rounding makes up.
#[inline(always)]
pub(super) fn level(material: &Material, footprint: f32) -> MipLevel {
    let number = level_number(footprint * material.levels[0].size as f32, material.last_level as i32);
    material.levels[number as usize]
}

/// Its number, for a pixel that covers so many texels of the finest level; `last` is the number of the coarsest.
#[inline(always)]
fn level_number(texels: f32, last: i32) -> i32 {
    /// Half of 0.086, less half a quarter.
    const ROUNDING: i32 = (-0.082 * (1 << 23) as f32) as i32;
    let logarithm = (texels.to_bits() as i32).wrapping_sub(1.0_f32.to_bits() as i32);
    (logarithm.wrapping_add(ROUNDING) >> 21).max(0).min(last)
}

/// A length on a surface in tiles, less whole ones, along u (`axis` 0) or v (1).
#[inline(always)]
pub(super) fn within_tile(length_m: f32, material: &Material, axis: usize) -> f32 {
    fraction(length_m * material.tiles_per_m[axis])
}

/// A number less whole ones.
#[inline(always)]
fn fraction(x: f32) -> f32 {
    x - x.floor()
}

/// A coordinate on a level of this size, in 1/256 texel and from the centre of its first texel, of a place within the tile.
#[inline(always)]
fn coordinate(within_tile: f32, size: f32) -> i32 {
    whole(within_tile * size * 256.0) - 128
}

/// The same of any place, given in texels of the level: whole tiles are taken away. At its edge it does not matter which of the
/// tiles it falls into, as both have a border.
#[inline(always)]
pub(super) fn wrapped(texels: f32, level: MipLevel) -> i32 {
    let size = level.size as f32;
    let tiles = round(texels * (1.0 / size) - 0.5);
    round(texels * 256.0).wrapping_sub(tiles.wrapping_mul(256 * level.size as i32)) - 128
}

/// Two channels of each of them, 16 bits each.
type Channels = [u16; 2 * LANES];

/// The mean of two channels, rounded up.
#[inline(always)]
fn mean(a: u8, b: u8) -> u8 {
    ((u16::from(a) + u16::from(b) + 1) >> 1) as u8
}

/// The sum of two channels with weights that make up 256.
#[inline(always)]
fn weigh(a: u16, b: u16, weight: u16) -> u16 {
    a * (256 - weight) + b * weight
}

/// Writes a number below 2^16 into both halves of a word.
#[inline(always)]
fn twice(number: i32) -> u32 {
    (number as u32) * 0x0001_0001
}

/// What the colours of some pixels are multiplied with: light in 1/4096, at most 16, for both channels of a lane.
#[inline(always)]
fn factors(light: &[f32; LANES]) -> Block {
    let mut factors = [0; LANES];
    for k in 0..LANES {
        let scaled = light[k] * 4096.0;
        factors[k] = twice(round(if scaled < 65535.0 { scaled } else { 65535.0 }));
    }
    factors
}

/// A channel in 1/256 times light.
#[inline(always)]
fn light_up(channel: u16, factor: u16) -> u16 {
    ((((u32::from(channel) * u32::from(factor)) >> 16) as u16 + 8) >> 4).min(255)
}

/// Two channels of a pixel, lit: the lower half of a word has red and green, the upper one blue and alpha.
#[inline(always)]
fn lit(low: u16, high: u16, factor: u16) -> u16 {
    light_up(low, factor) | light_up(high, factor) << 8
}

/// Makes colours opaque.
#[inline(always)]
fn opaque(colours: &mut Block) {
    for colour in colours {
        *colour |= 0xff00_0000;
    }
}

/// Two lines of texels that lie next to one another along u, and the share in 1/16 of the second.
#[derive(Debug, Clone, Copy)]
struct Lines<'a> {
    /// From the beginning of each line; beyond its end there is something else.
    first: &'a [u32],
    second: &'a [u32],
    length: usize,
    weight: u32,
}

impl<'a> Lines<'a> {
    /// The lines around a coordinate.
    #[inline(always)]
    fn new(atlas: &'a [u32], level: MipLevel, u: i32) -> Self {
        let first = &atlas[level.place((u >> 8) as u32, 0) as usize..];
        Self { first, second: &first[level.pitch() as usize..], length: level.size as usize, weight: (u >> 4 & 15) as u32 }
    }

    /// A texel in the line that is any number of texels from its beginning, as tiles repeat.
    #[inline(always)]
    fn within(&self, place: i32) -> usize {
        place.rem_euclid(self.length as i32) as usize
    }

    /// Mixes the lines by means alone, from texel `from` on. Whole blocks are written, up to one more than is asked for.
    #[inline(always)]
    fn mix(&self, from: i32, count: usize, out: &mut [u32]) {
        let mut from = self.within(from);
        let mut done = 0;
        while done < count.min(self.length) {
            let some = (count - done).min(self.length - from);
            let whole = some.next_multiple_of(LANES);
            let blocks = |line: &'a [u32]| line[from..from + whole].as_chunks::<LANES>().0;
            let out = out[done..done + whole].as_chunks_mut::<LANES>().0;
            self.mix_blocks(blocks(self.first), blocks(self.second), out);
            (done, from) = (done + some, 0);
        }
        // The whole line is there: it repeats.
        while done < count {
            let whole_lines = done - done % self.length;
            let some = whole_lines.min(count - done);
            out.copy_within(done - whole_lines..done - whole_lines + some, done);
            done += some;
        }
    }

    #[inline(always)]
    fn mix_blocks(&self, a: &[Block], b: &[Block], out: &mut [Block]) {
        let choose = |bit: u32| if self.weight >> bit & 1 == 0 { a } else { b };
        let [w, x, y, z] = [choose(0), choose(1), choose(2), choose(3)];
        for (((((a, w), x), y), z), out) in a.iter().zip(w).zip(x).zip(y).zip(z).zip(out) {
            // One mean after the other, for the compiler makes bytes of none but the first when they are one expression.
            let mut mixed = *bytes(a);
            for line in [w, x, y, z] {
                let line = bytes(line);
                for k in 0..4 * LANES {
                    mixed[k] = mean(mixed[k], line[k]);
                }
            }
            *bytes_mut(out) = mixed;
        }
    }
}

/// The channels of a block.
#[inline(always)]
fn bytes(block: &Block) -> &[u8; 4 * LANES] {
    bytemuck::cast_ref(block)
}

/// The same, to be written.
#[inline(always)]
fn bytes_mut(block: &mut Block) -> &mut [u8; 4 * LANES] {
    bytemuck::cast_mut(block)
}

/// Where the texels lie that a run of rows needs.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct StripRoom {
    /// Of the lines that the run lies between, mixed.
    texels: [u32; REACH + 2 * LANES],
    /// Block by block those on either side of each row, where they are not used at once.
    pairs: [[Pair; LANES]; RUN / LANES],
}

impl Default for StripRoom {
    fn default() -> Self {
        Self { texels: [0; REACH + 2 * LANES], pairs: [[[0; 2]; LANES]; RUN / LANES] }
    }
}

/// What some columns see of upright surfaces, a lane each.
#[derive(Debug)]
pub(super) struct StripPlaces<'a> {
    pub material: [&'a Material; LANES],
    /// Where along the surface, m.
    pub u: [f32; LANES],
    /// How high on it in row 0 of the picture, m, and how far it falls from row to row, which is what a pixel covers along v.
    pub v: [f32; LANES],
    pub step: [f32; LANES],
    /// What a pixel covers along u, m.
    pub slant: [f32; LANES],
    /// The first row that is asked for.
    pub first_row: [i32; LANES],
}

/// Textures along some columns of upright surfaces, a lane each; see [`Strip`].
#[derive(Debug)]
pub(super) struct Strips<'a> {
    atlas: &'a [u32],
    level: [MipLevel; LANES],
    u: [i32; LANES],
    v: [i32; LANES],
    step: [i32; LANES],
}

impl<'a> Strips<'a> {
    #[inline(always)]
    pub fn new(atlas: &'a [u32], places: &StripPlaces<'a>) -> Self {
        let StripPlaces { material, u, v, step, slant, first_row } = places;
        let (mut tiles_per_m, mut size, mut last) = ([[0.0; LANES]; 2], [0.0; LANES], [0; LANES]);
        for (k, material) in material.iter().enumerate() {
            [tiles_per_m[0][k], tiles_per_m[1][k]] = material.tiles_per_m;
            (size[k], last[k]) = (material.levels[0].size as f32, material.last_level as i32);
        }
        let mut number = [0; LANES];
        for k in 0..LANES {
            let footprint = strip_footprint([tiles_per_m[0][k], tiles_per_m[1][k]], [slant[k], step[k]]);
            number[k] = level_number(footprint * size[k], last[k]);
        }
        let mut level = [MipLevel { base: 0, size: 0 }; LANES];
        for (k, level) in level.iter_mut().enumerate() {
            *level = material[k].levels[number[k] as usize];
            size[k] = level.size as f32;
        }
        let mut strips = Self { atlas, level, u: [0; LANES], v: [0; LANES], step: [0; LANES] };
        for k in 0..LANES {
            strips.u[k] = coordinate(fraction(u[k] * tiles_per_m[0][k]), size[k]);
            strips.step[k] = whole(step[k] * tiles_per_m[1][k] * size[k] * -65536.0);
            let v = whole(fraction(v[k] * tiles_per_m[1][k]) * size[k] * 65536.0);
            strips.v[k] = v.wrapping_add(strips.step[k].wrapping_mul(first_row[k]));
        }
        strips
    }

    /// One of them.
    #[inline(always)]
    pub fn at(&self, k: usize) -> Strip<'a> {
        Strip { atlas: self.atlas, level: self.level[k], u: self.u[k], v: self.v[k], step: self.step[k] }
    }
}

/// A texture along a column of an upright surface: u and level of detail are fixed, v falls evenly from row to row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip<'a> {
    atlas: &'a [u32],
    level: MipLevel,
    /// In 1/256 texel.
    u: i32,
    /// v of the first row, and its change from row to row, in 1/65536 texel of the level.
    v: i32,
    step: i32,
}

impl<'a> Strip<'a> {
    /// Coordinate of a row, in 1/256 texel.
    #[inline(always)]
    fn at(&self, row: usize) -> i32 {
        (self.v.wrapping_add(self.step.wrapping_mul(row as i32)) >> 8) - 128
    }

    /// The lines of texels that it runs along.
    #[inline(always)]
    fn lines(&self) -> Lines<'a> {
        Lines::new(self.atlas, self.level, self.u)
    }

    /// The lowest texel that `count` rows look at, and how many there are. A level of one texel may have rows that see the
    /// tile more often than can be counted: all places below [`REACH`] and the one that follows are then looked at.
    #[inline(always)]
    fn reach(&self, count: usize) -> (i32, usize) {
        let lowest = self.at(count - 1) >> 8;
        (lowest, (((self.at(0) >> 8).wrapping_sub(lowest)) as u32 as usize).min(REACH - 1) + 2)
    }

    /// Mixes the lines that it lies between, as far as so many blocks of rows see them.
    #[inline(always)]
    pub fn mix(&self, blocks: usize, room: &mut StripRoom) {
        let (lowest, span) = self.reach(LANES * blocks);
        self.lines().mix(lowest, span, &mut room.texels);
    }

    /// Colours of as many rows as there is `light` for, those that [`Strip::mix`] was told.
    #[inline(always)]
    pub fn shade<L: LookUp>(&self, look_up: L, light: &[[f32; LANES]], room: &mut StripRoom, out: &mut [Block]) {
        let (lowest, _) = self.reach(LANES * light.len());
        let StripRoom { texels, pairs: found } = room;
        let find = |block: usize, found: &mut [Pair; LANES]| {
            let places = std::array::from_fn(|k| (self.at(LANES * block + k) >> 8).wrapping_sub(lowest) as u32);
            pairs::<REACH, _>(look_up, texels, &places, found);
        };
        let blocks = light.iter().zip(out).enumerate();
        if L::AT_ONCE {
            for (block, (light, out)) in blocks {
                let mut found = [[0; 2]; LANES];
                find(block, &mut found);
                self.shade_block(block, &found, light, out);
            }
        } else {
            for (block, found) in found.iter_mut().enumerate().take(light.len()) {
                find(block, found);
            }
            for ((block, (light, out)), found) in blocks.zip(found) {
                self.shade_block(block, found, light, out);
            }
        }
    }

    /// Colours of a block of rows whose texels have been looked up.
    #[inline(always)]
    fn shade_block(&self, block: usize, pairs: &[Pair; LANES], light: &[f32; LANES], out: &mut Block) {
        let (mut near, mut far, mut weight) = ([0; LANES], [0; LANES], [0; LANES]);
        for k in 0..LANES {
            near[k] = pairs[k][0];
            far[k] = pairs[k][1];
            weight[k] = twice(self.at(LANES * block + k) & 255);
        }
        let factor = factors(light);
        let [near, far, weight, factor]: [&Channels; 4] = [&near, &far, &weight, &factor].map(bytemuck::cast_ref);
        let words: &mut Channels = bytemuck::cast_mut(out);
        for k in 0..2 * LANES {
            let low = weigh(near[k] & 255, far[k] & 255, weight[k]);
            words[k] = lit(low, weigh(near[k] >> 8, far[k] >> 8, weight[k]), factor[k]);
        }
        opaque(out);
    }
}

/// Points sampled at once: some vectors.
pub(super) const POINTS: usize = 4 * LANES;

/// Where the texels lie that some points need.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct PointRoom {
    /// Block by block the texels on either side of each point along u.
    pairs: [[[Pair; LANES]; 2]; POINTS / LANES],
    /// Numbers of the walls that may darken them.
    pub walls: Vec<u32>,
}

impl Default for PointRoom {
    fn default() -> Self {
        Self { pairs: [[[[0; 2]; LANES]; 2]; POINTS / LANES], walls: Vec::new() }
    }
}

/// A texture at points that share a level of detail: what a row sees of a horizontal surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points<'a> {
    pub texels: Texels<'a>,
    /// In 1/256 texel; see [`wrapped`].
    pub u: &'a [i32; POINTS],
    pub v: &'a [i32; POINTS],
}

/// What a block of points needs: texels next to them, and weights.
struct Taps {
    /// First along v, then along u.
    texels: [[Block; 2]; 2],
    u: Block,
    v: Block,
}

impl Points<'_> {
    /// Looks up the texels of the blocks that have a bit in `wanted`.
    #[inline(always)]
    pub fn look_up<L: LookUp>(&self, look_up: L, wanted: u64, room: &mut PointRoom) {
        let texels = self.texels;
        for (block, pairs) in room.pairs.iter_mut().enumerate() {
            if !is_wanted(wanted, block) {
                continue;
            }
            let mut places = [0; LANES];
            for (k, place) in places.iter_mut().enumerate() {
                let point = LANES * block + k;
                *place = texels.place((self.u[point] >> 8) as u32, (self.v[point] >> 8) as u32);
            }
            texels.squares(look_up, &places, pairs);
        }
    }

    /// Colours of a block whose texels have been looked up.
    #[inline(always)]
    pub fn shade(&self, block: usize, light: &[f32; LANES], room: &PointRoom, out: &mut Block) {
        let factor = factors(light);
        let factor: &Channels = bytemuck::cast_ref(&factor);
        let taps = self.taps(block, room);
        let words: &mut Channels = bytemuck::cast_mut(out);
        for k in 0..2 * LANES {
            words[k] = lit(taps.low(k), taps.high(k), factor[k]);
        }
        opaque(out);
    }

    #[inline(always)]
    fn taps(&self, block: usize, room: &PointRoom) -> Taps {
        let [near, far] = &room.pairs[block];
        let mut taps = Taps { texels: [[[0; LANES]; 2]; 2], u: [0; LANES], v: [0; LANES] };
        for k in 0..LANES {
            let point = LANES * block + k;
            taps.u[k] = twice(self.u[point] & 255);
            taps.v[k] = twice(self.v[point] & 255);
            [taps.texels[0][0][k], taps.texels[1][0][k]] = near[k];
            [taps.texels[0][1][k], taps.texels[1][1][k]] = far[k];
        }
        taps
    }
}

impl Taps {
    /// Word of a tap and its weights.
    #[inline(always)]
    fn words(&self, k: usize) -> ([[u16; 2]; 2], u16, u16) {
        let word = |block: &Block| -> u16 { bytemuck::cast_ref::<Block, Channels>(block)[k] };
        let [low, high] = &self.texels;
        ([[word(&low[0]), word(&low[1])], [word(&high[0]), word(&high[1])]], word(&self.u), word(&self.v))
    }

    /// The lower channel of a word, in 1/256: mixed along u and rounded, then along v.
    #[inline(always)]
    fn low(&self, k: usize) -> u16 {
        let (t, u, v) = self.words(k);
        let along = |t: [u16; 2]| (weigh(t[0] & 255, t[1] & 255, u) + 128) >> 8;
        weigh(along(t[0]), along(t[1]), v)
    }

    /// The upper channel.
    #[inline(always)]
    fn high(&self, k: usize) -> u16 {
        let (t, u, v) = self.words(k);
        let along = |t: [u16; 2]| (weigh(t[0] >> 8, t[1] >> 8, u) + 128) >> 8;
        weigh(along(t[0]), along(t[1]), v)
    }
}

/// Colour of a single point, given in tiles within one, times light: for surfaces whose level of detail changes from pixel to
/// pixel.
#[inline(always)]
pub(super) fn shade_point(atlas: &[u32], level: MipLevel, [u, v]: [f32; 2], light: f32) -> u32 {
    let (u, v) = (coordinate(u, level.size as f32), coordinate(v, level.size as f32));
    let texels = Texels::new(atlas, level);
    let [near, far] = texels.square(texels.place((u >> 8) as u32, (v >> 8) as u32));
    let factor = factors(&[light; LANES])[0] as u16;
    let channel = |k: usize| {
        let channel = |texel: u32| (texel >> (8 * k) & 255) as u16;
        let along = |k: usize| (weigh(channel(near[k]), channel(far[k]), (u & 255) as u16) + 128) >> 8;
        u32::from(light_up(weigh(along(0), along(1), (v & 255) as u16), factor)) << (8 * k)
    };
    channel(0) | channel(1) | channel(2) | 0xff00_0000
}

/// Whether a block has a bit.
#[inline(always)]
pub(super) fn is_wanted(mask: u64, block: usize) -> bool {
    mask >> (LANES * block) & ((1 << LANES) - 1) != 0
}

#[cfg(test)]
mod tests {
    use super::super::scene::LEVELS;
    use super::super::texels::OneByOne;
    use super::*;

    /// Rows that see a tile of one texel several times over, farther than can be counted, see nothing of what was mixed before.
    #[test]
    fn rows_that_see_many_tiles_see_only_these() {
        const GREY: u32 = 0xff80_8080;
        let level = MipLevel { base: 0, size: 1 };
        let material = Material { tiles_per_m: [1.0; 2], last_level: 0, foot_m: 0.0, levels: [level; LEVELS] };
        for tenths in 20..60 {
            let [u, v, step, slant] = [0.3, 0.7, 0.1 * tenths as f32, 0.0].map(|x| [x; LANES]);
            let places = StripPlaces { material: [&material; LANES], u, v, step, slant, first_row: [0; LANES] };
            let strip = Strips::new(&[GREY; 9 + 2 * LANES], &places).at(0);
            let mut room = StripRoom::default();
            room.texels.fill(u32::MAX);
            let mut out = [[0; LANES]; RUN / LANES];
            strip.mix(RUN / LANES, &mut room);
            strip.shade(OneByOne, &[[1.0; LANES]; RUN / LANES], &mut room, &mut out);
            let other = out.as_flattened().iter().position(|colour| *colour != GREY);
            assert_eq!(other, None, "{tenths}");
        }
    }
}
