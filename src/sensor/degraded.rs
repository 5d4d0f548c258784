//! Any sensor, made worse on purpose.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use rand::RngExt;

use super::{Sensor, check_deviation, check_share};
use crate::error::Result;
use crate::geometry::{Pose, wrap};
use crate::observation::{Bearing, HomeSnapshot, LandmarkId};
use crate::random::{Seed, Stream, standard_normal};

/// What is done to the bearings of a sensor, on top of the faults that they have anyway.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Degradation {
    /// Share of the home snapshot's landmarks that are never seen on the way.
    pub hidden: f64,
    /// Share of bearings that are given the azimuth of another landmark, or one out of nowhere.
    pub false_match: f64,
    /// Standard deviation of the normal noise that is added to each bearing, at home too, rad. The sensor knows of it: the
    /// standard deviations that it states grow accordingly.
    pub noise_sd_rad: f64,
}

impl Degradation {
    /// Whether nothing is done.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Checks that the shares are shares and that the noise is a standard deviation.
    ///
    /// # Errors
    /// When a value is out of its range.
    pub fn check(&self) -> Result<()> {
        check_share("share of hidden landmarks", self.hidden)?;
        check_share("share of false matches", self.false_match)?;
        check_deviation("added noise of bearings", self.noise_sd_rad)
    }
}

/// A sensor whose bearings are hidden, confused and blurred.
///
/// Which landmarks are hidden is drawn once a run: with the same seed, a greater share hides the same ones and more. False
/// matches and noise are drawn anew for each bearing.
pub struct DegradedSensor<'a> {
    sensor: Box<dyn Sensor + 'a>,
    home: HomeSnapshot,
    degradation: Degradation,
    seed: Seed,
    /// Landmarks whose key is not above this are hidden.
    hidden_up_to: f64,
    hidden: BTreeMap<LandmarkId, bool>,
    false_match: Stream,
    normal: Stream,
    /// The other readings of the last view, and the noise of them.
    alternatives: Vec<Vec<Bearing>>,
    other_normal: Stream,
}

impl<'a> DegradedSensor<'a> {
    /// Makes `sensor` worse.
    pub fn new(sensor: Box<dyn Sensor + 'a>, degradation: Degradation) -> Self {
        let seed = Seed(0);
        Self {
            sensor,
            home: HomeSnapshot::default(),
            degradation,
            seed,
            hidden_up_to: -1.0,
            hidden: BTreeMap::new(),
            false_match: seed.stream("false-match"),
            normal: seed.stream("noise"),
            alternatives: Vec::new(),
            other_normal: seed.stream("noise-alternatives"),
        }
    }

    /// Other readings of the view are of the same features: hidden with them, and as noisy. They are wrong matches anyway.
    fn spoil_alternatives(&mut self) {
        let mut readings = self.sensor.alternatives().to_vec();
        for reading in &mut readings {
            reading.retain(|b| !self.is_hidden(b.id));
            for bearing in reading {
                *bearing = blurred(*bearing, self.degradation.noise_sd_rad, standard_normal(&mut self.other_normal));
            }
        }
        self.alternatives = readings;
    }

    fn is_hidden(&mut self, id: LandmarkId) -> bool {
        let (seed, up_to) = (self.seed, self.hidden_up_to);
        *self.hidden.entry(id).or_insert_with(|| hiding_key(seed, id) <= up_to)
    }
}

/// A number in [0, 1) that is the landmark's own: those with the smallest ones are hidden. It is there for landmarks that are
/// first met on the way, too.
fn hiding_key(seed: Seed, id: LandmarkId) -> f64 {
    seed.stream(&format!("hidden-{}", id.0)).random()
}

/// The bearing moved by `deviations` standard deviations of noise that is independent of what it has already.
fn blurred(bearing: Bearing, sd_rad: f64, deviations: f64) -> Bearing {
    if sd_rad == 0.0 {
        return bearing;
    }
    Bearing {
        azimuth_rad: wrap(bearing.azimuth_rad + sd_rad * deviations),
        sd_rad: (bearing.sd_rad * bearing.sd_rad + sd_rad * sd_rad).sqrt(),
        ..bearing
    }
}

impl Sensor for DegradedSensor<'_> {
    fn reset(&mut self, seed: Seed) -> Result<()> {
        self.sensor.reset(seed)?;
        self.seed = seed.derive("degraded");
        self.home = self.sensor.home().clone();
        let mut at_home = self.seed.stream("noise-home");
        for bearing in &mut self.home.bearings {
            *bearing = blurred(*bearing, self.degradation.noise_sd_rad, standard_normal(&mut at_home));
        }
        let mut keys: Vec<f64> = self.home.bearings.iter().map(|b| hiding_key(self.seed, b.id)).collect();
        keys.sort_by(f64::total_cmp);
        let count = libm::round(self.degradation.hidden * keys.len() as f64) as usize;
        self.hidden_up_to = count.checked_sub(1).and_then(|last| keys.get(last)).copied().unwrap_or(-1.0);
        self.hidden.clear();
        (self.false_match, self.normal) = (self.seed.stream("false-match"), self.seed.stream("noise"));
        self.other_normal = self.seed.stream("noise-alternatives");
        self.alternatives.clear();
        Ok(())
    }

    fn home(&self) -> &HomeSnapshot {
        &self.home
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        let mut seen = self.sensor.observe(truth, bodies)?;
        seen.retain(|b| !self.is_hidden(b.id));
        let others: Vec<f64> = seen.iter().map(|b| b.azimuth_rad).collect();
        for (k, bearing) in seen.iter_mut().enumerate() {
            // All numbers are drawn whatever comes of them, so that a greater share changes more bearings and not others.
            let [is_false, kind, which] = std::array::from_fn(|_| self.false_match.random::<f64>());
            let deviations = standard_normal(&mut self.normal);
            if is_false < self.degradation.false_match {
                // A wrong match is most often with something that looks alike, which is another landmark; else with anything.
                let another = kind < 0.5 && others.len() > 1;
                bearing.azimuth_rad = if another {
                    let step = 1 + (which * (others.len() - 1) as f64) as usize;
                    others[(k + step) % others.len()]
                } else {
                    PI - TAU * which
                };
            }
            *bearing = blurred(*bearing, self.degradation.noise_sd_rad, deviations);
        }
        self.spoil_alternatives();
        Ok(seen)
    }

    fn inner(&self) -> Option<&dyn Sensor> {
        Some(self.sensor.as_ref())
    }

    fn alternatives(&self) -> &[Vec<Bearing>] {
        &self.alternatives
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sees 200 landmarks all round, from anywhere, exactly.
    struct Carousel(HomeSnapshot);

    impl Carousel {
        fn new() -> Self {
            let azimuth = |k: u32| wrap(TAU * f64::from(k) / 200.0);
            let bearing = |k: u32| Bearing { id: LandmarkId(k), azimuth_rad: azimuth(k), sd_rad: 0.003 };
            Self(HomeSnapshot { bearings: (0..200).map(bearing).collect() })
        }
    }

    impl Sensor for Carousel {
        fn home(&self) -> &HomeSnapshot {
            &self.0
        }
        fn observe(&mut self, _: Pose, _: &[Pose]) -> Result<Vec<Bearing>> {
            Ok(self.0.bearings.clone())
        }
    }

    fn sensor(degradation: Degradation, seed: u64) -> DegradedSensor<'static> {
        let mut sensor = DegradedSensor::new(Box::new(Carousel::new()), degradation);
        sensor.reset(Seed(seed)).unwrap();
        sensor
    }

    fn look(sensor: &mut DegradedSensor<'_>) -> Vec<Bearing> {
        sensor.observe(Pose::IDENTITY, &[]).unwrap()
    }

    fn ids(seen: &[Bearing]) -> Vec<u32> {
        seen.iter().map(|b| b.id.0).collect()
    }

    #[test]
    fn the_same_landmarks_stay_hidden_and_more_of_them_with_a_greater_share() {
        let mut less = sensor(Degradation { hidden: 0.3, ..Degradation::default() }, 1);
        let mut more = sensor(Degradation { hidden: 0.7, ..Degradation::default() }, 1);
        let (first, few) = (look(&mut less), look(&mut more));
        assert_eq!((first.len(), few.len()), (140, 60));
        assert_eq!(first, look(&mut less));
        assert!(few.iter().all(|b| first.contains(b)));
        assert_eq!(less.home(), &Carousel::new().0, "home was seen before");
        let another = look(&mut sensor(Degradation { hidden: 0.3, ..Degradation::default() }, 2));
        assert_ne!(ids(&another), ids(&first));
        assert_eq!(look(&mut sensor(Degradation { hidden: 1.0, ..Degradation::default() }, 1)), []);
    }

    #[test]
    fn faults_come_as_often_and_as_large_as_asked_for() {
        let truth = Carousel::new().0.bearings;
        let noise_sd_rad = 0.004;
        let mut worse = sensor(Degradation { hidden: 0.0, false_match: 0.25, noise_sd_rad }, 3);
        let (mut wrong, mut square, mut steps) = (0.0, 0.0, 0.0);
        for _ in 0..200 {
            for (seen, true_one) in look(&mut worse).iter().zip(&truth) {
                assert!((seen.sd_rad - 0.005).abs() < 1e-12, "0.003 and 0.004 make 0.005");
                let error = wrap(seen.azimuth_rad - true_one.azimuth_rad);
                steps += 1.0;
                if error.abs() > 5.0 * noise_sd_rad {
                    wrong += 1.0;
                } else {
                    square += error * error;
                }
            }
        }
        // A direction out of nowhere may by chance be near the right one; so may a neighbour's not be: they are 31 mrad apart.
        let by_chance = 0.25 * 0.5 * 10.0 * noise_sd_rad / TAU;
        let share: f64 = wrong / steps + by_chance;
        assert!((share - 0.25).abs() < 0.01, "{share}");
        let sd: f64 = (square / (steps - wrong)).sqrt();
        assert!((sd / noise_sd_rad - 1.0).abs() < 0.05, "{sd}");
        assert!(worse.home().bearings.iter().zip(&truth).all(|(b, t)| b.azimuth_rad != t.azimuth_rad && b.sd_rad > 0.0049));
    }

    #[test]
    fn nothing_asked_for_nothing_done() {
        let mut same = sensor(Degradation::default(), 4);
        assert_eq!(look(&mut same), Carousel::new().0.bearings);
        assert!(Degradation { hidden: 1.1, ..Degradation::default() }.check().is_err());
        assert!(Degradation { noise_sd_rad: f64::NAN, ..Degradation::default() }.check().is_err());
    }
}
