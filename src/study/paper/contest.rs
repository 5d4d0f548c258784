//! Section IV-C, Fig. 8: how long each method takes home from the same starts, at the same speed, under the same limit of the turn
//! rate.
//!
//! The paper compares itself with a "bearing only method" and an "ALV method" of its reference list, which is not in the text; as
//! we read it these are visual servoing with a constant range (Liu et al. 2010) and an average landmark vector on image features. What
//! a method knows decides much, so it stands beside each: the paper's filter is given the true start, the vector laws may have a
//! compass, the anchored filter has nothing.

use rayon::prelude::*;
use strum::IntoStaticStr;

use super::LAWS;
use super::course::{Course, StartError, Variant};
use super::ideal::Ideal;
use super::images::ImageCase;
use super::trial::{self, Eyes};
use crate::control::Law;
use crate::control::vectors::VectorLaw;
use crate::episode::Setup;
use crate::error::Result;
use crate::geometry::Pose;
use crate::method::MethodKind;
use crate::statistics::mean;

/// Ts of Fig. 8, s.
const PERIOD_S: f64 = 0.01;
/// Speed of Fig. 8, m/s.
const SPEED_M_S: f64 = 0.10;

/// What a method is told beside bearings and odometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr)]
pub enum Told {
    /// The true pose at the start.
    #[strum(serialize = "the true start")]
    Start,
    /// The true heading all the way.
    #[strum(serialize = "a perfect compass")]
    Compass,
    /// Nothing; the paper's filter is then started at R = 50 cm, theta = 0.1, alpha = 0.
    #[strum(serialize = "nothing")]
    Nothing,
}

/// A method with its steering and what it is told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entrant {
    /// What decides.
    pub method: MethodKind,
    /// What steers it.
    pub law: Law,
    /// What it is told.
    pub told: Told,
}

impl Entrant {
    /// All, in the order of the table.
    pub fn all() -> Vec<Self> {
        let filters = [
            (MethodKind::PaperEkf, Told::Start),
            (MethodKind::PaperEkf, Told::Nothing),
            (MethodKind::AnchoredEkf, Told::Nothing),
        ];
        let vectors = [Told::Compass, Told::Nothing].map(|told| VectorLaw::ALL.map(|vector| (MethodKind::from(vector), told)));
        let methods = filters.into_iter().chain(vectors.into_iter().flatten());
        methods.flat_map(|(method, told)| LAWS.map(|law| Self { method: method.clone(), law, told })).collect()
    }

    /// Whether it steers by a homing vector and estimates nothing.
    pub fn is_vector(&self) -> bool {
        !matches!(self.method, MethodKind::PaperEkf | MethodKind::AnchoredEkf)
    }

    /// Whether it is shown on all objects too.
    fn can_use_more(&self) -> bool {
        match self.method {
            MethodKind::AnchoredEkf => true,
            MethodKind::Alv | MethodKind::Ibvs => self.told == Told::Compass,
            _ => false,
        }
    }

    /// The same as a setup of a run from `start` (home frame).
    fn setup(&self, start: &Pose) -> Setup {
        match (&self.method, self.told) {
            (MethodKind::PaperEkf, Told::Start) => Variant::of_images().setup(self.law, start),
            (MethodKind::PaperEkf, _) => Variant::of_images().started(StartError::Untold).setup(self.law, start),
            (method, _) => trial::method(method.clone(), self.law),
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
    /// Mean over the starts of time over straight-line time; `None` if it did not come home from all of them.
    pub mean_ratio: Option<f64>,
}

impl Row {
    /// From how many starts it came home.
    pub fn home(&self) -> usize {
        self.times_s.iter().flatten().count()
    }
}

/// One of the two parts of Fig. 8.
#[derive(Debug, Clone, PartialEq)]
pub struct Contest {
    /// Time of the straight way from each start to Rc, s: no method at this speed is faster.
    pub straight_s: [f64; 4],
    /// All methods.
    pub rows: Vec<Row>,
}

impl Contest {
    /// The row of a method that sees the paper's three objects.
    pub fn row(&self, method: &MethodKind, law: Law, told: Told) -> Option<&Row> {
        let is = |e: &Entrant| e.method == *method && e.law == law && e.told == told;
        self.rows.iter().find(|row| is(&row.entrant) && row.objects == 3)
    }
}

/// Runs all methods on a set's three objects, and then those that can use more on all of its objects.
///
/// # Errors
/// When the set has fewer than three objects.
pub fn contest(case: &ImageCase, source: Source) -> Result<Contest> {
    let mut world = case.world.clone();
    (world.spec.task.control_period_s, world.spec.task.speed_m_s) = (PERIOD_S, SPEED_M_S);
    world.spec.robot.max_speed_m_s = SPEED_M_S;
    let fixes = case.field.objects.iter().filter_map(|o| case.field.fix(o));
    let landmarks: Vec<_> = fixes.map(|fix| fix.point).collect();
    let all = landmarks.len();
    let exact = Ideal { landmarks, starts: case.starts.clone(), world: world.clone(), noise: None };
    let course: &(dyn Course + Sync) = match source {
        Source::Images => case,
        Source::Points => &exact,
    };
    let crowd = Entrant::all().into_iter().filter(|entrant| all > 3 && entrant.can_use_more());
    let entries: Vec<(Entrant, usize)> = Entrant::all().into_iter().map(|e| (e, 3)).chain(crowd.map(|e| (e, all))).collect();
    let straight_s: [f64; 4] = std::array::from_fn(|k| trial::straight_s(&case.starts[k].1, &world.spec.task));
    let enter = |(entrant, objects): (Entrant, usize)| -> Result<Row> {
        let (mut times_s, mut ends_m) = ([None; 4], [f64::NAN; 4]);
        for (k, (_, start)) in case.starts.iter().enumerate() {
            let eyes = Eyes { compass: entrant.told == Told::Compass, ..course.eyes(objects) };
            let track = trial::run(&world, &entrant.setup(start), *start, eyes)?;
            (times_s[k], ends_m[k]) = (track.time_s(), track.final_distance_m());
        }
        let ratios = times_s.iter().zip(straight_s).map(|(time, straight)| Some((*time)? / straight));
        let mean_ratio = ratios.collect::<Option<Vec<f64>>>().and_then(mean);
        Ok(Row { entrant, objects, times_s, ends_m, mean_ratio })
    };
    Ok(Contest { straight_s, rows: entries.into_par_iter().map(enter).collect::<Result<_>>()? })
}
