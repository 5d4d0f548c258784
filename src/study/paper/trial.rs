//! One run as the paper simulates it: a unicycle at constant speed, stopped when it is truly within Rc of home.

use crate::control::Law;
use crate::control::printed::PrintedLaw;
use crate::control::vectors::{VectorLaw, align};
use crate::error::Result;
use crate::estimation::anchored::FilterSettings;
use crate::estimation::paper::{PaperEkf, PaperSettings};
use crate::geometry::{Pose, Twist, angle_of, sin_cos, wrap};
use crate::method::{self, LawKind, MethodKind};
use crate::observation::{
    Bearing, Briefing, Decision, HomeSnapshot, LandmarkId, Method, Observation, Odometry, RobotSheet, Status, TaskSheet,
};
use crate::ode::{Tolerance, integrate};

/// What a run is given beside its start: the paper's Ts, v, Rc, and when to give up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Terms {
    /// Ts, s.
    pub period_s: f64,
    /// v, m/s.
    pub speed_m_s: f64,
    /// Rc, m.
    pub radius_m: f64,
    /// A run that takes longer has not come home, s.
    pub limit_s: f64,
}

/// What sees landmarks from a pose in the home frame. It may count its looks, to draw noise.
pub type Eyes<'a> = dyn FnMut(&Pose) -> Vec<Bearing> + 'a;

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

/// Drives `method` from `start` (home frame) until it is truly within Rc, stops by itself, or is out of time. The truth is integrated by Dormand and Prince's method between sampling instants, the
/// odometry is the command itself. `compass` says whether the method is told the true heading.
pub fn drive(terms: &Terms, start: Pose, eyes: &mut Eyes<'_>, compass: bool, method: &mut dyn Method) -> Track {
    let mut truth = start;
    let mut odometry = Odometry::default();
    let mut samples = Vec::new();
    loop {
        let time_s = samples.len() as f64 * terms.period_s;
        let bearings = eyes(&truth);
        let compass_rad = compass.then_some(truth.heading);
        let decision = method.step(&Observation { time_s, odometry, bearings: &bearings, compass_rad, panorama: None });
        samples.push(Sample { time_s, truth, estimate: decision.estimate.map(|e| e.pose) });
        let home = truth.position().norm() <= terms.radius_m;
        let twist = decision.command;
        let over = decision.status != Status::Running || time_s >= terms.limit_s;
        if home || over || !(twist.v.is_finite() && twist.omega.is_finite()) {
            let straight_s = (start.position().norm() - terms.radius_m) / terms.speed_m_s;
            return Track { samples, home, straight_s };
        }
        truth = moved(truth, twist, terms.period_s);
        odometry = Odometry { twist, dt_s: terms.period_s };
    }
}

/// The unicycle (1) in Cartesian form, which has no singularity at home.
fn moved(pose: Pose, twist: Twist, dt: f64) -> Pose {
    let slope = |s: &[f64; 3]| {
        let (sin, cos) = sin_cos(s[2]);
        [twist.v * cos, twist.v * sin, twist.omega]
    };
    let [x, y, heading] = integrate(slope, [pose.x, pose.y, pose.heading], dt, Tolerance::TIGHT);
    Pose::new(x, y, heading)
}

/// The paper's filter and one of its laws, as printed.
pub struct PaperPilot {
    law: PrintedLaw,
    ids: [LandmarkId; 3],
    home: [f64; 3],
    settings: PaperSettings,
    initial: Pose,
    filter: Option<PaperEkf>,
}

impl PaperPilot {
    /// On the first three landmarks of the home snapshot, started at `initial`; `None` if there are fewer.
    #[must_use]
    pub fn new(law: PrintedLaw, settings: PaperSettings, home: &HomeSnapshot, initial: Pose) -> Option<Self> {
        let three: [Bearing; 3] = home.bearings.get(..3)?.try_into().ok()?;
        let (ids, home) = (three.map(|b| b.id), three.map(|b| b.azimuth_rad));
        Some(Self { law, ids, home, settings, initial, filter: None })
    }
}

impl Method for PaperPilot {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let seen = self.ids.map(|id| observation.bearings.iter().find(|b| b.id == id).map(|b| b.azimuth_rad));
        let filter = self.filter.get_or_insert_with(|| {
            // A landmark that is not seen at the start: its bearing as the supposed pose would have it far away.
            let first = std::array::from_fn(|k| seen[k].unwrap_or(self.home[k] - self.initial.heading));
            PaperEkf::new(self.settings, self.home, first, self.initial)
        });
        if observation.odometry.dt_s > 0.0 {
            filter.predict(observation.odometry.twist, observation.odometry.dt_s);
            filter.update(seen);
        }
        let estimate = filter.estimate();
        Decision {
            command: Twist { v: self.law.speed_m_s, omega: self.law.turn_rate(&estimate.pose) },
            estimate: Some(estimate),
            status: Status::Running,
            matched: seen.iter().flatten().count(),
            rejected: 0,
            nis: f64::NAN,
        }
    }
}

/// Limit of everyone's turn rate, rad/s: what the paper's proportional law asks for at most. With the paper's constants the nonlinear
/// one asks for less.
pub const TURN_LIMIT_RAD_S: f64 = std::f64::consts::PI;

/// The anchored filter, told nothing, with its own controller: it slows down to turn and to stop, and stops when it is sure to be home.
///
/// # Errors
/// When there are fewer than three landmarks.
pub fn anchored(law: Law, terms: &Terms, home: &HomeSnapshot) -> Result<Box<dyn Method>> {
    let law = match law {
        Law::Proportional => LawKind::Proportional,
        Law::Lyapunov => LawKind::Lyapunov,
    };
    let robot = RobotSheet {
        track_m: 0.23,
        camera_offset_m: [0.0; 2],
        max_speed_m_s: terms.speed_m_s,
        max_turn_rate_rad_s: TURN_LIMIT_RAD_S,
        max_acceleration_m_s2: 10.0,
    };
    let task = TaskSheet { speed_m_s: terms.speed_m_s, control_period_s: terms.period_s, arrival_radius_m: terms.radius_m };
    let briefing = Briefing { home: home.clone(), robot, task, compass: false, camera: None };
    method::build(MethodKind::AnchoredEkf, law, FilterSettings::default(), briefing, None)
}

/// A homing vector at constant speed, steered by the same two laws: proportionally to the angle between heading and vector,
/// or by a relay at the yaw rate beta v / Rc.
pub struct VectorPilot<'a> {
    /// What the vector is made of.
    pub vector: VectorLaw,
    /// How it steers.
    pub law: PrintedLaw,
    /// What was seen at home.
    pub home: &'a HomeSnapshot,
}

impl Method for VectorPilot<'_> {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let home = |id| self.home.bearings.iter().find(|h| h.id == id).map(|h| h.azimuth_rad);
        let pairs = |heading: f64| -> Vec<(f64, f64)> {
            let seen = observation.bearings.iter();
            seen.filter_map(|b| Some((home(b.id)?, b.azimuth_rad + heading))).collect()
        };
        let heading = observation.compass_rad.unwrap_or_else(|| align(&pairs(0.0)));
        let pairs = pairs(heading);
        // A robot somewhere opposite to the vector, facing as this one does: the law then steers along the vector.
        let place = -self.vector.vector(&pairs);
        Decision {
            command: Twist { v: self.law.speed_m_s, omega: self.law.turn_rate(&Pose::new(place.x, place.y, heading)) },
            estimate: None,
            status: Status::Running,
            matched: pairs.len(),
            rejected: 0,
            nis: f64::NAN,
        }
    }
}
