//! One run as the paper simulates it: a unicycle at constant speed, stopped when it is truly within Rc of home.
//!
//! Such a run is an ordinary [`Simulation`] with the paper's plant, pace and stop rule; only its bearings are told by a function.

use std::ops::ControlFlow;

use crate::control::{BETA, Law, Pace};
use crate::episode::{BeliefError, Outcome, Parts, PlantKind, Record, Setup, Simulation, Step, StopRule};
use crate::error::Result;
use crate::geometry::{Pose, Twist, wrap};
use crate::method::MethodKind;
use crate::observation::{Bearing, Estimate, HomeSnapshot};
use crate::sensor::Sensor;
use crate::world::{TaskSpec, World};

/// Limit of everyone's turn rate, rad/s: what the paper's proportional law asks for at most. With the paper's constants the nonlinear
/// one asks for less.
pub const TURN_LIMIT_RAD_S: f64 = std::f64::consts::PI;

/// One sampling instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time since the start, s.
    pub time_s: f64,
    /// True pose in the home frame.
    pub truth: Pose,
    /// The filter's, for a method that has one.
    pub estimate: Option<Estimate>,
    /// What the wheels are told until the next instant.
    pub command: Twist,
}

/// What a run leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// All sampling instants from the start on.
    pub samples: Vec<Sample>,
    /// Whether the last one is within Rc of home.
    pub home: bool,
    /// Time of the straight way to Rc at the run's speed, s.
    pub straight_s: f64,
}

/// Root mean square errors (17) of the states that are not measured: R in cm, theta and alpha in rad.
pub type Rmse = [f64; 3];

impl Track {
    fn of(record: &Record, task: &TaskSpec) -> Self {
        let sampled = record.steps.iter().filter(|step| step.seen.is_some());
        let local = |truth: &Pose| record.home.to_local(truth);
        let sample = |s: &Step| Sample { time_s: s.time_s, truth: local(&s.truth), estimate: s.estimate, command: s.command };
        let straight_s = straight_s(&local(&record.first().truth), task);
        Self { samples: sampled.map(sample).collect(), home: record.outcome == Outcome::Home, straight_s }
    }

    /// Time at which the robot came within Rc; `None` if it did not.
    pub fn time_s(&self) -> Option<f64> {
        self.samples.last().filter(|_| self.home).map(|s| s.time_s)
    }

    /// True distance to home at the end, m.
    pub fn final_distance_m(&self) -> f64 {
        self.samples.last().map_or(f64::NAN, |s| s.truth.position().norm())
    }

    /// Errors of the estimate by (17), over the instants after the start that have one.
    pub fn rmse(&self) -> Option<Rmse> {
        let (mut sums, mut count) = ([0.0; 3], 0.0);
        for sample in self.samples.iter().skip(1) {
            let Some(estimate) = sample.estimate else { continue };
            let off = BeliefError::new(&estimate, &sample.truth);
            for (sum, error) in sums.iter_mut().zip([100.0 * off.range_m, off.bearing_rad, off.heading_rad]) {
                *sum += error * error;
            }
            count += 1.0;
        }
        (count > 0.0).then(|| sums.map(|sum: f64| (sum / count).sqrt()))
    }
}

/// Time of the straight way from a start (home frame) to Rc, s: no method at this speed is faster.
pub fn straight_s(start: &Pose, task: &TaskSpec) -> f64 {
    (start.position().norm() - task.arrival_radius_m) / task.speed_m_s
}

/// Ts, v, Rc and the time limit of the paper's runs stand in the task of `world`. Its robot is made one without limits of its own but for
/// [`TURN_LIMIT_RAD_S`].
pub fn unlimited(world: &World) -> World {
    let mut world = world.clone();
    let robot = &mut world.spec.robot;
    (robot.track_m, robot.max_turn_rate_rad_s, robot.max_acceleration_m_s2) = (0.23, TURN_LIMIT_RAD_S, 10.0);
    robot.max_speed_m_s = world.spec.task.speed_m_s;
    world
}

/// A method under the paper's stop rule: homing vectors and the paper's filter at the paper's pace, the anchored filter at its own,
/// which slows down to turn and stops when it is sure to be home. None of them is told where it starts.
pub fn method(method: MethodKind, law: Law) -> Setup {
    let pace = Pace::Constant { beta: BETA };
    Setup { plant: PlantKind::Unicycle, method, law, pace, stop: StopRule::Reached, ..Setup::default() }
}

/// Runs `setup` from `start` (home frame) with the bearings that `eyes` tell.
///
/// # Errors
/// When the method needs more landmarks than there are.
pub fn run<'a>(world: &'a World, setup: &Setup, start: Pose, eyes: Eyes<'a>) -> Result<Track> {
    let parts = Parts::with_sensor(world, setup.plant, Box::new(eyes))?;
    let mut simulation = Simulation::from_parts(world, setup, parts);
    let record = simulation.run_from(0, world.home.compose(&start), &mut |_| ControlFlow::Continue(()))?;
    Ok(Track::of(&record, &world.spec.task))
}

/// Tells what is seen from a pose in the home frame. It may count its looks, to draw noise.
pub type Look<'a> = Box<dyn FnMut(&Pose) -> Vec<Bearing> + Send + 'a>;

/// A sensor whose bearings a function tells.
pub struct Eyes<'a> {
    /// Home in the room.
    pub home_pose: Pose,
    /// What was seen there.
    pub home: HomeSnapshot,
    /// What is seen on the way.
    pub look: Look<'a>,
    /// Whether there is a compass that tells the true heading.
    pub compass: bool,
}

impl Sensor for Eyes<'_> {
    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, _bodies: &[Pose]) -> Result<Vec<Bearing>> {
        Ok((self.look)(&self.home_pose.to_local(&truth)))
    }

    fn compass_rad(&mut self, truth: Pose) -> Option<f64> {
        self.compass.then(|| wrap(truth.heading - self.home_pose.heading))
    }
}
