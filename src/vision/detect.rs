//! Features: blobs that stand out in position and scale, found to a fraction of a pixel.
//!
//! A feature is an extremum of the difference-of-Gaussians over its eight neighbours and over the layers below and above
//! (Lowe 2004, on the half-octave pyramid). The robot turns about the vertical only, so features have no orientation: up is
//! up in every picture.

use std::f32::consts::TAU;
use std::ops::Range;

use super::pyramid::{BASE_SIGMA, Image, Pyramid, UNITS};
use super::shared;

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
    /// How loosely the blob fixes its own column: 1 for a round one, above for one that is stretched along the row.
    pub looseness: f32,
}

/// Finds the features of a pyramid and keeps the strongest, spread over azimuth and scale, in an order that depends on the
/// picture only. Returns the strength below which no feature had a chance to be kept: 0 if none was too weak.
pub(super) fn detect(pyramid: &Pyramid, criteria: &Criteria, features: &mut Vec<Feature>) -> f32 {
    let layers = 2 * pyramid.octaves.len();
    // Cut as the images were when they were made, so that a thread finds most of what it reads in its own cache.
    let parts = rayon::current_num_threads();
    *features = shared(parts, |some| {
        let (mut scratch, mut features) = (Scratch::default(), Vec::new());
        for layer in 0..layers - 1 {
            let rows = pyramid.octaves[layer / 2].difference[layer % 2].height.saturating_sub(2);
            let rows = 1 + rows * some.start / parts..1 + rows * some.end / parts;
            scan(pyramid, layer, rows, criteria, &mut scratch, &mut features);
        }
        features
    });
    let width = pyramid.octaves[0].gauss[0].width as f32;
    spread(features, width, criteria)
}

/// A layer next to the one that is scanned, addressed in the pixels of that one.
struct Neighbour<'a> {
    image: &'a Image<i16>,
    ratio_x: f32,
    ratio_y: f32,
}

impl<'a> Neighbour<'a> {
    fn new(pyramid: &'a Pyramid, layer: usize, scanned: usize) -> Self {
        let (own, other) = (&pyramid.octaves[scanned / 2], &pyramid.octaves[layer / 2]);
        Self { image: &other.difference[layer % 2], ratio_x: own.step_x / other.step_x, ratio_y: own.step_y / other.step_y }
    }

    /// Value in units at (x, y) of the scanned layer.
    fn sample(&self, x: f32, y: f32) -> f32 {
        self.image.sample(x * self.ratio_x, y * self.ratio_y)
    }

    /// Whether `value`, in units, at row `y` and the middle one of three columns, lies further from 0 than this layer at and
    /// beside that place.
    fn topped_by(&self, value: i16, [left, x, right]: [usize; 3], y: usize) -> bool {
        let sign = value.signum();
        if self.ratio_x == 1.0 {
            let at = |x: usize, y: usize| sign * self.image.row(y)[x] < sign * value;
            return at(x, y) && at(left, y) && at(right, y) && at(x, y - 1) && at(x, y + 1);
        }
        let (x, y) = (x as f32, y as f32);
        let (sign, value) = (f32::from(sign), f32::from(value));
        let cross = [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)];
        cross.iter().all(|(dx, dy)| sign * self.sample(x + dx, y + dy) < sign * value)
    }
}

/// What counts as a feature.
#[derive(Debug, Clone, Copy)]
pub(super) struct Criteria {
    /// Least strength, grey levels.
    pub contrast: f32,
    /// Largest ratio of curvatures.
    pub edge_ratio: f32,
    /// Features are ranked among those within this azimuth on either side, rad.
    pub spread_rad: f64,
    /// Most features.
    pub limit: usize,
    /// Strongest features of the whole panorama that compete for those places; at least `limit`.
    pub contenders: usize,
}

/// Adds the features of some rows of a layer.
fn scan(
    pyramid: &Pyramid,
    layer: usize,
    rows: Range<usize>,
    criteria: &Criteria,
    scratch: &mut Scratch,
    features: &mut Vec<Feature>,
) {
    let octave = &pyramid.octaves[layer / 2];
    let image = &octave.difference[layer % 2];
    let width = image.width;
    let coarser = Neighbour::new(pyramid, layer + 1, layer);
    // The finest layer has none below it: what is smallest there may be smaller still, and is taken as it is.
    let finer = (layer > 0).then(|| Neighbour::new(pyramid, layer - 1, layer));
    // One of the two lies in the same octave. It is asked first, since it needs no interpolation.
    let (first, last) =
        if layer.is_multiple_of(2) { (Some(&coarser), finer.as_ref()) } else { (finer.as_ref(), Some(&coarser)) };
    for y in rows {
        let rows = [image.row(y - 1), image.row(y), image.row(y + 1)];
        scratch.find(rows, criteria.contrast);
        for &x in &scratch.found {
            let columns = [if x == 0 { width - 1 } else { x - 1 }, x, if x + 1 == width { 0 } else { x + 1 }];
            let value = rows[1][x];
            let tops = |layer: Option<&Neighbour>| layer.is_none_or(|layer| layer.topped_by(value, columns, y));
            if !tops(first) {
                continue;
            }
            let patch = rows.map(|row| columns.map(|x| f32::from(row[x])));
            let Some((dx, dy, peak, looseness)) = refine(&patch, criteria.edge_ratio) else { continue };
            if !tops(last) {
                continue;
            }
            let (xr, yr) = (x as f32 + dx, y as f32 + dy);
            let shift = finer.as_ref().map_or(0.0, |finer| {
                let (low, high) = (finer.sample(xr, yr), coarser.sample(xr, yr));
                let bend = low + high - 2.0 * peak;
                // The bend has the sign opposite to the peak's.
                if bend * peak < 0.0 { (0.5 * (low - high) / bend).clamp(-0.5, 0.5) } else { 0.0 }
            });
            // Mean of the two images' standard deviations: a layer's two Gaussians are sqrt 2 apart.
            let sigma = BASE_SIGMA * 1.189_207_1 * libm::exp2f(0.5 * (layer as f32 + shift));
            features.push(Feature {
                x: xr.rem_euclid(width as f32) * octave.step_x,
                y: yr * octave.step_y,
                sigma,
                octave: layer / 2,
                level: layer % 2,
                response: peak * (1.0 / UNITS),
                looseness,
            });
        }
    }
}

/// Buffers of the scan.
#[derive(Debug, Clone, Default)]
struct Scratch {
    high: Vec<i16>,
    low: Vec<i16>,
    mask: Vec<u8>,
    found: Vec<usize>,
}

impl Scratch {
    /// Fills `found` with the columns whose value in the middle row is above `threshold` grey levels and above all eight
    /// neighbours, or below both the negative threshold and all neighbours; of equal neighbours the left or upper one counts.
    /// Written as plain loops over whole rows, which vectorise; few pixels are left for the costlier tests.
    fn find(&mut self, rows: [&[i16]; 3], threshold: f32) {
        let width = rows[1].len();
        let threshold = (threshold * UNITS) as i16;
        self.high.resize(width + 2, 0);
        self.low.resize(width + 2, 0);
        // Buffers serve layers of all widths: what a wider one left behind the last column must not be found.
        self.mask.clear();
        self.mask.resize(width.next_multiple_of(64), 0);
        self.mask[width..].fill(0);
        mark_extremes(rows, threshold, &mut self.high, &mut self.low, &mut self.mask);
        self.found.clear();
        for (k, block) in self.mask.as_chunks::<64>().0.iter().enumerate() {
            let words: &[[u8; 8]; 8] = bytemuck::cast_ref(block);
            let words = words.map(u64::from_le_bytes);
            if words.iter().fold(0, |any, word| any | word) == 0 {
                continue; // most are
            }
            for (j, word) in words.iter().enumerate() {
                let mut marks = *word;
                while marks != 0 {
                    self.found.push(64 * k + 8 * j + (marks.trailing_zeros() / 8) as usize);
                    marks &= marks - 1;
                }
            }
        }
    }
}

/// The vectorised part of `Scratch::find`.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+bmi1+bmi2+lzcnt+popcnt",
    "x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"
))]
fn mark_extremes(rows: [&[i16]; 3], threshold: i16, high: &mut [i16], low: &mut [i16], mask: &mut [u8]) {
    let [above, row, below] = rows;
    let width = row.len();
    // Extremes of each column's three pixels, with a copy of the other end on either side.
    let columns = above.iter().zip(row).zip(below);
    for ((high, low), ((a, b), c)) in high[1..=width].iter_mut().zip(&mut low[1..=width]).zip(columns) {
        *high = (*a).max(*b).max(*c);
        *low = (*a).min(*b).min(*c);
    }
    (high[0], high[width + 1]) = (high[width], high[1]);
    (low[0], low[width + 1]) = (low[width], low[1]);
    let high = high[..width].iter().zip(&high[2..]);
    let low = low[..width].iter().zip(&low[2..]);
    let columns = above.iter().zip(row).zip(below);
    for (((mask, (h0, h1)), (l0, l1)), ((a, b), c)) in mask.iter_mut().zip(high).zip(low).zip(columns) {
        let top = (*b > (*h0).max(*a).max(threshold)) & (*b >= (*h1).max(*c));
        let bottom = (*b < (*l0).min(*a).min(-threshold)) & (*b <= (*l1).min(*c));
        *mask = u8::from(top | bottom);
    }
}

/// Fits a quadric to a 3 x 3 patch. Returns the offset of its extremum, the value there and its looseness (see
/// [`Feature`]), or `None` for an edge (the
/// ratio of its curvatures is above `edge_ratio`) and where the extremum lies outside of the pixel by far.
fn refine(p: &[[f32; 3]; 3], edge_ratio: f32) -> Option<(f32, f32, f32, f32)> {
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
    // Variance of the column, from the inverse of the curvature, over that of a round blob of the same mean curvature.
    // Measured bearing errors grow with its power 3/4.
    let variance = 0.5 * trace * yy / det;
    let looseness = (variance * variance.sqrt()).sqrt();
    Some((dx, dy, p[1][1] + 0.5 * (gx * dx + gy * dy), looseness))
}

/// Keeps the wanted number of features. The strongest of the panorama are ranked by how many stronger ones of their octave
/// lie nearby in azimuth, and the best ranked stay: rich corners of the room do not crowd out the poor ones, and no sector
/// border makes a turn of the robot change the choice. Returns the strength of the strongest that was not even ranked.
fn spread(features: &mut Vec<Feature>, width: f32, criteria: &Criteria) -> f32 {
    let Criteria { limit, contenders, .. } = *criteria;
    let reach = criteria.spread_rad as f32 / TAU * width;
    let mut least = 0.0;
    if features.len() > contenders {
        features.select_nth_unstable_by_key(contenders, |f| (weakness(f), place(f)));
        least = features[contenders].response.abs();
        features.truncate(contenders);
    }
    if features.len() > limit {
        features.sort_unstable_by_key(|f| (f.octave, place(f)));
        let mut ranked = Vec::with_capacity(features.len());
        let (mut places, mut strengths) = (Vec::new(), Vec::new());
        for class in features.chunk_by(|a, b| a.octave == b.octave) {
            // Three turns in a row, so that windows across the seam are slices too.
            places.clear();
            strengths.clear();
            for turn in [-width, 0.0, width] {
                places.extend(class.iter().map(|f| f.x + turn));
                strengths.extend(class.iter().map(|f| f.response.abs()));
            }
            let (mut from, mut to) = (0, 0);
            for feature in class {
                while places[from] < feature.x - reach {
                    from += 1;
                }
                while to < places.len() && places[to] <= feature.x + reach {
                    to += 1;
                }
                let strength = feature.response.abs();
                let rank: u32 = strengths[from..to].iter().map(|s| u32::from(*s > strength)).sum();
                ranked.push((rank, *feature));
            }
        }
        ranked.select_nth_unstable_by_key(limit, |(rank, f)| (*rank, weakness(f), place(f)));
        ranked.truncate(limit);
        features.clear();
        features.extend(ranked.into_iter().map(|(_, feature)| feature));
    }
    features.sort_unstable_by_key(place);
    least
}

/// Orders features from the strongest to the weakest.
fn weakness(feature: &Feature) -> u32 {
    !feature.response.abs().to_bits()
}

/// Orders features by column, then by row, scale and layer. From 0 on the bits of floats are in their order; adding 0 takes away the sign
/// of -0.
fn place(feature: &Feature) -> (u32, u32, u32, usize) {
    let layer = 2 * feature.octave + feature.level;
    ((feature.x + 0.0).to_bits(), feature.y.to_bits(), feature.sigma.to_bits(), layer)
}
