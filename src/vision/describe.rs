//! Descriptors: what the surroundings of a feature look like, as 128 bytes.
//!
//! A grid of 16 x 16 samples around the feature, spaced in proportion to its scale, is turned into gradients; those are
//! summed into 4 x 4 cells of 8 directions each (Lowe 2004), upright. The square roots of the normalised sums are stored
//! (Arandjelovic and Zisserman 2012), which makes the Euclidean distance of descriptors the Hellinger distance of histograms.

use super::detect::Feature;
use super::pyramid::{Image, Pyramid, split_clamped, split_cyclic};

/// Length of a descriptor.
pub(super) const LENGTH: usize = 128;
/// Samples along an edge of the grid.
const GRID: usize = 16;
/// Samples with the ring that central differences need.
const PATCH: usize = GRID + 2;
/// Cells along an edge.
const CELLS: usize = 4;
/// Directions per cell.
const DIRECTIONS: usize = 8;
/// Norm of a descriptor; entries rarely come near 255.
const NORM: f32 = 512.0;

/// A descriptor; entries are 0 to 255 and kept as `i16`, which multiplies fastest.
pub(super) type Descriptor = [i16; LENGTH];

/// Squared Euclidean distance of two descriptors, in units of `DISTANCE_SCALE`.
pub(super) fn distance(a: &Descriptor, b: &Descriptor) -> u32 {
    let sum: i32 = a
        .iter()
        .zip(b)
        .map(|(a, b)| {
            let d = a - b;
            i32::from(d) * i32::from(d)
        })
        .sum();
    sum as u32
}

/// Squared distance of two descriptors that have nothing in common (orthogonal).
pub(super) const DISTANCE_SCALE: f32 = 2.0 * NORM * NORM;

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
        let mut sums = [[[0.0_f32; DIRECTIONS]; CELLS]; CELLS];
        for (j, row_weights) in self.weights.iter().enumerate() {
            let mut row_sums = [[0.0_f32; DIRECTIONS]; CELLS];
            for (i, weights) in self.weights.iter().enumerate() {
                let gx = patch[j + 1][i + 2] - patch[j + 1][i];
                let gy = patch[j + 2][i + 1] - patch[j][i + 1];
                let (bins, shares) = directions(gx, gy);
                // Linear interpolation: a sample counts for at most two neighbouring cells.
                let first = (i.saturating_sub(GRID / CELLS / 2)) / (GRID / CELLS);
                for c in first..(first + 2).min(CELLS) {
                    row_sums[c][bins[0]] += weights[c] * shares[0];
                    row_sums[c][bins[1]] += weights[c] * shares[1];
                }
            }
            for (cells, weight) in sums.iter_mut().zip(row_weights) {
                if *weight > 0.0 {
                    for (to, from) in cells.as_flattened_mut().iter_mut().zip(row_sums.as_flattened()) {
                        *to += weight * from;
                    }
                }
            }
        }
        let flat = sums.as_flattened().as_flattened();
        let total: f32 = flat.iter().sum::<f32>().max(f32::MIN_POSITIVE);
        let mut descriptor = [0; LENGTH];
        for (entry, sum) in descriptor.iter_mut().zip(flat) {
            *entry = (NORM * (sum / total).sqrt() + 0.5).min(255.0) as i16;
        }
        descriptor
    }
}

/// Splits a gradient between the two of the eight directions that enclose it, such that the two shares as vectors add up to
/// it. No angle is computed.
fn directions(gx: f32, gy: f32) -> ([usize; 2], [f32; 2]) {
    let (ax, ay) = (gx.abs(), gy.abs());
    let (large, small) = if ax >= ay { (ax, ay) } else { (ay, ax) };
    let axis = if ax >= ay {
        if gx >= 0.0 { 0 } else { 4 }
    } else if gy >= 0.0 {
        2
    } else {
        6
    };
    let diagonal = match (gx >= 0.0, gy >= 0.0) {
        (true, true) => 1,
        (false, true) => 3,
        (false, false) => 5,
        (true, false) => 7,
    };
    ([axis, diagonal], [large - small, std::f32::consts::SQRT_2 * small])
}

/// Samples an image on a grid around `centre` with the given steps (x, y), both in pixels of the image.
fn cut(image: &Image, centre: (f32, f32), step: (f32, f32)) -> [[f32; PATCH]; PATCH] {
    let offset = |k: usize| k as f32 - 0.5 * (PATCH - 1) as f32;
    let columns: [(usize, usize, f32); PATCH] = std::array::from_fn(|k| split_cyclic(centre.0 + step.0 * offset(k), image.width));
    std::array::from_fn(|j| {
        let (y0, y1, fy) = split_clamped(centre.1 + step.1 * offset(j), image.height);
        let (a, b) = (image.row(y0), image.row(y1));
        std::array::from_fn(|i| {
            let (x0, x1, fx) = columns[i];
            let top = a[x0] + fx * (a[x1] - a[x0]);
            let bottom = b[x0] + fx * (b[x1] - b[x0]);
            top + fy * (bottom - top)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_the_gradient() {
        for k in 0..64 {
            let angle = std::f64::consts::TAU * f64::from(k) / 64.0;
            let (s, c) = crate::geometry::sin_cos(angle);
            let (bins, shares) = directions(2.0 * c as f32, 2.0 * s as f32);
            let (mut x, mut y) = (0.0, 0.0);
            for (bin, share) in bins.iter().zip(shares) {
                let (s, c) = crate::geometry::sin_cos(std::f64::consts::TAU * *bin as f64 / 8.0);
                assert!(share >= 0.0);
                x += c * f64::from(share);
                y += s * f64::from(share);
            }
            assert!((x - 2.0 * c).abs() < 1e-6 && (y - 2.0 * s).abs() < 1e-6, "{angle}");
        }
    }
}
