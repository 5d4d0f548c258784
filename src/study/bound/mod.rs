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

mod path;

use std::ops::{ControlFlow, RangeInclusive};

use rayon::prelude::*;
use serde::Serialize;

use crate::episode::Start;
use crate::error::{Error, Result, go_on};
use crate::estimation::anchored::FilterSettings;
use crate::random::Seed;
use crate::sensor::Noise;
use crate::statistics::{chi_square_95, mean};
use crate::world::World;
use path::{Path, StepErrors};

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
        if !(path::LEAST_BEARING_SD_RAD..1.0).contains(&self.bearing_sd_rad) {
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
    fn new([range_m, bearing_rad, heading_rad]: [f64; 3]) -> Self {
        Self { range_m, bearing_rad, heading_rad }
    }

    /// R (m), theta and alpha (rad).
    pub fn values(&self) -> [f64; 3] {
        [self.range_m, self.bearing_rad, self.heading_rad]
    }

    /// Of the runs together: the mean of their variances is the least mean squared error of an unbiased estimate in all of them. `None`
    /// where one of them is unbounded, and without runs.
    fn root_mean_square(each: impl Iterator<Item = Option<Self>>) -> Option<Self> {
        let each = each.collect::<Option<Vec<Self>>>()?;
        let rms = |k: usize| mean(each.iter().map(|e| e.values()[k] * e.values()[k])).map(f64::sqrt);
        Some(Self::new([rms(0)?, rms(1)?, rms(2)?]))
    }

    /// By component, these over `other`.
    pub fn over(&self, other: &Self) -> [f64; 3] {
        std::array::from_fn(|k| self.values()[k] / other.values()[k])
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
    /// What runs of the filter, those that have an estimate, make of a step.
    fn of<'a>(path: &Path<'_>, k: usize, runs: impl Iterator<Item = &'a StepErrors>, bound: Option<PolarErrors>) -> Self {
        let runs: Vec<&StepErrors> = runs.collect();
        let bearings: usize = runs.iter().map(|step| step.bearings).sum();
        let nis: f64 = runs.iter().map(|step| step.nis).sum();
        Self {
            time_s: path.time_s(k),
            distance_m: path.truth(k).position().norm(),
            bound,
            runs: runs.len(),
            rmse: PolarErrors::root_mean_square(runs.iter().map(|step| Some(step.errors))),
            nees: mean(runs.iter().map(|step| step.nees)),
            nis: (bearings > 0).then(|| nis / bearings as f64),
            bearings,
        }
    }

    /// The filter's errors over the bound, for R, theta and alpha.
    pub fn ratio(&self) -> Option<[f64; 3]> {
        Some(self.rmse?.over(&self.bound?))
    }

    /// 95 % interval in which the mean NEES of a consistent filter falls.
    pub fn nees_band(&self) -> [f64; 2] {
        nees_band(self.runs)
    }

    /// 95 % interval in which the NIS a bearing of a consistent filter falls.
    pub fn nis_band(&self) -> [f64; 2] {
        chi_square_95(self.bearings as f64).map(|bound| bound / self.bearings as f64)
    }
}

/// 95 % interval in which the mean NEES of a consistent filter falls over so many runs.
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
    let judge = |(k, seed): (usize, u64)| {
        let way = path.way(Seed(seed));
        let errors = path.estimate(Seed(seed), &way)?;
        let bounds = (k < BOUND_RUNS).then(|| path.bounds(&way)).transpose()?;
        go_on(watch())?;
        Ok((errors, bounds))
    };
    let judged = seeds.clone().collect::<Vec<u64>>().into_par_iter().enumerate().map(judge).collect::<Result<Vec<_>>>()?;
    let (runs, bounds): (Vec<_>, Vec<_>) = judged.into_iter().unzip();
    let each: Vec<Vec<Option<PolarErrors>>> = bounds.into_iter().flatten().collect();
    let bounds: Vec<_> = (0..path.len()).map(|k| PolarErrors::root_mean_square(each.iter().map(|b| b[k]))).collect();
    let rows = |runs: &[Vec<Option<StepErrors>>]| -> Vec<BoundRow> {
        let row = |k: usize| BoundRow::of(&path, k, runs.iter().filter_map(|run| run[k].as_ref()), bounds[k]);
        (0..path.len()).map(row).collect()
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
}
