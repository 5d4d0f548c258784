//! Prefiltered texture sampling. The twin of `shaders/sample.wgsl`.
//!
//! A sample is bilinear on each of two neighbouring levels and linear between them. Coordinates and weights are fixed-point
//! numbers and texels are mixed as integers, along u first, then v, then between levels, so that CPU and GPU agree to the bit
//! once they agree on a coordinate. The GPU takes pixel after pixel; here a run of pixels is sampled at once, some texels to a
//! vector. Functions are inlined throughout, so that they run on the vector unit that their caller was compiled for.
//!
//! Coordinates are in 1/65536 texel of the finest level. They may wrap around: a tile's edge is a power of two.

use std::ops::Range;

use super::scene::Material;

/// Most pixels sampled at once.
pub(super) const RUN: usize = 64;
/// Most texels along v that a run of rows covers on a level: less than two a row, for [`strip_footprint`] sees to that.
const REACH: usize = 2 * RUN + 8;
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
/// number, linear between powers of two: the same on all machines.
#[inline(always)]
pub(super) fn level(material: &Material, footprint: f32) -> i32 {
    let logarithm = (footprint.to_bits() as i32 - 1.0_f32.to_bits() as i32) >> 15;
    logarithm.clamp(0, 256 * material.log2_size as i32)
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

/// Mixes two texels channel by channel, the share of `b` being `weight`/256.
///
/// Two channels share a word, 16 bits each: `a * (256 - weight) + b * weight` fits there, and 256 `a` + (`b` - `a`) `weight` is
/// the same number, whatever the halves borrow from each other on the way.
#[inline(always)]
fn mix_texel(a: u32, b: u32, weight: u32) -> u32 {
    const LOW: u32 = 0x00ff_00ff;
    const HALF: u32 = 0x0080_0080;
    let pair = |a: u32, b: u32| (a << 8).wrapping_add(b.wrapping_sub(a).wrapping_mul(weight)).wrapping_add(HALF);
    (pair(a & LOW, b & LOW) >> 8 & LOW) | (pair(a >> 8 & LOW, b >> 8 & LOW) & !LOW)
}

/// Mixes `b` into `a`, texel by texel.
#[inline(always)]
fn mix(a: &mut [u32], b: &[u32], weight: &[u32]) {
    for ((a, b), weight) in a.iter_mut().zip(b).zip(weight) {
        *a = mix_texel(*a, *b, *weight);
    }
}

/// A texture along a column of an upright surface: u and level of detail are fixed, v falls evenly from row to row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    material: Material,
    u: i32,
    /// v at row 0 of the picture, and its change from row to row.
    v: i32,
    step: i32,
    level: i32,
}

impl Strip {
    /// `u_m`, and `v_m` at row 0 of the picture; v falls by `step_m` a row. `level` comes from [`strip_footprint`] with `step_m`
    /// along v.
    #[inline(always)]
    pub fn new(material: &Material, u_m: f32, v_m: f32, step_m: f32, level: i32) -> Self {
        Self {
            material: *material,
            u: coordinate(u_m, material, 0),
            v: coordinate(v_m, material, 1),
            step: (step_m * material.texels_per_m[1] * -65536.0) as i32,
            level,
        }
    }

    /// Colours of the rows from `row` on; at most [`RUN`].
    #[inline(always)]
    pub fn sample(&self, atlas: &[u32], row: usize, out: &mut [u32]) {
        let fine = (self.level >> 8) as u32;
        self.sample_level(atlas, fine, row, out);
        let weight = self.level & 255;
        if weight > 0 {
            let mut coarse = [0; RUN];
            let coarse = &mut coarse[..out.len()];
            self.sample_level(atlas, fine + 1, row, coarse);
            mix(out, coarse, &[weight as u32; RUN]);
        }
    }

    #[inline(always)]
    fn sample_level(&self, atlas: &[u32], level: u32, row: usize, out: &mut [u32]) {
        let log2_size = self.material.log2_size - level;
        let (base, mask) = (level_base(&self.material, level), (1_i32 << log2_size) - 1);
        if log2_size == 0 {
            out.fill(atlas[base]);
            return;
        }
        // Where each row lies, in texels above the lowest row.
        let n = out.len();
        let top = self.v.wrapping_add(self.step.wrapping_mul(row as i32));
        let mut at = [0_i32; RUN];
        for (k, at) in (0_i32..).zip(&mut at[..n]) {
            *at = on_level(top.wrapping_add(self.step.wrapping_mul(k)), level);
        }
        let lowest = at[n - 1] >> 8;
        let around = 0xffff_i32 >> level; // coordinates wrap around here
        let count = ((((at[0] >> 8) - lowest) & around) as usize + 2).min(REACH);
        // The two lines of texels next to u are mixed over all that the run covers; then each row takes two neighbours.
        let u = on_level(self.u, level);
        let line = |u: i32| &atlas[base + (((u & mask) as usize) << log2_size)..][..1 << log2_size];
        let (first, second) = (line(u >> 8), line((u >> 8) + 1));
        let weight = (u & 255) as u32;
        let mut texels = [0_u32; REACH];
        let mut done = 0;
        while done < count {
            let from = ((lowest + done as i32) & mask) as usize;
            let n = (count - done).min(first.len() - from);
            mix_lines(&first[from..from + n], &second[from..from + n], weight, &mut texels[done..done + n]);
            done += n;
        }
        let (mut next, mut weights) = ([0; RUN], [0; RUN]);
        for (&at, weight) in at[..n].iter().zip(&mut weights) {
            *weight = (at & 255) as u32;
        }
        for at in &mut at[..n] {
            *at = ((*at >> 8) - lowest) & around;
        }
        for ((&at, out), next) in at[..n].iter().zip(&mut *out).zip(&mut next) {
            let k = (at as usize).min(REACH - 2);
            *out = texels[k];
            *next = texels[k + 1];
        }
        mix(out, &next[..n], &weights[..n]);
    }
}

/// Mixes two lines of texels with one weight.
#[inline(always)]
fn mix_lines(a: &[u32], b: &[u32], weight: u32, out: &mut [u32]) {
    for ((a, b), out) in a.iter().zip(b).zip(out) {
        *out = mix_texel(*a, *b, weight);
    }
}

/// Colours at the points (`u`, `v`) with one level of detail for all: what a row sees of a horizontal surface. Only the points
/// in `wanted` are looked up.
#[inline(always)]
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
        mix(&mut colours, &coarse, &[weight as u32; N]);
    }
    colours
}

#[inline(always)]
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
    // Texels and weights of all points first: that part runs in vectors.
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
    let weight = x.map(|x| (x & 255) as u32);
    mix(&mut near, &near_second, &weight);
    mix(&mut far, &far_second, &weight);
    mix(&mut near, &far, &y.map(|y| (y & 255) as u32));
    near
}
