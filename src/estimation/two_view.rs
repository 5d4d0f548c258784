//! Two views of the same landmarks: how the camera turned from one to the other, and which way it went.
//!
//! The camera moves on level floor: from home it went in direction d (home frame) and turned by alpha. A landmark at azimuth a*
//! and tangent of elevation t* from home is seen at a and t now; with phi = a + alpha its direction now in the home frame,
//!
//! ```text
//! t sin(a* - d) = t* sin(phi - d),
//! ```
//!
//! the epipolar constraint of a planar motion, free of all ranges. Azimuths alone would not do: any two bundles of rays in a plane meet
//! somewhere. Which of d and its opposite it is tells the parallax, since what is seen moves away from where the camera goes. At
//! home itself every d serves; its deviation says so.
//!
//! Knows of: angles. Must not know of pictures, and of which landmark is which only what it is told.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix2, Vector2};

use crate::geometry::{cross, direction, wrap};

/// Where a landmark is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Azimuth from the robot's heading, rad.
    pub azimuth_rad: f64,
    /// Tangent of elevation.
    pub tan_elevation: f64,
    /// Standard deviation of both, rad.
    pub sd_rad: f64,
}

/// A landmark in both views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// From home.
    pub home: Ray,
    /// Now.
    pub now: Ray,
}

/// Direction of the step from home and turn since home.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// d: direction from home to where the camera is now, rad, home frame.
    pub direction_rad: f64,
    /// alpha: turn since home, rad, which is the heading in the home frame.
    pub turn_rad: f64,
    /// Standard deviation of the direction, rad; that of any direction at all where nothing fixes it.
    pub direction_sd_rad: f64,
    /// Standard deviation of the turn, rad.
    pub turn_sd_rad: f64,
    /// Median angle by which landmarks are displaced, rad: 0 at home, and the larger the farther it is in units of their distance.
    pub parallax_rad: f64,
}

impl Step {
    /// Which way home is, rad from the heading now.
    #[must_use]
    pub fn home_rad(&self) -> f64 {
        wrap(self.direction_rad + PI - self.turn_rad)
    }
}

/// Degrees of freedom of the residuals' t distribution: heavy tails, for wrong matches.
const TAIL: f64 = 4.0;
/// Steps of the search grid over half a turn of the direction and a whole one of the heading.
const DIRECTIONS: usize = 36;
const TURNS: usize = 120;
/// Most landmarks by which the grid is searched.
const SEARCHED: usize = 60;
/// Minima of the grid that are refined.
const REFINED: usize = 8;
/// Square of a standard normal number that half of all are below.
const MEDIAN_CHI2: f64 = 0.454_936;
/// Standard deviation of a direction of which nothing is known, rad.
const ANY_RAD: f64 = 1.813_799;

/// What the constraint is made of at a step: residual, its variance, and its derivatives with respect to direction and turn.
struct Residual {
    error: f64,
    variance: f64,
    slope: Vector2<f64>,
}

/// A landmark with its unit vectors at hand.
struct Pair {
    home: Vector2<f64>,
    now: Vector2<f64>,
    seen: Seen,
}

impl Pair {
    fn new(seen: &Seen) -> Self {
        Self { home: direction(seen.home.azimuth_rad), now: direction(seen.now.azimuth_rad), seen: *seen }
    }

    /// Unit vector of the azimuth now in the home frame.
    fn turned(&self, turn: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(turn.x * self.now.x - turn.y * self.now.y, turn.y * self.now.x + turn.x * self.now.y)
    }

    fn residual(&self, step: Vector2<f64>, turn: Vector2<f64>) -> Residual {
        let phi = self.turned(turn);
        let (a, a_cos) = (cross(step, self.home), step.dot(&self.home));
        let (b, b_cos) = (cross(step, phi), step.dot(&phi));
        let (home, now) = (&self.seen.home, &self.seen.now);
        let variance = home.sd_rad.powi(2) * ((now.tan_elevation * a_cos).powi(2) + b * b)
            + now.sd_rad.powi(2) * ((home.tan_elevation * b_cos).powi(2) + a * a);
        Residual {
            error: now.tan_elevation * a - home.tan_elevation * b,
            variance: variance + 1e-12,
            slope: Vector2::new(home.tan_elevation * b_cos - now.tan_elevation * a_cos, -home.tan_elevation * b_cos),
        }
    }
}

/// The step that explains what two views show; `None` with fewer than three landmarks.
#[must_use]
pub fn planar_step(seen: &[Seen]) -> Option<Step> {
    if seen.len() < 3 {
        return None;
    }
    let pairs: Vec<Pair> = seen.iter().map(Pair::new).collect();
    let few: Vec<&Pair> = pairs.iter().step_by(pairs.len().div_ceil(SEARCHED)).collect();
    let mut grid = Vec::with_capacity(DIRECTIONS * TURNS);
    for k in 0..TURNS {
        let turn_rad = TAU * k as f64 / TURNS as f64;
        let turn = direction(turn_rad);
        for n in 0..DIRECTIONS {
            let direction_rad = PI * n as f64 / DIRECTIONS as f64;
            let step = direction(direction_rad);
            grid.push((few.iter().map(|p| loss(&p.residual(step, turn))).sum::<f64>(), direction_rad, turn_rad));
        }
    }
    grid.sort_by(|a, b| a.0.total_cmp(&b.0));
    let refined = grid[..REFINED].iter().map(|&(_, d, turn)| refine(&pairs, d, turn));
    let (_, mut d, turn_rad) = refined.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let turn = direction(turn_rad);
    // What is seen moves away from d: to the left of it to the left.
    let away = |p: &Pair| {
        let side = cross(direction(d), p.home);
        (cross(p.home, p.turned(turn)) * side.signum()).clamp(-0.1, 0.1)
    };
    if pairs.iter().map(away).sum::<f64>() < 0.0 {
        d += PI;
    }
    let (step, count) = (direction(d), pairs.len());
    let mut squares: Vec<f64> = pairs.iter().map(|p| p.residual(step, turn)).map(|r| r.error * r.error / r.variance).collect();
    squares.sort_by(f64::total_cmp);
    let scale = (squares[count / 2] / MEDIAN_CHI2).max(1.0);
    let normal: Matrix2<f64> = pairs
        .iter()
        .map(|p| p.residual(step, turn))
        .map(|r| r.slope * r.slope.transpose() * (weight(r.error * r.error / r.variance / scale) / r.variance / scale))
        .sum();
    let covariance = (normal + Matrix2::identity() / (ANY_RAD * ANY_RAD)).try_inverse()?;
    let mut parallaxes: Vec<f64> =
        pairs.iter().map(|p| p.turned(turn)).zip(&pairs).map(|(phi, p)| cross(p.home, phi).abs().min(1.0)).collect();
    parallaxes.sort_by(f64::total_cmp);
    Some(Step {
        direction_rad: wrap(d),
        turn_rad: wrap(turn_rad),
        direction_sd_rad: covariance[(0, 0)].sqrt(),
        turn_sd_rad: covariance[(1, 1)].sqrt(),
        parallax_rad: libm::asin(parallaxes[count / 2]),
    })
}

/// Negative log likelihood of a residual, up to a constant.
fn loss(r: &Residual) -> f64 {
    0.5 * (TAIL + 1.0) * libm::log(1.0 + r.error * r.error / (TAIL * r.variance))
}

/// Weight of a residual of this square in the least squares that the t distribution amounts to.
fn weight(square: f64) -> f64 {
    (TAIL + 1.0) / (TAIL + square)
}

/// Reweighted Gauss-Newton steps; gives loss, direction and turn.
fn refine(pairs: &[Pair], mut d: f64, mut turn_rad: f64) -> (f64, f64, f64) {
    let total = |d: f64, turn: f64| pairs.iter().map(|p| loss(&p.residual(direction(d), direction(turn)))).sum::<f64>();
    let mut best = total(d, turn_rad);
    let mut damping = 1e-3;
    for _ in 0..20 {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for r in pairs.iter().map(|p| p.residual(direction(d), direction(turn_rad))) {
            let w = weight(r.error * r.error / r.variance) / r.variance;
            normal += r.slope * r.slope.transpose() * w;
            right -= r.slope * (r.error * w);
        }
        let damped = normal + Matrix2::identity() * (damping * (normal.trace() + 1e-9));
        let Some(move_by) = damped.try_inverse().map(|inverse| inverse * right) else { break };
        let move_by = move_by.map(|x| x.clamp(-FRAC_PI_2, FRAC_PI_2));
        let next = total(d + move_by.x, turn_rad + move_by.y);
        if next < best {
            (best, d, turn_rad, damping) = (next, d + move_by.x, turn_rad + move_by.y, 0.2 * damping);
            if move_by.norm() < 1e-6 {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    (best, d, turn_rad)
}

/// How far a ray seen now lies off where a landmark seen from home can be, were the step the true one: the angle to the half plane of
/// the landmark's line of sight from home and the step, rad. The landmark's range is free.
#[must_use]
pub fn miss_rad(seen: &Seen, direction_rad: f64, turn_rad: f64) -> f64 {
    use nalgebra::Vector3;
    let ray = |azimuth_rad: f64, tan: f64| {
        let flat = direction(azimuth_rad);
        Vector3::new(flat.x, flat.y, tan).normalize()
    };
    let home = ray(seen.home.azimuth_rad, seen.home.tan_elevation);
    let now = ray(seen.now.azimuth_rad + turn_rad, seen.now.tan_elevation);
    let flat = direction(direction_rad);
    let step = Vector3::new(flat.x, flat.y, 0.0);
    let between = |a: &Vector3<f64>, b: &Vector3<f64>| crate::geometry::atan2(a.cross(b).norm(), a.dot(b));
    let normal = step.cross(&home);
    if normal.norm() < 1e-9 {
        return between(&home, &now); // straight ahead or behind: it stays where it is
    }
    // From where it is at infinity, along the great circle away from the step, to the step's opposite.
    let normal = normal.normalize();
    let foot = (now - normal * now.dot(&normal)).normalize();
    let along = between(&step, &foot) * if step.cross(&foot).dot(&normal) < 0.0 { -1.0 } else { 1.0 };
    if (between(&step, &home)..=PI).contains(&along) {
        return libm::asin(now.dot(&normal).abs().min(1.0));
    }
    between(&home, &now).min(between(&-step, &now))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose, angle_of};
    use crate::random::Seed;
    use rand::RngExt;

    /// Landmarks all round, seen from home and from `now`; every fourth one matched with another.
    fn seen(now: &Pose, wrong: bool) -> Vec<Seen> {
        let mut stream = Seed(3).stream("landmarks");
        let mut all: Vec<Seen> = (0..80)
            .map(|_| {
                let at = direction(stream.random_range(-PI..PI)) * stream.random_range(1.5..5.0);
                let height = stream.random_range(-0.4..1.5);
                let ray = |from: &Pose| {
                    let local = from.inverse_transform(at);
                    Ray { azimuth_rad: angle_of(local), tan_elevation: height / local.norm(), sd_rad: 0.003 }
                };
                Seen { home: ray(&Pose::IDENTITY), now: ray(now) }
            })
            .collect();
        if wrong {
            for k in (0..76).step_by(4) {
                all[k].now = all[(k + 7) % 80].now;
            }
        }
        all
    }

    #[test]
    fn the_step_is_found_in_spite_of_wrong_matches() {
        for wrong in [false, true] {
            for k in 0..12 {
                let way = f64::from(k) * 0.55 - 3.0;
                let at = direction(way) * 0.8;
                let turn = wrap(1.3 * f64::from(k));
                let step = planar_step(&seen(&Pose::new(at.x, at.y, turn), wrong)).unwrap();
                assert!(wrap(step.direction_rad - way).abs() < 0.02, "{k} {wrong}: {step:?}, {way}");
                assert!(wrap(step.turn_rad - turn).abs() < 0.02, "{k} {wrong}: {step:?}, {turn}");
                assert!(wrap(step.home_rad() - (way + PI - turn)).abs() < 0.04);
                assert!(step.direction_sd_rad < 0.05 && step.turn_sd_rad < 0.05, "{step:?}");
            }
        }
    }

    #[test]
    fn at_home_the_turn_is_known_and_no_direction() {
        let step = planar_step(&seen(&Pose::new(0.0, 0.0, 0.7), false)).unwrap();
        assert!((step.turn_rad - 0.7).abs() < 1e-3 && step.turn_sd_rad < 0.01, "{step:?}");
        assert!(step.direction_sd_rad > 1.0 && step.parallax_rad < 1e-3, "{step:?}");
        assert!(planar_step(&seen(&Pose::IDENTITY, false)[..2]).is_none());
    }

    /// Right matches lie where the geometry puts them, whatever their range; wrong ones mostly do not.
    #[test]
    fn what_a_step_cannot_explain_is_off() {
        let now = Pose::new(0.6, -0.5, 2.0);
        let way = angle_of(now.position());
        let off = |s: &Seen| miss_rad(s, way, now.heading);
        assert!(seen(&now, false).iter().all(|s| off(s) < 1e-6));
        let wrong = seen(&now, true);
        let count = wrong.iter().filter(|s| off(s) > 0.05).count();
        assert!((13..=19).contains(&count), "{count} of 19 wrong ones");
        // What moves towards where the camera goes is behind no landmark.
        let ray = |azimuth_rad: f64| Ray { azimuth_rad, tan_elevation: 0.1, sd_rad: 0.01 };
        let towards = Seen { home: ray(1.0), now: ray(0.5) };
        assert!(miss_rad(&towards, 0.0, 0.0) > 0.4);
    }
}
