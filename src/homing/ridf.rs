//! Rotational image difference: how unlike two views are when the one is turned against the other, column by column.
//!
//! Of home S and the current view C with w columns, IDF(k) over all pixels of C(c) - S(c + k) has its minimum at the turn since home: the
//! visual compass (Zeil, Hofmann and Chahl 2003). As a root of mean squares it is a correlation, and goes through Fourier
//! transforms of the rows. Grey levels are whole numbers, and so are sums of their products; what the transforms give is rounded to
//! them, so that it is exact, and the same on every machine.

use std::f64::consts::TAU;
use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::grey::Grey;
use super::{Angle, Answer, Homing};
use crate::error::Result;
use crate::geometry::wrap;
use crate::panorama::Panorama;

/// The rows of a view transformed.
#[derive(Debug, Clone)]
pub struct Spectrum {
    rows: Vec<Complex64>,
    squares: u64,
}

/// Transforms for views of one size.
#[derive(Clone)]
pub struct Ridf {
    width: usize,
    height: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    row: Vec<f64>,
    sum: Vec<Complex64>,
    products: Vec<f64>,
    scratch: Vec<Complex64>,
}

impl Ridf {
    /// Plans the transforms of views of this many columns and rows.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        let mut planner = RealFftPlanner::<f64>::new();
        let (forward, inverse) = (planner.plan_fft_forward(width), planner.plan_fft_inverse(width));
        let scratch = vec![Complex64::default(); forward.get_scratch_len().max(inverse.get_scratch_len())];
        let (row, sum, products) = (forward.make_input_vec(), inverse.make_input_vec(), inverse.make_output_vec());
        Self { width, height, forward, inverse, row, sum, products, scratch }
    }

    /// The rows of a view transformed, which serves all comparisons with it.
    ///
    /// # Panics
    /// When the view has another size.
    pub fn spectrum(&mut self, view: &Grey) -> Spectrum {
        assert_eq!((view.width(), view.height()), (self.width, self.height), "a view of the planned size");
        let half = self.width / 2 + 1;
        let mut rows = vec![Complex64::default(); half * self.height];
        for (pixels, out) in view.pixels.chunks_exact(self.width).zip(rows.chunks_exact_mut(half)) {
            self.row.iter_mut().zip(pixels).for_each(|(value, pixel)| *value = f64::from(*pixel));
            // Only lengths can be wrong, and these are the plan's own.
            let _ = self.forward.process_with_scratch(&mut self.row, out, &mut self.scratch);
        }
        let squares = view.pixels.iter().map(|p| u64::from(*p) * u64::from(*p)).sum();
        Spectrum { rows, squares }
    }

    /// Sums of squared differences of grey levels, C(c) - S(c + k), for each k.
    pub fn squares(&mut self, now: &Spectrum, home: &Spectrum, out: &mut Vec<u64>) {
        let half = self.width / 2 + 1;
        self.sum.fill(Complex64::default());
        for (c, s) in now.rows.chunks_exact(half).zip(home.rows.chunks_exact(half)) {
            for ((sum, c), s) in self.sum.iter_mut().zip(c).zip(s) {
                sum.re += c.re * s.re + c.im * s.im;
                sum.im += c.re * s.im - c.im * s.re;
            }
        }
        // These are real by nature, and rounding must not make the transform refuse them.
        self.sum[0].im = 0.0;
        if self.width.is_multiple_of(2) {
            self.sum[half - 1].im = 0.0;
        }
        let _ = self.inverse.process_with_scratch(&mut self.sum, &mut self.products, &mut self.scratch);
        let total = (now.squares + home.squares) as i64;
        let share = 1.0 / self.width as f64;
        out.clear();
        out.extend(self.products.iter().map(|p| (total - 2 * (p * share).round() as i64).max(0) as u64));
    }
}

/// Sums of absolute differences of grey levels, |C(c) - S(c + k)|, for each k.
///
/// # Panics
/// When the views have different sizes.
#[must_use]
pub fn absolutes(now: &Grey, home: &Grey) -> Vec<u64> {
    assert_eq!((now.width(), now.height()), (home.width(), home.height()), "views of one size");
    let width = now.width();
    let mut sums = vec![0; width];
    let mut twice = vec![0; 2 * width];
    for (c, s) in now.pixels.chunks_exact(width).zip(home.pixels.chunks_exact(width)) {
        twice[..width].copy_from_slice(s);
        twice[width..].copy_from_slice(s);
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += u64::from(c.iter().zip(&twice[k..k + width]).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>());
        }
    }
    sums
}

/// The least of the differences: its k, between columns by the parabola through it and its neighbours, and its value.
///
/// # Panics
/// When there are none.
#[must_use]
pub fn minimum(differences: &[u64]) -> (f64, u64) {
    let count = differences.len();
    let (k, &least) = differences.iter().enumerate().min_by_key(|(_, d)| **d).expect("a view has columns");
    let [before, after] = [count - 1, 1].map(|step| differences[(k + step) % count] as f64);
    let bend = before - 2.0 * least as f64 + after;
    let shift = if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    (k as f64 + shift, least)
}

/// Turn since home at a minimum, rad.
#[must_use]
pub fn turn_rad(k: f64, width: usize) -> f64 {
    wrap(k * TAU / width as f64)
}

/// The visual compass: heading in the home frame, and no direction of home.
pub struct Compass {
    ridf: Ridf,
    home: Grey,
    spectrum: Spectrum,
    squares: Vec<u64>,
}

impl Compass {
    /// With this view at home.
    #[must_use]
    pub fn new(home: &Panorama) -> Self {
        let home = Grey::of(home);
        let mut ridf = Ridf::new(home.width(), home.height());
        let spectrum = ridf.spectrum(&home);
        Self { ridf, home, spectrum, squares: Vec::new() }
    }

    /// Turn since home, rad, and the view itself.
    ///
    /// # Errors
    /// When the view is of another size or projection than home.
    pub fn turn(&mut self, now: &Panorama) -> Result<(f64, Grey)> {
        let now = Grey::of(now);
        now.check_like(&self.home)?;
        let spectrum = self.ridf.spectrum(&now);
        self.ridf.squares(&spectrum, &self.spectrum, &mut self.squares);
        Ok((turn_rad(minimum(&self.squares).0, self.home.width()), now))
    }

    /// The view at home.
    #[must_use]
    pub fn home(&self) -> &Grey {
        &self.home
    }
}

impl Homing for Compass {
    fn look(&mut self, now: &Panorama) -> Result<Answer> {
        let (turn, _) = self.turn(now)?;
        Ok(Answer { turn: Some(Angle { rad: turn, sd_rad: None }), ..Answer::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::Projection;
    use crate::random::Seed;
    use rand_pcg::rand_core::Rng;

    fn noise(width: u32, height: u32, name: &str) -> Grey {
        let mut stream = Seed(5).stream(name);
        let projection = Projection::new(width, height);
        Grey { projection, pixels: (0..projection.pixels()).map(|_| stream.next_u32() as u8).collect() }
    }

    /// Sums of squares by their definition.
    fn brute(now: &Grey, home: &Grey) -> Vec<u64> {
        let width = now.width();
        let square = |k: usize, row: usize, c: usize| {
            let (a, b) = (now.pixels[row * width + c], home.pixels[row * width + (c + k) % width]);
            u64::from(a.abs_diff(b)).pow(2)
        };
        (0..width).map(|k| (0..now.height()).map(|row| (0..width).map(|c| square(k, row, c)).sum::<u64>()).sum()).collect()
    }

    #[test]
    fn transforms_give_the_sums_exactly() {
        for (width, height) in [(90, 13), (561, 81), (17, 1), (8, 3)] {
            let (now, home) = (noise(width, height, "now"), noise(width, height, "home"));
            let mut ridf = Ridf::new(now.width(), now.height());
            let (a, b) = (ridf.spectrum(&now), ridf.spectrum(&home));
            let mut found = Vec::new();
            ridf.squares(&a, &b, &mut found);
            assert_eq!(found, brute(&now, &home), "{width} x {height}");
        }
    }

    #[test]
    fn a_turn_is_where_the_difference_is_least() {
        let home = noise(90, 13, "home");
        for turn in [0, 1, 37, 89] {
            let mut now = home.clone();
            // Turned to the left by so many columns: what was at column c + turn is at c.
            now.pixels.chunks_exact_mut(90).for_each(|row| row.rotate_left(turn));
            let mut ridf = Ridf::new(90, 13);
            let (a, b) = (ridf.spectrum(&now), ridf.spectrum(&home));
            let mut squares = Vec::new();
            ridf.squares(&a, &b, &mut squares);
            for differences in [&squares, &absolutes(&now, &home)] {
                let (k, least) = minimum(differences);
                assert!(least == 0 && (wrap((k - turn as f64) * TAU / 90.0)).abs() < 0.01, "{k} for {turn}");
            }
        }
    }
}
