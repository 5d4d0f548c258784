//! Features: blobs that stand out in position and scale, found to a fraction of a pixel.
//!
//! A feature is an extremum of the difference-of-Gaussians over its eight neighbours and over the layers below and above
//! (Lowe 2004, on the half-octave pyramid). The robot turns about the vertical only, so features have no orientation: up is
//! up in every picture.

use super::ExtractorSettings;
use super::pyramid::{BASE_SIGMA, Image, Pyramid};

/// A feature of a panorama.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feature {
    /// Column, panorama pixels, in [0, width).
    pub x: f32,
    /// Row, panorama pixels.
    pub y: f32,
    /// Scale: standard deviation of the Gaussian that fits the blob, panorama pixels.
    pub sigma: f32,
    /// Octave and image within it that suit the scale.
    pub octave: usize,
    pub level: usize,
    /// Strength of the difference-of-Gaussians, grey levels; negative for a bright blob.
    pub response: f32,
}

/// Finds the features of a pyramid and keeps the strongest, spread over azimuth and scale, in an order that depends on the
/// picture only.
pub(super) fn detect(pyramid: &Pyramid, settings: &ExtractorSettings, limit: usize, features: &mut Vec<Feature>) {
    features.clear();
    let layers = 2 * pyramid.octaves.len();
    for layer in 0..layers - 1 {
        scan(pyramid, layer, settings, features);
    }
    let width = pyramid.octaves[0].gauss[0].width as f32;
    spread(features, width, settings.spread_rad as f32 / std::f32::consts::TAU * width, limit);
}

/// A layer's difference image and its size relative to the panorama.
fn layer_of(pyramid: &Pyramid, layer: usize) -> (&Image, f32, f32) {
    let octave = &pyramid.octaves[layer / 2];
    (&octave.difference[layer % 2], octave.step_x, octave.step_y)
}

fn scan(pyramid: &Pyramid, layer: usize, settings: &ExtractorSettings, features: &mut Vec<Feature>) {
    let (image, step_x, step_y) = layer_of(pyramid, layer);
    let (width, height) = (image.width, image.height);
    let threshold = settings.contrast;
    for y in 1..height - 1 {
        let (above, row, below) = (image.row(y - 1), image.row(y), image.row(y + 1));
        for x in 0..width {
            let value = row[x];
            if value.abs() < threshold {
                continue;
            }
            let (left, right) = (if x == 0 { width - 1 } else { x - 1 }, if x + 1 == width { 0 } else { x + 1 });
            let sign = value.signum();
            // Ties go to the first in reading order, so a flat top is found once.
            let beaten = sign * row[left] >= sign * value
                || sign * row[right] > sign * value
                || sign * above[x] >= sign * value
                || sign * below[x] > sign * value
                || sign * above[left] >= sign * value
                || sign * above[right] >= sign * value
                || sign * below[left] > sign * value
                || sign * below[right] > sign * value;
            if beaten {
                continue;
            }
            let (xf, yf) = (x as f32, y as f32);
            let other = |layer: usize, x: f32, y: f32| {
                let (image, sx, sy) = layer_of(pyramid, layer);
                sign * image.sample(x * step_x / sx, y * step_y / sy)
            };
            let tops = |layer: usize| {
                [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)]
                    .iter()
                    .all(|&(dx, dy)| other(layer, xf + dx, yf + dy) < sign * value)
            };
            // The finest layer has none below it: what is smallest there may be smaller still, and is taken as it is.
            if (layer > 0 && !tops(layer - 1)) || !tops(layer + 1) {
                continue;
            }
            let patch = [
                [above[left], above[x], above[right]],
                [row[left], value, row[right]],
                [below[left], below[x], below[right]],
            ];
            let Some((dx, dy, peak)) = refine(&patch, settings.edge_ratio) else { continue };
            let (xr, yr) = (xf + dx, yf + dy);
            let shift = if layer == 0 {
                0.0
            } else {
                let (low, high) = (other(layer - 1, xr, yr), other(layer + 1, xr, yr));
                let bend = low + high - 2.0 * sign * peak;
                if bend < 0.0 { (0.5 * (low - high) / bend).clamp(-0.5, 0.5) } else { 0.0 }
            };
            // Mean of the two images' standard deviations: a layer's two Gaussians are sqrt 2 apart.
            let sigma = BASE_SIGMA * 1.189_207_1 * libm::exp2f(0.5 * (layer as f32 + shift));
            let columns = width as f32;
            features.push(Feature {
                x: xr.rem_euclid(columns) * step_x,
                y: yr * step_y,
                sigma,
                octave: layer / 2,
                level: layer % 2,
                response: peak,
            });
        }
    }
}

/// Fits a quadric to a 3 x 3 patch. Returns the offset of its extremum and the value there, or `None` for an edge (the
/// ratio of its curvatures is above `edge_ratio`) and where the extremum lies outside of the pixel by far.
fn refine(p: &[[f32; 3]; 3], edge_ratio: f32) -> Option<(f32, f32, f32)> {
    let gx = 0.5 * (p[1][2] - p[1][0]);
    let gy = 0.5 * (p[2][1] - p[0][1]);
    let xx = p[1][2] + p[1][0] - 2.0 * p[1][1];
    let yy = p[2][1] + p[0][1] - 2.0 * p[1][1];
    let xy = 0.25 * (p[2][2] - p[2][0] - p[0][2] + p[0][0]);
    let det = xx * yy - xy * xy;
    let trace = xx + yy;
    if det <= 0.0 || trace * trace * edge_ratio >= (edge_ratio + 1.0) * (edge_ratio + 1.0) * det {
        return None;
    }
    let dx = -(yy * gx - xy * gy) / det;
    let dy = -(xx * gy - xy * gx) / det;
    if dx.abs() > 1.0 || dy.abs() > 1.0 {
        return None;
    }
    let (dx, dy) = (dx.clamp(-0.6, 0.6), dy.clamp(-0.6, 0.6));
    Some((dx, dy, p[1][1] + 0.5 * (gx * dx + gy * dy)))
}

/// Keeps `limit` features. Each is ranked by how many stronger ones of its octave lie within `reach` columns, and the best
/// ranked stay: rich corners of the room do not crowd out the poor ones, and no sector border makes a turn of the robot
/// change the choice.
fn spread(features: &mut Vec<Feature>, width: f32, reach: f32, limit: usize) {
    features.sort_by(|a, b| a.octave.cmp(&b.octave).then(a.x.total_cmp(&b.x)).then(a.y.total_cmp(&b.y)).then(a.level.cmp(&b.level)));
    if features.len() <= limit {
        return;
    }
    let mut ranked = Vec::with_capacity(features.len());
    for class in features.chunk_by(|a, b| a.octave == b.octave) {
        let n = class.len();
        let gap = |i: usize, j: usize| (class[j % n].x - class[i % n].x).rem_euclid(width);
        for (i, feature) in class.iter().enumerate() {
            let strength = feature.response.abs();
            let ahead = (1..n).map(|k| i + k).take_while(|&j| gap(i, j) <= reach);
            let behind = (1..n).map(|k| i + n - k).take_while(|&j| gap(j, i) <= reach);
            let stronger = |j: &usize| class[j % n].response.abs() > strength;
            let rank = ahead.filter(stronger).count() + behind.filter(stronger).count();
            ranked.push((rank, *feature));
        }
    }
    ranked.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.response.abs().total_cmp(&a.1.response.abs())));
    ranked.truncate(limit);
    features.clear();
    features.extend(ranked.into_iter().map(|(_, feature)| feature));
    features.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.sigma.total_cmp(&b.sigma)));
}
