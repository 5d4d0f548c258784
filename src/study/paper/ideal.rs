//! Section IV-A: three point landmarks, accurate bearings, four starts, both laws. Table I and Fig. 3.

use super::trial::{PaperPilot, Terms, Track, anchored, drive};
use super::{BETA, LAWS, STARTS};
use crate::control::Law;
use crate::control::printed::PrintedLaw;
use crate::error::{Error, Result};
use crate::estimation::paper::PaperSettings;
use crate::geometry::{Pose, Vector2, angle_of};
use crate::observation::{Bearing, HomeSnapshot, LandmarkId};
use crate::random::{Seed, Stream, standard_normal};
use crate::world::World;

/// The setting: landmarks around home and the terms of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Ideal {
    /// Landmarks in the home frame, m.
    pub landmarks: Vec<Vector2<f64>>,
    /// The starts by name, in the home frame.
    pub starts: Vec<(&'static str, Pose)>,
    /// Ts, v, Rc and the limit.
    pub terms: Terms,
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
            return Err(Error::Invalid {
                what: format!("landmarks of world `{}`", world.spec.name),
                found: landmarks.len().to_string(),
                allowed: "at least 3".into(),
            });
        }
        let starts = STARTS.into_iter().map(|name| Ok((name, home.to_local(&world.named_start(name)?))));
        let task = &world.spec.task;
        let terms = Terms {
            period_s: task.control_period_s,
            speed_m_s: task.speed_m_s,
            radius_m: task.arrival_radius_m,
            limit_s: task.time_limit_s,
        };
        Ok(Self { landmarks, starts: starts.collect::<Result<_>>()?, terms })
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

    /// One run of the paper's filter, started at `initial`.
    #[must_use]
    pub fn run(&self, law: Law, start: Pose, initial: Pose, twists: &Twists) -> Track {
        let law = PrintedLaw { law, speed_m_s: self.terms.speed_m_s, radius_m: self.terms.radius_m, beta: twists.beta };
        let mut noise = twists.noise.map(|(sd_rad, seed)| (sd_rad, Seed(seed).stream("paper bearings")));
        let mut look = |pose: &Pose| {
            let mut seen = self.bearings(pose);
            if let Some((sd_rad, stream)) = &mut noise {
                blur(&mut seen, *sd_rad, stream);
            }
            seen
        };
        let home = HomeSnapshot { bearings: look(&Pose::IDENTITY) };
        match PaperPilot::new(law, twists.settings, &home, initial) {
            Some(mut pilot) => drive(&self.terms, start, &mut look, false, &mut pilot),
            None => Track { samples: Vec::new(), home: false, straight_s: 0.0 }, // fewer than three landmarks: `of` refuses them
        }
    }

    /// All starts and laws; `initial` says where the filter is started for a run that starts at its argument.
    #[must_use]
    pub fn runs(&self, twists: &Twists, initial: impl Fn(&Pose) -> Pose) -> Vec<Run> {
        let each = |law: Law| {
            let initial = &initial;
            self.starts.iter().map(move |&(name, start)| Run {
                start: name,
                law,
                track: self.run(law, start, initial(&start), twists),
            })
        };
        LAWS.into_iter().flat_map(each).collect()
    }

    /// The anchored filter from all starts with both laws, told nothing.
    ///
    /// # Errors
    /// When it cannot be built.
    pub fn anchored(&self) -> Result<Vec<Run>> {
        let home = HomeSnapshot { bearings: self.bearings(&Pose::IDENTITY) };
        let mut runs = Vec::new();
        for law in LAWS {
            for &(name, start) in &self.starts {
                let mut method = anchored(law, &self.terms, &home)?;
                let track = drive(&self.terms, start, &mut |pose| self.bearings(pose), false, method.as_mut());
                runs.push(Run { start: name, law, track });
            }
        }
        Ok(runs)
    }

    /// Table I: the filter started at the true pose.
    #[must_use]
    pub fn table_one(&self) -> Vec<Run> {
        self.runs(&Twists::default(), |start| *start)
    }
}

fn blur(seen: &mut [Bearing], sd_rad: f64, stream: &mut Stream) {
    for bearing in seen {
        bearing.azimuth_rad = crate::geometry::wrap(bearing.azimuth_rad + sd_rad * standard_normal(stream));
        bearing.sd_rad = sd_rad;
    }
}
