//! Prefiltered texture sampling. The twin of `shaders/sample.wgsl`.
//!
//! A sample is bilinear on each of two neighbouring levels and linear between them, in quarters of a level. Coordinates and
//! weights are fixed-point numbers and texels are mixed as integers, in the same order on both processors, so that CPU and GPU
//! agree to the bit once they agree on a coordinate. The GPU takes pixel after pixel; here a run of pixels is sampled at once.
//! Functions are inlined throughout, so that they run on the vector unit that their caller was compiled for.
//!
//! Coordinates are in 1/65536 texel of the finest level. They may wrap around: a tile's edge is a power of two.

use super::scene::Material;
use super::texels::{Texels, fetch};

/// Pixels calculated at once: the 32-bit lanes of the widest vector.
pub(super) const LANES: usize = 16;
/// Most rows of a column that are sampled at once.
pub(super) const RUN: usize = 240;
/// Most texels along v that a run of rows covers on a level, a power of two: little more than two a row, for [`strip_footprint`] sees to
/// that.
const REACH: usize = 1024;
/// Adding this rounds a number of magnitude below 2^22 to a whole one, which then stands in the low bits.
const ROUNDER: f32 = 12_582_912.0;

/// `x` rounded to the nearest whole number; its magnitude must be below 2^22.
#[inline(always)]
pub(super) fn round(x: f32) -> i32 {
    ((x + ROUNDER).to_bits() as i32).wrapping_sub(ROUNDER.to_bits() as i32)
}

/// What a pixel covers of an upright surface, in texels along the axis that counts: `u_m` by `v_m`.
///
/// The texture is filtered the same along both axes. Taking the long side would blur surfaces that are seen at a flat angle,
/// the short side would let them flicker; half the long side is the compromise.
#[inline(always)]
pub(super) fn footprint(material: &Material, [u_m, v_m]: [f32; 2]) -> f32 {
    let (u, v) = (u_m * material.texels_per_m[0], v_m * material.texels_per_m[1]);
    (0.5 * u.max(v)).max(u.min(v))
}

/// The same where u is seen at a slant and v is not, and [`REACH`] asks that v is never undersampled.
#[inline(always)]
pub(super) fn strip_footprint(material: &Material, [u_m, v_m]: [f32; 2]) -> f32 {
    (0.5 * (u_m * material.texels_per_m[0])).max(v_m * material.texels_per_m[1])
}

/// Level of detail, in 1/256 of a level, for a pixel that covers so many texels. The logarithm is read off the bits of the
/// number, linear between powers of two: the same on all machines. It is rounded to quarters.
#[inline(always)]
pub(super) fn level(material: &Material, footprint: f32) -> i32 {
    let logarithm = (footprint.to_bits() as i32 - 1.0_f32.to_bits() as i32) >> 15;
    (logarithm.clamp(0, 256 * material.log2_size as i32) + 32) & !63
}

/// A length on a surface in texels, less whole periods, along u (`axis` 0) or v (1).
#[inline(always)]
pub(super) fn within_tile(length_m: f32, material: &Material, axis: usize) -> f32 {
    let size = (1_u32 << material.log2_size) as f32;
    let texels = length_m * material.texels_per_m[axis];
    texels - size * libm::floorf(texels / size)
}

/// The same as a coordinate.
#[inline(always)]
pub(super) fn coordinate(length_m: f32, material: &Material, axis: usize) -> i32 {
    (within_tile(length_m, material, axis) * 65536.0) as i32
}

/// Index in the atlas of the first texel of a level.
#[inline(always)]
fn level_base(material: &Material, level: u32) -> usize {
    let finest = 2 * material.log2_size;
    (material.base + ((4 << finest) - (4 << (finest - 2 * level))) / 3) as usize
}

/// A coordinate on a level, in 1/256 texel of that level and from the centre of its first texel.
#[inline(always)]
fn on_level(coordinate: i32, level: u32) -> i32 {
    (coordinate >> (8 + level)) - 128
}

/// Texels or colours of as many pixels as there are lanes, red in the lowest byte.
pub(super) type Block = [u32; LANES];
/// Two channels of each of them, 16 bits each.
type Channels = [u16; 2 * LANES];
/// Texels that lie next to one another along v.
type Pair = [u32; 2];

/// Whole texels of a level count up to this, then coordinates wrap around.
#[inline(always)]
fn around(level: u32) -> i32 {
    0xffff >> level
}

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
    #[inline(always)]
    fn new(atlas: &'a [u32], material: &Material, level: u32, u: i32) -> Self {
        let log2_size = material.log2_size - level;
        let (base, mask) = (level_base(material, level), (1_i32 << log2_size) - 1);
        let u = on_level(u, level);
        let first = &atlas[base + ((((u >> 8) & mask) as usize) << log2_size)..];
        let second = &atlas[base + (((((u >> 8) + 1) & mask) as usize) << log2_size)..];
        Self { first, second, length: 1 << log2_size, weight: (u >> 4 & 15) as u32 }
    }

    /// Asks for `count` texels from `from` on.
    #[inline(always)]
    fn fetch(&self, from: i32, count: usize) {
        for k in (0..count + LANES).step_by(LANES) {
            let at = (from as usize).wrapping_add(k) & (self.length - 1);
            fetch(&self.first[at..]);
            fetch(&self.second[at..]);
        }
    }

    /// Mixes the lines by means alone, from texel `from` on, which may be any number, as tiles repeat. Whole blocks are written,
    /// up to one more than is asked for.
    #[inline(always)]
    fn mix(&self, from: i32, count: usize, out: &mut [u32]) {
        let mut from = from as usize & (self.length - 1);
        let mut done = 0;
        while done < count {
            let some = (count - done).min(self.length - from);
            let whole = some.next_multiple_of(LANES);
            let blocks = |line: &'a [u32]| line[from..from + whole].as_chunks::<LANES>().0;
            let out = out[done..done + whole].as_chunks_mut::<LANES>().0;
            self.mix_blocks(blocks(self.first), blocks(self.second), out);
            (done, from) = (done + some, 0);
        }
    }

    #[inline(always)]
    fn mix_blocks(&self, a: &[Block], b: &[Block], out: &mut [Block]) {
        let choose = |bit: u32| if self.weight >> bit & 1 == 0 { a } else { b };
        let [w, x, y, z] = [choose(0), choose(1), choose(2), choose(3)];
        for (((((a, w), x), y), z), out) in a.iter().zip(w).zip(x).zip(y).zip(z).zip(out) {
            let [a, w, x, y, z] = [a, w, x, y, z].map(bytes);
            let out = bytes_mut(out);
            for k in 0..4 * LANES {
                out[k] = mean(mean(mean(mean(a[k], w[k]), x[k]), y[k]), z[k]);
            }
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

/// Where the texels lie that a run of rows needs. Looking texels up runs one by one, calculating with them in vectors: each is
/// done for the whole run before the other, for a vector that was just written in parts takes long to load.
#[derive(Debug)]
pub(super) struct StripRoom {
    coarse: [u32; REACH],
    texels: [u32; REACH + 3 * LANES],
    places: [u32; RUN],
    pairs: [Pair; RUN],
}

impl Default for StripRoom {
    fn default() -> Self {
        Self { coarse: [0; REACH], texels: [0; REACH + 3 * LANES], places: [0; RUN], pairs: [[0; 2]; RUN] }
    }
}

/// A texture along a column of an upright surface: u and level of detail are fixed, v falls evenly from row to row.
///
/// The coarser level is mixed into the texels of the finer one, so that each row only takes two neighbours.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip<'a> {
    pub atlas: &'a [u32],
    pub material: &'a Material,
    pub u: i32,
    /// v of the first row, and its change from row to row.
    v: i32,
    step: i32,
    level: i32,
}

impl<'a> Strip<'a> {
    /// `u_m`, and `v_m` at row 0 of the picture; v falls by `step_m` a row. `level` comes from [`strip_footprint`] with `step_m`
    /// along v. `row` is the first that is asked for.
    #[inline(always)]
    pub fn new(atlas: &'a [u32], material: &'a Material, [u_m, v_m, step_m]: [f32; 3], level: i32, row: usize) -> Self {
        let step = (step_m * material.texels_per_m[1] * -65536.0) as i32;
        let v = coordinate(v_m, material, 1).wrapping_add(step.wrapping_mul(row as i32));
        Self { atlas, material, u: coordinate(u_m, material, 0), v, step, level }
    }

    /// Coordinate of a row on a level.
    #[inline(always)]
    fn at(&self, level: u32, row: usize) -> i32 {
        on_level(self.v.wrapping_add(self.step.wrapping_mul(row as i32)), level)
    }

    /// Asks for the texels of `count` rows.
    #[inline(always)]
    pub fn fetch(&self, count: usize) {
        let level = (self.level >> 8) as u32;
        let lowest = self.at(level, count - 1) >> 8;
        let span = ((self.at(level, 0) >> 8).wrapping_sub(lowest) & around(level)) as usize + 2;
        Lines::new(self.atlas, self.material, level, self.u).fetch(lowest, span);
        if self.level >> 6 & 3 != 0 {
            Lines::new(self.atlas, self.material, level + 1, self.u).fetch((lowest >> 1) - 1, span / 2 + 3);
        }
    }

    /// Colours of as many rows as there is `light` for.
    #[inline(always)]
    pub fn shade(&self, light: &[[f32; LANES]], room: &mut StripRoom, out: &mut [Block]) {
        let level = (self.level >> 8) as u32;
        let count = LANES * light.len();
        // From an even texel on: two share one of the coarser level.
        let lowest = self.at(level, count - 1) >> 8 & !1;
        let span = ((self.at(level, 0) >> 8).wrapping_sub(lowest) & around(level)) as usize + 2;
        self.fill(level, lowest, span.min(REACH), room);
        let StripRoom { texels, places, pairs, .. } = room;
        for (k, place) in places[..count].iter_mut().enumerate() {
            *place = ((self.at(level, k) >> 8).wrapping_sub(lowest) & around(level)) as u32;
        }
        for (pair, place) in pairs[..count].iter_mut().zip(&*places) {
            let place = *place as usize & (REACH - 1);
            *pair = [texels[place], texels[place + 1]];
        }
        let pairs = &pairs.as_chunks::<LANES>().0[..light.len()];
        for (block, ((pairs, light), out)) in pairs.iter().zip(light).zip(out).enumerate() {
            let (mut near, mut far, mut weight) = ([0; LANES], [0; LANES], [0; LANES]);
            for k in 0..LANES {
                near[k] = pairs[k][0];
                far[k] = pairs[k][1];
                weight[k] = twice(self.at(level, LANES * block + k) & 255);
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

    /// Texels from `lowest` on, mixed along u and between levels.
    #[inline(always)]
    fn fill(&self, level: u32, lowest: i32, count: usize, room: &mut StripRoom) {
        let quarters = self.level >> 6 & 3;
        Lines::new(self.atlas, self.material, level, self.u).mix(lowest, count, &mut room.texels);
        if quarters == 0 {
            return;
        }
        let below = (lowest >> 1) - 1;
        let halves = (count / 2 + 1).next_multiple_of(LANES);
        Lines::new(self.atlas, self.material, level + 1, self.u).mix(below, halves + 2, &mut room.coarse);
        // At the middle of a finer texel the coarser level is three parts of its own texel and one of the nearer neighbour.
        for from in (0..halves).step_by(LANES) {
            let (Some(before), Some(own), Some(after)) = (
                room.coarse[from..].first_chunk::<LANES>(),
                room.coarse[from + 1..].first_chunk::<LANES>(),
                room.coarse[from + 2..].first_chunk::<LANES>(),
            ) else {
                return;
            };
            let (mut even, mut odd) = ([0; LANES], [0; LANES]);
            three_to_one(own, before, &mut even);
            three_to_one(own, after, &mut odd);
            let fine = &mut room.texels[2 * from..][..2 * LANES];
            let mut coarse = [0; 2 * LANES];
            for k in 0..LANES {
                coarse[2 * k] = even[k];
                coarse[2 * k + 1] = odd[k];
            }
            for (fine, coarse) in fine.as_chunks_mut().0.iter_mut().zip(coarse.as_chunks().0) {
                towards_texels(bytes_mut(fine), bytes(coarse), quarters);
            }
        }
    }
}

/// Three parts of one texel and one of another.
#[inline(always)]
fn three_to_one(own: &Block, other: &Block, out: &mut Block) {
    let (own, other, out) = (bytes(own), bytes(other), bytes_mut(out));
    for k in 0..4 * LANES {
        out[k] = mean(own[k], mean(own[k], other[k]));
    }
}

/// Mixes coarser texels into finer ones; their share is `quarters`/4.
#[inline(always)]
fn towards_texels(fine: &mut [u8; 4 * LANES], coarse: &[u8; 4 * LANES], quarters: i32) {
    match quarters {
        1 => fine.iter_mut().zip(coarse).for_each(|(fine, coarse)| *fine = mean(mean(*fine, *coarse), *fine)),
        2 => fine.iter_mut().zip(coarse).for_each(|(fine, coarse)| *fine = mean(*fine, *coarse)),
        _ => fine.iter_mut().zip(coarse).for_each(|(fine, coarse)| *fine = mean(mean(*fine, *coarse), *coarse)),
    }
}

/// Points sampled at once: some vectors.
pub(super) const POINTS: usize = 4 * LANES;

/// Where the texels lie that some points need.
#[derive(Debug)]
pub(super) struct PointRoom {
    /// Texels on either side of each point along u, for each of two levels.
    pairs: [[[Pair; POINTS]; 2]; 2],
}

impl Default for PointRoom {
    fn default() -> Self {
        Self { pairs: [[[[0; 2]; POINTS]; 2]; 2] }
    }
}

/// A texture at points that share a level of detail: what a row sees of a horizontal surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points<'a> {
    pub atlas: &'a [u32],
    pub material: &'a Material,
    pub u: &'a [i32; POINTS],
    pub v: &'a [i32; POINTS],
    pub level: i32,
}

/// What a block of points needs of one level: texels next to them, and weights.
struct Taps {
    /// First along v, then along u.
    texels: [[Block; 2]; 2],
    u: Block,
    v: Block,
}

impl Points<'_> {
    /// Looks up the texels of the blocks that have a bit in `wanted`.
    #[inline(always)]
    pub fn look_up(&self, wanted: u64, room: &mut PointRoom) {
        let [fine, coarse] = &mut room.pairs;
        self.look_up_level((self.level >> 8) as u32, wanted, fine);
        if self.level & 255 != 0 {
            self.look_up_level((self.level >> 8) as u32 + 1, wanted, coarse);
        }
    }

    /// Colours of a block whose texels have been looked up.
    #[inline(always)]
    pub fn shade(&self, block: usize, light: &[f32; LANES], room: &PointRoom, out: &mut Block) {
        let level = (self.level >> 8) as u32;
        let quarters = (self.level >> 6 & 3) as u16;
        let factor = factors(light);
        let factor: &Channels = bytemuck::cast_ref(&factor);
        let fine = self.taps(level, block, &room.pairs[0]);
        let words: &mut Channels = bytemuck::cast_mut(out);
        if quarters == 0 {
            for k in 0..2 * LANES {
                words[k] = lit(fine.low(k), fine.high(k), factor[k]);
            }
        } else {
            let coarse = self.taps(level + 1, block, &room.pairs[1]);
            for k in 0..2 * LANES {
                let low = towards(fine.low(k), coarse.low(k), quarters);
                words[k] = lit(low, towards(fine.high(k), coarse.high(k), quarters), factor[k]);
            }
        }
        opaque(out);
    }

    #[inline(always)]
    fn look_up_level(&self, level: u32, wanted: u64, [near, far]: &mut [[Pair; POINTS]; 2]) {
        let log2_size = self.material.log2_size - level;
        let mask = (1_i32 << log2_size) - 1;
        let texels = Texels::new(self.atlas, level_base(self.material, level), 2 * log2_size);
        for block in 0..POINTS / LANES {
            if !is_wanted(wanted, block) {
                continue;
            }
            let (mut first, mut second, mut end) = ([0; LANES], [0; LANES], 0);
            for k in 0..LANES {
                let x = on_level(self.u[LANES * block + k], level) >> 8;
                let y = on_level(self.v[LANES * block + k], level) >> 8 & mask;
                first[k] = (((x & mask) << log2_size) + y) as u32;
                second[k] = ((((x + 1) & mask) << log2_size) + y) as u32;
                end |= i32::from(y == mask);
            }
            let near = &mut near[LANES * block..][..LANES];
            let far = &mut far[LANES * block..][..LANES];
            if end == 0 {
                copy_pairs(&texels, &first, near);
                copy_pairs(&texels, &second, far);
            } else {
                copy_pairs_around(&texels, mask as u32, &first, near);
                copy_pairs_around(&texels, mask as u32, &second, far);
            }
        }
    }

    #[inline(always)]
    fn taps(&self, level: u32, block: usize, [near, far]: &[[Pair; POINTS]; 2]) -> Taps {
        let mut taps = Taps { texels: [[[0; LANES]; 2]; 2], u: [0; LANES], v: [0; LANES] };
        for k in 0..LANES {
            let point = LANES * block + k;
            taps.u[k] = twice(on_level(self.u[point], level) & 255);
            taps.v[k] = twice(on_level(self.v[point], level) & 255);
            [taps.texels[0][0][k], taps.texels[1][0][k]] = near[point];
            [taps.texels[0][1][k], taps.texels[1][1][k]] = far[point];
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

/// A channel in 1/256 mixed with one of the coarser level, whose share is `quarters`/4.
#[inline(always)]
fn towards(fine: u16, coarse: u16, quarters: u16) -> u16 {
    fine.wrapping_add((coarse >> 2).wrapping_sub(fine >> 2).wrapping_mul(quarters))
}

/// Colour of a single point times light: for surfaces whose level of detail changes from pixel to pixel.
#[inline(always)]
pub(super) fn shade_point(atlas: &[u32], material: &Material, [u, v]: [i32; 2], level: i32, light: f32) -> u32 {
    let (finer, quarters) = ((level >> 8) as u32, (level >> 6 & 3) as u16);
    let fine = sample_point(atlas, material, u, v, finer);
    let coarse = if quarters == 0 { fine } else { sample_point(atlas, material, u, v, finer + 1) };
    let factor = factors(&[light; LANES])[0] as u16;
    let channel = |k: usize| u32::from(light_up(towards(fine[k], coarse[k], quarters), factor)) << (8 * k);
    channel(0) | channel(1) | channel(2) | 0xff00_0000
}

/// Red, green and blue of one level at a point, in 1/256.
#[inline(always)]
fn sample_point(atlas: &[u32], material: &Material, u: i32, v: i32, level: u32) -> [u16; 3] {
    let log2_size = material.log2_size - level;
    let mask = (1_i32 << log2_size) - 1;
    let texels = &atlas[level_base(material, level)..][..1 << (2 * log2_size)];
    let (x, y) = (on_level(u, level), on_level(v, level));
    let texel = |x: i32, y: i32| texels[(((x & mask) << log2_size) + (y & mask)) as usize];
    let line = |y: i32| [texel(x >> 8, y), texel((x >> 8) + 1, y)];
    let (low, high) = (line(y >> 8), line((y >> 8) + 1));
    let channel = |texel: u32, k: usize| (texel >> (8 * k) & 255) as u16;
    let along = |t: [u32; 2], k: usize| (weigh(channel(t[0], k), channel(t[1], k), (x & 255) as u16) + 128) >> 8;
    std::array::from_fn(|k| weigh(along(low, k), along(high, k), (y & 255) as u16))
}

/// Texels at some places and those after them.
#[inline(always)]
fn copy_pairs(texels: &Texels<'_>, places: &Block, pairs: &mut [Pair]) {
    for (pair, place) in pairs.iter_mut().zip(places) {
        *pair = texels.pair(*place);
    }
}

/// The same where a line of the tile may end between them and begin again.
#[inline(never)]
fn copy_pairs_around(texels: &Texels<'_>, mask: u32, places: &Block, pairs: &mut [Pair]) {
    for (pair, place) in pairs.iter_mut().zip(places) {
        let next = (place & !mask) | ((place + 1) & mask);
        *pair = [texels.pair(*place)[0], texels.pair(next)[0]];
    }
}

/// Whether a block has a bit.
#[inline(always)]
pub(super) fn is_wanted(mask: u64, block: usize) -> bool {
    mask >> (LANES * block) & ((1 << LANES) - 1) != 0
}
