//! Prefiltered texture sampling. The twin of `shaders/sample.wgsl`.
//!
//! A sample is bilinear on each of two neighbouring levels and linear between them. Coordinates and weights are fixed-point
//! numbers and texels are mixed as integers, along u first, then v, then between levels, so that CPU and GPU agree to the bit
//! once they agree on a coordinate. The GPU takes pixel after pixel; here a run of rows is sampled at once, four texels to a
//! vector.

use std::ops::Range;

use super::scene::Material;

/// Most pixels sampled at once.
pub(super) const RUN: usize = 64;
/// Most texels along v that a run of rows covers on a level: less than two a row, for [`level`] sees to that.
const REACH: usize = 2 * RUN + 4;

/// Level of detail, in 1/256 of a level, for a pixel that covers `a_m` by `b_m` of the surface.
///
/// The texture is filtered the same along both axes. Taking the long side would blur surfaces that are seen at a flat angle,
/// the short side would let them flicker; half the long side is the compromise. The logarithm is read off the bits of the
/// number, linear between powers of two: the same on all machines.
pub(super) fn level(material: &Material, a_m: f32, b_m: f32) -> i32 {
    let footprint = (0.5 * a_m.max(b_m)).max(a_m.min(b_m)) * material.texels_per_m;
    let logarithm = (footprint.to_bits() as i32 - 1.0_f32.to_bits() as i32) >> 15;
    logarithm.clamp(0, 256 * material.log2_size as i32)
}

/// A coordinate of a texture, in 1/256 texel of the finest level.
pub(super) fn fixed(coordinate_m: f32, material: &Material) -> i32 {
    (coordinate_m * (material.texels_per_m * 256.0)) as i32
}

/// Index in the atlas of the first texel of a level.
fn level_base(material: &Material, level: u32) -> usize {
    let finest = 2 * material.log2_size;
    (material.base + ((4 << finest) - (4 << (finest - 2 * level))) / 3) as usize
}

/// A coordinate on a level, in 1/256 texel of that level and from the centre of its first texel.
fn on_level(coordinate: i32, level: u32) -> i32 {
    (coordinate >> level) - 128
}

/// Mixes `a` and `b` channel by channel, the share of `b` being `weight`/256.
fn mix_quad(a: &[u8; 16], b: &[u8; 16], weight: &[u8; 16]) -> [u8; 16] {
    std::array::from_fn(|k| {
        let w = u16::from(weight[k]);
        ((u16::from(a[k]) * (256 - w) + u16::from(b[k]) * w + 128) >> 8) as u8
    })
}

/// Four times the same weight: one for each channel of a texel.
fn spread(weight: i32) -> u32 {
    let two = weight as u32 | (weight as u32) << 8;
    two | two << 16
}

fn quads(texels: &[u32]) -> &[[u8; 16]] {
    bytemuck::cast_slice::<u32, u8>(texels).as_chunks().0
}

fn quads_mut(texels: &mut [u32]) -> &mut [[u8; 16]] {
    bytemuck::cast_slice_mut::<u32, u8>(texels).as_chunks_mut().0
}

/// Mixes `b` into `a`, texel by texel, with weights from [`spread`]. The lengths are equal, and multiples of four.
fn mix(a: &mut [u32], b: &[u32], weight: &[u32]) {
    for ((a, b), weight) in quads_mut(a).iter_mut().zip(quads(b)).zip(quads(weight)) {
        *a = mix_quad(a, b, weight);
    }
}

/// A texture with u and level of detail fixed: what a column sees of an upright surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    pub material: Material,
    u: i32,
    level: i32,
}

impl Strip {
    /// `u_m` in metres, `level` from [`level`] with the step between the rows as one of its lengths.
    pub fn new(material: &Material, u_m: f32, level: i32) -> Self {
        Self { material: *material, u: fixed(u_m, material), level }
    }

    /// Colours at the coordinates `v`, from [`fixed`], which fall from row to row. All lengths are equal, and multiples of
    /// four.
    pub fn sample(&self, atlas: &[u32], v: &[i32], out: &mut [u32]) {
        let fine = (self.level >> 8) as u32;
        self.sample_level(atlas, fine, v, out);
        let weight = self.level & 255;
        if weight > 0 {
            let mut coarse = [0; RUN];
            let coarse = &mut coarse[..v.len()];
            self.sample_level(atlas, fine + 1, v, coarse);
            let weight = bytemuck::cast([spread(weight); 4]);
            for (a, b) in quads_mut(out).iter_mut().zip(quads(coarse)) {
                *a = mix_quad(a, b, &weight);
            }
        }
    }

    fn sample_level(&self, atlas: &[u32], level: u32, v: &[i32], out: &mut [u32]) {
        let log2_size = self.material.log2_size - level;
        let (base, mask) = (level_base(&self.material, level), (1_i32 << log2_size) - 1);
        let (Some(&top), Some(&bottom)) = (v.first(), v.last()) else { return };
        if log2_size == 0 {
            out.fill(atlas[base]);
            return;
        }
        // The two lines of texels next to u are mixed over all that the run covers; then each row takes two neighbours.
        let u = on_level(self.u, level);
        let line = |u: i32| &atlas[base + (((u & mask) as usize) << log2_size)..][..1 << log2_size];
        let (first, second) = (line(u >> 8), line((u >> 8) + 1));
        let lowest = on_level(bottom, level) >> 8;
        let count = (((on_level(top, level) >> 8) - lowest + 2) as usize).min(REACH);
        let weight = [(u & 255) as u8; 16];
        let mut texels = [0_u32; REACH];
        let mut done = 0;
        while done < count {
            let from = ((lowest + done as i32) & mask) as usize;
            let n = (count - done).min(first.len() - from);
            mix_lines(&first[from..from + n], &second[from..from + n], &weight, &mut texels[done..done + n]);
            done += n;
        }
        let (mut at, mut next, mut weights) = ([0; RUN], [0; RUN], [0; RUN]);
        let n = v.len();
        for ((&v, at), weight) in v.iter().zip(&mut at).zip(&mut weights) {
            let here = on_level(v, level);
            *at = (here >> 8) - lowest;
            *weight = spread(here & 255);
        }
        for ((&at, out), next) in at[..n].iter().zip(&mut *out).zip(&mut next) {
            let k = (at as usize).min(REACH - 2);
            *out = texels[k];
            *next = texels[k + 1];
        }
        mix(out, &next[..n], &weights[..n]);
    }
}

fn mix_lines(a: &[u32], b: &[u32], weight: &[u8; 16], out: &mut [u32]) {
    for ((a, b), out) in quads(a).iter().zip(quads(b)).zip(quads_mut(out)) {
        *out = mix_quad(a, b, weight);
    }
    let whole = a.len() & !3;
    let (mut last_a, mut last_b) = ([0; 4], [0; 4]);
    let rest = a.len() - whole;
    if rest > 0 {
        last_a[..rest].copy_from_slice(&a[whole..]);
        last_b[..rest].copy_from_slice(&b[whole..]);
        let mixed: [u32; 4] = bytemuck::cast(mix_quad(&bytemuck::cast(last_a), &bytemuck::cast(last_b), weight));
        out[whole..].copy_from_slice(&mixed[..rest]);
    }
}

/// Colours at the points (`u`, `v`), coordinates from [`fixed`], with one level of detail for all: what a row sees of a
/// horizontal surface. Only the points in `wanted` are looked up.
pub(super) fn sample_points<const N: usize>(
    atlas: &[u32],
    material: &Material,
    [u, v]: [&[i32; N]; 2],
    level: i32,
    wanted: Range<usize>,
) -> [u32; N] {
    if material.log2_size == 0 {
        return [atlas[material.base as usize]; N];
    }
    let fine = (level >> 8) as u32;
    let mut colours = sample_points_level(atlas, material, [u, v], fine, wanted.clone());
    let weight = level & 255;
    if weight > 0 {
        let coarse = sample_points_level(atlas, material, [u, v], fine + 1, wanted);
        mix(&mut colours, &coarse, &[spread(weight); N]);
    }
    colours
}

fn sample_points_level<const N: usize>(
    atlas: &[u32],
    material: &Material,
    [u, v]: [&[i32; N]; 2],
    level: u32,
    wanted: Range<usize>,
) -> [u32; N] {
    let log2_size = material.log2_size - level;
    let mask = (1_i32 << log2_size) - 1;
    let atlas = &atlas[level_base(material, level)..][..1 << (2 * log2_size)];
    let last = atlas.len() - 1;
    // Columns, lines and weights of all points first: that part runs in vectors.
    let x = u.map(|u| on_level(u, level));
    let y = v.map(|v| on_level(v, level));
    let first = x.map(|x| ((x >> 8) & mask) << log2_size);
    let second = x.map(|x| (((x >> 8) + 1) & mask) << log2_size);
    let low = y.map(|y| (y >> 8) & mask);
    let high = y.map(|y| ((y >> 8) + 1) & mask);
    let mut taps = [[0_u32; N]; 4];
    for k in wanted {
        let texel = |line: i32, place: i32| atlas[(line + place) as usize & last];
        taps[0][k] = texel(first[k], low[k]);
        taps[1][k] = texel(second[k], low[k]);
        taps[2][k] = texel(first[k], high[k]);
        taps[3][k] = texel(second[k], high[k]);
    }
    let [mut near, near_second, mut far, far_second] = taps;
    let weight = x.map(|x| spread(x & 255));
    mix(&mut near, &near_second, &weight);
    mix(&mut far, &far_second, &weight);
    mix(&mut near, &far, &y.map(|y| spread(y & 255)));
    near
}
