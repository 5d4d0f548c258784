//! Odometry as a step with its uncertainty.
//!
//! Wheels that grip leave odometry with errors of a few per cent. Wheels that slip leave it with any error, and the encoders do
//! not say which it is. Two things do: slip comes with acceleration, which the encoders see, and a step that did not go as the
//! wheels turned does not fit the bearings. So a step's noise has a part that grows with the measured acceleration and fades
//! after it, and a step can be [loosened](Motion::loosened) when the bearings contradict it.

use nalgebra::{Matrix3, Vector3};

use super::FilterSettings;
use crate::geometry::{Pose, Twist, sin_cos};
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

/// More noise than the wheels' own, for a step that the bearings contradict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loosening {
    /// Each wheel slips on its own by about this much, m/s.
    Slip(f64),
    /// The robot is pushed by about this much, m and rad, whatever its wheels do.
    Push(f64, f64),
}

/// What is tried, in this order, when a step does not fit: the wheels lose half of their grip at a slow cruise, spin on the
/// spot, or are no longer what moves the robot.
pub const LOOSENINGS: [Loosening; 3] = [Loosening::Slip(0.06), Loosening::Slip(0.3), Loosening::Push(0.1, 0.3)];

impl Motion {
    /// The step and its noise: errors forward, sideways and in turn, where half of a turn's error bends the chord, and both
    /// wheels slipping on their own by about `slip_m_s`.
    #[must_use]
    pub fn from_odometry(odometry: &Odometry, slip_m_s: f64, settings: &FilterSettings) -> Self {
        let (twist, dt) = (odometry.twist, odometry.dt_s);
        let forward = twist.v * dt;
        let turn = twist.omega * dt;
        let moving = twist.v.abs() + twist.omega.abs() > 1e-4;
        let floor = if moving { square(settings.speed_noise_m_s * dt) } else { 0.0 };
        let standing = square(STANDING_SD);
        let variances = Vector3::new(
            square(settings.speed_noise_share * forward) + floor + standing,
            square(settings.sideways_noise_share * forward) + standing,
            square(settings.turn_noise_share * turn) + square(settings.turn_noise_rad_m * forward) + standing,
        ) + slip_variances(slip_m_s * dt, settings);
        let delta = Pose::IDENTITY.advanced(twist, dt);
        Self { delta, covariance: along_chord(forward, turn, &variances) }
    }

    /// Covariance that a loosened step has on top of its own, in the frame of the pose before the step.
    #[must_use]
    pub fn loosened(&self, by: Loosening, dt_s: f64, settings: &FilterSettings) -> Matrix3<f64> {
        match by {
            Loosening::Slip(slip_m_s) => {
                let variances = slip_variances(slip_m_s * dt_s, settings);
                along_chord(self.delta.position().norm(), self.delta.heading, &variances)
            }
            Loosening::Push(m, rad) => Matrix3::from_diagonal(&Vector3::new(m * m, m * m, rad * rad)),
        }
    }
}

fn square(v: f64) -> f64 {
    v * v
}

/// Variances (forward, sideways, turn) of a step in which each wheel slips on its own by `slip_m`; what slips along its rolling
/// direction has little grip left across it, which shows as a sideways slip of a share of that.
fn slip_variances(slip_m: f64, settings: &FilterSettings) -> Vector3<f64> {
    let wheel = square(slip_m);
    Vector3::new(0.5 * wheel, square(settings.sideways_slip_share) * wheel, 2.0 * wheel / square(settings.track_m))
}

/// Covariance of a step with the given variances forward, sideways and in turn.
fn along_chord(forward: f64, turn: f64, variances: &Vector3<f64>) -> Matrix3<f64> {
    let (s, c) = sin_cos(0.5 * turn);
    let g = Matrix3::new(c, -s, -0.5 * forward * s, s, c, 0.5 * forward * c, 0.0, 0.0, 1.0);
    g * Matrix3::from_diagonal(variances) * g.transpose()
}

/// Slip to be expected from what the encoders tell.
#[derive(Debug, Clone, Copy, Default)]
pub struct SlipWatch {
    before: Twist,
    slip_m_s: f64,
}

impl SlipWatch {
    /// Standard deviation of a wheel's slip speed in this step, m/s: a share of the faster change of the two wheels' speeds,
    /// fading over the steps after it.
    pub fn expect(&mut self, odometry: &Odometry, settings: &FilterSettings) -> f64 {
        let change_v = (odometry.twist.v - self.before.v).abs();
        let change_omega = (odometry.twist.omega - self.before.omega).abs();
        self.before = odometry.twist;
        let wheel = change_v + 0.5 * settings.track_m * change_omega;
        self.slip_m_s = (settings.slip_share * wheel).max(settings.slip_persistence * self.slip_m_s);
        self.slip_m_s
    }
}
