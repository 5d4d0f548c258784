//! Getting round: what a robot without range sensors does when something is in its way.
//!
//! A body in the way presses the bumper; a robot without one finds that it is told to drive and does not move. It then backs off, turns
//! along what it met, drives on beside it, and the homing law takes over again from where the robot is. Where it meets the same thing
//! again it goes on along the same side, so that it comes to the end of a wall; where it meets another thing on that way, which is
//! a corner, or where the side proves long, it tries the other one, and farther (the bug algorithms of Lumelsky and Stepanov, 1987, for a
//! robot that feels but does not see what it follows).

use std::collections::VecDeque;

use crate::geometry::{Pose, Twist, wrap};
use crate::observation::{Bumper, BumperSector, RobotSheet, TaskSheet};

/// Time over which commands are held against movement, s.
const WINDOW_S: f64 = 1.0;
/// Mean commanded speed in the window below which nothing is expected of the robot, as a share of cruising speed.
const LEAST_SPEED_SHARE: f64 = 0.4;
/// A robot that moved less than this share of what it was told, ...
const MOVED_SHARE: f64 = 0.2;
/// ... and turned by less than this, is blocked, rad.
const TURNED_RAD: f64 = 0.2;
/// Time for which the bumper is pressed before what presses it counts as in the way, s: a stool gives way sooner.
const PRESSED_S: f64 = 0.35;
/// Backing off: time, s, and speed as a share of cruising speed.
const BACK: (f64, f64) = (0.8, 0.6);
/// Turn rate as a share of the robot's greatest.
const TURN_SHARE: f64 = 0.6;
/// Turn away from straight ahead where nothing tells how the obstacle lies, rad.
const ASIDE_RAD: f64 = 1.4;
/// Way along the obstacle, m.
const ALONG_M: f64 = 0.6;
/// A contact later than this after a manoeuvre is with something else, s.
const AGAIN_S: f64 = 12.0;
/// Manoeuvres to one side before the other is tried; twice as many then.
const PATIENCE: u32 = 5;

/// One manoeuvre's part.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    command: Twist,
    until_s: f64,
}

/// Watches for a blocked robot and gets it round what blocks it.
#[derive(Debug, Clone)]
pub struct Escape {
    robot: RobotSheet,
    task: TaskSheet,
    /// Pose and command of the last steps.
    window: VecDeque<(Pose, Twist)>,
    /// Since when the bumper is pressed, s.
    pressed_since_s: Option<f64>,
    /// What is left of the manoeuvre, last part first.
    parts: Vec<Part>,
    /// Side on which the obstacle is passed: 1 left, -1 right; 0 before the first.
    side: f64,
    /// Manoeuvres to this side so far, and how many of them are tried.
    tried: u32,
    patience: u32,
    ended_s: f64,
    manoeuvres: u32,
}

impl Escape {
    /// For one robot and task.
    #[must_use]
    pub fn new(robot: RobotSheet, task: TaskSheet) -> Self {
        Self {
            robot,
            task,
            window: VecDeque::new(),
            pressed_since_s: None,
            parts: Vec::new(),
            side: 0.0,
            tried: 0,
            patience: PATIENCE,
            ended_s: f64::NEG_INFINITY,
            manoeuvres: 0,
        }
    }

    /// Whether a manoeuvre is under way.
    #[must_use]
    pub fn is_active(&self) -> bool {
        !self.parts.is_empty()
    }

    /// Manoeuvres so far.
    #[must_use]
    pub fn manoeuvres(&self) -> u32 {
        self.manoeuvres
    }

    /// The command to give instead of `command`: that itself as long as the robot moves. `pose` is the believed pose in any
    /// frame that stays; a frame that changes looks like movement for a second.
    pub fn guard(&mut self, time_s: f64, pose: &Pose, bumper: Bumper, command: Twist) -> Twist {
        while self.parts.last().is_some_and(|part| time_s >= part.until_s) {
            self.parts.pop();
            self.ended_s = time_s;
        }
        let ahead = self.parts.last().map_or(command, |part| part.command);
        let met = if ahead.v > 0.0 { self.contact(time_s, bumper) } else { None };
        if let Some(part) = self.parts.last() {
            let Some(contact_rad) = met else { return part.command };
            // Something stands in the way along the obstacle: a corner.
            self.other_side();
            return self.begin(time_s, Some(contact_rad)).unwrap_or(command);
        }
        if met.is_some() || self.is_held(pose, command) {
            return self.begin(time_s, met).unwrap_or(command);
        }
        command
    }

    /// Direction of what has pressed the bumper for long enough, from the heading, rad.
    fn contact(&mut self, time_s: f64, bumper: Bumper) -> Option<f64> {
        let directions: Vec<f64> = bumper.sectors().map(BumperSector::direction_rad).collect();
        if directions.is_empty() {
            self.pressed_since_s = None;
            return None;
        }
        let since = *self.pressed_since_s.get_or_insert(time_s);
        (time_s - since >= PRESSED_S).then(|| directions.iter().sum::<f64>() / directions.len() as f64)
    }

    /// Whether the robot was told to drive and did not move.
    fn is_held(&mut self, pose: &Pose, command: Twist) -> bool {
        self.window.push_back((*pose, command));
        let steps = (WINDOW_S / self.task.control_period_s).ceil() as usize;
        if self.window.len() <= steps {
            return false;
        }
        let (before, _) = self.window[0];
        let told: f64 = self.window.iter().take(steps).map(|(_, c)| c.v.max(0.0)).sum::<f64>() * self.task.control_period_s;
        self.window.pop_front();
        let least = LEAST_SPEED_SHARE * self.cruise() * steps as f64 * self.task.control_period_s;
        let moved = (pose.position() - before.position()).norm();
        told >= least && moved <= MOVED_SHARE * told && wrap(pose.heading - before.heading).abs() <= TURNED_RAD
    }

    fn other_side(&mut self) {
        self.side = -self.side;
        self.tried = 0;
        self.patience *= 2;
    }

    /// Begins a manoeuvre round what lies in `contact_rad` from the heading, where that is felt.
    fn begin(&mut self, time_s: f64, contact_rad: Option<f64>) -> Option<Twist> {
        if time_s - self.ended_s > AGAIN_S || self.side == 0.0 {
            // Something new: past it on the side that it is not on.
            self.side = if contact_rad.is_some_and(|direction| direction > 0.1) { -1.0 } else { 1.0 };
            (self.tried, self.patience) = (0, PATIENCE);
        } else if self.tried >= self.patience {
            self.other_side();
        }
        self.tried += 1;
        self.manoeuvres += 1;
        let turn_rad =
            contact_rad.map_or(self.side * ASIDE_RAD, |direction| direction + self.side * std::f64::consts::FRAC_PI_2);
        let omega = TURN_SHARE * self.robot.max_turn_rate_rad_s;
        let back_s = time_s + BACK.0;
        let aside_s = back_s + turn_rad.abs() / omega;
        let along_s = aside_s + ALONG_M / self.cruise();
        self.parts = vec![
            Part { command: Twist { v: self.cruise(), omega: 0.0 }, until_s: along_s },
            Part { command: Twist { v: 0.0, omega: omega.copysign(turn_rad) }, until_s: aside_s },
            Part { command: Twist { v: -BACK.1 * self.cruise(), omega: 0.0 }, until_s: back_s },
        ];
        self.pressed_since_s = None;
        self.window.clear();
        self.parts.last().map(|part| part.command)
    }

    fn cruise(&self) -> f64 {
        self.task.speed_m_s.min(self.robot.max_speed_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn escape() -> Escape {
        let robot = RobotSheet {
            track_m: 0.23,
            camera_offset_m: [0.0; 2],
            max_speed_m_s: 0.3,
            max_turn_rate_rad_s: 1.9,
            max_acceleration_m_s2: 0.9,
        };
        Escape::new(robot, TaskSheet { speed_m_s: 0.3, control_period_s: 0.1, arrival_radius_m: 0.05 })
    }

    /// A point robot before a wall from (0.5, -0.3) to (0.5, 0.3), told to drive along +x, comes past it and is left alone in
    /// free space.
    #[test]
    fn a_blocked_robot_gets_past_and_a_free_one_is_left_alone() {
        let mut escape = escape();
        let mut pose = Pose::IDENTITY;
        let mut manoeuvres = 0;
        for step in 0..400 {
            let active = escape.is_active();
            let law = Twist { v: 0.3, omega: (-2.0 * pose.heading).clamp(-1.9, 1.9) };
            let command = escape.guard(0.1 * f64::from(step), &pose, Bumper::default(), law);
            manoeuvres += u32::from(!active && escape.is_active());
            let next = pose.advanced(command, 0.1);
            let hits = pose.x < 0.5 && next.x >= 0.5 && next.y.abs() < 0.3;
            pose = if hits { Pose { heading: next.heading, ..pose } } else { next };
        }
        assert!(pose.x > 3.0, "{pose:?}");
        assert!((1..=2).contains(&manoeuvres), "{manoeuvres}");
    }

    /// The same before a wall from -1.2 to 1 m: felt by the bumper, it is followed to its end.
    #[test]
    fn a_wide_wall_is_followed_to_its_end() {
        let mut escape = escape();
        let (mut pose, mut bumper) = (Pose::IDENTITY, Bumper::default());
        let mut contacts = 0;
        for step in 0..600 {
            let home = crate::geometry::angle_of(crate::geometry::Vector2::new(3.0, 0.0) - pose.position());
            let law = Twist { v: 0.3, omega: (2.0 * wrap(home - pose.heading)).clamp(-1.9, 1.9) };
            let command = escape.guard(0.1 * f64::from(step), &pose, bumper, law);
            let next = pose.advanced(command, 0.1);
            let hits = pose.x < 0.5 && next.x >= 0.5 && (-1.2..1.0).contains(&next.y);
            bumper = Bumper::default();
            if hits {
                bumper.press(wrap(-pose.heading));
            }
            contacts += u32::from(hits);
            pose = if hits { Pose { heading: next.heading, ..pose } } else { next };
            if pose.x > 2.5 {
                break;
            }
        }
        assert!(pose.x > 2.5, "{pose:?} after {} manoeuvres", escape.manoeuvres());
        assert!((2..=5).contains(&escape.manoeuvres()) && contacts < 40, "{} manoeuvres, {contacts}", escape.manoeuvres());
    }
}
