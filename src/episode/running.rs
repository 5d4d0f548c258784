//! The run that is under way: what moves, what is sensed at this moment, and all of the past.

use std::time::Instant;

use super::record::{Step, Timing};
use super::recorder::Moment;
use crate::geometry::{Pose, Twist, wrap};
use crate::observation::{Bearing, Odometry};
use crate::panorama::Panorama;
use crate::physics::{Collision, Plant};

/// A robot is stuck when it was told to move all through this time, s ...
const STUCK_WINDOW_S: f64 = 5.0;
/// ... and stayed within this distance, m, ...
const STUCK_DISTANCE_M: f64 = 0.02;
/// ... and this angle of where it is, rad.
const STUCK_TURN_RAD: f64 = 0.1;
/// Commands below these count as not told to move, m/s and rad/s.
const IDLE_TWIST: Twist = Twist { v: 0.005, omega: 0.02 };

/// How an episode stands, as its surroundings see it. What a method thinks of it is
/// [`Status`](crate::observation::Status).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// On the way.
    Running,
    /// The robot truly is within the arrival radius, under [`StopRule::Reached`](super::StopRule::Reached).
    Reached,
    /// The time limit has come.
    OutOfTime,
    /// The robot was told to move for some seconds and did not.
    Stuck,
}

/// The run that is under way.
pub(super) struct Episode<'a> {
    pub seed: u64,
    pub start: Pose,
    pub plant: Box<dyn Plant + 'a>,
    /// Control periods since the start, and the time that other intervals took, s.
    pub ticks: usize,
    pub other_s: f64,
    pub phase: Phase,
    /// What is sensed at this moment.
    pub odometry: Odometry,
    pub bearings: Vec<Bearing>,
    pub compass_rad: Option<f64>,
    pub slip_m_s: [f64; 2],
    pub dead_reckoned: Pose,
    /// All of the past, each row with the command that ended it.
    pub steps: Vec<Step>,
    pub collisions: Vec<Collision>,
    /// How many of these there were before the last step.
    pub known_collisions: usize,
    pub start_picture: Option<Panorama>,
    pub began: Instant,
    pub timing: Timing,
}

impl Episode<'_> {
    pub fn time_s(&self, period_s: f64) -> f64 {
        self.ticks as f64 * period_s + self.other_s
    }

    /// Moves for one interval.
    pub fn step(&mut self, command: Twist, interval_s: Option<f64>, period_s: f64) {
        let moving = Instant::now();
        let moved = self.plant.step(command, interval_s.unwrap_or(period_s));
        self.timing.physics_s += moving.elapsed().as_secs_f64();
        match interval_s {
            None => self.ticks += 1,
            Some(interval_s) => self.other_s += interval_s,
        }
        self.odometry = moved.odometry;
        self.slip_m_s = moved.slip_m_s;
        self.known_collisions = self.collisions.len();
        self.collisions.extend_from_slice(self.plant.collisions());
        self.dead_reckoned = self.dead_reckoned.advanced(moved.odometry.twist, moved.odometry.dt_s);
    }

    /// A row that says where the plant is, without an observation or a command.
    pub fn row(&self, period_s: f64) -> Step {
        Step {
            time_s: self.time_s(period_s),
            truth: self.plant.truth(),
            dead_reckoned: self.dead_reckoned,
            odometry: self.odometry.twist,
            slip_m_s: self.slip_m_s,
            command: Twist::default(),
            estimate: None,
            seen: None,
            matched: 0,
            rejected: 0,
            nis: f64::NAN,
        }
    }

    /// What a recorder is told of a step.
    pub fn moment<'m>(&'m self, step: &'m Step, bearings: &'m [Bearing], panorama: Option<&'m Panorama>) -> Moment<'m> {
        let collisions = &self.collisions[self.known_collisions..];
        Moment { step, bearings, panorama, bodies: self.plant.body_poses(), collisions }
    }

    /// Whether the robot was told to move during the whole window before now and did not.
    pub fn is_stuck(&self, period_s: f64) -> bool {
        let window = (STUCK_WINDOW_S / period_s).ceil() as usize;
        let Some(first) = self.steps.len().checked_sub(window) else { return false };
        let now = self.plant.truth();
        self.steps[first..].iter().all(|s| {
            (s.command.v.abs() >= IDLE_TWIST.v || s.command.omega.abs() >= IDLE_TWIST.omega)
                && (s.truth.position() - now.position()).norm() < STUCK_DISTANCE_M
                && wrap(s.truth.heading - now.heading).abs() < STUCK_TURN_RAD
        })
    }
}
