//! Sensors of bearings: where the truth becomes an observation.
//!
//! A sensor belongs to the simulator, so it sees the true poses; what it gives to the method are bearings only. Four kinds:
//! [`RenderedSensor`] looks through the camera and the feature extractor, [`DatasetSensor`] at panoramas on disk, [`IdealSensor`] takes the bearings of the landmark
//! bodies from geometry, and [`NoisySensor`] spoils those with noise, drop-outs and false matches. A [`DegradedSensor`] makes any
//! of them worse, for studies of robustness; a [`CompassSensor`] adds a compass to any of them.
//!
//! Knows of: the true world, the renderer, the extractor and panorama sets. Must not know of methods.

mod camera;
mod compass;
mod dataset;
mod degraded;
mod ideal;
mod noisy;
mod rendered;
mod sight;

pub use camera::CameraSensor;
pub use compass::CompassSensor;
pub use dataset::{DatasetChoice, DatasetField, DatasetSensor};
pub use degraded::{Degradation, DegradedSensor};
pub use ideal::IdealSensor;
pub use noisy::{Noise, NoisySensor};
pub use rendered::{RenderedSensor, Sight};

use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::observation::{Bearing, HomeSnapshot};
use crate::panorama::Panorama;
use crate::random::Seed;
use crate::render::RendererInfo;

/// A source of bearings. It is [reset](Sensor::reset) before each run, and only then used.
pub trait Sensor: Send {
    /// Readies the sensor for a run: takes the home snapshot, with all bodies where they stand at time 0, and draws from `seed` all
    /// that is random. After the same seed it tells the same.
    ///
    /// # Errors
    /// When a renderer fails.
    fn reset(&mut self, seed: Seed) -> Result<()> {
        let _ = seed;
        Ok(())
    }

    /// What was seen at home; empty before the first reset.
    fn home(&self) -> &HomeSnapshot;

    /// Bearings from the true pose `truth` in the room, with the bodies at `bodies` in the order of `World::bodies`. Each id
    /// comes at most once.
    ///
    /// # Errors
    /// When a renderer fails.
    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>>;

    /// What the last look may show instead: further sets of bearings, each id at most once in each, likeliest first. Empty for a
    /// sensor that does not mistake one landmark for another.
    fn alternatives(&self) -> &[Vec<Bearing>] {
        self.inner().map_or(&[], Sensor::alternatives)
    }

    /// Heading in the home frame, rad, of a robot whose true pose in the room is `truth`; `None` without a compass.
    fn compass_rad(&mut self, _truth: Pose) -> Option<f64> {
        None
    }

    /// The sensor whose bearings this one changes: what it does not say itself of a camera, that one says.
    fn inner(&self) -> Option<&dyn Sensor> {
        None
    }

    /// The panorama from home, where the sensor has a camera.
    fn home_panorama(&self) -> Option<&Panorama> {
        self.inner()?.home_panorama()
    }

    /// The last panorama seen, where the sensor has a camera.
    fn panorama(&self) -> Option<&Panorama> {
        self.inner()?.panorama()
    }

    /// What renders, where the sensor has a camera.
    fn renderer(&self) -> Option<&RendererInfo> {
        self.inner()?.renderer()
    }

    /// Wall-clock time spent in `observe` so far.
    fn timing(&self) -> SensorTiming {
        self.inner().map_or_else(SensorTiming::default, Sensor::timing)
    }
}

/// Sees nothing.
#[derive(Default)]
pub(crate) struct Blind(HomeSnapshot);

impl Sensor for Blind {
    fn home(&self) -> &HomeSnapshot {
        &self.0
    }

    fn observe(&mut self, _truth: Pose, _bodies: &[Pose]) -> Result<Vec<Bearing>> {
        Ok(Vec::new())
    }
}

/// Wall-clock time that a sensor has taken.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SensorTiming {
    /// Rendering, s.
    pub render_s: f64,
    /// Turning panoramas into bearings, s.
    pub vision_s: f64,
}

/// Refuses a share or a probability that is none.
pub(crate) fn check_share(what: &str, share: f64) -> Result<()> {
    let fault = || Error::Invalid { what: what.into(), found: share.to_string(), allowed: "0 to 1".into() };
    if (0.0..=1.0).contains(&share) { Ok(()) } else { Err(fault()) }
}

/// Refuses a standard deviation of an angle that is none.
pub(crate) fn check_deviation(what: &str, sd_rad: f64) -> Result<()> {
    let fault = || Error::Invalid { what: what.into(), found: format!("{sd_rad} rad"), allowed: "0 or more".into() };
    if sd_rad >= 0.0 && sd_rad.is_finite() { Ok(()) } else { Err(fault()) }
}
