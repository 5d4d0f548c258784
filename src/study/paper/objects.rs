//! Landmarks from panoramas on a grid, as the paper gets them: objects of the home image, found again in every other image.
//!
//! The paper detects features in the home image and in another, matches them, removes outliers, calls what is left of an object
//! its detection and takes the middle of it as the landmark. Its objects are chosen by hand. Here an object is an upright strip of
//! the home panorama; its features as found in another panorama fix a shift and a stretch of the strip by the median of all pairs
//! (Theil and Sen), and the landmark is where the strip's middle goes. Strips are chosen by how often they are found, and nothing else.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::geometry::{Vector2, direction, wrap};
use crate::observation::{Bearing, HomeSnapshot, LandmarkId};
use crate::panorama::Panorama;
use crate::panorama_set::{Grid, Place};
use crate::statistics::quantile;
use crate::vision::{Extractor, ExtractorSettings, Match};

/// Width of an object's strip, rad.
pub const WIDTH_RAD: f64 = 12.0 * std::f64::consts::PI / 180.0;
/// Fewest matched features that make a detection.
const LEAST_FEATURES: usize = 4;
/// Largest miss of a feature in a detection, as a share of the strip's width.
const MISS: f64 = 0.08;
/// Least share of a strip's matched features that must agree in a detection.
const AGREE: f64 = 0.7;
/// Candidates for objects begin this far apart, rad.
const STEP_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Least angle between any two of the three objects, rad.
const LEAST_APART_RAD: f64 = 60.0 * std::f64::consts::PI / 180.0;
/// An object counts as one of all if it is found at this share of the places.
const OFTEN: f64 = 0.9;

/// An object of the home panorama.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Azimuth of its middle at home, rad.
    pub home_rad: f64,
    /// Azimuth at each place of the grid, in the order of [`Grid::places`], rad; `None` where it was not found.
    pub seen_rad: Vec<Option<f64>>,
}

/// The point that explains an object's azimuths best, and how well it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Where it is in the home frame, m.
    pub point: Vector2<f64>,
    /// Root mean square of what is left of the azimuths, rad.
    pub rms_rad: f64,
    /// Greatest of it, rad.
    pub worst_rad: f64,
}

/// Bearings of objects over a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectField {
    /// Where the panoramas were taken.
    pub grid: Grid,
    /// The three of the paper's filter first, then all others that are found often and do not overlap.
    pub objects: Vec<Object>,
    /// Columns and rows of the panoramas.
    pub size_px: [u32; 2],
    /// Features matched in a panorama, on average.
    pub matches_mean: f64,
}

impl ObjectField {
    /// Finds the objects of the panorama at home, which comes with them, in the panoramas of all places. `load` is called from several
    /// threads.
    ///
    /// # Errors
    /// What `load` fails with, panoramas of different sizes, or too few objects.
    pub fn extract(
        grid: Grid,
        settings: &ExtractorSettings,
        load: &(dyn Fn(Place) -> Result<Panorama> + Sync),
    ) -> Result<(Panorama, Self)> {
        let home = load(grid.home)?;
        let projection = home.projection;
        let places: Vec<Place> = grid.places().collect();
        let observe = |extractor: &mut Extractor, place: &Place| -> Result<Vec<Match>> {
            let panorama = load(*place)?;
            if panorama.projection != projection {
                let size = |p: crate::panorama::Projection| format!("{} x {}", p.width, p.height);
                return Err(Error::Unfit {
                    what: format!("size of the panorama at ({}, {})", place.i, place.j),
                    found: size(panorama.projection),
                    needed: format!("that of the panorama at home, {}", size(projection)),
                });
            }
            extractor.observe(&panorama);
            Ok(extractor.matches().to_vec())
        };
        let matches: Vec<Vec<Match>> =
            places.par_iter().map_init(|| Extractor::new(settings.clone(), &home), observe).collect::<Result<_>>()?;
        let width = f64::from(projection.width);
        let candidates: Vec<Object> = (0..(std::f64::consts::TAU / STEP_RAD).round() as usize)
            .map(|k| projection.column(k as f64 * STEP_RAD))
            .map(|column| Object {
                home_rad: projection.azimuth(column),
                seen_rad: matches.iter().map(|m| Some(projection.azimuth(detect(m, column, width)?))).collect(),
            })
            .collect();
        let objects = choose(&candidates).ok_or_else(|| Error::Unfit {
            what: "objects in the home panorama that are found elsewhere".into(),
            found: "fewer than three that lie 60 degrees apart".into(),
            needed: "at least three".into(),
        })?;
        let matches_mean = matches.iter().map(Vec::len).sum::<usize>() as f64 / places.len().max(1) as f64;
        Ok((home, Self { grid, objects, size_px: [projection.width, projection.height], matches_mean }))
    }

    /// The home snapshot of the first `count` objects.
    pub fn home(&self, count: usize, sd_rad: f64) -> HomeSnapshot {
        let bearing =
            |(k, object): (usize, &Object)| Bearing { id: LandmarkId(k as u32), azimuth_rad: object.home_rad, sd_rad };
        HomeSnapshot { bearings: self.objects.iter().take(count).enumerate().map(bearing).collect() }
    }

    /// Bearings of the first `count` objects from a pose in the home frame: interpolated linearly between the four places around
    /// it. An object that was not found at one of them is not seen.
    pub fn bearings(&self, pose: &crate::geometry::Pose, count: usize, sd_rad: f64) -> Vec<Bearing> {
        let Some(cell) = self.grid.cell(pose.position()) else { return Vec::new() };
        let interpolate = |(k, object): (usize, &Object)| -> Option<Bearing> {
            let mut azimuths = [0.0; 4];
            for (azimuth, place) in azimuths.iter_mut().zip(cell.corners) {
                *azimuth = object.seen_rad[self.grid.index(place)]?;
            }
            let first = azimuths[0];
            let turn: f64 = azimuths.iter().zip(cell.weights).map(|(azimuth, weight)| weight * wrap(azimuth - first)).sum();
            Some(Bearing { id: LandmarkId(k as u32), azimuth_rad: wrap(first + turn - pose.heading), sd_rad })
        };
        self.objects.iter().take(count).enumerate().filter_map(interpolate).collect()
    }

    /// The point in the plane that explains an object's azimuths best.
    pub fn fix(&self, object: &Object) -> Option<Fix> {
        let sights: Vec<(Vector2<f64>, f64)> = self
            .grid
            .places()
            .zip(&object.seen_rad)
            .filter_map(|(place, seen)| Some((self.grid.position(place), (*seen)?)))
            .collect();
        triangulate(&sights)
    }
}

/// Column in the current panorama to which the strip's middle goes.
fn detect(matches: &[Match], column: f64, width: f64) -> Option<f64> {
    let apart = |a: f64, b: f64| {
        let d = (a - b).rem_euclid(width);
        if d > 0.5 * width { d - width } else { d }
    };
    let strip = WIDTH_RAD / std::f64::consts::TAU * width;
    let inside: Vec<&Match> = matches.iter().filter(|m| apart(m.home_px.0, column).abs() <= 0.5 * strip).collect();
    if inside.len() < LEAST_FEATURES {
        return None;
    }
    // Column now = anchor + stretch (column at home - middle); all relative to where the first feature is now.
    let anchor = inside[0].now_px.0;
    let points: Vec<(f64, f64)> = inside.iter().map(|m| (apart(m.home_px.0, column), apart(m.now_px.0, anchor))).collect();
    let mut slopes = Vec::new();
    for (k, a) in points.iter().enumerate() {
        for b in &points[k + 1..] {
            // Features side by side say nothing of the stretch.
            if (a.0 - b.0).abs() > 0.1 * strip {
                slopes.push((a.1 - b.1) / (a.0 - b.0));
            }
        }
    }
    let stretch = quantile(&slopes, 0.5).unwrap_or(1.0).clamp(0.2, 5.0);
    let middles = |points: &[(f64, f64)]| points.iter().map(|p| p.1 - stretch * p.0).collect::<Vec<_>>();
    let middle = quantile(&middles(&points), 0.5)?;
    let agrees = |p: &&(f64, f64)| (p.1 - stretch * p.0 - middle).abs() <= MISS * strip * stretch.max(1.0);
    let good: Vec<(f64, f64)> = points.iter().filter(agrees).copied().collect();
    if good.len() < LEAST_FEATURES || (good.len() as f64) < AGREE * points.len() as f64 {
        return None;
    }
    let middles = middles(&good);
    Some((anchor + middles.iter().sum::<f64>() / middles.len() as f64).rem_euclid(width))
}

/// The three that are found together most often, those that leave the smallest gap between them among equals, and then the others.
fn choose(candidates: &[Object]) -> Option<Vec<Object>> {
    let found = |object: &Object| object.seen_rad.iter().filter(|s| s.is_some()).count();
    let apart = |a: &Object, b: &Object| wrap(a.home_rad - b.home_rad).abs();
    let mut best: Option<([usize; 3], (usize, f64))> = None;
    for a in 0..candidates.len() {
        for b in a + 1..candidates.len() {
            if apart(&candidates[a], &candidates[b]) < LEAST_APART_RAD - 1e-9 {
                continue;
            }
            for c in b + 1..candidates.len() {
                let [x, y, z] = [&candidates[a], &candidates[b], &candidates[c]];
                if apart(x, z) < LEAST_APART_RAD - 1e-9 || apart(y, z) < LEAST_APART_RAD - 1e-9 {
                    continue;
                }
                let together = x.seen_rad.iter().zip(&y.seen_rad).zip(&z.seen_rad);
                let count = together.filter(|((x, y), z)| x.is_some() && y.is_some() && z.is_some()).count();
                // Candidates are in order of azimuth, so these three gaps go once round.
                let gaps = [b - a, c - b, candidates.len() + a - c];
                let balance = -(gaps.into_iter().max().unwrap_or(0) as f64);
                if count > 0 && best.is_none_or(|(_, score)| (count, balance) > score) {
                    best = Some(([a, b, c], (count, balance)));
                }
            }
        }
    }
    let mut chosen: Vec<Object> = best?.0.iter().map(|&k| candidates[k].clone()).collect();
    let mut others: Vec<&Object> = candidates.iter().collect();
    others.sort_by(|a, b| found(b).cmp(&found(a)).then(a.home_rad.total_cmp(&b.home_rad)));
    for object in others {
        let often = found(object) as f64 >= OFTEN * object.seen_rad.len() as f64;
        if often && chosen.iter().all(|c| apart(c, object) >= WIDTH_RAD - 1e-9) {
            chosen.push(object.clone());
        }
    }
    Some(chosen)
}

/// Row and right-hand side of one line of sight (from, azimuth).
type Equation<'a> = &'a dyn Fn(&Vector2<f64>, f64) -> (Vector2<f64>, f64);

/// Least squares of the azimuths' misses by Gauss-Newton steps from the point nearest to all lines of sight.
fn triangulate(sights: &[(Vector2<f64>, f64)]) -> Option<Fix> {
    let normals = |weigh: Equation<'_>| {
        let mut a = nalgebra::Matrix2::zeros();
        let mut b = Vector2::zeros();
        for (from, azimuth) in sights {
            let (row, value) = weigh(from, *azimuth);
            a += row * row.transpose();
            b += row * value;
        }
        a.try_inverse().map(|inverse| inverse * b)
    };
    let mut point = normals(&|from, azimuth| {
        let d = direction(azimuth);
        let left = Vector2::new(-d.y, d.x);
        (left, left.dot(from))
    })?;
    for _ in 0..10 {
        point += normals(&|from, azimuth| {
            let to = point - from;
            let range_squared = to.norm_squared().max(1e-6);
            let miss = wrap(azimuth - crate::geometry::angle_of(to));
            (Vector2::new(-to.y, to.x) / range_squared, miss)
        })?;
    }
    let misses: Vec<f64> =
        sights.iter().map(|(from, azimuth)| wrap(azimuth - crate::geometry::angle_of(point - from)).abs()).collect();
    let rms_rad = (misses.iter().map(|m| m * m).sum::<f64>() / misses.len() as f64).sqrt();
    Some(Fix { point, rms_rad, worst_rad: misses.into_iter().fold(0.0, f64::max) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose, angle_of};

    const GRID: Grid = Grid { rows: 5, columns: 7, spacing_m: 0.3, home: Place { i: 2, j: 3 } };

    /// A strip that is shifted, stretched and has two wrong matches among its features.
    #[test]
    fn a_strip_is_found_among_outliers() {
        let at = |home: f64, now: f64| Match {
            id: LandmarkId(0),
            home_px: (home, 20.0),
            now_px: (now, 20.0),
            home_scale_px: 2.0,
            now_scale_px: 2.0,
            misfit: 0.0,
            distance: 0.1,
            home_sd_rad: 1e-3,
            now_sd_rad: 1e-3,
        };
        // Strip of 12 of 360 columns around column 1, which goes to column 355 at a stretch of 1.5, across the seam.
        let now = |home: f64| (355.0 + 1.5 * (home - 1.0)).rem_euclid(360.0);
        let mut matches: Vec<Match> =
            [356.0, 358.5, 0.0, 2.0, 4.5, 6.0].iter().map(|h| at(*h, now(if *h > 180.0 { h - 360.0 } else { *h }))).collect();
        matches.extend([at(3.0, 100.0), at(359.0, 40.0), at(90.0, 95.0)]); // six of eight agree
        let found = detect(&matches, 1.0, 360.0).unwrap();
        assert!((found - 355.0).abs() < 1e-9, "{found}");
        assert_eq!(detect(&matches, 90.0, 360.0), None);
    }

    /// Objects that are points: bearings between places are near the true ones, and the fix finds the point.
    #[test]
    fn bearings_between_places() {
        let point = Vector2::new(2.0, 1.0);
        let seen = |place| Some(angle_of(point - GRID.position(place)));
        let object = Object { home_rad: angle_of(point), seen_rad: GRID.places().map(seen).collect() };
        let field = ObjectField { grid: GRID, objects: vec![object], size_px: [360, 40], matches_mean: 0.0 };
        let pose = Pose::new(0.37, -0.41, 2.0);
        let bearing = field.bearings(&pose, 1, 0.01)[0];
        let miss = wrap(bearing.azimuth_rad - angle_of(pose.inverse_transform(point)));
        assert!(miss.abs() > 1e-6 && miss.abs() < 0.01, "{miss}");
        let fix = field.fix(&field.objects[0]).unwrap();
        assert!((fix.point - point).norm() < 1e-9 && fix.worst_rad < 1e-9);
        assert!(field.bearings(&Pose::new(9.0, 0.0, 0.0), 1, 0.01).is_empty());
    }
}
