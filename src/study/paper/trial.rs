//! One run as the paper simulates it: a unicycle at constant speed, stopped when it is truly within Rc of home.
//!
//! Such a run is an ordinary [`Simulation`] with the paper's plant, pace and stop rule; only its bearings are told by a function.

use std::ops::ControlFlow;

use crate::control::{BETA, Law, Pace};
use crate::episode::{Outcome, Parts, PlantKind, Record, Setup, Simulation, StopRule};
use crate::error::Result;
use crate::estimation::paper::PaperSettings;
use crate::geometry::{Pose, angle_of, wrap};
use crate::method::MethodKind;
use crate::observation::{Bearing, HomeSnapshot};
use crate::random::Seed;
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
    /// The filter's pose, for a method that has one.
    pub estimate: Option<Pose>,
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
        let samples: Vec<Sample> = sampled
            .map(|step| Sample {
                time_s: step.time_s,
                truth: record.home.to_local(&step.truth),
                estimate: step.estimate.map(|e| e.pose),
            })
            .collect();
        let straight_m = record.home.to_local(&record.first().truth).position().norm() - task.arrival_radius_m;
        Self { samples, home: record.outcome == Outcome::Home, straight_s: straight_m / task.speed_m_s }
    }

    /// Time at which the robot came within Rc; `None` if it did not.
    #[must_use]
    pub fn time_s(&self) -> Option<f64> {
        self.samples.last().filter(|_| self.home).map(|s| s.time_s)
    }

    /// True distance to home at the end, m.
    #[must_use]
    pub fn final_distance_m(&self) -> f64 {
        self.samples.last().map_or(f64::NAN, |s| s.truth.position().norm())
    }

    /// Errors of the estimate by (17), over the instants after the start that have one.
    #[must_use]
    pub fn rmse(&self) -> Option<Rmse> {
        let mut sums = [0.0; 3];
        let mut count = 0.0;
        for sample in self.samples.iter().skip(1) {
            let Some(estimate) = sample.estimate else { continue };
            for (sum, error) in sums.iter_mut().zip(polar_errors(&sample.truth, &estimate)) {
                *sum += error * error;
            }
            count += 1.0;
        }
        (count > 0.0).then(|| sums.map(|sum: f64| (sum / count).sqrt()))
    }
}

/// Errors of R (cm), theta and alpha (rad).
#[must_use]
pub fn polar_errors(truth: &Pose, estimate: &Pose) -> [f64; 3] {
    let (t, e) = (truth.position(), estimate.position());
    [100.0 * (e.norm() - t.norm()), wrap(angle_of(e) - angle_of(t)), wrap(estimate.heading - truth.heading)]
}

/// Ts, v, Rc and the time limit of the paper's runs stand in the task of `world`. Its robot is made one without limits of its own but for
/// [`TURN_LIMIT_RAD_S`].
#[must_use]
pub fn unlimited(world: &World) -> World {
    let mut world = world.clone();
    let robot = &mut world.spec.robot;
    (robot.track_m, robot.max_turn_rate_rad_s, robot.max_acceleration_m_s2) = (0.23, TURN_LIMIT_RAD_S, 10.0);
    robot.max_speed_m_s = world.spec.task.speed_m_s;
    world
}

/// The paper's filter under one of its laws, started at `initial` (home frame).
#[must_use]
pub fn paper_ekf(law: Law, beta: f64, paper: PaperSettings, initial: Pose) -> Setup {
    Setup { paper, pace: Pace::Constant { beta }, initial_estimate: Some(initial), ..method(MethodKind::PaperEkf, law) }
}

/// A method under the paper's stop rule: homing vectors at the paper's pace, the anchored filter at its own, which slows down to
/// turn and stops when it is sure to be home. None of them is told where it starts.
#[must_use]
pub fn method(method: MethodKind, law: Law) -> Setup {
    let pace = Pace::Constant { beta: BETA };
    Setup { plant: PlantKind::Unicycle, method, law, pace, stop: StopRule::Reached, ..Setup::default() }
}

/// Runs `setup` from `start` (home frame) with the bearings that `eyes` tells.
///
/// # Errors
/// When the method needs more landmarks than there are.
pub fn run<'a>(world: &'a World, setup: &Setup, start: Pose, eyes: Eyes<'a>) -> Result<Track> {
    let parts = Parts::with_sensor(world, setup.plant, Box::new(Sighted { home_pose: world.home, eyes }))?;
    let mut simulation = Simulation::from_parts(world, setup, parts);
    let record = simulation.run_from(0, world.home.compose(&start), &mut |_| ControlFlow::Continue(()))?;
    Ok(Track::of(&record, &world.spec.task))
}

/// What is seen from a pose in the home frame.
pub type Look<'a> = Box<dyn FnMut(&Pose) -> Vec<Bearing> + Send + 'a>;

/// What sees landmarks.
pub struct Eyes<'a> {
    /// What they saw at home.
    pub home: HomeSnapshot,
    /// What they see from a pose in the home frame. They may count their looks, to draw noise.
    pub look: Look<'a>,
    /// Whether a compass comes with them that tells the true heading.
    pub compass: bool,
}

/// Eyes as a sensor.
struct Sighted<'a> {
    home_pose: Pose,
    eyes: Eyes<'a>,
}

impl Sensor for Sighted<'_> {
    /// The noise is drawn where the eyes are made.
    fn reset(&mut self, _seed: Seed) -> Result<()> {
        Ok(())
    }

    fn home(&self) -> &HomeSnapshot {
        &self.eyes.home
    }

    fn observe(&mut self, truth: Pose, _bodies: &[Pose]) -> Result<Vec<Bearing>> {
        Ok((self.eyes.look)(&self.home_pose.to_local(&truth)))
    }

    fn compass_rad(&mut self, truth: Pose) -> Option<f64> {
        self.eyes.compass.then(|| wrap(truth.heading - self.home_pose.heading))
    }
}
