//! Section IV-C, Fig. 8: how long each method takes home from the same starts, at the same speed, under the same limit of the turn
//! rate.
//!
//! The paper compares itself with a "bearing only method" and an "ALV method" of its reference list, which is not in the text; as
//! we read it these are visual servoing with a constant range (Liu et al. 2010) and an average landmark vector on image features. What
//! a method knows decides much, so it stands beside each: the paper's filter is given the true start, the vector laws may have a
//! compass, the anchored filter has nothing.

use rayon::prelude::*;

use super::ideal::Ideal;
use super::images::{ImageCase, image_settings};
use super::trial::{self, Eyes, paper_ekf};
use crate::control::vectors::VectorLaw;
use crate::control::{BETA, Law};
use crate::episode::Setup;
use crate::error::Result;
use crate::geometry::{Pose, Vector2};
use crate::method::{MethodKind, untold};
use crate::observation::HomeSnapshot;

/// Ts of Fig. 8, s.
const PERIOD_S: f64 = 0.01;
/// Speed of Fig. 8, m/s.
const SPEED_M_S: f64 = 0.10;

/// What a method is told beside bearings and odometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Told {
    /// The true pose at the start.
    Start,
    /// The true heading all the way.
    Compass,
    /// Nothing.
    Nothing,
}

/// A method with its steering.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entrant {
    /// The paper's filter.
    Paper(Law),
    /// The same, told nothing: started at R = 50 cm, theta = 0.1, alpha = 0.
    PaperUntold(Law),
    /// The anchored filter.
    Anchored(Law),
    /// A homing vector.
    Vector(VectorLaw, Law, Told),
}

impl Entrant {
    /// All, in the order of the table.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let laws = super::LAWS;
        let mut all: Vec<Self> = laws.map(Self::Paper).into();
        all.extend(laws.map(Self::PaperUntold));
        all.extend(laws.map(Self::Anchored));
        for told in [Told::Compass, Told::Nothing] {
            all.extend(VectorLaw::ALL.into_iter().flat_map(|vector| laws.map(|law| Self::Vector(vector, law, told))));
        }
        all
    }

    /// What it is told.
    #[must_use]
    pub fn told(self) -> Told {
        match self {
            Self::Paper(_) => Told::Start,
            Self::PaperUntold(_) | Self::Anchored(_) => Told::Nothing,
            Self::Vector(_, _, told) => told,
        }
    }

    /// The same as a setup of a run from `start` (home frame).
    fn setup(self, start: Pose) -> Setup {
        match self {
            Self::Paper(law) => paper_ekf(law, BETA, image_settings(), start),
            Self::PaperUntold(law) => paper_ekf(law, BETA, image_settings(), untold()),
            Self::Anchored(law) => trial::method(MethodKind::AnchoredEkf, law),
            Self::Vector(vector, law, _) => trial::method(vector.into(), law),
        }
    }

    /// What steers it.
    #[must_use]
    pub fn law(self) -> Law {
        match self {
            Self::Paper(law) | Self::PaperUntold(law) | Self::Anchored(law) | Self::Vector(_, law, _) => law,
        }
    }
}

/// Where the bearings of a contest come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Objects in the set's images, interpolated between places, as in the paper.
    Images,
    /// The exact bearings of the points that explain the objects best.
    Points,
}

/// Times of one method.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which.
    pub entrant: Entrant,
    /// How many objects it sees.
    pub objects: usize,
    /// Time to Rc from each start, s; `None` where it did not come there.
    pub times_s: [Option<f64>; 4],
    /// Distance from home at the end of each run, m: Rc or a little less where it came home.
    pub ends_m: [f64; 4],
}

impl Row {
    /// Mean over the starts of time over straight-line time; `None` if it did not come home from all of them.
    #[must_use]
    pub fn mean_ratio(&self, straight_s: &[f64; 4]) -> Option<f64> {
        let ratios = self.times_s.iter().zip(straight_s).map(|(time, straight)| Some((*time)? / straight));
        ratios.collect::<Option<Vec<f64>>>().map(|r| r.iter().sum::<f64>() / r.len() as f64)
    }
}

/// One of the two parts of Fig. 8.
#[derive(Debug, Clone, PartialEq)]
pub struct Contest {
    /// Where bearings come from.
    pub source: Source,
    /// Time of the straight way from each start to Rc, s: no method at this speed is faster.
    pub straight_s: [f64; 4],
    /// All methods.
    pub rows: Vec<Row>,
}

impl Contest {
    /// The row of an entrant that sees the paper's three objects.
    #[must_use]
    pub fn row(&self, entrant: Entrant) -> Option<&Row> {
        self.rows.iter().find(|row| row.entrant == entrant && row.objects == 3)
    }
}

/// Runs all methods on a set's three objects, and then those that can use more on all of its objects.
///
/// # Errors
/// When the anchored filter cannot be built.
pub fn contest(case: &ImageCase, source: Source) -> Result<Contest> {
    let mut world = case.world.clone();
    (world.spec.task.control_period_s, world.spec.task.speed_m_s) = (PERIOD_S, SPEED_M_S);
    world.spec.robot.max_speed_m_s = SPEED_M_S;
    let points: Vec<Vector2<f64>> = case.field.objects.iter().filter_map(|o| case.field.fix(o)).map(|fix| fix.point).collect();
    let crowd = Entrant::all().into_iter().filter(|entrant| {
        matches!(entrant, Entrant::Anchored(_) | Entrant::Vector(VectorLaw::Alv | VectorLaw::Ibvs, _, Told::Compass))
    });
    let all = points.len();
    let entries: Vec<(Entrant, usize)> =
        Entrant::all().into_iter().map(|e| (e, 3)).chain(crowd.map(|e| (e, all)).filter(|_| all > 3)).collect();
    let enter = |&(entrant, objects): &(Entrant, usize)| -> Result<Row> {
        let exact = Ideal { landmarks: points[..objects.min(all)].to_vec(), starts: Vec::new(), world: world.clone() };
        let compass = entrant.told() == Told::Compass;
        let mut row = Row { entrant, objects, times_s: [None; 4], ends_m: [f64::NAN; 4] };
        for (k, &(_, start)) in case.starts.iter().enumerate() {
            let setup = entrant.setup(start);
            let track = match source {
                Source::Images => case.run(&world, &setup, start, objects, compass)?,
                Source::Points => {
                    let home = HomeSnapshot { bearings: exact.bearings(&Pose::IDENTITY) };
                    let look = Box::new(|pose: &Pose| exact.bearings(pose));
                    trial::run(&world, &setup, start, Eyes { home, look, compass })?
                }
            };
            (row.times_s[k], row.ends_m[k]) = (track.time_s(), track.final_distance_m());
        }
        Ok(row)
    };
    let rows = entries.par_iter().map(enter).collect::<Result<_>>()?;
    let task = &world.spec.task;
    let straight = |k: usize| (case.starts[k].1.position().norm() - task.arrival_radius_m) / task.speed_m_s;
    Ok(Contest { source, straight_s: std::array::from_fn(straight), rows })
}
