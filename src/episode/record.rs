//! What an episode leaves behind.

use serde::Serialize;
use strum::IntoStaticStr;

use crate::geometry::{Pose, Twist};
use crate::observation::Estimate;
use crate::panorama::Panorama;
use crate::physics::Collision;
use crate::render::RendererInfo;

/// How an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Outcome {
    /// The method claimed to be home, and the robot came to rest within the arrival radius of home.
    Home,
    /// The time limit came first.
    Timeout,
    /// The method gave up, or claimed to be home where home is not.
    Lost,
    /// The robot did not move although it was told to.
    Stuck,
    /// The method broke: a program under test that ended, took too long or answered nonsense.
    Failed,
}

impl Outcome {
    /// Lower-case name, as files have it.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// One control step: the truth, what was sensed of it, and the method's answer.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Time since the start, s.
    pub time_s: f64,
    /// True pose in the room.
    pub truth: Pose,
    /// Pose that the odometry alone leads to, in the room, from the true start.
    pub dead_reckoned: Pose,
    /// Twist that the encoders measured over the interval before this step.
    pub odometry: Twist,
    /// Slip speed of the left and right wheel over the interval before this step, m/s.
    pub slip_m_s: [f64; 2],
    /// Command for the interval after this step.
    pub command: Twist,
    /// The method's belief, in the home frame.
    pub estimate: Option<Estimate>,
    /// Bearings that the sensor gave; `None` while the robot coasts to rest after the method has stopped.
    pub seen: Option<usize>,
    /// Bearings that the method used.
    pub matched: usize,
    /// Bearings that the method refused.
    pub rejected: usize,
    /// The method's normalised innovation squared; NaN where it has none.
    pub nis: f64,
}

/// What a method with an estimate is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Belief {
    /// Home is not found yet.
    Searching,
    /// There is an estimate.
    Homing,
    /// There was one, and it no longer explains what is seen.
    Lost,
}

impl Belief {
    /// Lower-case name, as files have it.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The belief at each step; `None` while the robot coasts to rest, and all through for a method that never has an estimate.
    pub fn of_steps(steps: &[Step]) -> Vec<Option<Self>> {
        let mut found = false;
        let ever = steps.iter().any(|s| s.estimate.is_some());
        let belief = |step: &Step| {
            found |= step.estimate.is_some();
            let state = match (step.estimate, found) {
                (Some(_), _) => Self::Homing,
                (None, false) => Self::Searching,
                (None, true) => Self::Lost,
            };
            (ever && step.seen.is_some()).then_some(state)
        };
        steps.iter().map(belief).collect()
    }
}

/// Wall-clock time that an episode took, by part, s. Alone in a record in that it differs from run to run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Timing {
    /// Physics.
    pub physics_s: f64,
    /// Rendering.
    pub render_s: f64,
    /// Turning panoramas into bearings.
    pub vision_s: f64,
    /// The method: estimation and control.
    pub estimation_s: f64,
    /// The loop from its first observation to its end, with all of the above.
    pub wall_s: f64,
    /// Simulated time over wall-clock time.
    pub real_time_factor: f64,
}

/// Panoramas of an episode whose sensor has a camera.
#[derive(Debug, Clone, Default)]
pub struct Pictures {
    /// From the home pose before the run.
    pub home: Option<Panorama>,
    /// From the start.
    pub start: Option<Panorama>,
    /// From where the method stopped.
    pub end: Option<Panorama>,
}

/// All that is known about an episode after its end.
#[derive(Debug, Clone)]
pub struct Record {
    /// How it ended.
    pub outcome: Outcome,
    /// Whether the method claimed to be home, rightly or not.
    pub claimed_home: bool,
    /// Why the method broke, where it did.
    pub failure: Option<String>,
    /// Time at which the run ended: the method stopped, or was stopped, s.
    pub time_s: f64,
    /// Control steps, first to last. The rows after `time_s` are the robot coming to rest.
    pub steps: Vec<Step>,
    /// Contacts with walls and bodies as they began.
    pub collisions: Vec<Collision>,
    /// Where home is, in the room.
    pub home: Pose,
    /// Bearings in the home snapshot.
    pub home_bearings: usize,
    /// Pictures, where the sensor has a camera.
    pub pictures: Pictures,
    /// What rendered, where the sensor has a camera.
    pub renderer: Option<RendererInfo>,
    /// How long it took.
    pub timing: Timing,
}

impl Record {
    /// First control step.
    pub fn first(&self) -> &Step {
        &self.steps[0]
    }

    /// Last control step, with the robot at rest.
    pub fn last(&self) -> &Step {
        &self.steps[self.steps.len() - 1]
    }

    /// True distance from the robot to home after its end, m.
    pub fn final_distance_m(&self) -> f64 {
        (self.last().truth.position() - self.home.position()).norm()
    }

    /// Distance between where the odometry alone puts the robot at the end and where it is, m.
    pub fn odometry_drift_m(&self) -> f64 {
        (self.last().truth.position() - self.last().dead_reckoned.position()).norm()
    }
}
