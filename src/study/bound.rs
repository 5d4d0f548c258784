//! How well can where home is be known at all? The Cramer-Rao bound along a path, and what the filter makes of it.
//!
//! One run is driven in closed loop and its path kept. What the sensors tell along that path has a Fisher information about
//! everything that is unknown: the robot's pose at each step, the direction and inverse range of each landmark from home. The
//! inverse of what is left of it for the last pose, all else marginalised, bounds the covariance of any unbiased estimate of
//! that pose; along the polar coordinates of the paper it bounds R, theta and alpha. It is evaluated at the truth, which no
//! estimator knows, and ranges have no prior worth the name.
//!
//! Beside it the anchored filter is run along the same path again and again, with noise of its own in each repetition and told
//! the true size of that noise. Odometry reads the same each time; it is the truth that strays from it, as slip and scrub do it,
//! by the filter's own motion model. So the bound's model is the filter's and the world's, and what the filter loses against the
//! bound it loses by linearising and deciding.

use std::collections::BTreeMap;
use std::ops::{ControlFlow, RangeInclusive};

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

use super::statistics::chi_square_95;
use crate::episode::method::{self, LawKind, MethodKind};
use crate::episode::sensor::{IdealSensor, Noise, NoisySensor, Sensor};
use crate::episode::{BeliefError, Parts, PlantKind, Setup, Start, run};
use crate::error::{Error, Result};
use crate::estimation::anchored::map::Prior;
use crate::estimation::anchored::motion::{Motion, SlipWatch};
use crate::estimation::anchored::smoother::{Frame, Iterate, Sighting, Stretch};
use crate::estimation::anchored::{AnchoredFilter, FilterSettings};
use crate::geometry::{Matrix3, Pose, angle_of};
use crate::observation::{Bearing, Estimate, HomeSnapshot, LandmarkId, Odometry};
use crate::physics::UnicyclePlant;
use crate::random::{Seed, Stream, standard_normal};
use crate::world::World;

/// Least noise of bearings, rad: what even the ideal sensor states.
const LEAST_BEARING_SD_RAD: f64 = 1e-4;
/// Standard deviation of the prior on an inverse range, 1/m: none, in effect. A landmark at 10 cm has 10.
const NO_RANGE_PRIOR_SD: f64 = 100.0;
/// The same for the direction from home of a landmark that was not seen there, rad.
const NO_DIRECTION_PRIOR_SD: f64 = 100.0;

/// Which path, and how much noise.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundSettings {
    /// Seed of the run that gives the path.
    pub path_seed: u64,
    /// Where that run starts.
    pub start: Start,
    /// Standard deviation of bearings, at home too, rad.
    pub bearing_sd_rad: f64,
    /// Noise of odometry as a share of speed and of yaw rate, in each step anew. The smaller terms of the motion model are the
    /// filter's own.
    pub odometry_share: f64,
}

impl Default for BoundSettings {
    fn default() -> Self {
        let filter = FilterSettings::default();
        Self {
            path_seed: 0,
            start: Start::Random,
            bearing_sd_rad: Noise::default().sd_rad,
            odometry_share: filter.speed_noise_share,
        }
    }
}

impl BoundSettings {
    fn check(&self, world: &World) -> Result<()> {
        let invalid = |what: &str, found: String, allowed: &str| {
            Err(Error::Invalid { what: what.into(), found, allowed: allowed.into() })
        };
        if !(LEAST_BEARING_SD_RAD..1.0).contains(&self.bearing_sd_rad) {
            let found = format!("{} degrees", self.bearing_sd_rad.to_degrees());
            return invalid("noise of bearings", found, "0.0058 to 57 degrees");
        }
        if !(0.0..1.0).contains(&self.odometry_share) {
            return invalid("noise of odometry", self.odometry_share.to_string(), "a share from 0 to less than 1");
        }
        let offset = world.spec.camera.offset_m;
        if offset != [0.0; 2] {
            return invalid("camera.offset_m of the world", format!("{offset:?}"), "[0.0, 0.0]: bearings from above the axle");
        }
        match world.landmarks().iter().find(|l| l.motion.is_some()) {
            Some(body) => invalid("landmarks of the world", format!("`{}`, which moves", body.name), "landmarks at rest"),
            None => Ok(()),
        }
    }

    fn filter(&self, world: &World) -> FilterSettings {
        FilterSettings {
            speed_noise_share: self.odometry_share,
            turn_noise_share: self.odometry_share,
            track_m: world.spec.robot.track_m,
            ..FilterSettings::default()
        }
    }

    fn noise(&self) -> Noise {
        Noise { sd_rad: self.bearing_sd_rad, dropout: 0.0, false_match: 0.0 }
    }
}

/// Errors of range to home, bearing from home and heading: the paper's R, theta and alpha.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PolarErrors {
    /// R, m.
    pub range_m: f64,
    /// theta, rad.
    pub bearing_rad: f64,
    /// alpha, rad.
    pub heading_rad: f64,
}

impl PolarErrors {
    /// By component, these over `other`.
    #[must_use]
    pub fn over(&self, other: &Self) -> [f64; 3] {
        [self.range_m / other.range_m, self.bearing_rad / other.bearing_rad, self.heading_rad / other.heading_rad]
    }
}

/// One step of the path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BoundRow {
    /// Time since the start, s.
    pub time_s: f64,
    /// Distance to home, m.
    pub distance_m: f64,
    /// Least standard deviations of an unbiased estimate; `None` while the information is singular.
    pub bound: Option<PolarErrors>,
    /// Runs of the filter that have an estimate by now.
    pub runs: usize,
    /// Their root mean square errors; `None` without runs.
    pub rmse: Option<PolarErrors>,
    /// Their mean normalised estimation error squared of (x, y, heading); 3 for a consistent filter.
    pub nees: Option<f64>,
    /// Their normalised innovation squared, a bearing: 1 for a consistent filter; `None` without bearings.
    pub nis: Option<f64>,
    /// Bearings that the latter is of.
    pub bearings: usize,
}

impl BoundRow {
    /// The filter's errors over the bound, for R, theta and alpha.
    #[must_use]
    pub fn ratio(&self) -> Option<[f64; 3]> {
        Some(self.rmse?.over(&self.bound?))
    }

    /// 95 % interval in which the mean NEES of a consistent filter falls.
    #[must_use]
    pub fn nees_band(&self) -> [f64; 2] {
        chi_square_95(3.0 * self.runs as f64).map(|bound| bound / self.runs as f64)
    }

    /// 95 % interval in which the NIS a bearing of a consistent filter falls.
    #[must_use]
    pub fn nis_band(&self) -> [f64; 2] {
        chi_square_95(self.bearings as f64).map(|bound| bound / self.bearings as f64)
    }
}

/// What a run of the filter makes of a step.
struct StepErrors {
    belief: BeliefError,
    nis: f64,
    bearings: usize,
}

/// The bound along a path and the filter beside it.
#[derive(Debug, Clone, Serialize)]
pub struct Bound {
    /// One row a step.
    pub rows: Vec<BoundRow>,
    /// First and last seed of the filter's runs.
    pub seeds: [u64; 2],
    /// Seed of the path.
    pub path_seed: u64,
    /// Standard deviation of bearings, rad.
    pub bearing_sd_rad: f64,
    /// Noise of odometry as a share of speed and yaw rate.
    pub odometry_share: f64,
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Version of this program.
    pub version: &'static str,
}

/// Works out the bound and runs the filter once a seed, in parallel; the result does not depend on the number of threads.
/// `watch` is called when a run of the filter is done.
///
/// # Errors
/// When a setting is out of its range, the world has no such start or not enough landmarks, or `watch` breaks.
pub fn bound(
    world: &World,
    settings: &BoundSettings,
    seeds: &RangeInclusive<u64>,
    watch: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Result<Bound> {
    settings.check(world)?;
    let path = Path::drive(world, settings)?;
    let runs: Vec<Vec<Option<StepErrors>>> = seeds
        .clone()
        .collect::<Vec<u64>>()
        .into_par_iter()
        .map(|seed| {
            let errors = path.estimate(world, settings, Seed(seed))?;
            if watch().is_break() { Err(Error::Interrupted) } else { Ok(errors) }
        })
        .collect::<Result<_>>()?;
    let bounds = path.bounds(world, settings)?;
    let rows = (0..path.steps.len())
        .map(|k| {
            let of_step = || runs.iter().filter_map(|run| run[k].as_ref());
            let errors: Vec<&BeliefError> = of_step().map(|step| &step.belief).collect();
            let bearings: usize = of_step().map(|step| step.bearings).sum();
            let nis: f64 = of_step().map(|step| step.nis).sum();
            let mean = |of: &dyn Fn(&BeliefError) -> f64| errors.iter().map(|e| of(e)).sum::<f64>() / errors.len() as f64;
            let rmse = |of: &dyn Fn(&BeliefError) -> f64| mean(&|e| of(e) * of(e)).sqrt();
            let some = !errors.is_empty();
            BoundRow {
                time_s: k as f64 * path.period_s,
                distance_m: path.truth(k).position().norm(),
                bound: bounds[k],
                runs: errors.len(),
                rmse: some.then(|| PolarErrors {
                    range_m: rmse(&|e| e.range_m),
                    bearing_rad: rmse(&|e| e.bearing_rad),
                    heading_rad: rmse(&|e| e.heading_rad),
                }),
                nees: some.then(|| mean(&|e| e.nees.unwrap_or(f64::INFINITY))),
                nis: (bearings > 0).then(|| nis / bearings as f64),
                bearings,
            }
        })
        .collect();
    Ok(Bound {
        rows,
        seeds: [*seeds.start(), *seeds.end()],
        path_seed: settings.path_seed,
        bearing_sd_rad: settings.bearing_sd_rad,
        odometry_share: settings.odometry_share,
        world: world.spec.name.clone(),
        world_sha256: world.sha256.clone(),
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// One step of the path.
struct PathStep {
    /// Pose in the room.
    truth: Pose,
    /// Motion since the step before.
    odometry: Odometry,
    /// Where the world's bodies stand.
    bodies: Vec<Pose>,
}

/// The path of a run.
struct Path {
    home: Pose,
    period_s: f64,
    steps: Vec<PathStep>,
}

impl Path {
    /// Drives home once in closed loop, on a robot whose odometry tells the truth.
    fn drive(world: &World, settings: &BoundSettings) -> Result<Self> {
        let setup =
            Setup { plant: PlantKind::Unicycle, noise: settings.noise(), start: settings.start.clone(), ..Setup::default() };
        let seed = Seed(settings.path_seed);
        let mut plant = UnicyclePlant::new(world, setup.start_pose(world, seed)?, seed);
        let mut sensor = BodyWatch {
            sensor: NoisySensor::new(IdealSensor::new(world), world.landmark_count, settings.noise(), seed),
            bodies: Vec::new(),
        };
        let briefing = setup.briefing(world, &sensor);
        let mut method =
            method::build(MethodKind::AnchoredEkf, LawKind::Proportional, FilterSettings::default(), briefing, None)?;
        let task = setup.task(world);
        let parts = Parts { plant: &mut plant, sensor: &mut sensor, method: method.as_mut() };
        let record = run(parts, world.home, &task, &mut |_| ControlFlow::Continue(()))?;
        let steps = record
            .steps
            .iter()
            .zip(sensor.bodies)
            .enumerate()
            .map(|(k, (step, bodies))| PathStep {
                truth: step.truth,
                odometry: Odometry { twist: step.odometry, dt_s: if k == 0 { 0.0 } else { task.control_period_s } },
                bodies,
            })
            .collect();
        Ok(Self { home: world.home, period_s: task.control_period_s, steps })
    }

    /// The steps as the filter's motion model has them.
    fn motions(&self, settings: &FilterSettings) -> impl Iterator<Item = Motion> {
        let (mut slip, settings) = (SlipWatch::default(), *settings);
        self.steps.iter().map(move |step| {
            let slip_m_s = slip.expect(&step.odometry, &settings);
            Motion::from_odometry(&step.odometry, slip_m_s, &settings)
        })
    }

    /// True pose in the home frame at step `k`.
    fn truth(&self, k: usize) -> Pose {
        self.home.to_local(&self.steps[k].truth)
    }

    /// The bound at each step.
    fn bounds(&self, world: &World, settings: &BoundSettings) -> Result<Vec<Option<PolarErrors>>> {
        let mut sensor = IdealSensor::new(world);
        let variance = settings.bearing_sd_rad * settings.bearing_sd_rad;
        let seen: Vec<Vec<Bearing>> = self.steps.iter().map(|s| sensor.observe(s.truth, &s.bodies)).collect::<Result<_>>()?;
        let mut ids: Vec<LandmarkId> = seen.iter().flatten().map(|b| b.id).collect();
        ids.sort_unstable();
        ids.dedup();
        let index: BTreeMap<LandmarkId, usize> = ids.iter().enumerate().map(|(k, id)| (*id, k)).collect();
        let bodies = world.body_poses();
        let landmarks: Vec<[f64; 2]> = ids
            .iter()
            .map(|id| {
                let place = self.home.inverse_transform(bodies[id.0 as usize].position());
                [angle_of(place), 1.0 / place.norm()]
            })
            .collect();
        let priors: Vec<Prior> = ids
            .iter()
            .zip(&landmarks)
            .map(|(id, &mean)| {
                let at_home = sensor.home().bearings.iter().any(|b| b.id == *id);
                let direction = if at_home { variance } else { NO_DIRECTION_PRIOR_SD * NO_DIRECTION_PRIOR_SD };
                Prior { mean, variance: [direction, NO_RANGE_PRIOR_SD * NO_RANGE_PRIOR_SD] }
            })
            .collect();
        let frames: Vec<Frame> = self
            .motions(&settings.filter(world))
            .zip(&seen)
            .map(|(motion, seen)| Frame {
                motion,
                sightings: seen
                    .iter()
                    .map(|b| Sighting { landmark: index[&b.id], azimuth_rad: b.azimuth_rad, variance })
                    .collect(),
            })
            .collect();
        let poses: Vec<Pose> = (0..self.steps.len()).map(|k| self.truth(k)).collect();
        let at = |k: usize| {
            let stretch = Stretch { frames: &frames[..=k], priors: &priors, heavy_tails: false };
            let truth = Iterate { poses: poses[..=k].to_vec(), landmarks: landmarks.clone() };
            let covariance: Matrix3<f64> = stretch.covariance_at(&truth)?.fixed_view::<3, 3>(0, 0).into_owned();
            let best = Estimate { pose: poses[k], covariance };
            let errors = PolarErrors {
                range_m: best.range_sd_m(),
                bearing_rad: best.bearing_sd_rad(),
                heading_rad: best.heading_sd_rad(),
            };
            (errors.range_m + errors.bearing_rad + errors.heading_rad).is_finite().then_some(errors)
        };
        Ok((0..self.steps.len()).into_par_iter().map(at).collect())
    }

    /// The filter's errors along the path, one a step where it has an estimate.
    fn estimate(&self, world: &World, settings: &BoundSettings, seed: Seed) -> Result<Vec<Option<StepErrors>>> {
        let seed = seed.derive("bound");
        let mut straying = seed.stream("straying");
        let mut sensor = NoisySensor::new(IdealSensor::new(world), world.landmark_count, settings.noise(), seed);
        let filter_settings = settings.filter(world);
        let mut filter = AnchoredFilter::new(filter_settings, sensor.home());
        let mut truth = self.steps[0].truth;
        self.steps
            .iter()
            .zip(self.motions(&filter_settings))
            .map(|(step, motion)| {
                if step.odometry.dt_s > 0.0 {
                    truth = truth.compose(&strayed(&motion, &mut straying));
                }
                let report = filter.step(&step.odometry, &sensor.observe(truth, &step.bodies)?);
                Ok(filter.estimate().map(|estimate| StepErrors {
                    belief: BeliefError::new(&estimate, &self.home.to_local(&truth)),
                    nis: report.nis,
                    bearings: report.matched,
                }))
            })
            .collect()
    }
}

/// A step that the robot may really have made when odometry tells `motion`.
fn strayed(motion: &Motion, stream: &mut Stream) -> Pose {
    let normal = Vector3::from_fn(|_, _| standard_normal(stream));
    let off = motion.covariance.cholesky().map_or_else(Vector3::zeros, |c| c.l() * normal);
    Pose::new(motion.delta.x + off.x, motion.delta.y + off.y, motion.delta.heading + off.z)
}

/// A sensor that keeps where the bodies stood at each look.
struct BodyWatch<'a> {
    sensor: NoisySensor<'a>,
    bodies: Vec<Vec<Pose>>,
}

impl Sensor for BodyWatch<'_> {
    fn home(&self) -> &HomeSnapshot {
        self.sensor.home()
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> Result<Vec<Bearing>> {
        self.bodies.push(bodies.to_vec());
        self.sensor.observe(truth, bodies)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lab(settings: &BoundSettings, seeds: RangeInclusive<u64>) -> Vec<BoundRow> {
        let world = World::open("lab").unwrap();
        bound(&world, settings, &seeds, &|| ControlFlow::Continue(())).unwrap().rows
    }

    /// No run of seeds beats the bound by more than chance allows, and the filter is not far from it.
    #[test]
    fn the_filter_is_near_the_bound_and_not_below_it() {
        let runs = 60;
        let rows = lab(&BoundSettings { path_seed: 3, ..BoundSettings::default() }, 1..=runs);
        // Near home theta has no meaning, and before all runs have an estimate the hard ones are left out.
        let settled: Vec<_> = rows.iter().filter(|r| r.runs == runs as usize && r.distance_m > 0.3).collect();
        assert!(settled.len() >= 15, "{}", settled.len());
        // A standard deviation from n values has a relative error of 1 / sqrt(2 n).
        let chance = 3.0 / (2.0 * runs as f64).sqrt();
        for row in settled {
            let ratio = row.ratio().unwrap();
            assert!(ratio.iter().all(|r| (1.0 - chance..2.0).contains(r)), "{ratio:?} at {} s", row.time_s);
        }
    }

    /// What can only help does help, and the bound scales as the noise does.
    #[test]
    fn information_grows_with_time_and_falls_with_noise() {
        let settings = BoundSettings { path_seed: 3, ..BoundSettings::default() };
        let world = World::open("lab").unwrap();
        let path = Path::drive(&world, &settings).unwrap();
        let at_end = |s: &BoundSettings| path.bounds(&world, s).unwrap().last().copied().flatten().unwrap();
        let usual = at_end(&settings);
        let twice = BoundSettings {
            bearing_sd_rad: 2.0 * settings.bearing_sd_rad,
            odometry_share: 2.0 * settings.odometry_share,
            ..settings.clone()
        };
        let [range, _, heading] = at_end(&twice).over(&usual);
        // Twice all noise is twice the bound, but for the small terms of the motion model that stay.
        assert!((1.85..2.0001).contains(&range) && (1.85..2.0001).contains(&heading), "{range} {heading}");
        let bounds = path.bounds(&world, &settings).unwrap();
        let early = bounds[10].unwrap();
        assert!(early.range_m > 3.0 * bounds[40].unwrap().range_m, "motion makes range visible: {early:?}");
    }
}
