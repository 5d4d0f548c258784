//! The runs of a table: the paper's four starts under both of its laws.

use super::trial::{Eyes, Track, method, run};
use super::{LAWS, STARTS};
use crate::control::{BETA, Law, Pace};
use crate::episode::Setup;
use crate::error::Result;
use crate::estimation::paper::{PaperSettings, Transition};
use crate::geometry::{Pose, angle_of, direction};
use crate::method::{MethodKind, untold};
use crate::world::World;

/// The starts by name, in the home frame.
pub type Starts = Vec<(&'static str, Pose)>;

/// Those of a world that has P1 to P4.
///
/// # Errors
/// When it lacks one of them.
pub fn starts(world: &World) -> Result<Starts> {
    STARTS.into_iter().map(|name| Ok((name, world.home.to_local(&world.named_start(name)?)))).collect()
}

/// One run of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Name of the start.
    pub start: &'static str,
    /// Law that steered.
    pub law: Law,
    /// What came of it.
    pub track: Track,
}

/// A place with starts and landmarks.
pub trait Course {
    /// Home, Ts, v, Rc and the time limit.
    fn world(&self) -> &World;

    /// The starts.
    fn starts(&self) -> &Starts;

    /// What sees the first so many landmarks.
    fn eyes(&self, landmarks: usize) -> Eyes<'_>;

    /// Runs from all starts with both laws on three landmarks; `setup` says what runs under a law from a start (home frame).
    ///
    /// # Errors
    /// When there are fewer than three landmarks.
    fn runs_of(&self, setup: &dyn Fn(Law, &Pose) -> Setup) -> Result<Vec<Run>> {
        let all = LAWS.into_iter().flat_map(|law| self.starts().iter().map(move |(name, start)| (law, *name, start)));
        let run = |(law, name, start)| {
            Ok(Run { start: name, law, track: run(self.world(), &setup(law, start), *start, self.eyes(3))? })
        };
        all.map(run).collect()
    }

    /// The same with a variant of the paper's filter.
    ///
    /// # Errors
    /// As [`Course::runs_of`].
    fn runs(&self, variant: &Variant) -> Result<Vec<Run>> {
        self.runs_of(&|law, start| variant.setup(law, start))
    }
}

/// How the paper's filter is set and where it is started. The default is that of Table I: started at the true pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variant {
    /// Settings of the filter.
    pub settings: PaperSettings,
    /// Beta of (16).
    pub beta: f64,
    /// Where the filter is started.
    pub start: StartError,
}

impl Default for Variant {
    fn default() -> Self {
        Self { settings: PaperSettings::default(), beta: BETA, start: StartError::None }
    }
}

impl Variant {
    /// That of Table II, for bearings from images: Q = 0.01 I, M = I, P0 = I.
    pub fn of_images() -> Self {
        Self { settings: PaperSettings { measurement: 1.0, ..PaperSettings::default() }, ..Self::default() }
    }

    /// The same with the Jacobian of the prediction as it is printed.
    pub fn printed(self) -> Self {
        Self { settings: PaperSettings { transition: Transition::Printed, ..self.settings }, ..self }
    }

    /// The same with the filter started elsewhere.
    pub fn started(self, start: StartError) -> Self {
        Self { start, ..self }
    }

    /// What runs from a true start (home frame).
    pub fn setup(&self, law: Law, truth: &Pose) -> Setup {
        let (pace, initial_estimate) = (Pace::Constant { beta: self.beta }, Some(self.start.apply(truth)));
        Setup { paper: self.settings, pace, initial_estimate, ..method(MethodKind::PaperEkf, law) }
    }
}

/// A way in which the supposed start differs from the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StartError {
    /// Not at all.
    None,
    /// R times this.
    Range(f64),
    /// alpha plus this, rad.
    Heading(f64),
    /// R = 50 cm and theta plus this, rad.
    Place(f64),
    /// Nothing known: R = 50 cm, theta = 0.1, alpha = 0.
    Untold,
}

impl StartError {
    /// Those of the audit.
    pub const ALL: [Self; 8] = [
        Self::None,
        Self::Range(1.01),
        Self::Range(1.2),
        Self::Range(0.8),
        Self::TEN_DEGREES,
        Self::HALF_RIGHT_ANGLE,
        Self::Place(0.5),
        Self::Untold,
    ];
    /// A heading that is 10 degrees off.
    pub const TEN_DEGREES: Self = Self::Heading(10.0 * std::f64::consts::PI / 180.0);
    /// One that is 45 degrees off.
    pub const HALF_RIGHT_ANGLE: Self = Self::Heading(45.0 * std::f64::consts::PI / 180.0);

    /// The supposed start for a true one, both in the home frame.
    pub fn apply(self, truth: &Pose) -> Pose {
        match self {
            Self::None => *truth,
            Self::Range(factor) => Pose::new(factor * truth.x, factor * truth.y, truth.heading),
            Self::Heading(angle) => Pose::new(truth.x, truth.y, truth.heading + angle),
            Self::Place(angle) => {
                let p = direction(angle_of(truth.position()) + angle) * 0.5;
                Pose::new(p.x, p.y, truth.heading)
            }
            Self::Untold => untold(),
        }
    }
}
