//! A square canvas without borders: what is drawn over one edge comes in at the opposite one. Lengths are metres.

use rand_pcg::rand_core::Rng;
use rayon::prelude::*;

use crate::random::Stream;

/// Red, green and blue, 0 to 255.
pub(super) type Colour = [f32; 3];

/// A uniform number in [low, high).
pub(super) fn between(stream: &mut Stream, low: f64, high: f64) -> f64 {
    let unit = (stream.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    low + (high - low) * unit
}

/// A uniform whole number in 0..n.
pub(super) fn below(stream: &mut Stream, n: usize) -> usize {
    (between(stream, 0.0, n as f64) as usize).min(n - 1)
}

/// A square canvas without borders.
pub(super) struct Canvas {
    /// Pixels along an edge.
    size: usize,
    /// Edge length, m.
    pub period: f64,
    /// Colour it starts with, which [`Canvas::weaken`] goes back to.
    pub base: Colour,
    /// Colours, v fastest.
    pixels: Vec<Colour>,
}

impl Canvas {
    pub fn new(size: usize, period: f64, base: Colour) -> Self {
        Self { size, period, base, pixels: vec![base; size * size] }
    }

    /// Replaces all pixels by `pixels`, v fastest.
    pub fn fill(&mut self, pixels: Vec<Colour>) {
        debug_assert_eq!(pixels.len(), self.pixels.len());
        self.pixels = pixels;
    }

    /// Length that `count_per_period` equal parts have; at least one part, about `length_m` long.
    pub fn divide(&self, length_m: f64) -> (usize, f64) {
        let count = libm::round(self.period / length_m).clamp(1.0, (self.size / 2).max(1) as f64);
        (count as usize, self.period / count)
    }

    fn scale(&self) -> f64 {
        self.size as f64 / self.period
    }

    fn wrapped(&self, k: i64) -> usize {
        k.rem_euclid(self.size as i64) as usize
    }

    /// Changes the pixels whose centres lie in a box.
    fn within(&mut self, u: [f64; 2], v: [f64; 2], mut change: impl FnMut(f64, f64, &mut Colour)) {
        let scale = self.scale();
        let pixel = |x: f64| libm::ceil(x * scale - 0.5) as i64;
        let span = |[low, high]: [f64; 2]| pixel(low)..pixel(high).min(pixel(low) + self.size as i64);
        let (us, vs) = (span(u), span(v));
        for ku in us {
            let line = self.wrapped(ku) * self.size;
            for kv in vs.clone() {
                let at = line + self.wrapped(kv);
                change((ku as f64 + 0.5) / scale, (kv as f64 + 0.5) / scale, &mut self.pixels[at]);
            }
        }
    }

    /// Changes every pixel.
    pub fn each(&mut self, change: impl FnMut(f64, f64, &mut Colour)) {
        self.within([0.0, self.period], [0.0, self.period], change);
    }

    /// Fills a box.
    pub fn rectangle(&mut self, u: [f64; 2], v: [f64; 2], colour: Colour) {
        self.within(u, v, |_, _, c| *c = colour);
    }

    /// Multiplies a box's colours.
    pub fn darken(&mut self, u: [f64; 2], v: [f64; 2], factor: f32) {
        self.within(u, v, |_, _, c| *c = c.map(|x| x * factor));
    }

    /// Fills a disc.
    pub fn disc(&mut self, u: f64, v: f64, radius: f64, colour: Colour) {
        self.within([u - radius, u + radius], [v - radius, v + radius], |x, y, c| {
            if (x - u) * (x - u) + (y - v) * (y - v) < radius * radius {
                *c = colour;
            }
        });
    }

    /// Draws a straight stroke with round ends.
    pub fn stroke(&mut self, from: [f64; 2], to: [f64; 2], width: f64, colour: Colour) {
        let half = 0.5 * width;
        let reach = |k: usize| [from[k].min(to[k]) - half, from[k].max(to[k]) + half];
        let d = [to[0] - from[0], to[1] - from[1]];
        let square = (d[0] * d[0] + d[1] * d[1]).max(1e-12);
        self.within(reach(0), reach(1), |x, y, c| {
            let p = [x - from[0], y - from[1]];
            let s = ((p[0] * d[0] + p[1] * d[1]) / square).clamp(0.0, 1.0);
            let q = [p[0] - s * d[0], p[1] - s * d[1]];
            if q[0] * q[0] + q[1] * q[1] < half * half {
                *c = colour;
            }
        });
    }

    /// Fills a convex polygon of either sense.
    pub fn polygon(&mut self, corners: &[[f64; 2]], colour: Colour) {
        let reach = |k: usize| corners.iter().fold([f64::MAX, f64::MIN], |[low, high], c| [c[k].min(low), c[k].max(high)]);
        self.within(reach(0), reach(1), |x, y, c| {
            let side = |k: usize| {
                let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
                (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
            };
            if (0..corners.len()).all(|k| side(k) >= 0.0) || (0..corners.len()).all(|k| side(k) <= 0.0) {
                *c = colour;
            }
        });
    }

    /// Adds smooth noise of a wavelength (m, along u and v): values of a random lattice, interpolated; up to +-`strength` per channel,
    /// of which the share `tint` differs between channels.
    pub fn noise(&mut self, stream: &mut Stream, wavelength: [f64; 2], strength: f32, tint: f32) {
        let (nu, cell_u) = self.divide(wavelength[0]);
        let (nv, cell_v) = self.divide(wavelength[1]);
        let lattice: Vec<Colour> = (0..nu * nv)
            .map(|_| {
                let grey = between(stream, -1.0, 1.0) as f32;
                [0; 3].map(|_| strength * ((1.0 - tint) * grey + tint * between(stream, -1.0, 1.0) as f32))
            })
            .collect();
        let scale = self.scale();
        let place = |k: usize, cell: f64, n: usize| {
            let at = (k as f64 + 0.5) / (scale * cell);
            let k = at as usize;
            let f = at - k as f64;
            (k % n, (k + 1) % n, (f * f * (3.0 - 2.0 * f)) as f32)
        };
        let along_v: Vec<_> = (0..self.size).map(|k| place(k, cell_v, nv)).collect();
        let mut between_lines = vec![[0.0; 3]; nv];
        for (k, line) in self.pixels.chunks_mut(self.size).enumerate() {
            let (a, b, f) = place(k, cell_u, nu);
            for (v, value) in between_lines.iter_mut().enumerate() {
                let (a, b) = (lattice[a * nv + v], lattice[b * nv + v]);
                *value = std::array::from_fn(|c| a[c] + (b[c] - a[c]) * f);
            }
            for (pixel, &(p, q, f)) in line.iter_mut().zip(&along_v) {
                let (p, q) = (between_lines[p], between_lines[q]);
                for c in 0..3 {
                    pixel[c] += p[c] + (q[c] - p[c]) * f;
                }
            }
        }
    }

    /// Draws the pattern back towards the base colour: 1 leaves it, 0 removes it.
    pub fn weaken(&mut self, contrast: f32) {
        let base = self.base;
        for c in &mut self.pixels {
            for (x, b) in c.iter_mut().zip(base) {
                *x = (b + contrast * (*x - b)).clamp(0.0, 255.0);
            }
        }
    }

    /// The same with `size` pixels along an edge, at most as many as there are: each is the mean of what it covers.
    pub fn shrunk(&self, size: usize) -> Self {
        let shares = shares(self.size, size);
        let mut pixels = vec![[0.0; 3]; size * size];
        pixels.par_chunks_mut(size).zip(&shares).for_each_init(
            || vec![[0.0_f32; 3]; self.size],
            |line, (out, covered)| {
                line.fill([0.0; 3]);
                for &(u, share) in covered {
                    let add = self.pixels[u * self.size..][..self.size].as_flattened();
                    line.as_flattened_mut().iter_mut().zip(add).for_each(|(sum, x)| *sum += share * x);
                }
                for (out, covered) in out.iter_mut().zip(&shares) {
                    let add = |sum: Colour, &(v, share): &(usize, f32)| -> Colour {
                        let colour: Colour = line[v];
                        std::array::from_fn(|c| sum[c] + share * colour[c])
                    };
                    // Written without being read: fresh memory that is read first is asked of the system twice.
                    *out = covered.iter().fold([0.0; 3], add);
                }
            },
        );
        Self { size, pixels, ..*self }
    }

    /// Writes the pixels, packed with red in the lowest byte, with a border of one pixel in which the tile goes on.
    pub fn write_texels(&self, out: &mut [u32]) {
        let packed = |colour: &Colour| {
            let [r, g, b] = colour.map(|x| (x + 0.5) as u32);
            r | g << 8 | b << 16 | 0xff00_0000
        };
        let pitch = self.size + 2;
        debug_assert_eq!(out.len(), pitch * pitch);
        out.par_chunks_exact_mut(pitch).enumerate().for_each(|(k, out)| {
            let line = &self.pixels[(k + self.size - 1) % self.size * self.size..][..self.size];
            out[0] = packed(&line[self.size - 1]);
            out[1..=self.size].iter_mut().zip(line).for_each(|(out, colour)| *out = packed(colour));
            out[pitch - 1] = packed(&line[0]);
        });
    }
}

/// For each of `to` equal parts of a line of `from` pixels: the pixels that it covers, and their shares of it.
pub(super) fn shares(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    let scale = from as f64 / to as f64;
    (0..to)
        .map(|k| {
            let (low, high) = (k as f64 * scale, (k + 1) as f64 * scale);
            let last = (libm::ceil(high) as usize).min(from);
            (low as usize..last)
                .map(|p| {
                    let covered = high.min((p + 1) as f64) - low.max(p as f64);
                    (p, (covered / scale) as f32)
                })
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up() {
        for (from, to) in [(1, 8), (3, 4), (7, 7), (1000, 64), (5, 2)] {
            let shares = shares(from, to);
            assert!(shares.iter().all(|s| (s.iter().map(|(_, w)| w).sum::<f32>() - 1.0).abs() < 1e-5), "{from} {to}");
            let all: f32 = shares.iter().flatten().filter(|(p, _)| *p == from - 1).map(|(_, w)| w).sum();
            assert!((all - to as f32 / from as f32).abs() < 1e-4, "{from} {to}: {all}");
        }
    }
}
