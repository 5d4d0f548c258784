//! The path of a run, the bound along the ways that runs take of it, and the filter on them.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use nalgebra::Vector3;

use super::{BoundSettings, PolarErrors};
use crate::episode::{BeliefError, Moment, Parts, PlantKind, Recorder, Setup, Simulation};
use crate::error::Result;
use crate::estimation::anchored::map::Prior;
use crate::estimation::anchored::motion::{Motion, SlipWatch};
use crate::estimation::anchored::smoother::{Frame, Iterate, Sighting, Stretch};
use crate::estimation::anchored::{AnchoredFilter, FilterSettings};
use crate::geometry::{Matrix3, Pose, angle_of};
use crate::observation::{Bearing, Estimate, LandmarkId, Odometry};
use crate::random::{Seed, Stream, standard_normal};
use crate::sensor::{IdealSensor, NoisySensor, Sensor};
use crate::world::World;

/// Least noise of bearings, rad: what even the ideal sensor states.
pub(super) const LEAST_BEARING_SD_RAD: f64 = 1e-4;
/// Standard deviation of the prior on an inverse range, 1/m: none, in effect. A landmark at 10 cm has 10.
const NO_RANGE_PRIOR_SD: f64 = 100.0;
/// The same for the direction from home of a landmark that was not seen there, rad.
const NO_DIRECTION_PRIOR_SD: f64 = 100.0;

/// What a run of the filter makes of a step.
pub(super) struct StepErrors {
    pub(super) errors: PolarErrors,
    /// Of (x, y, heading); infinite where the covariance is not regular.
    pub(super) nees: f64,
    pub(super) nis: f64,
    pub(super) bearings: usize,
}

/// The path of a run.
pub(super) struct Path<'a> {
    world: &'a World,
    settings: &'a BoundSettings,
    filter: FilterSettings,
    steps: Vec<PathStep>,
}

/// One step of it.
struct PathStep {
    /// Pose in the room.
    truth: Pose,
    /// Motion since the step before.
    odometry: Odometry,
    /// Where the world's bodies stand.
    bodies: Vec<Pose>,
}

impl<'a> Path<'a> {
    /// Drives home once in closed loop, on a robot whose odometry tells the truth.
    pub(super) fn drive(world: &'a World, settings: &'a BoundSettings) -> Result<Self> {
        let setup = Setup { plant: PlantKind::Unicycle, start: settings.start.clone(), ..Setup::default() };
        let filter = settings.filter(world);
        let path = Self { world, settings, filter, steps: Vec::new() };
        let parts = Parts::with_sensor(world, setup.plant, Box::new(path.sensor(Seed(settings.path_seed))))?;
        let mut simulation = Simulation::from_parts(world, &setup, parts);
        let steps = Steps { period_s: world.spec.task.control_period_s, held: Arc::default() };
        simulation.record_to(steps.clone());
        simulation.run(settings.path_seed, &mut |_| ControlFlow::Continue(()))?;
        let steps = steps.held.lock().map(|mut held| std::mem::take(&mut *held)).unwrap_or_default();
        Ok(Self { steps, ..path })
    }

    /// What sees landmarks with the bound's noise.
    fn sensor(&self, seed: Seed) -> NoisySensor<'a> {
        NoisySensor::new(IdealSensor::new(self.world), self.world.landmark_count, self.settings.noise(), seed)
    }

    /// How many steps it has.
    pub(super) fn len(&self) -> usize {
        self.steps.len()
    }

    /// Time of step `k`, s.
    pub(super) fn time_s(&self, k: usize) -> f64 {
        k as f64 * self.world.spec.task.control_period_s
    }

    /// True pose in the home frame at step `k`.
    pub(super) fn truth(&self, k: usize) -> Pose {
        self.world.home.to_local(&self.steps[k].truth)
    }

    /// The steps as the filter's motion model has them.
    fn motions(&self) -> impl Iterator<Item = Motion> {
        let mut slip = SlipWatch::default();
        self.steps.iter().map(move |step| {
            let slip_m_s = slip.expect(&step.odometry, &self.filter);
            Motion::from_odometry(&step.odometry, slip_m_s, &self.filter)
        })
    }

    /// True poses in the room of the run with this seed.
    pub(super) fn way(&self, seed: Seed) -> Vec<Pose> {
        let mut straying = seed.derive("bound").stream("straying");
        let mut truth = self.steps[0].truth;
        let moves = self.steps.iter().zip(self.motions());
        moves
            .map(|(step, motion)| {
                if step.odometry.dt_s > 0.0 {
                    truth = truth.compose(&strayed(&motion, &mut straying));
                }
                truth
            })
            .collect()
    }

    /// The bound at each step of a run whose true poses in the room these are; `None` while the information is singular.
    pub(super) fn bounds(&self, way: &[Pose]) -> Result<Vec<Option<PolarErrors>>> {
        let mut sensor = IdealSensor::new(self.world);
        let variance = self.settings.bearing_sd_rad * self.settings.bearing_sd_rad;
        let looks = way.iter().zip(&self.steps);
        let seen: Vec<Vec<Bearing>> = looks.map(|(truth, step)| sensor.observe(*truth, &step.bodies)).collect::<Result<_>>()?;
        let mut ids: Vec<LandmarkId> = seen.iter().flatten().map(|b| b.id).collect();
        ids.sort_unstable();
        ids.dedup();
        let index: BTreeMap<LandmarkId, usize> = ids.iter().enumerate().map(|(k, id)| (*id, k)).collect();
        let (home, bodies) = (self.world.home, self.world.body_poses());
        let prior = |id: &LandmarkId| {
            let place = home.inverse_transform(bodies[id.0 as usize].position());
            let at_home = sensor.home().bearings.iter().any(|b| b.id == *id);
            let direction = if at_home { variance } else { NO_DIRECTION_PRIOR_SD * NO_DIRECTION_PRIOR_SD };
            let mean = [angle_of(place), 1.0 / place.norm()];
            Prior { mean, variance: [direction, NO_RANGE_PRIOR_SD * NO_RANGE_PRIOR_SD] }
        };
        let priors: Vec<Prior> = ids.iter().map(prior).collect();
        let landmarks: Vec<[f64; 2]> = priors.iter().map(|prior| prior.mean).collect();
        let sighting = |b: &Bearing| Sighting { landmark: index[&b.id], azimuth_rad: b.azimuth_rad, variance };
        let frame = |(motion, seen): (Motion, &Vec<Bearing>)| Frame { motion, sightings: seen.iter().map(sighting).collect() };
        let frames: Vec<Frame> = self.motions().zip(&seen).map(frame).collect();
        let poses: Vec<Pose> = way.iter().map(|truth| home.to_local(truth)).collect();
        let at = |k: usize| {
            let stretch = Stretch { frames: &frames[..=k], priors: &priors, heavy_tails: false };
            let truth = Iterate { poses: poses[..=k].to_vec(), landmarks: landmarks.clone() };
            let covariance: Matrix3<f64> = stretch.covariance_at(&truth)?.fixed_view::<3, 3>(0, 0).into_owned();
            let best = Estimate { pose: poses[k], covariance };
            let errors = [best.range_sd_m(), best.bearing_sd_rad(), best.heading_sd_rad()];
            errors.iter().all(|error| error.is_finite()).then(|| PolarErrors::new(errors))
        };
        Ok((0..self.len()).map(at).collect())
    }

    /// The filter's errors on a run's way, one a step where it has an estimate.
    pub(super) fn estimate(&self, seed: Seed, way: &[Pose]) -> Result<Vec<Option<StepErrors>>> {
        let mut sensor = self.sensor(seed.derive("bound"));
        let mut filter = AnchoredFilter::new(self.filter, sensor.home());
        let mut errors = |(step, truth): (&PathStep, &Pose)| {
            let report = filter.step(&step.odometry, &sensor.observe(*truth, &step.bodies)?);
            Ok(filter.estimate().map(|estimate| {
                let off = BeliefError::new(&estimate, &self.world.home.to_local(truth));
                StepErrors {
                    errors: PolarErrors::new([off.range_m, off.bearing_rad, off.heading_rad]),
                    nees: off.nees.unwrap_or(f64::INFINITY),
                    nis: report.nis,
                    bearings: report.matched,
                }
            }))
        };
        self.steps.iter().zip(way).map(&mut errors).collect()
    }
}

/// A step that the robot may really have made when odometry tells `motion`.
fn strayed(motion: &Motion, stream: &mut Stream) -> Pose {
    let normal = Vector3::from_fn(|_, _| standard_normal(stream));
    let off = motion.covariance.cholesky().map_or_else(Vector3::zeros, |c| c.l() * normal);
    Pose::new(motion.delta.x + off.x, motion.delta.y + off.y, motion.delta.heading + off.z)
}

/// Keeps the steps at which the robot looked.
#[derive(Clone)]
struct Steps {
    period_s: f64,
    held: Arc<Mutex<Vec<PathStep>>>,
}

impl Recorder for Steps {
    fn record(&mut self, moment: &Moment<'_>) -> Result<()> {
        if let (Some(_), Ok(mut held)) = (moment.step.seen, self.held.lock()) {
            let dt_s = if held.is_empty() { 0.0 } else { self.period_s };
            let odometry = Odometry { twist: moment.step.odometry, dt_s };
            held.push(PathStep { truth: moment.step.truth, odometry, bodies: moment.bodies.to_vec() });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What can only help does help, and the bound scales as the noise does.
    #[test]
    fn information_grows_with_time_and_falls_with_noise() {
        let settings = BoundSettings { path_seed: 3, ..BoundSettings::default() };
        let world = World::open("lab").unwrap();
        let path = Path::drive(&world, &settings).unwrap();
        let straight: Vec<Pose> = path.steps.iter().map(|step| step.truth).collect();
        let bounds = path.bounds(&straight).unwrap();
        let usual = bounds.last().copied().flatten().unwrap();
        let twice = BoundSettings {
            bearing_sd_rad: 2.0 * settings.bearing_sd_rad,
            odometry_share: 2.0 * settings.odometry_share,
            ..settings.clone()
        };
        let louder = Path { settings: &twice, filter: twice.filter(&world), ..path };
        let [range, _, heading] = louder.bounds(&straight).unwrap().last().copied().flatten().unwrap().over(&usual);
        // Twice all noise is twice the bound, but for the small terms of the motion model that stay.
        assert!((1.85..2.0001).contains(&range) && (1.85..2.0001).contains(&heading), "{range} {heading}");
        let early = bounds[10].unwrap();
        assert!(early.range_m > 3.0 * bounds[40].unwrap().range_m, "motion makes range visible: {early:?}");
    }
}
