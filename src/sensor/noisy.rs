//! Bearings from geometry, spoiled.

use std::f64::consts::{PI, TAU};

use rand::RngExt;

use super::{IdealSensor, Sensor};
use crate::error::Result;
use crate::geometry::{Pose, wrap};
use crate::observation::{Bearing, HomeSnapshot};
use crate::random::{Seed, Stream, standard_normal};

/// How bearings are spoiled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of a bearing, rad.
    pub sd_rad: f64,
    /// Probability that a visible landmark is missed in a step.
    pub dropout: f64,
    /// Probability that a bearing is a false match: evenly distributed over all directions.
    pub false_match: f64,
}

impl Default for Noise {
    /// What a matcher of image features in a room of some metres does: 0.3 degrees, 5 % missed, 2 % false.
    fn default() -> Self {
        Self { sd_rad: 0.3_f64.to_radians(), dropout: 0.05, false_match: 0.02 }
    }
}

/// The ideal sensor's bearings with normal noise, drop-outs and false matches. The home snapshot has the noise only, as it can
/// be taken at leisure.
///
/// Each fault draws from a stream of its own, as often for a hidden landmark as for a visible one, so that another path through
/// the room never shifts the draws.
#[derive(Debug, Clone)]
pub struct NoisySensor<'a> {
    ideal: IdealSensor<'a>,
    home: HomeSnapshot,
    landmarks: u32,
    noise: Noise,
    normal: Stream,
    dropout: Stream,
    false_match: Stream,
}

impl<'a> NoisySensor<'a> {
    /// Spoils `ideal`, whose world has `landmarks` landmarks, as a run of `seed` has it.
    pub fn new(ideal: IdealSensor<'a>, landmarks: usize, noise: Noise, seed: Seed) -> Self {
        let mut at_home = seed.stream("bearing-noise-home");
        let mut home = ideal.home().clone();
        for bearing in &mut home.bearings {
            *bearing = blurred(*bearing, noise.sd_rad, standard_normal(&mut at_home));
        }
        Self {
            ideal,
            home,
            landmarks: landmarks as u32,
            noise,
            normal: seed.stream("bearing-noise"),
            dropout: seed.stream("bearing-dropout"),
            false_match: seed.stream("bearing-false-match"),
        }
    }
}

/// The bearing moved by `deviations` standard deviations; it states the larger of both standard deviations.
fn blurred(bearing: Bearing, sd_rad: f64, deviations: f64) -> Bearing {
    Bearing { azimuth_rad: wrap(bearing.azimuth_rad + sd_rad * deviations), sd_rad: bearing.sd_rad.max(sd_rad), ..bearing }
}

impl Sensor for NoisySensor<'_> {
    fn reset(&mut self, seed: Seed) -> Result<()> {
        *self = Self::new(self.ideal.clone(), self.landmarks as usize, self.noise, seed);
        Ok(())
    }

    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        let mut visible = self.ideal.observe(truth, bodies)?.into_iter().peekable();
        let mut bearings = Vec::new();
        for id in 0..self.landmarks {
            let deviations = standard_normal(&mut self.normal);
            let missed = self.dropout.random::<f64>() < self.noise.dropout;
            let (is_false, where_to) = (self.false_match.random::<f64>(), self.false_match.random::<f64>());
            let Some(bearing) = visible.next_if(|b| b.id.0 == id) else { continue };
            if missed {
                continue;
            }
            let mut bearing = blurred(bearing, self.noise.sd_rad, deviations);
            if is_false < self.noise.false_match {
                bearing.azimuth_rad = PI - TAU * where_to;
            }
            bearings.push(bearing);
        }
        Ok(bearings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn faults_come_as_often_as_they_are_asked_for() {
        let world = World::load("worlds/lab.toml".as_ref()).unwrap();
        let noise = Noise { sd_rad: 0.01, dropout: 0.2, false_match: 0.1 };
        let (truth, bodies) = (world.home, world.body_poses());
        let ideal = IdealSensor::new(&world).observe(truth, &bodies).unwrap();
        let mut sensor = NoisySensor::new(IdealSensor::new(&world), world.landmark_count, noise, Seed(1));
        let (mut seen, mut wrong, mut square) = (0.0, 0.0, 0.0);
        let steps = 2000.0;
        for _ in 0..2000 {
            for b in sensor.observe(truth, &bodies).unwrap() {
                let error = wrap(b.azimuth_rad - ideal.iter().find(|i| i.id == b.id).unwrap().azimuth_rad);
                seen += 1.0;
                if error.abs() > 0.06 {
                    wrong += 1.0;
                } else {
                    square += error * error;
                }
            }
        }
        let expected = steps * ideal.len() as f64;
        assert!((seen / expected - 0.8).abs() < 0.02, "{seen} of {expected}");
        assert!((wrong / seen - 0.1 * (1.0 - 0.06 / PI)).abs() < 0.02, "{wrong} of {seen}");
        let sd: f64 = (square / (seen - wrong)).sqrt();
        assert!((sd - 0.01).abs() < 1e-3, "{sd}");
    }
}
