//! Steering along a line.

use crate::geometry::{Pose, Twist, wrap};
use crate::observation::{RobotSheet, TaskSheet};

use super::chart::{Beside, Line};

/// Gain of the yaw rate by the error of heading, 1/s.
const HEADING_GAIN: f64 = 2.6;
/// Angle at which the line is steered for by the distance from it, rad/m, ...
const APPROACH_RAD_M: f64 = 2.2;
/// ... at most, rad.
const STEEPEST_RAD: f64 = 1.1;
/// Yaw rate that corners are taken at, rad/s.
const CORNER_RAD_S: f64 = 0.9;
/// How far ahead corners are seen, m.
const AHEAD_M: f64 = 0.18;
/// Deceleration towards the end of the line as a share of the robot's greatest.
const BRAKING_SHARE: f64 = 0.4;
/// Curvature acts this much later than it is commanded, s.
const LATENCY_S: f64 = 0.12;

/// Where on the line a robot is that was at `along_m` of it.
#[must_use]
pub fn progress(line: &Line, along_m: f64, pose: &Pose) -> Beside {
    let (from, to) = line.stretch(along_m);
    let reach = |m: f64| m.clamp(from, to);
    line.nearest(pose.position(), reach(along_m - 0.3), reach(along_m + 1.0))
}

/// Twist that brings a robot at `pose`, which is at `beside` the line, onto it and along to its end, at the task's speed at most.
#[must_use]
pub fn steer(line: &Line, beside: &Beside, pose: &Pose, robot: &RobotSheet, task: &TaskSheet) -> Twist {
    let cruise = task.speed_m_s.min(robot.max_speed_m_s);
    let left_m = line.stretch(beside.along_m).1 - beside.along_m;
    let braking = (2.0 * BRAKING_SHARE * robot.max_acceleration_m_s2 * left_m.max(0.0)).sqrt();
    let bend = [0.0, 0.5, 1.0]
        .map(|share| line.curvature((beside.along_m + share * AHEAD_M).min(line.length_m())).abs())
        .into_iter()
        .fold(0.0, f64::max);
    let corner = if bend > 0.0 { CORNER_RAD_S / bend } else { f64::INFINITY };
    let wanted = wrap(beside.direction_rad - (APPROACH_RAD_M * beside.offset_m).clamp(-STEEPEST_RAD, STEEPEST_RAD));
    let error = wrap(wanted - pose.heading);
    let facing = libm::cos(error.clamp(-1.5, 1.5)).max(0.0);
    let v = cruise.min(braking).min(corner.max(0.06)) * facing * facing;
    let ahead_m = (beside.along_m + v * LATENCY_S).min(line.length_m());
    let omega = v * line.curvature(ahead_m) + HEADING_GAIN * error;
    Twist { v, omega: omega.clamp(-robot.max_turn_rate_rad_s, robot.max_turn_rate_rad_s) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vector2, direction};

    /// A perfect unicycle keeps to an S of two quarter circles to a centimetre, and comes back to it from beside.
    #[test]
    fn a_line_is_kept_to() {
        let robot = RobotSheet {
            track_m: 0.23,
            camera_offset_m: [0.0; 2],
            max_speed_m_s: 0.3,
            max_turn_rate_rad_s: 1.9,
            max_acceleration_m_s2: 0.9,
        };
        let task = TaskSheet { speed_m_s: 0.3, control_period_s: 0.1, arrival_radius_m: 0.05 };
        let mut at = Vector2::new(0.0, 0.0);
        let mut points = vec![at];
        for k in 0..60 {
            let heading = if k < 30 { 0.05 * f64::from(k) } else { 1.5 - 0.05 * f64::from(k - 30) };
            at += direction(heading) * 0.03;
            points.push(at);
        }
        for _ in 0..30 {
            at += Vector2::new(0.03, 0.0);
            points.push(at);
        }
        let line = Line::new(points);
        for (y, greatest) in [(0.0, 0.015), (0.3, 0.31)] {
            let (mut pose, mut along, mut last, mut worst) = (Pose::new(0.0, y, 0.0), 0.0, 0.0, 0.0_f64);
            for _ in 0..300 {
                let beside = progress(&line, along, &pose);
                (along, last) = (beside.along_m, beside.offset_m);
                worst = worst.max(beside.offset_m.abs());
                pose = pose.advanced(steer(&line, &beside, &pose, &robot, &task), 0.1);
            }
            assert!(line.length_m() - along < 0.01 && last.abs() < 0.005 && worst < greatest, "{along} {last} {worst}");
        }
    }
}
