//! Getting free: what a robot without range sensors does when it is told to drive and does not move.
//!
//! A body in the way shows in the belief, or in wheels that stall. The robot then backs off, turns aside and drives past, to one
//! side and to the other in turn, farther each time; after that the homing law takes over again from where the robot is.

use std::collections::VecDeque;

use crate::geometry::{Pose, Twist, wrap};
use crate::observation::{RobotSheet, TaskSheet};

/// Time over which commands are held against movement, s.
const WINDOW_S: f64 = 1.0;
/// Mean commanded speed in the window below which nothing is expected of the robot, as a share of cruising speed.
const LEAST_SPEED_SHARE: f64 = 0.4;
/// A robot that moved less than this share of what it was told, ...
const MOVED_SHARE: f64 = 0.2;
/// ... and turned by less than this, is blocked, rad.
const TURNED_RAD: f64 = 0.2;
/// Backing off: time, s, and speed as a share of cruising speed.
const BACK: (f64, f64) = (1.0, 0.6);
/// Turning aside, rad.
const ASIDE_RAD: f64 = 1.2;
/// Driving past at the first attempt, s; each further one takes that much longer.
const PAST_S: f64 = 1.5;
/// Attempts after which the distance driven past starts small again.
const ATTEMPTS: u32 = 4;

/// One manoeuvre's part.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    command: Twist,
    until_s: f64,
}

/// Watches for a blocked robot and frees it.
#[derive(Debug, Clone)]
pub struct Escape {
    robot: RobotSheet,
    task: TaskSheet,
    /// Pose and command of the last steps.
    window: VecDeque<(Pose, Twist)>,
    /// What is left of the manoeuvre, last part first.
    parts: Vec<Part>,
    attempts: u32,
}

impl Escape {
    /// For one robot and task.
    #[must_use]
    pub fn new(robot: RobotSheet, task: TaskSheet) -> Self {
        Self { robot, task, window: VecDeque::new(), parts: Vec::new(), attempts: 0 }
    }

    /// Whether a manoeuvre is under way.
    #[must_use]
    pub fn is_active(&self) -> bool {
        !self.parts.is_empty()
    }

    /// The command to give instead of `command`: that itself as long as the robot moves. `pose` is the believed pose in any
    /// frame that stays; a frame that changes looks like movement for a second.
    pub fn guard(&mut self, time_s: f64, pose: &Pose, command: Twist) -> Twist {
        while self.parts.last().is_some_and(|part| time_s >= part.until_s) {
            self.parts.pop();
        }
        if let Some(part) = self.parts.last() {
            return part.command;
        }
        self.window.push_back((*pose, command));
        let steps = (WINDOW_S / self.task.control_period_s).ceil() as usize;
        if self.window.len() <= steps {
            return command;
        }
        let (before, _) = self.window[0];
        let told: f64 = self.window.iter().take(steps).map(|(_, c)| c.v.max(0.0)).sum::<f64>() * self.task.control_period_s;
        self.window.pop_front();
        let least = LEAST_SPEED_SHARE * self.cruise() * steps as f64 * self.task.control_period_s;
        let moved = (pose.position() - before.position()).norm();
        if told < least || moved > MOVED_SHARE * told || wrap(pose.heading - before.heading).abs() > TURNED_RAD {
            return command;
        }
        self.begin(time_s);
        self.parts.last().map_or(command, |part| part.command)
    }

    fn begin(&mut self, time_s: f64) {
        let side = if self.attempts.is_multiple_of(2) { 1.0 } else { -1.0 };
        let omega = 0.6 * self.robot.max_turn_rate_rad_s;
        let back_s = time_s + BACK.0;
        let aside_s = back_s + ASIDE_RAD / omega;
        let past_s = aside_s + PAST_S * f64::from(1 + self.attempts % ATTEMPTS);
        self.parts = vec![
            Part { command: Twist { v: self.cruise(), omega: 0.0 }, until_s: past_s },
            Part { command: Twist { v: 0.0, omega: side * omega }, until_s: aside_s },
            Part { command: Twist { v: -BACK.1 * self.cruise(), omega: 0.0 }, until_s: back_s },
        ];
        self.attempts += 1;
        self.window.clear();
    }

    fn cruise(&self) -> f64 {
        self.task.speed_m_s.min(self.robot.max_speed_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point robot before a wall from (0.5, -0.3) to (0.5, 0.3), told to drive along +x, comes past it and is left alone in
    /// free space.
    #[test]
    fn a_blocked_robot_gets_past_and_a_free_one_is_left_alone() {
        let robot = RobotSheet {
            track_m: 0.23,
            camera_offset_m: [0.0; 2],
            max_speed_m_s: 0.3,
            max_turn_rate_rad_s: 1.9,
            max_acceleration_m_s2: 0.9,
        };
        let task = TaskSheet { speed_m_s: 0.3, control_period_s: 0.1, arrival_radius_m: 0.05 };
        let mut escape = Escape::new(robot, task);
        let mut pose = Pose::IDENTITY;
        let mut manoeuvres = 0;
        for step in 0..400 {
            let active = escape.is_active();
            let law = Twist { v: 0.3, omega: (-2.0 * pose.heading).clamp(-1.9, 1.9) };
            let command = escape.guard(0.1 * f64::from(step), &pose, law);
            manoeuvres += u32::from(!active && escape.is_active());
            let next = pose.advanced(command, 0.1);
            let hits = pose.x < 0.5 && next.x >= 0.5 && next.y.abs() < 0.3;
            pose = if hits { Pose { heading: next.heading, ..pose } } else { next };
        }
        assert!(pose.x > 3.0, "{pose:?}");
        assert!((1..=2).contains(&manoeuvres), "{manoeuvres}");
    }
}
