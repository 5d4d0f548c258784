//! The homing methods: an estimator or a direct law, joined to a controller, behind the [`Method`] trait.
//!
//! Everything here sees a [`Briefing`] and [`Observation`]s only. The one number a person may add is the pose that the paper's
//! filter is started from, because that filter cannot start from nothing.
//!
//! Knows of: observations, estimators and control laws. Must not know of worlds, plants, sensors or any truth.

pub mod exec;
mod paper;
mod vector;

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};
use strum::{EnumMessage, IntoStaticStr};

use crate::control::escape::Escape;
use crate::control::vectors::VectorLaw;
use crate::control::{Controller, Law, Pace};
use crate::error::{Error, Result};
use crate::estimation::anchored::{AnchoredFilter, FilterSettings};
use crate::estimation::paper::PaperSettings;
use crate::geometry::{Pose, Twist, wrap};
use crate::observation::{Briefing, Decision, Estimate, Method, Observation, RobotSheet, Status};
use exec::{ExecCommand, ExecHoming};
use paper::PaperHoming;
pub use paper::untold;
use vector::VectorHoming;

/// Homing methods by name. A method is read from its name and shown by it: `alv`, or `exec:python3 my_method.py`.
#[derive(Debug, Clone, PartialEq, Eq, EnumMessage, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum MethodKind {
    /// Filter that starts from nothing and anchors home when it can.
    AnchoredEkf,
    /// The paper's six-state filter on three landmarks, started at a supposed pose.
    PaperEkf,
    /// Average landmark vector; no estimate. Without a compass, this and those below align the two sets of bearings by their circular
    /// mean difference.
    Alv,
    /// Tron and Daniilidis' descent on bearings; no estimate.
    TronDaniilidis,
    /// Weber's bearing vectors; no estimate.
    Weber,
    /// Visual servoing with one constant range; no estimate.
    Ibvs,
    /// A program of your own, such as exec:"python3 my_method.py"; the README says what it is told and answers.
    Exec(ExecCommand),
}

impl MethodKind {
    /// The methods that the project brings.
    pub const BUILT_IN: [Self; 6] =
        [Self::AnchoredEkf, Self::PaperEkf, Self::Alv, Self::TronDaniilidis, Self::Weber, Self::Ibvs];

    /// Name without what belongs to one program.
    pub fn name(&self) -> &'static str {
        self.into()
    }

    /// Fewest landmarks in the home snapshot that the method can do with.
    pub fn fewest_landmarks(&self) -> usize {
        match self {
            Self::AnchoredEkf | Self::PaperEkf => 3,
            Self::Alv | Self::TronDaniilidis | Self::Weber | Self::Ibvs => 2,
            Self::Exec(_) => 0,
        }
    }

    /// Checks what can be checked before a run: that a program is there.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self) -> Result<()> {
        match self {
            Self::Exec(command) => command.check(),
            _ => Ok(()),
        }
    }
}

impl From<VectorLaw> for MethodKind {
    fn from(law: VectorLaw) -> Self {
        match law {
            VectorLaw::Alv => Self::Alv,
            VectorLaw::TronDaniilidis => Self::TronDaniilidis,
            VectorLaw::Weber => Self::Weber,
            VectorLaw::Ibvs => Self::Ibvs,
        }
    }
}

impl fmt::Display for MethodKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exec(command) => write!(f, "{}{command}", exec::PREFIX),
            own => f.write_str(own.name()),
        }
    }
}

impl FromStr for MethodKind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if let Some(command) = text.strip_prefix(exec::PREFIX) {
            return ExecCommand::parse(command).map(Self::Exec);
        }
        Self::BUILT_IN.into_iter().find(|kind| kind.name() == text).ok_or_else(|| Error::Invalid {
            what: "method".into(),
            found: format!("`{text}`"),
            allowed: format!("{}, {}COMMAND", Self::BUILT_IN.map(|kind| kind.name()).join(", "), exec::PREFIX),
        })
    }
}

impl Serialize for MethodKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What methods are set to, beside what the robot knows.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodOptions {
    /// How it steers.
    pub law: Law,
    /// How fast it drives: of homing vectors and of `paper-ekf`, which drives at the paper's constant pace anyway.
    pub pace: Pace,
    /// Knobs of the anchored filter.
    pub filter: FilterSettings,
    /// Knobs of the paper's filter.
    pub paper: PaperSettings,
    /// Pose in the home frame that `paper-ekf` is started from.
    pub initial: Option<Pose>,
    /// Whether `paper-ekf` stops where it believes to be home.
    pub stops: bool,
}

impl Default for MethodOptions {
    fn default() -> Self {
        Self {
            law: Law::Proportional,
            pace: Pace::Governed,
            filter: FilterSettings::default(),
            paper: PaperSettings::default(),
            initial: None,
            stops: true,
        }
    }
}

/// Builds a method.
///
/// # Errors
/// When the method needs more of the home snapshot than there is, or a supposed pose is given to a method that takes none.
pub fn build(kind: MethodKind, options: &MethodOptions, briefing: Briefing) -> Result<Box<dyn Method>> {
    if options.initial.is_some() && kind != MethodKind::PaperEkf {
        return Err(Error::Invalid {
            what: "initial estimate".into(),
            found: "one".into(),
            allowed: "none: only paper-ekf is started from a supposed pose".into(),
        });
    }
    let least = kind.fewest_landmarks();
    if briefing.home.bearings.len() < least {
        return Err(Error::Unfit {
            what: "landmarks in the home snapshot".into(),
            found: briefing.home.bearings.len().to_string(),
            needed: format!("at least {least}"),
        });
    }
    let controller = |pace| Controller::new(options.law, pace, briefing.robot, briefing.task);
    let vector = |law, briefing| Box::new(VectorHoming::new(law, controller(options.pace), briefing));
    Ok(match kind {
        MethodKind::AnchoredEkf => Box::new(AnchoredHoming::new(options.filter, controller(Pace::Governed), &briefing)),
        MethodKind::PaperEkf => Box::new(PaperHoming::new(options, briefing)),
        MethodKind::Alv => vector(VectorLaw::Alv, briefing.clone()),
        MethodKind::TronDaniilidis => vector(VectorLaw::TronDaniilidis, briefing.clone()),
        MethodKind::Weber => vector(VectorLaw::Weber, briefing.clone()),
        MethodKind::Ibvs => vector(VectorLaw::Ibvs, briefing.clone()),
        MethodKind::Exec(command) => Box::new(ExecHoming::new(command, briefing)),
    })
}

/// Home counts as reached within this share of the arrival radius, by the estimate.
const STOP_SHARE: f64 = 0.25;
/// ... or so near that braking at once ends there, within this share of the arrival radius ...
const ROLL_SHARE: f64 = 0.8;
/// ... if the position's standard deviation is within this share of the arrival radius.
const STOP_SD_SHARE: f64 = 0.4;
/// ... and the bearings of this many steps in a row bear it out.
const STEADY_STEPS: u32 = 3;
/// Where the robot went by this much more elsewhere in one step than wheels usually make it, the floor is slippery, m ...
const SLIP_M: f64 = 0.003;
/// ... and braking is begun as if the drive could do this share of it, ...
const SLIPPERY_SHARE: f64 = 0.25;
/// ... and home counts as reached only by a robot that moved less than this a step, m, ...
const AT_REST_M: f64 = 0.0015;
/// ... for so many steps in a row: wheels that stand still say nothing of a robot that slides on.
const REST_STEPS: u32 = 5;
/// Creeping speed while the estimate is home but not yet sure, m/s.
const CREEP_M_S: f64 = 0.06;
/// A filter that is home for this long without becoming sure starts again, s.
const UNSURE_S: f64 = 6.0;

/// The anchored filter with a controller.
struct AnchoredHoming {
    filter: AnchoredFilter,
    controller: Controller,
    arrival_radius_m: f64,
    max_acceleration_m_s2: f64,
    /// Speed last commanded.
    speed_m_s: f64,
    unsure_since_s: Option<f64>,
    /// Where the robot was believed to be at the step before.
    stood: Option<Pose>,
    /// Steps in a row in which it hardly moved.
    rest_steps: u32,
    /// Whether the floor has proved slippery.
    slippery: bool,
    escape: Escape,
    arrived: bool,
}

impl AnchoredHoming {
    fn new(settings: FilterSettings, controller: Controller, briefing: &Briefing) -> Self {
        let RobotSheet { track_m, camera_offset_m, .. } = briefing.robot;
        Self {
            filter: AnchoredFilter::new(FilterSettings { track_m, camera_offset_m, ..settings }, &briefing.home),
            controller,
            arrival_radius_m: briefing.task.arrival_radius_m,
            max_acceleration_m_s2: briefing.robot.max_acceleration_m_s2,
            speed_m_s: 0.0,
            unsure_since_s: None,
            stood: None,
            rest_steps: 0,
            slippery: false,
            escape: Escape::new(briefing.robot, briefing.task),
            arrived: false,
        }
    }

    /// Command for a belief that home is adopted.
    fn approach(&mut self, estimate: &Estimate, time_s: f64) -> (Twist, bool) {
        let range = estimate.range_m();
        // Braking from the speed last commanded takes this far; it may begin before home is reached.
        let rolling = self.speed_m_s * self.speed_m_s / (2.0 * self.max_acceleration_m_s2);
        let moved = self
            .stood
            .replace(estimate.pose)
            .map_or(f64::INFINITY, |before| (estimate.pose.position() - before.position()).norm());
        self.rest_steps = if moved <= AT_REST_M { self.rest_steps + 1 } else { 0 };
        if !self.slippery && self.filter.greatest_slip_m() > SLIP_M {
            self.slippery = true;
            self.controller = self.controller.braking_at(SLIPPERY_SHARE);
        }
        let near = range <= (STOP_SHARE * self.arrival_radius_m).max(rolling.min(ROLL_SHARE * self.arrival_radius_m));
        let passing = range <= 0.8 * self.arrival_radius_m && estimate.home_direction_rad().abs() > 1.4;
        if !(near || passing) {
            return (self.controller.drive(&estimate.pose), false);
        }
        if estimate.position_sd_m() <= STOP_SD_SHARE * self.arrival_radius_m && self.filter.steady_steps() >= STEADY_STEPS {
            return (Twist::default(), !self.slippery || self.rest_steps >= REST_STEPS);
        }
        // At home by the mean but not sure of it: a slow circle brings parallax.
        let since = *self.unsure_since_s.get_or_insert(time_s);
        if time_s - since > UNSURE_S {
            self.filter.restart();
            self.unsure_since_s = None;
        }
        (Twist { v: CREEP_M_S, omega: 0.8 }, false)
    }
}

impl Method for AnchoredHoming {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let report = self.filter.step(&observation.odometry, observation.bearings);
        let estimate = self.filter.estimate();
        let command = match (&estimate, self.filter.best_pose()) {
            _ if self.arrived => Twist::default(),
            (Some(estimate), _) => {
                let (command, arrived) = self.approach(estimate, observation.time_s);
                self.arrived = arrived && !self.escape.is_active();
                command
            }
            (None, Some(guess)) => self.search(&guess, observation.time_s),
            (None, None) => Twist { v: 0.0, omega: 0.6 },
        };
        let command = if self.arrived {
            command
        } else {
            self.escape.guard(observation.time_s, &self.filter.map_pose(), observation.bumper, command)
        };
        self.speed_m_s = command.v;
        let status = if self.arrived { Status::Arrived } else { Status::Running };
        let nis = if report.matched > 0 { report.nis / report.matched as f64 } else { f64::NAN };
        Decision { command, estimate, status, matched: report.matched, rejected: report.rejected, nis }
    }
}

impl AnchoredHoming {
    /// Command while home is only guessed: towards the guess, weaving a little for parallax, never stopping at it.
    fn search(&self, guess: &Pose, time_s: f64) -> Twist {
        let towards = wrap(crate::geometry::angle_of(-guess.position()) - guess.heading);
        let weave = 0.25 * libm::sin(2.0 * std::f64::consts::PI * time_s / 3.0);
        self.controller.follow(towards + weave)
    }
}
