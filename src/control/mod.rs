//! Control laws: from the believed pose to wheel commands.
//!
//! A law steers; a governor sets the speed. Both see only an estimate's pose and the data sheets, never the simulator.
//! [`printed`] has the paper's laws as they stand in the paper, for its reproduction; [`vectors`] the laws that make a direction
//! of bearings alone.
//!
//! Knows of: an estimate's pose and the data sheets. Must not know of the simulator.

pub mod printed;
pub mod vectors;

pub mod escape;

use serde::Serialize;
use strum::{Display, EnumMessage, IntoStaticStr, VariantArray};

use crate::geometry::{Pose, Twist, angle_of, wrap};
use crate::observation::{RobotSheet, TaskSheet};

/// Steering laws, by the names that the command line has for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Law {
    /// Turn rate proportional to the heading error: the paper's omega = pi - (alpha - theta), wrapped, with a gain.
    Proportional,
    /// The paper's switching law (16), omega = beta (v / Rc) sgn(theta'), beta > 1.
    Lyapunov,
}

/// How fast a robot drives under a law, and how much care is taken of its limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// Within the limits of robot and task: slower where home lies aside, and no faster than it can brake at home.
    Governed,
    /// As the paper's simulations have it: the law as it is printed, with its beta, always at cruising speed.
    Constant {
        /// Free parameter of (16), more than 1. The paper does not say which one it used.
        beta: f64,
    },
}

/// Gain of the proportional law on robots that can turn fast, 1/s. The paper's own gain is 1.
const STEERING_GAIN: f64 = 4.0;
/// The beta of (16) where nothing else is said. The paper says only that it is more than 1.
pub const BETA: f64 = 1.5;
/// Deceleration planned for the last stretch, as a share of the drive's own.
const BRAKING_SHARE: f64 = 0.9;

/// A steering law with the limits of robot and task.
#[derive(Debug, Clone, Copy)]
pub struct Controller {
    law: Law,
    pace: Pace,
    robot: RobotSheet,
    task: TaskSheet,
}

impl Controller {
    /// A controller for one robot and task.
    #[must_use]
    pub fn new(law: Law, pace: Pace, robot: RobotSheet, task: TaskSheet) -> Self {
        Self { law, pace, robot, task }
    }

    /// How fast it drives.
    #[must_use]
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// The same with less of the drive's deceleration planned for, as a share of it: for floors on which tyres slide.
    #[must_use]
    pub fn braking_at(self, share: f64) -> Self {
        let max_acceleration_m_s2 = share * self.robot.max_acceleration_m_s2;
        Self { robot: RobotSheet { max_acceleration_m_s2, ..self.robot }, ..self }
    }

    /// Yaw rate of the law alone, limited to the robot's, for a robot at `pose` in the home frame driving at `v`.
    ///
    /// The Lyapunov law is a relay. Sampled, a relay chatters by as much as the robot turns in one period; the yaw rate is
    /// therefore held to what brings the heading onto the home direction within one period.
    #[must_use]
    pub fn steer(&self, pose: &Pose, v: f64) -> f64 {
        let error = home_direction(pose);
        let omega = match self.law {
            Law::Proportional => STEERING_GAIN * error,
            Law::Lyapunov => {
                // theta' = v sin(alpha - theta) / R has the sign of the error: alpha - theta = pi - error.
                let relay = BETA * v / self.task.arrival_radius_m * error.signum();
                let enough = error.abs() / self.task.control_period_s;
                relay.clamp(-enough, enough)
            }
        };
        omega.clamp(-self.robot.max_turn_rate_rad_s, self.robot.max_turn_rate_rad_s)
    }

    /// Twist that drives a robot at `pose` (home frame) home. At a constant pace it is the printed law's; governed, cruising speed, less while it points far elsewhere, and no more than
    /// still lets it stop at home. It slows down late: an arc that begins at once beats a turn on the spot.
    #[must_use]
    pub fn drive(&self, pose: &Pose) -> Twist {
        if let Pace::Constant { beta } = self.pace {
            let v = self.task.speed_m_s;
            return Twist { v, omega: printed::turn_rate(self.law, beta, v / self.task.arrival_radius_m, pose) };
        }
        let range = pose.position().norm();
        let error = home_direction(pose);
        let cruise = self.task.speed_m_s.min(self.robot.max_speed_m_s);
        // The greatest speed that, held for one period more, can still be braked to rest at home: v T + v^2 / (2 a) = range.
        let a = BRAKING_SHARE * self.robot.max_acceleration_m_s2;
        let period = self.task.control_period_s;
        let braking = a * ((period * period + 2.0 * range / a).sqrt() - period);
        let facing = libm::cos(error.clamp(-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2));
        // The relay turns only while it moves: it needs a little speed even when it faces away.
        let least = if self.law == Law::Lyapunov { 0.1 } else { 0.0 };
        let v = cruise.min(braking) * facing.sqrt().sqrt().max(least);
        Twist { v, omega: self.steer(pose, v) }
    }

    /// Twist that follows a direction (rad from the heading) at cruising speed, for when only a direction is known.
    #[must_use]
    pub fn follow(&self, direction_rad: f64) -> Twist {
        let far = -crate::geometry::direction(wrap(direction_rad)) * 1e3;
        self.drive(&Pose::new(far.x, far.y, 0.0))
    }
}

/// Direction of home from the robot's heading, rad: pi - (alpha - theta), wrapped.
fn home_direction(pose: &Pose) -> f64 {
    wrap(angle_of(-pose.position()) - pose.heading)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controller(law: Law) -> Controller {
        Controller::new(
            law,
            Pace::Governed,
            RobotSheet {
                track_m: 0.23,
                camera_offset_m: [0.0; 2],
                max_speed_m_s: 0.3,
                max_turn_rate_rad_s: 1.9,
                max_acceleration_m_s2: 0.9,
            },
            TaskSheet { speed_m_s: 0.3, control_period_s: 0.1, arrival_radius_m: 0.05 },
        )
    }

    /// Either law brings a perfect unicycle home from any heading.
    #[test]
    fn both_laws_arrive() {
        for law in [Law::Proportional, Law::Lyapunov] {
            let c = controller(law);
            for k in 0..12 {
                let mut pose = Pose::new(1.3, -0.8, f64::from(k) * 0.55);
                let mut nearest = f64::INFINITY;
                for _ in 0..200 {
                    pose = pose.advanced(c.drive(&pose), 0.1);
                    nearest = nearest.min(pose.position().norm());
                }
                assert!(nearest < 0.02, "{law:?} {k} {nearest}");
            }
        }
    }

    /// The sign of the relay is that of the paper's theta'.
    #[test]
    fn relay_has_the_sign_of_theta_dot() {
        let c = controller(Law::Lyapunov);
        for k in 0..20 {
            let pose = Pose::new(0.4, 0.9, f64::from(k) * 0.3);
            let theta = angle_of(pose.position());
            let theta_dot = libm::sin(pose.heading - theta);
            assert!(c.steer(&pose, 0.3) * theta_dot >= 0.0);
        }
    }
}
