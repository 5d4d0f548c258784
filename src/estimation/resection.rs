//! Resection: where was a set of bearings taken, given landmarks whose place is known more or less?
//!
//! It is asked where home is, given the snapshot and what the search has learned of the landmarks; and where the robot is, when
//! it was carried off and the map is still good. Each landmark has a Gaussian over (direction, inverse range) seen from the
//! origin of the map; the bearings are from an unknown pose (x, y, heading). Three bearings fix a pose in the plane; many of them are weighed by
//! what the landmark's own uncertainty does to the predicted bearing. Before the ranges are known this is the constant-range
//! home vector with its errors stated; as the ranges sharpen it becomes the plain resection. The cost has several minima, so
//! the search starts from a polar grid.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::geometry::{Pose, atan2, direction, sin_cos, wrap};

/// A landmark as resection sees it.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    /// Direction of the landmark from the origin, rad.
    pub direction_rad: f64,
    /// Inverse of its range from the origin, 1/m.
    pub inverse_range: f64,
    /// Covariance of (direction, inverse range).
    pub covariance: Matrix2<f64>,
    /// Bearing of it from the pose that is looked for, rad.
    pub bearing_rad: f64,
    /// Variance of that bearing, rad^2.
    pub variance: f64,
}

/// A pose that explains the bearings.
#[derive(Debug, Clone, Copy)]
pub struct Hypothesis {
    /// The pose in the map's frame.
    pub pose: Pose,
    /// Negative log likelihood (Student's t residuals), up to a constant; lower is better.
    pub cost: f64,
}

/// Degrees of freedom of the residuals' t distribution: heavy tails, for wrong matches.
const TAIL: f64 = 4.0;
/// Distances of the start grid, m.
const START_DISTANCES_M: [f64; 5] = [0.15, 0.6, 1.3, 2.4, 4.0];
/// Directions of the start grid.
const START_DIRECTIONS: usize = 12;
/// Starts that are refined.
const REFINED: usize = 6;
/// Two minima closer than this (m, rad) are the same.
const SAME_M: f64 = 0.15;

impl Sighting {
    /// Predicted bearing's residual, its variance, and the residual's gradient with respect to (x, y, heading) of home.
    fn residual(&self, home: &Pose) -> (f64, f64, Vector3<f64>) {
        let (s, c) = sin_cos(self.direction_rad);
        let gx = c - self.inverse_range * home.x;
        let gy = s - self.inverse_range * home.y;
        let n = (gx * gx + gy * gy).max(1e-9);
        let (qx, qy) = (-gy / n, gx / n);
        let residual = wrap(self.bearing_rad - (atan2(gy, gx) - home.heading));
        let by_direction = -qx * s + qy * c;
        let by_inverse_range = -(qx * home.x + qy * home.y);
        let j = Vector2::new(by_direction, by_inverse_range);
        let variance = (self.covariance * j).dot(&j) + self.variance;
        // d residual / d home = -(d prediction / d home)
        (residual, variance, Vector3::new(self.inverse_range * qx, self.inverse_range * qy, 1.0))
    }

    /// Squared residual over its variance, for gating.
    #[must_use]
    pub fn normalised_squared(&self, home: &Pose) -> f64 {
        let (r, v, _) = self.residual(home);
        r * r / v
    }
}

fn cost(sightings: &[Sighting], home: &Pose) -> f64 {
    sightings
        .iter()
        .map(|s| {
            let (r, v, _) = s.residual(home);
            0.5 * libm::log(v) + 0.5 * (TAIL + 1.0) * libm::log(1.0 + r * r / (TAIL * v))
        })
        .sum()
}

/// Heading that fits best at a given place: circular mean of what each landmark asks for.
fn best_heading(sightings: &[Sighting], x: f64, y: f64) -> f64 {
    let mut sum = Vector2::zeros();
    for s in sightings {
        let (r, v, _) = s.residual(&Pose { x, y, heading: 0.0 });
        sum += direction(-r) / v.sqrt();
    }
    atan2(sum.y, sum.x)
}

/// Standard deviation of home's place along its worst direction, m, were the landmarks' errors independent; infinite where
/// the sightings do not fix a pose.
#[must_use]
pub fn position_sd_m(sightings: &[Sighting], home: &Pose) -> f64 {
    let mut normal = Matrix3::zeros();
    for s in sightings {
        let (_, v, g) = s.residual(home);
        normal += g * g.transpose() / v;
    }
    match normal.try_inverse() {
        Some(covariance) => crate::observation::Estimate { pose: *home, covariance }.position_sd_m(),
        None => f64::INFINITY,
    }
}

/// Iteratively reweighted Gauss-Newton with a damping that falls as the cost does.
fn refine(sightings: &[Sighting], start: Pose, start_cost: f64) -> Hypothesis {
    let mut best = Hypothesis { pose: start, cost: start_cost };
    let mut damping = 1e-2;
    for _ in 0..15 {
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for s in sightings {
            let (r, v, g) = s.residual(&best.pose);
            let weight = (TAIL + 1.0) / (TAIL + r * r / v) / v;
            normal += weight * g * g.transpose();
            right -= weight * r * g;
        }
        let damped = normal + Matrix3::from_diagonal(&(normal.diagonal() * damping + Vector3::repeat(1e-9)));
        let Some(step) = damped.cholesky().map(|c| c.solve(&right)) else { break };
        let next = Pose::new(best.pose.x + step.x, best.pose.y + step.y, best.pose.heading + step.z);
        let next_cost = if next.is_finite() { cost(sightings, &next) } else { f64::INFINITY };
        if next_cost < best.cost {
            let gained = best.cost - next_cost;
            best = Hypothesis { pose: next, cost: next_cost };
            damping *= 0.2;
            if gained < 1e-6 {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    best
}

/// Home poses that explain the snapshot, best first, minima that coincide given once. `near` (last step's answer, and the
/// robot's place, around which the grid is laid) saves no search, it only adds a start. Empty for fewer than two sightings.
#[must_use]
pub fn resect(sightings: &[Sighting], robot: Vector2<f64>, near: Option<Pose>) -> Vec<Hypothesis> {
    if sightings.len() < 2 {
        return Vec::new();
    }
    let mut starts: Vec<Hypothesis> = Vec::with_capacity(START_DISTANCES_M.len() * START_DIRECTIONS + 1);
    let places = START_DISTANCES_M
        .iter()
        .flat_map(|&d| (0..START_DIRECTIONS).map(move |k| robot + direction(TAU * k as f64 / START_DIRECTIONS as f64) * d));
    for p in places {
        let pose = Pose::new(p.x, p.y, best_heading(sightings, p.x, p.y));
        starts.push(Hypothesis { pose, cost: cost(sightings, &pose) });
    }
    starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    starts.truncate(REFINED);
    if let Some(pose) = near {
        starts.push(Hypothesis { pose, cost: cost(sightings, &pose) });
    }
    let mut found: Vec<Hypothesis> = Vec::new();
    for start in starts {
        let candidate = refine(sightings, start.pose, start.cost);
        let twin = found.iter_mut().find(|h| {
            (h.pose.position() - candidate.pose.position()).norm() < SAME_M
                && wrap(h.pose.heading - candidate.pose.heading).abs() < SAME_M
        });
        match twin {
            Some(known) if known.cost <= candidate.cost => {}
            Some(known) => *known = candidate,
            None => found.push(candidate),
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known landmarks and exact bearings give the home pose back, wherever it is.
    #[test]
    fn exact_bearings_give_the_pose() {
        let landmarks = [(2.0, 0.5), (-1.0, 2.5), (-2.0, -1.5), (1.0, -2.0), (3.0, 2.0)];
        for home in [Pose::new(1.2, 0.4, 0.8), Pose::new(-0.9, 1.1, -2.9), Pose::new(0.01, -0.02, 3.1)] {
            let sightings: Vec<_> = landmarks
                .iter()
                .map(|&(x, y)| {
                    let seen = home.inverse_transform(Vector2::new(x, y));
                    Sighting {
                        direction_rad: atan2(y, x),
                        inverse_range: 1.0 / libm::hypot(x, y),
                        covariance: Matrix2::identity() * 1e-8,
                        bearing_rad: atan2(seen.y, seen.x),
                        variance: 1e-8,
                    }
                })
                .collect();
            let best = resect(&sightings, Vector2::zeros(), None)[0].pose;
            assert!((best.position() - home.position()).norm() < 1e-6, "{best:?} {home:?}");
            assert!(wrap(best.heading - home.heading).abs() < 1e-6);
        }
    }
}
