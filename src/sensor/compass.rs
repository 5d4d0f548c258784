//! A compass beside any sensor of bearings.

use super::Sensor;
use crate::error::Result;
use crate::geometry::{Pose, wrap};
use crate::observation::{Bearing, HomeSnapshot};
use crate::random::{Seed, Stream, standard_normal};

/// A sensor with a compass that was set at home: it tells the heading in the home frame, with normal noise of its own.
pub struct CompassSensor<'a> {
    sensor: Box<dyn Sensor + 'a>,
    home: Pose,
    sd_rad: f64,
    noise: Stream,
}

impl<'a> CompassSensor<'a> {
    /// Adds a compass with readings of standard deviation `sd_rad` to `sensor`, for a home at `home` in the room.
    pub fn new(sensor: Box<dyn Sensor + 'a>, home: Pose, sd_rad: f64) -> Self {
        Self { sensor, home, sd_rad, noise: compass_noise(Seed(0)) }
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

    fn inner(&self) -> Option<&dyn Sensor> {
        Some(self.sensor.as_ref())
    }
}
