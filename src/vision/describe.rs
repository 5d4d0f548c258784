//! Descriptors: what the surroundings of a feature look like, as 128 bytes.
//!
//! A grid of 16 x 16 samples around the feature, spaced in proportion to its scale, is turned into gradients; those are
//! summed into 4 x 4 cells of 8 directions each (Lowe 2004), upright. The square roots of the normalised sums are stored
//! (Arandjelovic and Zisserman 2012) and compared by the sum of absolute differences: on rendered rooms this told right matches
//! from wrong ones at least as well as the Euclidean distance, and it is the fastest distance that a processor has.

use std::f32::consts::SQRT_2;

use super::detect::Feature;
use super::pyramid::{Image, Pyramid, split_clamped, split_cyclic};

/// Length of a descriptor.
pub(super) const LENGTH: usize = 128;
/// Samples along an edge of the grid.
const GRID: usize = 12;
/// Samples with the ring that central differences need.
const PATCH: usize = GRID + 2;
/// Cells along an edge.
const CELLS: usize = 4;
/// Directions per cell.
const DIRECTIONS: usize = 8;
/// Norm of a descriptor; entries rarely come near 255.
const NORM: f32 = 512.0;

/// A descriptor.
pub(super) type Descriptor = [u8; LENGTH];

/// Distance of two descriptors: the sum of absolute differences. Written by blocks of 16, for which compilers know one
/// instruction; inlined into a loop they miss it.
#[inline(never)]
pub(super) fn distance(a: &Descriptor, b: &Descriptor) -> u32 {
    let block = |(a, b): (&[u8; 16], &[u8; 16])| a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>();
    a.as_chunks().0.iter().zip(b.as_chunks().0).map(block).sum()
}

/// The distance of unrelated descriptors, roughly.
pub(super) const UNRELATED: f32 = 6000.0;

/// Weights of the sums: how much sample `k` of a row or column counts for cell `c`, linear between cell centres and faded
/// towards the border of the grid.
pub(super) struct Describer {
    weights: [[f32; CELLS]; GRID],
}

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
        let patch = cut(
            image,
            (feature.x / octave.step_x, feature.y / octave.step_y),
            (spacing * stretch / octave.step_x, spacing / octave.step_y),
        );
        // Rows first: each row of samples counts for the cell rows next to it.
        let mut by_row = [[[0.0_f32; GRID]; DIRECTIONS]; CELLS];
        let mut channels = [[0.0; GRID]; DIRECTIONS];
        for (j, row_weights) in self.weights.iter().enumerate() {
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
            for (weights, value) in self.weights.iter().zip(from) {
                for (to, weight) in to.iter_mut().zip(weights) {
                    *to += weight * value;
                }
            }
        }
        let flat = sums.as_flattened().as_flattened();
        let total: f32 = flat.iter().sum::<f32>().max(f32::MIN_POSITIVE);
        let mut descriptor = [0; LENGTH];
        for (entry, sum) in descriptor.iter_mut().zip(flat) {
            *entry = (NORM * (sum / total).sqrt() + 0.5).min(255.0) as u8;
        }
        descriptor
    }
}

/// Gradients of a row of samples, given with the rows above and below, as shares of the eight directions: each gradient is
/// split between the two directions that enclose it such that the two shares as vectors add up to it. No angle is computed.
fn directions(above: &[f32; PATCH], row: &[f32; PATCH], below: &[f32; PATCH], channels: &mut [[f32; GRID]; DIRECTIONS]) {
    for i in 0..GRID {
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
fn positive(a: f32) -> f32 {
    if a > 0.0 { a } else { 0.0 }
}

fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Samples an image on a grid around `centre` with the given steps (x, y), both in pixels of the image. Returns the rows of
/// the grid.
fn cut(image: &Image<u16>, centre: (f32, f32), step: (f32, f32)) -> [[f32; PATCH]; PATCH] {
    let offset = |k: usize| k as f32 - 0.5 * (PATCH - 1) as f32;
    let mut columns = [(0, 0, 0.0); PATCH];
    for (k, column) in columns.iter_mut().enumerate() {
        *column = split_cyclic(centre.0 + step.0 * offset(k), image.width);
    }
    let mut patch = [[0.0; PATCH]; PATCH];
    for (j, samples) in patch.iter_mut().enumerate() {
        let (y0, y1, fy) = split_clamped(centre.1 + step.1 * offset(j), image.height);
        let (a, b) = (image.row(y0), image.row(y1));
        for (sample, &(x0, x1, fx)) in samples.iter_mut().zip(&columns) {
            let (a0, a1, b0, b1) = (f32::from(a[x0]), f32::from(a[x1]), f32::from(b[x0]), f32::from(b[x1]));
            let (left, right) = (a0 + fy * (b0 - a0), a1 + fy * (b1 - a1));
            *sample = left + fx * (right - left);
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
            let mut channels = [[0.0; GRID]; DIRECTIONS];
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
