//! What the truth makes of an extractor's work: which home features are found again, and which matches are right.

use serde::Serialize;

use crate::geometry::wrap;
use crate::observation::HomeSnapshot;
use crate::panorama::Shot;
use crate::vision::{Extractor, Match};

/// A match is right, and a feature found again, within this distance of where the truth puts it, px.
pub const RIGHT_PX: f64 = 3.0;
/// A feature is found again if its scale is wrong by at most this factor.
const RIGHT_SCALE: f64 = 1.5;

/// Difference of two columns, signed, the short way round.
fn columns_apart(a: f64, b: f64, width: f64) -> f64 {
    (a - b + 1.5 * width).rem_euclid(width) - 0.5 * width
}

/// What was found in some panoramas.
#[derive(Debug, Clone, Default)]
pub struct Score {
    /// Panoramas.
    pub panoramas: usize,
    /// Home features that could be seen.
    pub visible: usize,
    /// Those of them that were found as features, matched or not.
    pub repeated: usize,
    /// Matches.
    pub matches: usize,
    /// Matches within [`RIGHT_PX`] of the truth.
    pub right: usize,
    /// Least number of right matches in a panorama.
    pub least_right: usize,
    /// Wrong matches that lie on the same instance as the home feature.
    pub wrong_same_instance: usize,
    /// Wrong matches within ten times [`RIGHT_PX`] of the truth.
    pub wrong_near: usize,
    /// Wrong matches that are neither.
    pub wrong_wild: usize,
    /// Bearing errors of right matches, rad.
    pub errors_rad: Vec<f64>,
    /// The same in units of the stated standard deviation.
    pub normalised: Vec<f64>,
    /// Bearing errors of objects, rad.
    pub object_errors_rad: Vec<f64>,
    /// The same in units of the stated standard deviation.
    pub object_normalised: Vec<f64>,
}

impl Score {
    /// Scores the last observation of `extractor`, which was made from `home` and has observed `now`.
    pub fn add(&mut self, extractor: &Extractor, home: &Shot, now: &Shot) {
        let width = f64::from(now.panorama.projection.width);
        let seen: Vec<_> = extractor.keypoints().collect();
        for keypoint in extractor.home_keypoints() {
            let truth = home.appearance(now, keypoint.px);
            if !truth.visible {
                continue;
            }
            self.visible += 1;
            let scale_px = keypoint.scale_px * truth.zoom;
            self.repeated += usize::from(seen.iter().any(|k| {
                let ratio = k.scale_px / scale_px;
                off(k.px, truth.px, width) <= RIGHT_PX && ratio < RIGHT_SCALE && ratio * RIGHT_SCALE > 1.0
            }));
        }
        let before = self.right;
        for m in extractor.matches() {
            self.add_match(m, home, now);
        }
        let right = self.right - before;
        self.least_right = if self.panoramas == 0 { right } else { self.least_right.min(right) };
        self.panoramas += 1;
    }

    fn add_match(&mut self, m: &Match, home: &Shot, now: &Shot) {
        let projection = now.panorama.projection;
        let truth = home.appearance(now, m.home_px);
        let width = f64::from(projection.width);
        let off_px = off(m.now_px, truth.px, width);
        self.matches += 1;
        if truth.visible && off_px <= RIGHT_PX {
            self.right += 1;
            let error = columns_apart(m.now_px.0, truth.px.0, width) * projection.pixel_rad();
            self.errors_rad.push(error.abs());
            self.normalised.push(error.abs() / (m.home_sd_rad * m.home_sd_rad + m.now_sd_rad * m.now_sd_rad).sqrt());
        } else {
            let (same, near) = (home.instance(m.home_px) == now.instance(m.now_px), off_px <= 10.0 * RIGHT_PX);
            self.wrong_same_instance += usize::from(same);
            self.wrong_near += usize::from(near);
            self.wrong_wild += usize::from(!same && !near);
        }
    }

    /// Scores the bearings of objects. The truth of an object is the mean azimuth of its features' places, hidden ones included.
    pub fn add_objects(&mut self, extractor: &mut Extractor, snapshot: &HomeSnapshot, home: &Shot, now: &Shot) {
        let keypoints: Vec<_> = extractor.home_keypoints().collect();
        for bearing in extractor.observe(&now.panorama) {
            let Some(at_home) = snapshot.bearings.iter().find(|b| b.id == bearing.id) else { continue };
            let azimuths: Vec<f64> = extractor
                .features_of(bearing.id)
                .iter()
                .map(|&k| now.panorama.projection.azimuth(home.appearance(now, keypoints[k].px).px.0))
                .collect();
            let mean = azimuths.iter().map(|a| wrap(a - bearing.azimuth_rad)).sum::<f64>() / azimuths.len().max(1) as f64;
            self.object_errors_rad.push(mean.abs());
            let sd_rad = (bearing.sd_rad * bearing.sd_rad + at_home.sd_rad * at_home.sd_rad).sqrt();
            self.object_normalised.push(mean.abs() / sd_rad);
        }
    }

    /// Joins another score to this one.
    pub fn join(&mut self, other: Self) {
        if other.panoramas == 0 {
            return;
        }
        self.least_right = if self.panoramas == 0 { other.least_right } else { self.least_right.min(other.least_right) };
        self.panoramas += other.panoramas;
        self.visible += other.visible;
        self.repeated += other.repeated;
        self.matches += other.matches;
        self.right += other.right;
        self.wrong_same_instance += other.wrong_same_instance;
        self.wrong_near += other.wrong_near;
        self.wrong_wild += other.wrong_wild;
        self.errors_rad.extend(other.errors_rad);
        self.normalised.extend(other.normalised);
        self.object_errors_rad.extend(other.object_errors_rad);
        self.object_normalised.extend(other.object_normalised);
    }

    /// Share of right matches; 1 where there is none.
    pub fn precision(&self) -> f64 {
        if self.matches == 0 { 1.0 } else { self.right as f64 / self.matches as f64 }
    }

    /// Share of the visible home features that were found.
    pub fn repeatability(&self) -> f64 {
        self.repeated as f64 / self.visible.max(1) as f64
    }
}

/// Distance of two places, px.
fn off(a: (f64, f64), b: (f64, f64), width: f64) -> f64 {
    let (dx, dy) = (columns_apart(a.0, b.0, width), a.1 - b.1);
    (dx * dx + dy * dy).sqrt()
}

/// Some quantiles of errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// Two thirds of the errors are smaller (68.3 %, one standard deviation of a normal distribution).
    pub q68: f64,
    /// 95 % of the errors are smaller.
    pub q95: f64,
}

impl Spread {
    /// Quantiles of `values`; `None` of no values.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted.get(((sorted.len() as f64 - 1.0) * share) as usize).copied();
        Some(Self { median: at(0.5)?, q68: at(0.683)?, q95: at(0.95)? })
    }

    /// The same in another unit.
    pub fn times(self, factor: f64) -> Self {
        Self { median: factor * self.median, q68: factor * self.q68, q95: factor * self.q95 }
    }
}
