//! Section IV-A: three point landmarks, accurate bearings, four starts, both laws. Table I and Fig. 3.

use super::trial::{self, Eyes, Track, paper_ekf, unlimited};
use super::{LAWS, STARTS};
use crate::control::{BETA, Law};
use crate::episode::Setup;
use crate::error::{Error, Result};
use crate::estimation::paper::PaperSettings;
use crate::geometry::{Pose, Vector2, angle_of};
use crate::method::MethodKind;
use crate::observation::{Bearing, HomeSnapshot, LandmarkId};
use crate::random::{Seed, Stream, standard_normal};
use crate::world::World;

/// The setting: landmarks around home, and the world whose task the runs have.
#[derive(Debug, Clone, PartialEq)]
pub struct Ideal {
    /// Landmarks in the home frame, m.
    pub landmarks: Vec<Vector2<f64>>,
    /// The starts by name, in the home frame.
    pub starts: Vec<(&'static str, Pose)>,
    /// Home, Ts, v, Rc and the time limit.
    pub world: World,
}

/// One run of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Name of the start.
    pub start: &'static str,
    /// Law that steered.
    pub law: Law,
    /// What came of it.
    pub track: Track,
}

/// How a run departs from the paper's Table I. The default does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twists {
    /// Settings of the filter.
    pub settings: PaperSettings,
    /// Beta of (16).
    pub beta: f64,
    /// Standard deviation of normal noise on every bearing, at home too, rad, and the seed of it.
    pub noise: Option<(f64, u64)>,
}

impl Default for Twists {
    fn default() -> Self {
        Self { settings: PaperSettings::default(), beta: BETA, noise: None }
    }
}

impl Ideal {
    /// The setting of a built-in world that has the starts P1 to P4; its landmarks count as points and hide nothing.
    ///
    /// # Errors
    /// When the world lacks one of the starts, or has fewer than three landmarks.
    pub fn of(world: &World) -> Result<Self> {
        let home = world.home;
        let landmarks: Vec<_> = world.landmarks().iter().map(|body| home.inverse_transform(body.pose.position())).collect();
        if landmarks.len() < 3 {
            return Err(Error::Unfit {
                what: format!("landmarks of world `{}`", world.spec.name),
                found: landmarks.len().to_string(),
                needed: "at least 3".into(),
            });
        }
        let starts = STARTS.into_iter().map(|name| Ok((name, home.to_local(&world.named_start(name)?))));
        Ok(Self { landmarks, starts: starts.collect::<Result<_>>()?, world: unlimited(world) })
    }

    /// The exact bearings from a pose in the home frame.
    #[must_use]
    pub fn bearings(&self, pose: &Pose) -> Vec<Bearing> {
        let bearing = |(k, landmark): (usize, &Vector2<f64>)| Bearing {
            id: LandmarkId(k as u32),
            azimuth_rad: angle_of(pose.inverse_transform(*landmark)),
            sd_rad: 1e-4,
        };
        self.landmarks.iter().enumerate().map(bearing).collect()
    }

    /// One run of `setup` from `start` (home frame), with the landmarks' bearings and normal noise of a standard deviation (rad) and
    /// a seed.
    ///
    /// # Errors
    /// When the method needs more landmarks than there are.
    pub fn run(&self, setup: &Setup, start: Pose, noise: Option<(f64, u64)>) -> Result<Track> {
        let mut noise = noise.map(|(sd_rad, seed)| (sd_rad, Seed(seed).stream("paper bearings")));
        let mut look = move |pose: &Pose| {
            let mut seen = self.bearings(pose);
            if let Some((sd_rad, stream)) = &mut noise {
                blur(&mut seen, *sd_rad, stream);
            }
            seen
        };
        let home = HomeSnapshot { bearings: look(&Pose::IDENTITY) };
        trial::run(&self.world, setup, start, Eyes { home, look: Box::new(look), compass: false })
    }

    /// The paper's filter from all starts with both laws; `initial` says where it is started for a run that starts at its argument.
    ///
    /// # Errors
    /// When there are fewer than three landmarks.
    pub fn runs(&self, twists: &Twists, initial: impl Fn(&Pose) -> Pose) -> Result<Vec<Run>> {
        self.each(|law, start| self.run(&paper_ekf(law, twists.beta, twists.settings, initial(&start)), start, twists.noise))
    }

    /// The anchored filter from all starts with both laws, told nothing.
    ///
    /// # Errors
    /// When there are fewer than three landmarks.
    pub fn anchored(&self) -> Result<Vec<Run>> {
        self.each(|law, start| self.run(&trial::method(MethodKind::AnchoredEkf, law), start, None))
    }

    fn each(&self, run: impl Fn(Law, Pose) -> Result<Track>) -> Result<Vec<Run>> {
        let all = LAWS.into_iter().flat_map(|law| self.starts.iter().map(move |&(name, start)| (law, name, start)));
        all.map(|(law, name, start)| Ok(Run { start: name, law, track: run(law, start)? })).collect()
    }

    /// Table I: the filter started at the true pose.
    ///
    /// # Errors
    /// When there are fewer than three landmarks.
    pub fn table_one(&self) -> Result<Vec<Run>> {
        self.runs(&Twists::default(), |start| *start)
    }
}

fn blur(seen: &mut [Bearing], sd_rad: f64, stream: &mut Stream) {
    for bearing in seen {
        bearing.azimuth_rad = crate::geometry::wrap(bearing.azimuth_rad + sd_rad * standard_normal(stream));
        bearing.sd_rad = sd_rad;
    }
}
