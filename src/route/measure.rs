//! Repeats in numbers: the measures of the field, with intervals over repeats.

use serde::Serialize;

use super::chart::Route;
use super::repeat::Repeat;
use crate::observation::Status;
use crate::statistics::{mean, quantile, wilson_95};

/// One repeat in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RepeatRow {
    /// Seed.
    pub seed: u64,
    /// How it ended, in the robot's own view: `arrived`, `lost`, or `timeout` for one that was still on its way.
    pub outcome: &'static str,
    /// Whether it claims the end and rests there.
    pub completed: bool,
    /// True distance at rest from the end, m.
    pub final_error_m: f64,
    /// Distance from the taught path: mean, m, ...
    pub cross_track_mean_m: Option<f64>,
    /// ... 95 % quantile, m, ...
    pub cross_track_p95_m: Option<f64>,
    /// ... and greatest, m.
    pub cross_track_max_m: Option<f64>,
    /// Mean of the heading's error, rad.
    pub heading_error_mean_rad: Option<f64>,
    /// Contacts with walls and what stands.
    pub wall_hits: usize,
    /// Contacts with people.
    pub walker_hits: usize,
    /// Snapshots claimed to be passed, ...
    pub legs: usize,
    /// ... and those that truly were elsewhere.
    pub wrong_legs: usize,
    /// Whether the robot knew where it was at the end or said that it did not.
    pub honest: bool,
    /// Length of the way, m.
    pub length_m: f64,
    /// Time, s.
    pub time_s: f64,
    /// Simulated over wall-clock time.
    pub real_time_factor: f64,
}

impl RepeatRow {
    /// The numbers of a repeat.
    #[must_use]
    pub fn new(repeat: &Repeat) -> Self {
        let errors: Vec<f64> = repeat.cross_track_m().collect();
        let counted = repeat.rows.iter().filter(|row| row.counts);
        let completed = repeat.is_completed();
        let steps = repeat.rows.windows(2).map(|pair| (pair[1].truth.position() - pair[0].truth.position()).norm());
        Self {
            seed: repeat.seed,
            outcome: match repeat.status {
                Status::Arrived => "arrived",
                Status::Lost | Status::Failed => "lost",
                Status::Running => "timeout",
            },
            completed,
            final_error_m: repeat.final_error_m,
            cross_track_mean_m: mean(errors.iter().copied()),
            cross_track_p95_m: quantile(&errors, 0.95),
            cross_track_max_m: errors.iter().copied().reduce(f64::max),
            heading_error_mean_rad: mean(counted.map(|row| row.heading_error_rad.abs())),
            wall_hits: repeat.wall_hits,
            walker_hits: repeat.walker_hits,
            legs: repeat.legs,
            wrong_legs: repeat.wrong_legs,
            honest: completed || repeat.status != Status::Arrived,
            length_m: steps.filter(|step| *step < 0.2).sum(),
            time_s: repeat.time_s(),
            real_time_factor: repeat.time_s() / repeat.wall_s.max(1e-9),
        }
    }
}

/// Many repeats of a route.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measures {
    /// Repeats.
    pub repeats: usize,
    /// Those that were completed, ...
    pub completed: usize,
    /// ... as a share, with its 95 % interval (Wilson).
    pub completed_95: [f64; 2],
    /// Those that were not and said so.
    pub said_lost: usize,
    /// Claims to be at the end by robots that were not.
    pub false_ends: usize,
    /// Cross-track error, m: mean over repeats of the mean of each, with the 95 % interval of it, ...
    pub cross_track_mean_m: Option<f64>,
    /// ... which is this.
    pub cross_track_mean_95_m: Option<[f64; 2]>,
    /// Standard deviation over all steps, m.
    pub cross_track_sd_m: Option<f64>,
    /// Mean over repeats of the 95 % quantile of each, m.
    pub cross_track_p95_m: Option<f64>,
    /// Greatest of all, m.
    pub cross_track_max_m: Option<f64>,
    /// Mean of the heading's error, rad.
    pub heading_error_mean_rad: Option<f64>,
    /// Final error of those that arrived, m: mean and greatest.
    pub final_error_mean_m: Option<f64>,
    /// Greatest final error of those that arrived, m.
    pub final_error_max_m: Option<f64>,
    /// Contacts with walls and what stands.
    pub wall_hits: usize,
    /// Contacts with people.
    pub walker_hits: usize,
    /// Legs, and those that ended elsewhere than claimed, with the 95 % interval of their share.
    pub legs: usize,
    /// Legs that ended elsewhere than claimed.
    pub wrong_legs: usize,
    /// The 95 % interval of the share of wrong legs.
    pub wrong_legs_95: [f64; 2],
    /// Time over that of the teach, mean.
    pub over_taught_time: f64,
    /// Median of simulated over wall-clock time.
    pub real_time_factor: f64,
}

impl Measures {
    /// Of these repeats of a route that took `taught_s` to teach.
    #[must_use]
    pub fn new(rows: &[RepeatRow], taught_s: f64) -> Self {
        let completed = rows.iter().filter(|row| row.completed).count();
        let arrived: Vec<f64> = rows.iter().filter(|row| row.outcome == "arrived").map(|row| row.final_error_m).collect();
        let means: Vec<f64> = rows.iter().filter_map(|row| row.cross_track_mean_m).collect();
        let cross_track_mean_m = mean(means.iter().copied());
        let spread = |m: f64| {
            let n = means.len() as f64;
            let variance = means.iter().map(|x| (x - m).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
            (variance / n).sqrt()
        };
        let sum = |of: &dyn Fn(&RepeatRow) -> usize| rows.iter().map(of).sum::<usize>();
        let (legs, wrong_legs) = (sum(&|row| row.legs), sum(&|row| row.wrong_legs));
        let factors: Vec<f64> = rows.iter().map(|row| row.real_time_factor).collect();
        let finished = rows.iter().filter(|row| row.completed);
        Self {
            repeats: rows.len(),
            completed,
            completed_95: wilson_95(completed, rows.len()),
            said_lost: rows.iter().filter(|row| !row.completed && row.honest).count(),
            false_ends: rows.iter().filter(|row| !row.honest).count(),
            cross_track_mean_m,
            cross_track_mean_95_m: cross_track_mean_m.map(|m| [m - 1.96 * spread(m), m + 1.96 * spread(m)]),
            cross_track_sd_m: cross_track_mean_m.map(|m| spread(m) * (means.len() as f64).sqrt()),
            cross_track_p95_m: mean(rows.iter().filter_map(|row| row.cross_track_p95_m)),
            cross_track_max_m: rows.iter().filter_map(|row| row.cross_track_max_m).reduce(f64::max),
            heading_error_mean_rad: mean(rows.iter().filter_map(|row| row.heading_error_mean_rad)),
            final_error_mean_m: mean(arrived.iter().copied()),
            final_error_max_m: arrived.iter().copied().reduce(f64::max),
            wall_hits: sum(&|row| row.wall_hits),
            walker_hits: sum(&|row| row.walker_hits),
            legs,
            wrong_legs,
            wrong_legs_95: wilson_95(wrong_legs, legs.max(1)),
            over_taught_time: mean(finished.map(|row| row.time_s / taught_s)).unwrap_or(f64::NAN),
            real_time_factor: quantile(&factors, 0.5).unwrap_or(f64::NAN),
        }
    }
}

/// What a route is and costs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteFigures {
    /// Name of the world.
    pub world: String,
    /// Rule for snapshots.
    pub rule: &'static str,
    /// Length by odometry, m.
    pub length_m: f64,
    /// Snapshots.
    pub snapshots: usize,
    /// Snapshots per 100 m.
    pub snapshots_per_100_m: f64,
    /// Features of all of them.
    pub features: usize,
    /// Bytes of the file.
    pub bytes: usize,
    /// Bytes per 100 m.
    pub bytes_per_100_m: f64,
    /// Time of the teach, s.
    pub time_s: f64,
    /// Contacts during the teach.
    pub collisions: usize,
    /// Distance at the end between odometry and truth, m.
    pub odometry_drift_m: f64,
}

impl RouteFigures {
    /// Of a route that takes `bytes` in its file.
    #[must_use]
    pub fn new(route: &Route, truth: &[crate::geometry::Pose], bytes: usize, time_s: f64, collisions: usize) -> Self {
        let length_m = route.length_m();
        let per_100_m = |count: usize| 100.0 * count as f64 / length_m.max(1e-9);
        let drift = match (truth.first(), truth.last(), route.path.last()) {
            (Some(first), Some(last), Some(told)) => (first.compose(told).position() - last.position()).norm(),
            _ => f64::NAN,
        };
        Self {
            world: route.sheet.world.clone(),
            rule: route.sheet.rule.name(),
            length_m,
            snapshots: route.snapshots.len(),
            snapshots_per_100_m: per_100_m(route.snapshots.len()),
            features: route.features(),
            bytes,
            bytes_per_100_m: per_100_m(bytes),
            time_s,
            collisions,
            odometry_drift_m: drift,
        }
    }
}
