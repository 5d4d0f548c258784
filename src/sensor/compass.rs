//! A compass beside any sensor of bearings.

use super::{Sensor, SensorTiming};
use crate::error::{Error, Result};
use crate::geometry::{Pose, wrap};
use crate::observation::{Bearing, HomeSnapshot};
use crate::panorama::Panorama;
use crate::random::{Seed, Stream, standard_normal};
use crate::render::RendererInfo;

/// A sensor with a compass that was set at home: it tells the heading in the home frame, with normal noise of its own.
pub struct CompassSensor<'a> {
    sensor: Box<dyn Sensor + 'a>,
    home: Pose,
    sd_rad: f64,
    noise: Stream,
}

impl<'a> CompassSensor<'a> {
    /// Adds a compass with readings of standard deviation `sd_rad` to `sensor`, for a home at `home` in the room.
    ///
    /// # Errors
    /// When the standard deviation is negative or not finite.
    pub fn new(sensor: Box<dyn Sensor + 'a>, home: Pose, sd_rad: f64) -> Result<Self> {
        if !(sd_rad >= 0.0 && sd_rad.is_finite()) {
            return Err(Error::Invalid {
                what: "noise of the compass".into(),
                found: format!("{sd_rad} rad"),
                allowed: "0 or more".into(),
            });
        }
        Ok(Self { sensor, home, sd_rad, noise: compass_noise(Seed(0)) })
    }
}

/// The noise of the readings in a run of `seed`.
fn compass_noise(seed: Seed) -> Stream {
    seed.stream("compass")
}

impl Sensor for CompassSensor<'_> {
    fn reset(&mut self, seed: Seed) -> Result<()> {
        self.noise = compass_noise(seed);
        self.sensor.reset(seed)
    }

    fn home(&self) -> &HomeSnapshot {
        self.sensor.home()
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        self.sensor.observe(truth, bodies)
    }

    fn compass_rad(&mut self, truth: Pose) -> Option<f64> {
        Some(wrap(truth.heading - self.home.heading + self.sd_rad * standard_normal(&mut self.noise)))
    }

    fn home_panorama(&self) -> Option<&Panorama> {
        self.sensor.home_panorama()
    }

    fn panorama(&self) -> Option<&Panorama> {
        self.sensor.panorama()
    }

    fn renderer(&self) -> Option<&RendererInfo> {
        self.sensor.renderer()
    }

    fn timing(&self) -> SensorTiming {
        self.sensor.timing()
    }
}
