//! Runs in numbers: the one summary that all studies give of some of their runs.

use serde::Serialize;

use super::row::{Ending, RunRow};
use crate::statistics::{quantile, wilson_95};

/// Some runs in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tally {
    /// Runs.
    pub runs: usize,
    /// Runs that ended at home, within the arrival radius.
    pub home: usize,
    /// Share of these.
    pub home_share: f64,
    /// 95 % Wilson interval of the share.
    pub home_share_95: [f64; 2],
    /// Runs by outcome.
    pub outcomes: OutcomeCounts,
    /// Runs that claimed to be home and came to rest outside the arrival radius.
    pub wrong_claims: usize,
    /// Time over straight-line time, of the runs that reached home.
    pub time_ratio: Spread,
    /// Final distance to home of all runs, m.
    pub final_distance_m: Spread,
    /// Final distance to home of the runs that claimed to be there, m.
    pub claimed_distance_m: Spread,
    /// Error of the estimated range at the end, without its sign, of the runs with an estimate, m.
    pub range_error_m: Spread,
    /// Mean NEES of a run.
    pub nees: Spread,
    /// Distance at the end between odometry alone and the truth, m.
    pub odometry_drift_m: Spread,
    /// Runs with at least one collision.
    pub runs_with_collisions: usize,
}

impl Tally {
    /// Of these runs.
    pub fn of<'a>(runs: impl IntoIterator<Item = &'a RunRow>) -> Self {
        let runs: Vec<&RunRow> = runs.into_iter().collect();
        let spread = |of: fn(&RunRow) -> Option<f64>| Spread::of(runs.iter().filter_map(|run| of(run)));
        let count = |holds: fn(&RunRow) -> bool| runs.iter().filter(|run| holds(run)).count();
        let home = count(RunRow::is_home);
        Self {
            runs: runs.len(),
            home,
            home_share: home as f64 / runs.len().max(1) as f64,
            home_share_95: wilson_95(home, runs.len()),
            outcomes: OutcomeCounts::of(&runs),
            wrong_claims: count(RunRow::is_wrong_claim),
            time_ratio: spread(|run| run.time_ratio),
            final_distance_m: spread(|run| run.final_distance_m),
            claimed_distance_m: spread(|run| run.final_distance_m.filter(|_| run.claimed_home == Some(true))),
            range_error_m: spread(|run| run.range_error_m.map(f64::abs)),
            nees: spread(|run| run.nees),
            odometry_drift_m: spread(|run| run.odometry_drift_m),
            runs_with_collisions: count(|run| run.collisions > Some(0)),
        }
    }
}

/// Runs by how they ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct OutcomeCounts {
    /// Home reached.
    pub home: usize,
    /// Out of time.
    pub timeout: usize,
    /// Gave up, or a wrong claim.
    pub lost: usize,
    /// Did not move.
    pub stuck: usize,
    /// The method broke; left out where it never did, as the next two.
    #[serde(skip_serializing_if = "is_zero")]
    pub failed: usize,
    /// Panicked.
    #[serde(skip_serializing_if = "is_zero")]
    pub panic: usize,
    /// Could not be run.
    #[serde(skip_serializing_if = "is_zero")]
    pub error: usize,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl OutcomeCounts {
    /// All but those at home, each with its name.
    pub fn others(&self) -> [(&'static str, usize); 6] {
        let Self { home: _, timeout, lost, stuck, failed, panic, error } = *self;
        [("timeout", timeout), ("lost", lost), ("stuck", stuck), ("failed", failed), ("panic", panic), ("error", error)]
    }

    fn of(runs: &[&RunRow]) -> Self {
        let mut counts = Self::default();
        for run in runs {
            *match run.outcome {
                Ending::Home => &mut counts.home,
                Ending::Timeout => &mut counts.timeout,
                Ending::Lost => &mut counts.lost,
                Ending::Stuck => &mut counts.stuck,
                Ending::Failed => &mut counts.failed,
                Ending::Panic => &mut counts.panic,
                Ending::Error => &mut counts.error,
            } += 1;
        }
        counts
    }
}

/// Median and outer values; each `None` where there are none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// How many values.
    pub count: usize,
    /// Lower and upper quartile, which figures show.
    #[serde(skip)]
    pub quartiles: [Option<f64>; 2],
    /// Median.
    pub median: Option<f64>,
    /// 90 % quantile.
    pub p90: Option<f64>,
    /// Greatest.
    pub max: Option<f64>,
}

impl Spread {
    /// Of the given values.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let at = |share| quantile(&values, share);
        Self { count: values.len(), quartiles: [at(0.25), at(0.75)], median: at(0.5), p90: at(0.9), max: at(1.0) }
    }
}
