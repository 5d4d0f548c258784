//! Homing vectors: from two sets of bearings straight to a direction, without an estimate of where the robot is.
//!
//! A law takes pairs (home bearing, current bearing), both in the home frame: phi_i* and phi_i. beta_i = (cos phi_i, sin phi_i) is
//! the current unit vector, beta_i* the home one, delta_i = wrap(phi_i* - phi_i) and n_i = (-sin phi_i, cos phi_i) the current
//! bearing's left. What turns current bearings into the home frame is the robot's heading: from a compass, or from the
//! bearings themselves ([`align`]).

use nalgebra::Matrix2;

use crate::geometry::{Vector2, atan2, direction, wrap};

/// Laws that make a homing vector of bearings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VectorLaw {
    /// Average landmark vector (Lambrinos et al. 1998): sum of beta_i - beta_i*.
    Alv,
    /// Tron and Daniilidis (arXiv 1402.3584) with f(c) = arccos(c)^2 / 2, a descent of sum r_i f(beta_i . beta_i*); with
    /// f(c) = 1 - c their law is the average landmark vector.
    TronDaniilidis,
    /// Bearing vectors of Weber, Venkatesh and Srinivasan (1999): each bearing's own correction, across its line of sight.
    Weber,
    /// Image-based visual servoing with one constant range for all landmarks (Liu et al. 2010, as we read it): least squares of
    /// delta_i over the bearings' rates, omega_i = (sin phi_i, -cos phi_i) . u / r0.
    Ibvs,
}

impl VectorLaw {
    /// All laws, in the order in which tables list them.
    pub const ALL: [Self; 4] = [Self::Alv, Self::TronDaniilidis, Self::Weber, Self::Ibvs];

    /// The homing vector in the home frame for pairs (home bearing, current bearing) in that frame, rad. Its direction is what
    /// counts; its length is 0 at home and has no unit. 0 without pairs.
    #[must_use]
    pub fn vector(self, pairs: &[(f64, f64)]) -> Vector2<f64> {
        let mut sum = Vector2::zeros();
        let mut normal = Matrix2::zeros();
        for &(home, now) in pairs {
            let beta = direction(now);
            let left = Vector2::new(-beta.y, beta.x);
            let delta = wrap(home - now);
            sum += match self {
                Self::Alv => beta - direction(home),
                // f(c) = delta^2 / 2 and f'(c) (I - beta beta^T) beta* = -delta / sin(delta) * sin(delta) n
                Self::TronDaniilidis => beta * (0.5 * delta * delta) - left * delta,
                Self::Weber | Self::Ibvs => -left * delta,
            };
            normal += left * left.transpose();
        }
        let mean = sum / (pairs.len().max(1) as f64);
        if self != Self::Ibvs {
            return mean;
        }
        // J has the rows -n_i, so J^T J = sum n n^T and J^T delta = -sum n delta, which is Weber's vector. Landmarks on one line of
        // sight leave the direction along it open; a damping of rounding size makes it none.
        normal += Matrix2::identity() * (1e-9 * pairs.len() as f64);
        normal.try_inverse().map_or(mean, |inverse| inverse * sum)
    }
}

/// Heading that turns the current bearings onto the home ones as well as one turn can: the circular mean of their differences,
/// rad. Exact at home; elsewhere off by the mean parallax. Pairs are (home bearing, bearing from the robot's heading).
#[must_use]
pub fn align(pairs: &[(f64, f64)]) -> f64 {
    let sum: Vector2<f64> = pairs.iter().map(|&(home, now)| direction(home - now)).sum();
    atan2(sum.y, sum.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::angle_of;

    const LANDMARKS: [[f64; 2]; 5] = [[1.5, 0.3], [1.0, 1.8], [-1.2, 0.6], [-0.4, -2.0], [1.3, -1.1]];

    fn pairs(robot: Vector2<f64>) -> Vec<(f64, f64)> {
        LANDMARKS.iter().map(|l| Vector2::new(l[0], l[1])).map(|l| (angle_of(l), angle_of(l - robot))).collect()
    }

    /// Each law goes home by descent of its own potential or at least turns homewards within a right angle.
    #[test]
    fn vectors_point_homewards() {
        for law in VectorLaw::ALL {
            for k in 0..24 {
                let robot = direction(f64::from(k) * 0.26) * 0.6;
                let vector = law.vector(&pairs(robot));
                assert!(vector.dot(&-robot) > 0.0, "{law:?} at {robot:?}: {vector:?}");
            }
            assert!(law.vector(&pairs(Vector2::zeros())).norm() < 1e-12, "{law:?}");
        }
    }

    /// Tron and Daniilidis' vector is minus the gradient of sum r f(c), by finite differences.
    #[test]
    fn tron_daniilidis_descends_its_potential() {
        let cost = |robot: Vector2<f64>| -> f64 {
            let range = |l: &[f64; 2]| (Vector2::new(l[0], l[1]) - robot).norm();
            let f = |&(home, now): &(f64, f64)| 0.5 * wrap(home - now) * wrap(home - now);
            LANDMARKS.iter().zip(&pairs(robot)).map(|(l, p)| range(l) * f(p)).sum()
        };
        let h = 1e-6;
        for robot in [Vector2::new(0.4, 0.3), Vector2::new(-0.7, 0.2), Vector2::new(0.1, -0.9)] {
            let slope = |d: Vector2<f64>| (cost(robot + d * h) - cost(robot - d * h)) / (2.0 * h);
            let gradient = Vector2::new(slope(Vector2::x()), slope(Vector2::y()));
            let vector = VectorLaw::TronDaniilidis.vector(&pairs(robot)) * LANDMARKS.len() as f64;
            assert!((gradient + vector).norm() < 1e-6, "{gradient:?} {vector:?}");
        }
    }

    /// With all landmarks on a circle around home the constant range is the right one, and near home the law points exactly home.
    #[test]
    fn servoing_is_exact_near_home_where_ranges_are_equal() {
        let robot = Vector2::new(3e-4, -2e-4);
        let pairs: Vec<_> =
            (0..5).map(|k| direction(0.3 + 1.1 * f64::from(k)) * 2.0).map(|l| (angle_of(l), angle_of(l - robot))).collect();
        let vector = VectorLaw::Ibvs.vector(&pairs) * 2.0; // r0
        assert!((vector + robot).norm() < 1e-3 * robot.norm(), "{vector:?}");
        assert!((align(&[(0.5, -0.5), (1.0, -0.2), (-2.0, -2.8)]) - 1.0).abs() < 0.01);
    }
}
