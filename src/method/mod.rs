//! The homing methods: an estimator or a direct law, joined to a controller, behind the [`Method`] trait.
//!
//! Everything here sees a [`Briefing`] and [`Observation`](crate::observation::Observation)s only. The one number a person may add is
//! the pose that the paper's filter is started from, because that filter cannot start from nothing.
//!
//! Knows of: observations, estimators and control laws. Must not know of worlds, plants, sensors or any truth.

mod anchored;
pub mod exec;
mod paper;
mod vector;

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};
use strum::{EnumMessage, IntoStaticStr};

use crate::control::vectors::VectorLaw;
use crate::control::{Controller, Law, Pace};
use crate::error::{Error, Result};
use crate::estimation::anchored::FilterSettings;
use crate::estimation::paper::PaperSettings;
use crate::geometry::Pose;
use crate::observation::{Briefing, Method};
use anchored::AnchoredHoming;
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
