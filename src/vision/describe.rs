//! Descriptors: what the surroundings of a feature look like, as 128 bytes.
//!
//! A grid of 12 x 12 samples around the feature, spaced in proportion to its scale, is turned into gradients; those are
//! summed into 4 x 4 cells of 8 directions each (Lowe 2004), upright. The square roots of the normalised sums are stored
//! (Arandjelovic and Zisserman 2012) and compared by the sum of absolute differences: on rendered rooms this told right matches
//! from wrong ones at least as well as the Euclidean distance, and it is the fastest distance that a processor has.

use std::f32::consts::SQRT_2;

use super::detect::Feature;
use super::pyramid::{Image, MARGIN, Pyramid, split_clamped, split_cyclic};

/// Length of a descriptor.
pub(super) const LENGTH: usize = 128;
/// Samples along an edge of the grid.
const GRID: usize = 12;
/// Samples with the ring that central differences need.
const PATCH: usize = GRID + 2;
/// Samples of a row as they are stored: the grid and what fills whole vectors, which nothing weighs.
const LANES: usize = 16;
/// Cells along an edge.
const CELLS: usize = 4;
/// Directions per cell.
const DIRECTIONS: usize = 8;
/// Columns of an image that a row of the grid spans at most.
const LINE: usize = MARGIN;
/// Columns that are enough for most features.
const SHORT: usize = 32;
/// Widest spacing of columns that this allows, in pixels of the image; features of ordinary settings stay below half of it.
const LARGEST_STEP: f32 = 4.5;
/// Norm of a descriptor; entries rarely come near 255.
const NORM: f32 = 512.0;

/// Added to a number from 0 to 2^22, it leaves the number, rounded, in the low bits of the sum: a conversion without cases, which
/// vectorises.
const TO_INTEGER: f32 = 8_388_608.0;

/// A descriptor.
pub(super) type Descriptor = [u8; LENGTH];

/// Distance of two descriptors: the sum of absolute differences.
#[inline]
pub(super) fn distance(a: &Descriptor, b: &Descriptor) -> u32 {
    a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum()
}

/// The same by the instruction that x86 has for it. Compilers know it, but miss it as soon as a loop is built around it.
#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn distance_avx2(a: &Descriptor, b: &Descriptor) -> u32 {
    use std::arch::x86_64::{_mm256_add_epi64, _mm256_sad_epu8, _mm256_setzero_si256};
    let mut sums = _mm256_setzero_si256();
    for (a, b) in a.as_chunks::<32>().0.iter().zip(b.as_chunks::<32>().0) {
        sums = _mm256_add_epi64(sums, _mm256_sad_epu8(bytemuck::cast(*a), bytemuck::cast(*b)));
    }
    let sums: [u64; 4] = bytemuck::cast(sums);
    ((sums[0] + sums[1]) + (sums[2] + sums[3])) as u32
}

/// The distance of unrelated descriptors, roughly.
pub(super) const UNRELATED: f32 = 6000.0;

/// Weights of the sums: how much sample `k` of a row or column counts for cell `c`, linear between cell centres and faded
/// towards the border of the grid.
pub(super) struct Describer {
    weights: Weights,
}

/// `[sample][cell]`.
type Weights = [[f32; CELLS]; GRID];

impl Describer {
    pub fn new() -> Self {
        let mut weights = [[0.0; CELLS]; GRID];
        for (k, weights) in weights.iter_mut().enumerate() {
            let from_centre = (k as f32 + 0.5) / GRID as f32 - 0.5;
            // Gaussian with a standard deviation of half the grid.
            let fade = libm::expf(-0.5 * (from_centre / 0.5) * (from_centre / 0.5));
            let cell = (k as f32 + 0.5) * CELLS as f32 / GRID as f32 - 0.5;
            for (c, weight) in weights.iter_mut().enumerate() {
                *weight = fade * (1.0 - (cell - c as f32).abs()).max(0.0);
            }
        }
        Self { weights }
    }

    /// Describes a feature. `cell` is the edge of a cell in units of the feature's scale; columns are spaced `stretch` times
    /// as far as rows.
    pub fn describe(&self, pyramid: &Pyramid, feature: &Feature, cell: f32, stretch: f32) -> Descriptor {
        let octave = &pyramid.octaves[feature.octave];
        let image = &octave.gauss[feature.level];
        let spacing = cell * feature.sigma * CELLS as f32 / GRID as f32;
        let centre = (feature.x / octave.step_x, feature.y / octave.step_y);
        histogram(&self.weights, image, centre, (spacing * stretch / octave.step_x, spacing / octave.step_y))
    }
}

/// The descriptor of the grid around `centre` with the given steps (x, y), in pixels of the image.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+bmi1+bmi2+lzcnt+popcnt",
    "x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"
))]
fn histogram(weights: &Weights, image: &Image<u16>, centre: (f32, f32), step: (f32, f32)) -> Descriptor {
    let patch = cut(image, centre, step);
    // Rows first: each row of samples counts for the cell rows next to it.
    let mut by_row = [[[0.0_f32; LANES]; DIRECTIONS]; CELLS];
    let mut channels = [[0.0; LANES]; DIRECTIONS];
    for (j, row_weights) in weights.iter().enumerate() {
        directions(&patch[j], &patch[j + 1], &patch[j + 2], &mut channels);
        for (cells, weight) in by_row.iter_mut().zip(row_weights) {
            if *weight > 0.0 {
                for (to, from) in cells.as_flattened_mut().iter_mut().zip(channels.as_flattened()) {
                    *to += weight * from;
                }
            }
        }
    }
    // Then columns.
    let mut sums = [[[0.0_f32; CELLS]; DIRECTIONS]; CELLS];
    for (to, from) in sums.as_flattened_mut().iter_mut().zip(by_row.as_flattened()) {
        for (weights, value) in weights.iter().zip(from) {
            for (to, weight) in to.iter_mut().zip(weights) {
                *to += weight * value;
            }
        }
    }
    // Added up in lanes, in an order of our own: a single chain of sums would wait for each of them.
    let flat: &[f32; LENGTH] = bytemuck::cast_ref(&sums);
    let mut lanes = [0.0; 16];
    for block in flat.as_chunks::<16>().0 {
        lanes = std::array::from_fn(|i| lanes[i] + block[i]);
    }
    let scale = NORM * NORM / lanes.iter().sum::<f32>().max(f32::MIN_POSITIVE);
    let mut descriptor = [0; LENGTH];
    for (entry, sum) in descriptor.iter_mut().zip(flat) {
        *entry = (smaller((sum * scale).sqrt(), 255.0) + TO_INTEGER).to_bits() as u8;
    }
    descriptor
}

/// A row of samples, with a ring on either side.
type Line = [f32; LANES + 2];

/// Gradients of a row of samples, given with the rows above and below, as shares of the eight directions: each gradient is
/// split between the two directions that enclose it such that the two shares as vectors add up to it. No angle is computed.
#[inline(always)]
fn directions(above: &Line, row: &Line, below: &Line, channels: &mut [[f32; LANES]; DIRECTIONS]) {
    for i in 0..LANES {
        let gx = row[i + 2] - row[i];
        let gy = below[i + 1] - above[i + 1];
        let (ax, ay) = (gx.abs(), gy.abs());
        let (east, west) = (0.5 * (ax + gx), 0.5 * (ax - gx));
        let (south, north) = (0.5 * (ay + gy), 0.5 * (ay - gy));
        // Along an axis counts what exceeds the other part, on a diagonal the smaller part.
        channels[0][i] = positive(east - ay);
        channels[2][i] = positive(south - ax);
        channels[4][i] = positive(west - ay);
        channels[6][i] = positive(north - ax);
        channels[1][i] = SQRT_2 * smaller(east, south);
        channels[3][i] = SQRT_2 * smaller(west, south);
        channels[5][i] = SQRT_2 * smaller(west, north);
        channels[7][i] = SQRT_2 * smaller(east, north);
    }
}

/// The number, or 0 if it is negative; one instruction, since NaN does not occur here.
#[inline(always)]
fn positive(a: f32) -> f32 {
    if a > 0.0 { a } else { 0.0 }
}

#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Interpolates the first `columns` columns between two rows.
#[inline(always)]
fn blend(line: &mut [f32; LINE], a: &[u16], b: &[u16], share: f32, columns: usize) {
    for ((to, a), b) in line[..columns].iter_mut().zip(&a[..columns]).zip(&b[..columns]) {
        let (a, b) = (f32::from(*a), f32::from(*b));
        *to = a + share * (b - a);
    }
}

/// Samples an image on a grid around `centre` with the given steps (x, y), both in pixels of the image. Returns the rows of
/// the grid.
///
/// Each row of the grid is first interpolated between two rows of the image, all columns at once, and then at its columns.
#[inline(always)]
fn cut(image: &Image<u16>, centre: (f32, f32), step: (f32, f32)) -> [Line; PATCH] {
    let offset = |k: usize| k as f32 - 0.5 * (PATCH - 1) as f32;
    let step = (smaller(step.0, LARGEST_STEP), step.1);
    let left = centre.0 + step.0 * offset(0);
    let (first, _, start) = split_cyclic(left, image.width);
    let mut places = [(0, 0.0); PATCH];
    for (k, place) in places.iter_mut().enumerate() {
        let x = start + step.0 * k as f32;
        let column = x as usize;
        *place = (column, x - column as f32);
    }
    // A fixed number of columns, of which few features need all, is faster than just those that are needed.
    let short = places[PATCH - 1].0 + 2 <= SHORT;
    let mut line = [0.0; LINE];
    let mut patch = [[0.0; LANES + 2]; PATCH];
    for (j, samples) in patch.iter_mut().enumerate() {
        let (y0, y1, fy) = split_clamped(centre.1 + step.1 * offset(j), image.height);
        let (a, b) = (&image.row_and_margin(y0)[first..], &image.row_and_margin(y1)[first..]);
        if short {
            blend(&mut line, a, b, fy, SHORT);
        } else {
            blend(&mut line, a, b, fy, LINE);
        }
        for (sample, (column, share)) in samples.iter_mut().zip(&places) {
            let (a, b) = (line[column % LINE], line[(column + 1) % LINE]);
            *sample = a + share * (b - a);
        }
    }
    patch
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_the_gradient() {
        for k in 0..64 {
            let (s, c) = crate::geometry::sin_cos(std::f64::consts::TAU * f64::from(k) / 64.0);
            // A plane that rises along (c, s); central differences span two samples.
            let row = |y: f64| std::array::from_fn(|x| (c * x as f64 + s * y) as f32);
            let mut channels = [[0.0; LANES]; DIRECTIONS];
            directions(&row(0.0), &row(1.0), &row(2.0), &mut channels);
            let (mut x, mut y) = (0.0, 0.0);
            for (bin, channel) in channels.iter().enumerate() {
                let (s, c) = crate::geometry::sin_cos(std::f64::consts::TAU * bin as f64 / 8.0);
                assert!(channel.iter().all(|share| *share >= 0.0));
                x += c * f64::from(channel[7]);
                y += s * f64::from(channel[7]);
            }
            assert!((x - 2.0 * c).abs() < 1e-5 && (y - 2.0 * s).abs() < 1e-5, "{k}: {x} {y}");
        }
    }
}
