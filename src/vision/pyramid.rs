//! Scale space of a panorama: a half-octave pyramid of Gaussian images and their differences, cyclic in azimuth.
//!
//! Each octave holds three images of standard deviation 1, sqrt 2 and 2 of its own pixels and their two differences. The
//! third image, sampled at every other pixel, is the first of the next octave, so nothing wider than a five-tap binomial
//! (variance 1) is ever convolved: one pass leads to the second image, two more to the third. This is the half-octave
//! pyramid of Crowley and Riff (2003), a fourth of the work of the usual scale space with three steps an octave.
//!
//! Columns wrap round: the seam of the panorama is no border. Rows are clamped at top and bottom.
//!
//! Each image is made of the one before in bands of rows, one a thread; small images are not worth sharing.
//!
//! Grey levels are kept in sixteenths, as 16-bit integers: twice as many fit a vector register as floats, and the binomial
//! sums of them just do not overflow.

use std::ops::Range;

use rayon::prelude::*;

use crate::panorama::Panorama;

/// Octave-pixel standard deviation of the finest image of an octave; a step to the next is a factor sqrt 2.
pub(super) const BASE_SIGMA: f32 = 1.0;

/// Units of a pixel's value in one grey level of 255.
pub(super) const UNITS: f32 = 16.0;

/// Columns of the left end that rows are followed by.
pub(super) const MARGIN: usize = 64;

/// Fewest pixels that are worth waking another thread for.
const WORTH_SHARING: usize = 1 << 15;

/// A grey image whose columns are cyclic. Each row is followed by a copy of its first columns, so that a piece of a row across
/// the seam is a slice like any other.
#[derive(Debug, Clone, Default)]
pub(super) struct Image<T> {
    pub width: usize,
    pub height: usize,
    data: Vec<T>,
}

impl<T: Copy + Default + Into<f32>> Image<T> {
    fn resize(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.data.resize((width + MARGIN) * height, T::default());
    }

    /// Row `y`.
    #[inline]
    pub fn row(&self, y: usize) -> &[T] {
        &self.row_and_margin(y)[..self.width]
    }

    /// Row `y`, followed by its first `MARGIN` columns again.
    #[inline]
    pub fn row_and_margin(&self, y: usize) -> &[T] {
        &self.data[y * (self.width + MARGIN)..(y + 1) * (self.width + MARGIN)]
    }

    /// All rows to be written, in bands of which each thread gets one.
    fn bands_mut(&mut self) -> Vec<Band<'_, T>> {
        let most = (self.width * self.height / WORTH_SHARING).max(1);
        let rows = self.height.div_ceil(rayon::current_num_threads().min(most)).max(1);
        let (width, pitch) = (self.width, self.width + MARGIN);
        let bands = self.data.chunks_mut(rows * pitch).enumerate();
        bands.map(|(k, data)| Band { first_row: k * rows, width, data }).collect()
    }

    /// Value between pixels: columns wrap, rows are clamped.
    #[inline]
    pub fn sample(&self, x: f32, y: f32) -> f32 {
        let (x0, x1, fx) = split_cyclic(x, self.width);
        let (y0, y1, fy) = split_clamped(y, self.height);
        let (a, b) = (self.row(y0), self.row(y1));
        let (a0, a1, b0, b1): (f32, f32, f32, f32) = (a[x0].into(), a[x1].into(), b[x0].into(), b[x1].into());
        let top = a0 + fx * (a1 - a0);
        let bottom = b0 + fx * (b1 - b0);
        top + fy * (bottom - top)
    }
}

/// Some rows of an image, to be written.
struct Band<'a, T> {
    first_row: usize,
    width: usize,
    data: &'a mut [T],
}

impl<T: Copy> Band<'_, T> {
    fn rows(&self) -> Range<usize> {
        self.first_row..self.first_row + self.data.len() / (self.width + MARGIN)
    }

    /// Row `y` of the image; its margin follows by [`Band::close`].
    #[inline]
    fn row_mut(&mut self, y: usize) -> &mut [T] {
        let start = (y - self.first_row) * (self.width + MARGIN);
        &mut self.data[start..start + self.width]
    }

    /// Fills the margin of row `y`.
    #[inline]
    fn close(&mut self, y: usize) {
        let start = (y - self.first_row) * (self.width + MARGIN);
        let (row, margin) = self.data[start..start + self.width + MARGIN].split_at_mut(self.width);
        // A narrow picture goes round more than once.
        for part in margin.chunks_mut(row.len()) {
            part.copy_from_slice(&row[..part.len()]);
        }
    }
}

/// Works on bands, each in a thread of its own.
fn share<B: Send>(mut bands: Vec<B>, work: impl Fn(B) + Send + Sync) {
    match bands.pop() {
        Some(only) if bands.is_empty() => work(only),
        Some(last) => {
            bands.push(last);
            bands.into_par_iter().with_max_len(1).for_each(work);
        }
        None => {}
    }
}

/// The two columns around `x` and the share of the second; cyclic.
#[inline]
pub(super) fn split_cyclic(x: f32, width: usize) -> (usize, usize, f32) {
    let towards_zero = x as i32;
    let floor = towards_zero - i32::from(towards_zero as f32 > x);
    let x0 = usize::try_from(floor).unwrap_or(usize::MAX);
    let x0 = if x0 < width { x0 } else { floor.rem_euclid(width as i32) as usize };
    (x0, if x0 + 1 == width { 0 } else { x0 + 1 }, x - floor as f32)
}

/// The two rows around `y` and the share of the second; clamped.
#[inline]
pub(super) fn split_clamped(y: f32, height: usize) -> (usize, usize, f32) {
    let y = y.clamp(0.0, (height - 1) as f32);
    let y0 = y as usize;
    (y0, (y0 + 1).min(height - 1), y - y0 as f32)
}

/// One octave.
#[derive(Debug, Clone, Default)]
pub(super) struct Octave {
    /// Gaussian images of standard deviation 1, sqrt 2 and 2 pixels of this octave.
    pub gauss: [Image<u16>; 3],
    /// Differences of neighbouring Gaussian images.
    pub difference: [Image<i16>; 2],
    scratch: Image<u16>,
    /// Panorama columns per column of this octave. 2^octave but where a width was odd.
    pub step_x: f32,
    /// Panorama rows per row of this octave.
    pub step_y: f32,
}

/// The pyramid, with buffers that are reused from panorama to panorama.
#[derive(Debug, Clone, Default)]
pub(super) struct Pyramid {
    pub octaves: Vec<Octave>,
    luma: Image<u16>,
}

impl Pyramid {
    /// Builds `octaves` octaves, fewer where the picture gets too small for them.
    pub fn build(&mut self, panorama: &Panorama, octaves: usize) {
        let (width, height) = (panorama.projection.width as usize, panorama.projection.height as usize);
        self.luma.resize(width, height);
        share(self.luma.bands_mut(), |mut band| {
            for y in band.rows() {
                luma(&panorama.rgba[4 * width * y..4 * width * (y + 1)], band.row_mut(y));
            }
        });
        let wanted = (0..octaves.max(1)).take_while(|&o| o == 0 || (height >> o >= 16 && width >> o >= 64)).count();
        self.octaves.resize_with(wanted, Octave::default);
        for o in 0..wanted {
            let (done, rest) = self.octaves.split_at_mut(o);
            let octave = &mut rest[0];
            match done.last() {
                None => {
                    octave.step_x = 1.0;
                    octave.step_y = 1.0;
                    blur(&self.luma, &mut octave.gauss[0], None);
                }
                Some(finer) => {
                    halve(&finer.gauss[2], &mut octave.gauss[0]);
                    octave.step_x = width as f32 / octave.gauss[0].width as f32;
                    octave.step_y = 2.0 * finer.step_y;
                }
            }
            let [g0, g1, g2] = &mut octave.gauss;
            let [d0, d1] = &mut octave.difference;
            blur(g0, g1, Some((g0, d0)));
            blur(g1, &mut octave.scratch, None);
            blur(&octave.scratch, g2, Some((g1, d1)));
        }
    }
}

/// Grey levels in sixteenths.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+bmi1+bmi2+lzcnt+popcnt",
    "x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"
))]
fn luma(rgba: &[u8], luma: &mut [u16]) {
    for (luma, p) in luma.iter_mut().zip(rgba.as_chunks::<4>().0) {
        let p = u32::from_le_bytes(*p);
        // BT.601 weights in 256ths; the sum fills 16 bits.
        *luma = ((77 * (p & 0xff) + 150 * (p >> 8 & 0xff) + 29 * (p >> 16 & 0xff)) >> 4) as u16;
    }
}

/// A finer image, and where the difference of a coarser one from it belongs.
type Difference<'a> = (&'a Image<u16>, &'a mut Image<i16>);

/// Convolves with the binomial (1 4 6 4 1) / 16 both ways: variance 1. The difference of the result from a finer image is taken
/// along while the result is at hand.
fn blur(source: &Image<u16>, target: &mut Image<u16>, difference: Option<Difference<'_>>) {
    target.resize(source.width, source.height);
    let Some((finer, difference)) = difference else {
        return share(target.bands_mut(), |band| blur_band(source, band, None));
    };
    difference.resize(source.width, source.height);
    let bands = target.bands_mut().into_iter().zip(difference.bands_mut());
    share(bands.collect(), |(band, difference)| blur_band(source, band, Some((finer, difference))));
}

/// [`blur`] of some rows.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+bmi1+bmi2+lzcnt+popcnt",
    "x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"
))]
fn blur_band(source: &Image<u16>, mut target: Band<'_, u16>, mut difference: Option<(&Image<u16>, Band<'_, i16>)>) {
    let (width, height) = (source.width, source.height);
    let mut line = vec![0; width + 4];
    for y in target.rows() {
        let row = |dy: isize| source.row(y.saturating_add_signed(dy).min(height - 1));
        let (a, b, c, d, e) = (row(-2), row(-1), row(0), row(1), row(2));
        for (((((out, a), b), c), d), e) in line[2..width + 2].iter_mut().zip(a).zip(b).zip(c).zip(d).zip(e) {
            *out = binomial(*a, *b, *c, *d, *e);
        }
        // The line carries two columns of the other end on either side, so the seam needs no case of its own.
        line[0] = line[width];
        line[1] = line[width + 1];
        line[width + 2] = line[2];
        line[width + 3] = line[3];
        let out = target.row_mut(y);
        let (a, b, c, d, e) = (&line[..width], &line[1..=width], &line[2..width + 2], &line[3..width + 3], &line[4..]);
        let taps = a.iter().zip(b).zip(c).zip(d).zip(e).map(|((((a, b), c), d), e)| binomial(*a, *b, *c, *d, *e));
        match &mut difference {
            None => {
                for (out, value) in out.iter_mut().zip(taps) {
                    *out = value;
                }
            }
            Some((finer, difference)) => {
                let places = out.iter_mut().zip(difference.row_mut(y)).zip(finer.row(y));
                for (((out, difference), finer), value) in places.zip(taps) {
                    *out = value;
                    *difference = value.wrapping_sub(*finer) as i16;
                }
            }
        }
        target.close(y);
    }
}

/// (1 4 6 4 1) / 16, rounded. At most 16 * 255 * 16 + 8 on the way: within 16 bits.
#[inline(always)]
fn binomial(a: u16, b: u16, c: u16, d: u16, e: u16) -> u16 {
    (a + e + 4 * (b + d) + 6 * c + 8) >> 4
}

/// Takes every other row and column; an odd width is resampled evenly to half of it, so that the turn stays closed.
fn halve(source: &Image<u16>, target: &mut Image<u16>) {
    let width = source.width / 2;
    target.resize(width, source.height.div_ceil(2));
    let even = source.width.is_multiple_of(2);
    let step = source.width as f32 / width as f32;
    share(target.bands_mut(), |mut band| {
        for y in band.rows() {
            let from = source.row(2 * y);
            let to = band.row_mut(y);
            if even {
                for (to, from) in to.iter_mut().zip(from.chunks_exact(2)) {
                    *to = from[0];
                }
            } else {
                for (x, to) in to.iter_mut().enumerate() {
                    let (x0, x1, f) = split_cyclic(x as f32 * step, source.width);
                    let (a, b) = (f32::from(from[x0]), f32::from(from[x1]));
                    *to = (a + f * (b - a) + 0.5) as u16;
                }
            }
            band.close(y);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panorama::Projection;

    /// A bar of light across the seam spreads by the stated variance in every image.
    #[test]
    fn images_have_the_stated_variance_and_know_no_seam() {
        let mut panorama = Panorama::black(Projection::new(256, 128));
        for row in panorama.rgba.chunks_exact_mut(4 * 256) {
            // Columns -8 to 8: a variance of (17^2 - 1) / 12 = 24.
            row[..4 * 9].fill(255);
            row[4 * 248..].fill(255);
        }
        let mut pyramid = Pyramid::default();
        pyramid.build(&panorama, 3);
        assert_eq!(pyramid.octaves.len(), 3);
        for (o, octave) in pyramid.octaves.iter().enumerate() {
            for (level, image) in octave.gauss.iter().enumerate() {
                let (mut sum, mut moment) = (0.0, 0.0);
                for y in 0..image.height {
                    for x in 0..image.width {
                        let value = f64::from(image.row(y)[x]);
                        let dx = (x as f64 + image.width as f64 / 2.0) % image.width as f64 - image.width as f64 / 2.0;
                        sum += value;
                        moment += value * dx * dx;
                    }
                }
                let blur = f64::from(BASE_SIGMA * BASE_SIGMA) * f64::from(1_u32 << level);
                let expected = 24.0 / f64::from(1_u32 << (2 * o)) + blur;
                assert!((moment / sum - expected).abs() < 0.05 * blur, "octave {o} level {level}: {}", moment / sum);
            }
        }
    }

    #[test]
    fn odd_widths_stay_closed() {
        let mut panorama = Panorama::black(Projection::new(561, 81));
        for (k, p) in panorama.rgba.chunks_exact_mut(4).enumerate() {
            let turn = std::f64::consts::TAU * (k % 561) as f64 / 561.0;
            p[..3].fill((128.0 + 100.0 * crate::geometry::sin_cos(3.0 * turn).0) as u8);
        }
        let mut pyramid = Pyramid::default();
        pyramid.build(&panorama, 2);
        let coarse = &pyramid.octaves[1];
        assert_eq!(coarse.gauss[0].width, 280);
        for x in 0..280 {
            let turn = std::f64::consts::TAU * f64::from(x as f32 * coarse.step_x) / 561.0;
            let expected = 127.5 + 100.0 * crate::geometry::sin_cos(3.0 * turn).0;
            assert!((f64::from(coarse.gauss[0].row(20)[x]) / f64::from(UNITS) - expected).abs() < 1.0, "column {x}");
        }
    }
}
