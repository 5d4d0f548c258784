//! Odometry as a step with its uncertainty.

use nalgebra::{Matrix3, Vector3};

use super::FilterSettings;
use crate::geometry::{Pose, sin_cos};
use crate::observation::Odometry;

/// A step of the robot as odometry tells it, in the frame of the pose before the step.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// The pose after the step.
    pub delta: Pose,
    /// Covariance of (x, y, heading) of `delta`; regular even when the robot stands.
    pub covariance: Matrix3<f64>,
}

/// Standard deviation of a step of a standing robot, m and rad: it keeps the covariance regular.
const STANDING_SD: f64 = 1e-6;

impl Motion {
    /// The step and its noise: errors forward, sideways and in turn, where half of a turn's error bends the chord.
    #[must_use]
    pub fn from_odometry(odometry: &Odometry, settings: &FilterSettings) -> Self {
        let (twist, dt) = (odometry.twist, odometry.dt_s);
        let delta = Pose::IDENTITY.advanced(twist, dt);
        let forward = twist.v * dt;
        let turn = twist.omega * dt;
        let moving = twist.v.abs() + twist.omega.abs() > 1e-4;
        let square = |v: f64| v * v;
        let floor = if moving { square(settings.speed_noise_m_s * dt) } else { 0.0 };
        let standing = square(STANDING_SD);
        let variances = Vector3::new(
            square(settings.speed_noise_share * forward) + floor + standing,
            square(settings.sideways_noise_share * forward) + standing,
            square(settings.turn_noise_share * turn) + square(settings.turn_noise_rad_m * forward) + standing,
        );
        let (s, c) = sin_cos(0.5 * turn);
        let g = Matrix3::new(c, -s, -0.5 * forward * s, s, c, 0.5 * forward * c, 0.0, 0.0, 1.0);
        Self { delta, covariance: g * Matrix3::from_diagonal(&variances) * g.transpose() }
    }
}
