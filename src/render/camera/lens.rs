//! What the lens keeps back: dark rims, and dirt.

use std::f64::consts::TAU;

use rand::RngExt;

use crate::geometry::{atan2, sin_cos};
use crate::panorama::Projection;
use crate::random::{Seed, Stream};
use crate::world::OpticsSpec;
use crate::world::spec::DirtSpec;

/// Light that dirt scatters into the picture where it keeps back all that comes through, levels.
const SCATTERED: f32 = 26.0;
/// Share of a spot's radius over which it fades.
const FADE: f64 = 0.35;

/// Factors of every pixel.
#[derive(Debug, Clone)]
pub(super) struct Lens {
    pub projection: Projection,
    /// Share of light that each row lets through.
    rows: Vec<f32>,
    /// Share of light that dirt lets through, row-major; empty without dirt.
    clear: Vec<f32>,
}

impl Lens {
    /// `None` for a lens that lets all light through.
    pub fn new(optics: &OpticsSpec, projection: &Projection) -> Option<Self> {
        let height = f64::from(projection.height);
        let farthest = projection.horizon_row.max(height - projection.horizon_row);
        let dirt = optics.dirt.as_ref().filter(|d| d.spots > 0 && d.opacity > 0.0);
        if optics.vignetting == 0.0 && dirt.is_none() {
            return None;
        }
        let rows = (0..projection.height)
            .map(|row| {
                let away = (f64::from(row) + 0.5 - projection.horizon_row) / farthest;
                (1.0 - optics.vignetting * away * away) as f32
            })
            .collect();
        Some(Self { projection: *projection, rows, clear: dirt.map(|d| soil(d, projection)).unwrap_or_default() })
    }

    /// Dims the light of a row, four channels a pixel.
    #[inline(always)]
    pub fn cover(&self, row: usize, line: &mut [f32]) {
        let factor = self.rows[row];
        if self.clear.is_empty() {
            for light in line {
                *light *= factor;
            }
            return;
        }
        let width = self.projection.width as usize;
        for (light, clear) in line.chunks_exact_mut(4).zip(&self.clear[row * width..]) {
            for light in light {
                *light = factor * *light * clear + (1.0 - clear) * SCATTERED;
            }
        }
    }
}

/// Share of light that comes through a dirty lens, pixel by pixel.
fn soil(dirt: &DirtSpec, projection: &Projection) -> Vec<f32> {
    let mut clear = vec![1.0; projection.pixels()];
    let mut stream = Seed(dirt.seed).stream("dirt");
    for _ in 0..dirt.spots {
        splash(&mut clear, dirt, projection, &mut stream);
    }
    clear
}

/// A spot of uneven outline. Its place and size are angles, so that it is the same at every size of picture.
fn splash(clear: &mut [f32], dirt: &DirtSpec, projection: &Projection, stream: &mut Stream) {
    let mut draw = |low: f64, high: f64| low + (high - low) * stream.random::<f64>();
    let (width, height) = (i64::from(projection.width), i64::from(projection.height));
    let column = draw(0.0, 1.0) * f64::from(projection.width);
    let row = draw(0.0, 1.0) * f64::from(projection.height);
    let size = draw(0.1, 1.0);
    let radius = size * size * dirt.size_deg.to_radians() / projection.pixel_rad();
    let opacity = dirt.opacity * draw(0.4, 1.0);
    let waves: [(f64, f64); 3] = std::array::from_fn(|k| (draw(0.0, 0.35) / (k + 1) as f64, draw(0.0, TAU)));
    let reach = libm::ceil(1.7 * radius) as i64;
    let (middle_column, middle_row) = (column as i64, row as i64);
    for y in (middle_row - reach).max(0)..(middle_row + reach + 1).min(height) {
        for x in middle_column - reach.min(width / 2)..=middle_column + reach.min(width / 2) {
            let (dx, dy) = (x as f64 + 0.5 - column, y as f64 + 0.5 - row);
            let angle = atan2(dy, dx);
            let uneven: f64 =
                (2_u8..).zip(&waves).map(|(k, (height, phase))| height * sin_cos(f64::from(k) * angle + phase).0).sum();
            let inside = 1.0 - (dx * dx + dy * dy).sqrt() / (radius * (1.0 + uneven)).max(1e-9);
            let covered = opacity * (inside / FADE).clamp(0.0, 1.0);
            let at = y * width + x.rem_euclid(width);
            clear[at as usize] *= (1.0 - covered) as f32;
        }
    }
}
