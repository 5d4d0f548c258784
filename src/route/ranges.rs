//! How far away the features of a route are: from the odometry between snapshots and the change of bearing.

use std::collections::BTreeMap;

use crate::geometry::{Pose, Vector2, atan2, direction, wrap};
use crate::vision::view::ViewFeature;

use super::chart::Route;

/// Mean and standard deviation of inverse ranges before anything is known, 1/m.
const PRIOR: (f64, f64) = (0.35, 0.35);
/// Standard deviation of a kept bearing, rad.
const BEARING_SD_RAD: f64 = 0.006;
/// Odometry between two snapshots is off by this share of the way, ...
const WAY_SHARE: f64 = 0.03;
/// ... and its heading by so much a metre, rad.
const HEADING_RAD_M: f64 = 0.012;
/// Snapshots farther off than this along the path say nothing of a range here, m.
const REACH_M: f64 = 6.0;

/// A feature of a snapshot with its range from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Landmark {
    pub feature: ViewFeature,
    pub track: u32,
    /// Inverse range from the camera at the snapshot, 1/m.
    pub inverse_range: f64,
    /// Its variance.
    pub variance: f64,
}

/// The landmarks of each snapshot of a route.
pub(super) fn landmarks(route: &Route) -> Vec<Vec<Landmark>> {
    let camera = Pose::new(route.sheet.camera_offset_m[0], route.sheet.camera_offset_m[1], 0.0);
    let poses: Vec<Pose> = (0..route.snapshots.len()).map(|k| route.pose(k).compose(&camera)).collect();
    let mut along_m = vec![0.0];
    for k in 1..poses.len() {
        along_m.push(along_m[k - 1] + (poses[k].position() - poses[k - 1].position()).norm());
    }
    let mut sightings: BTreeMap<u32, Vec<(usize, f64)>> = BTreeMap::new();
    for (k, snapshot) in route.snapshots.iter().enumerate() {
        for kept in &snapshot.features {
            sightings.entry(kept.track).or_default().push((k, kept.feature.azimuth_rad));
        }
    }
    let range = |k: usize, feature: &ViewFeature, track: u32| {
        let others = sightings[&track].iter().filter(|(j, _)| *j != k);
        let near = others.filter(|(j, _)| (along_m[*j] - along_m[k]).abs() <= REACH_M);
        let views: Vec<(Pose, f64, f64)> = near
            .map(|(j, azimuth)| {
                let way_m = (along_m[*j] - along_m[k]).abs();
                (poses[k].to_local(&poses[*j]), *azimuth, way_m)
            })
            .collect();
        inverse_range(feature.azimuth_rad, &views)
    };
    let of = |k: usize| {
        let landmark = |kept: &super::chart::KeptFeature| {
            let (inverse_range, variance) = range(k, &kept.feature, kept.track);
            Landmark { feature: kept.feature, track: kept.track, inverse_range, variance }
        };
        route.snapshots[k].features.iter().map(landmark).collect()
    };
    (0..route.snapshots.len()).map(of).collect()
}

/// Inverse range, and its variance, of what is seen in `azimuth_rad` from the origin and from each of `views`: pose, azimuth and way
/// from the origin, m.
fn inverse_range(azimuth_rad: f64, views: &[(Pose, f64, f64)]) -> (f64, f64) {
    let u = direction(azimuth_rad);
    let prior = (PRIOR.0, PRIOR.1 * PRIOR.1);
    // A single dimension with false bottoms: the best of a few starts is refined.
    let cost_and_slope = |rho: f64| {
        let (mut cost, mut gradient, mut curvature) =
            (0.5 * (rho - prior.0).powi(2) / prior.1, (rho - prior.0) / prior.1, 1.0 / prior.1);
        for (pose, azimuth, way_m) in views {
            let g: Vector2<f64> = u - pose.position() * rho;
            let n = g.norm_squared().max(1e-6);
            let residual = wrap(azimuth - (atan2(g.y, g.x) - pose.heading));
            let by_rho = -(g.x * pose.y - g.y * pose.x) / n;
            let heading = HEADING_RAD_M * way_m;
            let shift = WAY_SHARE * way_m * rho;
            let variance = 2.0 * BEARING_SD_RAD * BEARING_SD_RAD + heading * heading + shift * shift;
            let weight = 5.0 / (4.0 + residual * residual / variance) / variance;
            cost += 2.5 * libm::log(1.0 + residual * residual / (4.0 * variance));
            gradient -= weight * residual * by_rho;
            curvature += weight * by_rho * by_rho;
        }
        (cost, gradient, curvature)
    };
    let starts = [0.05, 0.12, 0.25, 0.5, 1.0, 1.8];
    let mut rho = starts.into_iter().min_by(|a, b| cost_and_slope(*a).0.total_cmp(&cost_and_slope(*b).0)).unwrap_or(PRIOR.0);
    for _ in 0..8 {
        let (_, gradient, curvature) = cost_and_slope(rho);
        rho = (rho - gradient / curvature).clamp(0.0, 4.0);
    }
    let (_, _, curvature) = cost_and_slope(rho);
    (rho, 1.0 / curvature)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thing at a known place, seen from three places: its range comes out, and one that nothing but the prior tells stays wide.
    #[test]
    fn parallax_tells_the_range() {
        let thing = Vector2::new(2.0, 1.5);
        let view = |x: f64, y: f64, heading: f64| {
            let pose = Pose::new(x, y, heading);
            let seen = pose.inverse_transform(thing);
            (pose, atan2(seen.y, seen.x), libm::hypot(x, y))
        };
        let (rho, variance) = inverse_range(atan2(1.5, 2.0), &[view(0.5, 0.0, 0.1), view(1.0, 0.1, -0.2)]);
        assert!((rho - 0.4).abs() < 0.01 && variance < 0.03 * 0.03, "{rho} {variance}");
        let (_, blind) = inverse_range(0.3, &[]);
        assert!((blind.sqrt() - PRIOR.1).abs() < 1e-12);
    }
}
