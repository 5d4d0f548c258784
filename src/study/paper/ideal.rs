//! Section IV-A: three point landmarks, accurate bearings, four starts, both laws. Table I and Fig. 3.

use super::course::{Course, Starts, starts};
use super::trial::{Eyes, Track, unlimited};
use crate::error::{Error, Result};
use crate::estimation::observability::observability;
use crate::geometry::{Pose, Vector2, angle_of, wrap};
use crate::observation::{Bearing, HomeSnapshot, LandmarkId};
use crate::random::{Seed, Stream, standard_normal};
use crate::statistics::mean;
use crate::world::World;

/// The setting: landmarks around home, and the world whose task the runs have.
#[derive(Debug, Clone, PartialEq)]
pub struct Ideal {
    /// Landmarks in the home frame, m.
    pub landmarks: Vec<Vector2<f64>>,
    /// The starts.
    pub starts: Starts,
    /// Home, Ts, v, Rc and the time limit.
    pub world: World,
    /// Standard deviation of normal noise on every bearing, at home too, rad, and the seed of it. The paper has none.
    pub noise: Option<(f64, u64)>,
}

impl Ideal {
    /// The setting of a built-in world that has the starts P1 to P4; its landmarks count as points and hide nothing.
    ///
    /// # Errors
    /// When the world lacks one of the starts, or has fewer than three landmarks.
    pub fn of(world: &World) -> Result<Self> {
        let landmarks: Vec<_> = world.landmarks().iter().map(|l| world.home.inverse_transform(l.pose.position())).collect();
        if landmarks.len() < 3 {
            return Err(Error::Unfit {
                what: format!("landmarks of world `{}`", world.spec.name),
                found: landmarks.len().to_string(),
                needed: "at least 3".into(),
            });
        }
        Ok(Self { landmarks, starts: starts(world)?, world: unlimited(world), noise: None })
    }

    /// The mean distance of the landmarks from home, m.
    pub fn length_m(&self) -> f64 {
        mean(self.landmarks.iter().map(|l| l.norm())).unwrap_or_default()
    }

    /// Condition of the observability block over time (s) along a run.
    pub fn conditions(&self, track: &Track) -> Vec<[f64; 2]> {
        let length_m = self.length_m();
        let condition = |truth| observability(truth, &self.landmarks, true, length_m).condition;
        track.samples.iter().map(|s| [s.time_s, condition(&s.truth)]).collect()
    }
}

impl Course for Ideal {
    fn world(&self) -> &World {
        &self.world
    }

    fn starts(&self) -> &Starts {
        &self.starts
    }

    fn eyes(&self, landmarks: usize) -> Eyes<'_> {
        let mut noise = self.noise.map(|(sd_rad, seed)| (sd_rad, Seed(seed).stream("paper bearings")));
        let mut look = move |pose: &Pose| {
            let bearing = |(k, landmark): (usize, &Vector2<f64>)| Bearing {
                id: LandmarkId(k as u32),
                azimuth_rad: angle_of(pose.inverse_transform(*landmark)),
                sd_rad: 1e-4,
            };
            let mut seen: Vec<Bearing> = self.landmarks.iter().take(landmarks).enumerate().map(bearing).collect();
            if let Some((sd_rad, stream)) = &mut noise {
                blur(&mut seen, *sd_rad, stream);
            }
            seen
        };
        let home = HomeSnapshot { bearings: look(&Pose::IDENTITY) };
        Eyes { home_pose: self.world.home, home, look: Box::new(look), compass: false }
    }
}

fn blur(seen: &mut [Bearing], sd_rad: f64, stream: &mut Stream) {
    for bearing in seen {
        bearing.azimuth_rad = wrap(bearing.azimuth_rad + sd_rad * standard_normal(stream));
        bearing.sd_rad = sd_rad;
    }
}
