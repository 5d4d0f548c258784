//! How well can where home is be known at all? The Cramer-Rao bound along a path, and what the filter makes of it.
//!
//! One run is driven in closed loop and its odometry kept. What the sensors tell along a way has a Fisher information about
//! everything that is unknown: the robot's pose at each step, the direction and inverse range of each landmark from home. The
//! inverse of what is left of it for the last pose, all else marginalised, bounds the covariance of any unbiased estimate of
//! that pose; along the polar coordinates of the paper it bounds R, theta and alpha. It is evaluated at the truth, which no
//! estimator knows, and ranges have no prior worth the name.
//!
//! Beside it the anchored filter is run with that odometry again and again, with noise of its own in each repetition and told
//! the true size of that noise. Odometry reads the same each time; it is the truth that strays from it, as slip and scrub do it,
//! by the filter's own motion model. So the bound's model is the filter's and the world's, and what the filter loses against the
//! bound it loses by linearising and deciding. Since no two runs go the same way, and passing a landmark a little nearer tells a
//! good deal more, the bound is that of the runs' own ways: the mean of its variances over [`BOUND_RUNS`] of them.

use std::collections::BTreeMap;
use std::ops::{ControlFlow, RangeInclusive};
use std::sync::{Arc, Mutex};

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

use super::statistics::chi_square_95;
use crate::episode::{BeliefError, Moment, Parts, PlantKind, Recorder, Setup, Simulation, Start};
use crate::error::{Error, Result};
use crate::estimation::anchored::map::Prior;
use crate::estimation::anchored::motion::{Motion, SlipWatch};
use crate::estimation::anchored::smoother::{Frame, Iterate, Sighting, Stretch};
use crate::estimation::anchored::{AnchoredFilter, FilterSettings};
use crate::geometry::{Matrix3, Pose, angle_of};
use crate::observation::{Bearing, Estimate, LandmarkId, Odometry};
use crate::random::{Seed, Stream, standard_normal};
use crate::sensor::{IdealSensor, Noise, NoisySensor, Sensor};
use crate::world::World;

/// Least noise of bearings, rad: what even the ideal sensor states.
const LEAST_BEARING_SD_RAD: f64 = 1e-4;
/// Standard deviation of the prior on an inverse range, 1/m: none, in effect. A landmark at 10 cm has 10.
const NO_RANGE_PRIOR_SD: f64 = 100.0;
/// The same for the direction from home of a landmark that was not seen there, rad.
const NO_DIRECTION_PRIOR_SD: f64 = 100.0;

/// Runs over whose ways the bound is averaged, the first ones; fewer if there are fewer.
pub const BOUND_RUNS: usize = 100;

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
    /// Runs whose means are held against the bands of a consistent filter; `None` for all of them together.
    pub group: Option<usize>,
}

impl Default for BoundSettings {
    fn default() -> Self {
        let filter = FilterSettings::default();
        Self {
            path_seed: 0,
            start: Start::Random,
            bearing_sd_rad: Noise::default().sd_rad,
            odometry_share: filter.speed_noise_share,
            group: None,
        }
    }
}

impl BoundSettings {
    fn check(&self, world: &World, seeds: &RangeInclusive<u64>) -> Result<()> {
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
        if seeds.is_empty() {
            return invalid("seeds", format!("{} to {}", seeds.start(), seeds.end()), "at least one");
        }
        let last = seeds.end() - seeds.start();
        if let Some(group) = self.group
            && (group == 0 || group as u64 - 1 > last)
        {
            let allowed = format!("1 to {}, as many as there are seeds", last.saturating_add(1));
            return invalid("runs in a group", group.to_string(), &allowed);
        }
        let unfit =
            |what: &str, found: String, needed: &str| Err(Error::Unfit { what: what.into(), found, needed: needed.into() });
        let offset = world.spec.camera.offset_m;
        if offset != [0.0; 2] {
            return unfit("camera.offset_m of the world", format!("{offset:?}"), "[0.0, 0.0]: bearings from above the axle");
        }
        match world.landmarks().iter().find(|l| l.motion.is_some()) {
            Some(body) => unfit("landmarks of the world", format!("`{}`, which moves", body.name), "landmarks at rest"),
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
    /// Of the runs together: the mean of their variances is the least mean squared error of an unbiased estimate in all of them. `None`
    /// where one of them is unbounded.
    fn root_mean_square(each: impl Iterator<Item = Option<Self>>) -> Option<Self> {
        let each: Vec<Self> = each.collect::<Option<_>>()?;
        let mean = |of: fn(&Self) -> f64| (each.iter().map(|e| of(e) * of(e)).sum::<f64>() / each.len() as f64).sqrt();
        Some(Self { range_m: mean(|e| e.range_m), bearing_rad: mean(|e| e.bearing_rad), heading_rad: mean(|e| e.heading_rad) })
    }

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
    /// Distance to home on the path that odometry tells, m; runs stray from it.
    pub distance_m: f64,
    /// Least standard deviations of an unbiased estimate over the first [`BOUND_RUNS`] runs; `None` while the information of one of
    /// them is singular.
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
        nees_band(self.runs)
    }

    /// 95 % interval in which the NIS a bearing of a consistent filter falls.
    #[must_use]
    pub fn nis_band(&self) -> [f64; 2] {
        chi_square_95(self.bearings as f64).map(|bound| bound / self.bearings as f64)
    }
}

/// 95 % interval in which the mean NEES of a consistent filter falls over so many runs.
#[must_use]
pub fn nees_band(runs: usize) -> [f64; 2] {
    chi_square_95(3.0 * runs as f64).map(|bound| bound / runs as f64)
}

/// How often the means over a group of runs lie in the 95 % bands of a consistent filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Consistency {
    /// Runs in a group.
    pub group: usize,
    /// Groups; runs that do not fill one more are left out.
    pub groups: usize,
    /// Steps of all groups in which all runs of the group have an estimate. Within a group they share the noise of the home
    /// snapshots, so that many of them may lie outside together.
    pub steps: usize,
    /// Those in which the mean NEES is in its band.
    pub nees_in_band: usize,
    /// Those in which the NIS is in its band.
    pub nis_in_band: usize,
}

impl Consistency {
    fn of(groups: &[Vec<BoundRow>], group: usize) -> Self {
        let within = |value: Option<f64>, [low, high]: [f64; 2]| value.is_some_and(|v| (low..=high).contains(&v));
        let settled: Vec<&BoundRow> = groups.iter().flatten().filter(|row| row.runs == group).collect();
        Self {
            group,
            groups: groups.len(),
            steps: settled.len(),
            nees_in_band: settled.iter().filter(|row| within(row.nees, row.nees_band())).count(),
            nis_in_band: settled.iter().filter(|row| within(row.nis, row.nis_band())).count(),
        }
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
    /// NEES and NIS against their bands.
    pub consistency: Consistency,
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
    settings.check(world, seeds)?;
    let path = Path::drive(world, settings)?;
    let runs: Vec<(Vec<Option<StepErrors>>, Option<_>)> = seeds
        .clone()
        .collect::<Vec<u64>>()
        .into_par_iter()
        .enumerate()
        .map(|(k, seed)| {
            let way = path.way(world, settings, Seed(seed));
            let errors = path.estimate(world, settings, Seed(seed), &way)?;
            let bounds = (k < BOUND_RUNS).then(|| path.bounds(world, settings, &way)).transpose()?;
            if watch().is_break() { Err(Error::Interrupted) } else { Ok((errors, bounds)) }
        })
        .collect::<Result<_>>()?;
    let (runs, bounds): (Vec<_>, Vec<_>) = runs.into_iter().unzip();
    let each: Vec<Vec<Option<PolarErrors>>> = bounds.into_iter().flatten().collect();
    let bounds: Vec<_> = (0..path.steps.len()).map(|k| PolarErrors::root_mean_square(each.iter().map(|b| b[k]))).collect();
    let rows = |runs: &[Vec<Option<StepErrors>>]| -> Vec<BoundRow> {
        (0..path.steps.len()).map(|k| path.row(k, runs.iter().filter_map(|run| run[k].as_ref()), bounds[k])).collect()
    };
    let group = settings.group.unwrap_or(runs.len());
    let groups: Vec<_> = runs.chunks_exact(group).map(rows).collect();
    Ok(Bound {
        rows: rows(&runs),
        consistency: Consistency::of(&groups, group),
        seeds: [*seeds.start(), *seeds.end()],
        path_seed: settings.path_seed,
        bearing_sd_rad: settings.bearing_sd_rad,
        odometry_share: settings.odometry_share,
        world: world.spec.name.clone(),
        world_sha256: world.sha256.clone(),
        version: crate::VERSION,
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
        let setup = Setup { plant: PlantKind::Unicycle, start: settings.start.clone(), ..Setup::default() };
        let seed = Seed(settings.path_seed);
        let sensor = NoisySensor::new(IdealSensor::new(world), world.landmark_count, settings.noise(), seed);
        let parts = Parts::with_sensor(world, setup.plant, Box::new(sensor))?;
        let mut simulation = Simulation::from_parts(world, &setup, parts);
        let bodies = Bodies::default();
        simulation.record_to(bodies.clone());
        let record = simulation.run(settings.path_seed, &mut |_| ControlFlow::Continue(()))?;
        let bodies = bodies.0.lock().map(|held| held.clone()).unwrap_or_default();
        let steps = record
            .steps
            .iter()
            .zip(bodies)
            .enumerate()
            .map(|(k, (step, bodies))| PathStep {
                truth: step.truth,
                odometry: Odometry { twist: step.odometry, dt_s: if k == 0 { 0.0 } else { world.spec.task.control_period_s } },
                bodies,
            })
            .collect();
        Ok(Self { home: world.home, period_s: world.spec.task.control_period_s, steps })
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

    /// What runs of the filter, those that have an estimate, make of step `k`.
    fn row<'a>(&self, k: usize, runs: impl Iterator<Item = &'a StepErrors>, bound: Option<PolarErrors>) -> BoundRow {
        let runs: Vec<&StepErrors> = runs.collect();
        let bearings: usize = runs.iter().map(|step| step.bearings).sum();
        let nis: f64 = runs.iter().map(|step| step.nis).sum();
        let mean = |of: &dyn Fn(&BeliefError) -> f64| runs.iter().map(|step| of(&step.belief)).sum::<f64>() / runs.len() as f64;
        let rmse = |of: &dyn Fn(&BeliefError) -> f64| mean(&|e| of(e) * of(e)).sqrt();
        let some = !runs.is_empty();
        BoundRow {
            time_s: k as f64 * self.period_s,
            distance_m: self.truth(k).position().norm(),
            bound,
            runs: runs.len(),
            rmse: some.then(|| PolarErrors {
                range_m: rmse(&|e| e.range_m),
                bearing_rad: rmse(&|e| e.bearing_rad),
                heading_rad: rmse(&|e| e.heading_rad),
            }),
            nees: some.then(|| mean(&|e| e.nees.unwrap_or(f64::INFINITY))),
            nis: (bearings > 0).then(|| nis / bearings as f64),
            bearings,
        }
    }

    /// The bound at each step of a run whose true poses in the room these are.
    fn bounds(&self, world: &World, settings: &BoundSettings, way: &[Pose]) -> Result<Vec<Option<PolarErrors>>> {
        let mut sensor = IdealSensor::new(world);
        let variance = settings.bearing_sd_rad * settings.bearing_sd_rad;
        let looks = way.iter().zip(&self.steps);
        let seen: Vec<Vec<Bearing>> = looks.map(|(truth, step)| sensor.observe(*truth, &step.bodies)).collect::<Result<_>>()?;
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
        let poses: Vec<Pose> = way.iter().map(|truth| self.home.to_local(truth)).collect();
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
        Ok((0..self.steps.len()).map(at).collect())
    }

    /// True poses in the room of the run with this seed.
    fn way(&self, world: &World, settings: &BoundSettings, seed: Seed) -> Vec<Pose> {
        let mut straying = seed.derive("bound").stream("straying");
        let mut truth = self.steps[0].truth;
        let settings = settings.filter(world);
        self.steps
            .iter()
            .zip(self.motions(&settings))
            .map(|(step, motion)| {
                if step.odometry.dt_s > 0.0 {
                    truth = truth.compose(&strayed(&motion, &mut straying));
                }
                truth
            })
            .collect()
    }

    /// The filter's errors on a run's way, one a step where it has an estimate.
    fn estimate(&self, world: &World, settings: &BoundSettings, seed: Seed, way: &[Pose]) -> Result<Vec<Option<StepErrors>>> {
        let noise = seed.derive("bound");
        let mut sensor = NoisySensor::new(IdealSensor::new(world), world.landmark_count, settings.noise(), noise);
        let mut filter = AnchoredFilter::new(settings.filter(world), sensor.home());
        self.steps
            .iter()
            .zip(way)
            .map(|(step, &truth)| {
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

/// Keeps where the bodies stood at each look.
#[derive(Clone, Default)]
struct Bodies(Arc<Mutex<Vec<Vec<Pose>>>>);

impl Recorder for Bodies {
    fn record(&mut self, moment: &Moment<'_>) -> Result<()> {
        if let (Some(_), Ok(mut held)) = (moment.step.seen, self.0.lock()) {
            held.push(moment.bodies.to_vec());
        }
        Ok(())
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
        let runs = 300;
        let rows = lab(&BoundSettings { path_seed: 5, ..BoundSettings::default() }, 1..=runs);
        // Near home theta has no meaning, and before all runs have an estimate the hard ones are left out.
        let settled: Vec<_> = rows.iter().filter(|r| r.runs == runs as usize && r.distance_m > 0.3).collect();
        assert!(settled.len() >= 15, "{}", settled.len());
        // A standard deviation from n values has a relative error of 1 / sqrt(2 n).
        let chance = 3.0 / (2.0 * runs as f64).sqrt();
        for row in settled {
            let ratio = row.ratio().unwrap();
            assert!(ratio.iter().all(|r| (1.0 - chance..1.0 + 2.0 * chance).contains(r)), "{ratio:?} at {} s", row.time_s);
        }
    }

    /// Groups of runs are judged as studies of their own would be.
    #[test]
    fn groups_are_judged_like_studies_of_their_own() {
        let world = World::open("lab").unwrap();
        let judge = |seeds: RangeInclusive<u64>, group| {
            let settings = BoundSettings { path_seed: 6, group, ..BoundSettings::default() };
            bound(&world, &settings, &seeds, &|| ControlFlow::Continue(())).map(|b| b.consistency)
        };
        let (a, b) = (judge(1..=8, None).unwrap(), judge(9..=16, None).unwrap());
        let both = Consistency {
            group: 8,
            groups: 2,
            steps: a.steps + b.steps,
            nees_in_band: a.nees_in_band + b.nees_in_band,
            nis_in_band: a.nis_in_band + b.nis_in_band,
        };
        assert_eq!(judge(1..=20, Some(8)).unwrap(), both);
        assert!(a.nees_in_band > 0 && b.nis_in_band > 0, "{a:?} {b:?}");
        let none = RangeInclusive::new(5, 1);
        assert!(judge(1..=8, Some(9)).is_err() && judge(1..=8, Some(0)).is_err() && judge(none, None).is_err());
    }

    #[test]
    fn variances_are_averaged_and_not_deviations() {
        let errors = |k: f64| PolarErrors { range_m: k, bearing_rad: 2.0 * k, heading_rad: 3.0 * k };
        assert_eq!(PolarErrors::root_mean_square([Some(errors(1.0)), Some(errors(7.0))].into_iter()), Some(errors(5.0)));
        assert_eq!(PolarErrors::root_mean_square([Some(errors(1.0)), None].into_iter()), None);
    }

    /// What can only help does help, and the bound scales as the noise does.
    #[test]
    fn information_grows_with_time_and_falls_with_noise() {
        let settings = BoundSettings { path_seed: 3, ..BoundSettings::default() };
        let world = World::open("lab").unwrap();
        let path = Path::drive(&world, &settings).unwrap();
        let straight: Vec<Pose> = path.steps.iter().map(|step| step.truth).collect();
        let at_end = |s: &BoundSettings| path.bounds(&world, s, &straight).unwrap().last().copied().flatten().unwrap();
        let usual = at_end(&settings);
        let twice = BoundSettings {
            bearing_sd_rad: 2.0 * settings.bearing_sd_rad,
            odometry_share: 2.0 * settings.odometry_share,
            ..settings.clone()
        };
        let [range, _, heading] = at_end(&twice).over(&usual);
        // Twice all noise is twice the bound, but for the small terms of the motion model that stay.
        assert!((1.85..2.0001).contains(&range) && (1.85..2.0001).contains(&heading), "{range} {heading}");
        let bounds = path.bounds(&world, &settings, &straight).unwrap();
        let early = bounds[10].unwrap();
        assert!(early.range_m > 3.0 * bounds[40].unwrap().range_m, "motion makes range visible: {early:?}");
    }
}
