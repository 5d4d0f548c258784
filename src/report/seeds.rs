//! The files of a batch of seeds.

use crate::episode::Summary;
use crate::error::Result;
use crate::storage::{OutputFolder, json};
use crate::study::seeds::SeedsSummary;

/// Names of all files of a batch; the last is there when a method broke.
pub const FILES: &[&str] = &["summary.json", "seeds.csv", "failures.csv"];

/// Columns of `seeds.csv`.
const COLUMNS: [&str; 17] = [
    "seed",
    "outcome",
    "claimed_home",
    "start_distance_m",
    "final_distance_m",
    "time_s",
    "time_ratio",
    "path_length_m",
    "odometry_drift_m",
    "collisions",
    "range_error_m",
    "bearing_error_rad",
    "heading_error_rad",
    "nees",
    "seen_mean",
    "matched_mean",
    "rejected_mean",
];

/// Writes all files of a batch.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, batch: &SeedsSummary, runs: &[Summary]) -> Result<()> {
    folder.write("seeds.csv", seeds_csv(runs).as_bytes())?;
    if let Some(table) = failures_csv(runs) {
        folder.write("failures.csv", &table)?;
    }
    folder.write("summary.json", json(batch).as_bytes())?;
    folder.finish()
}

/// One row a run, empty cells where there is no number.
#[must_use]
pub fn seeds_csv(runs: &[Summary]) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for run in runs {
        text.push_str(&row(run).join(","));
        text.push('\n');
    }
    text
}

/// Seed and reason of each run whose method broke; `None` where none did.
fn failures_csv(runs: &[Summary]) -> Option<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["seed", "failure"]).ok()?;
    let mut any = false;
    for (run, failure) in runs.iter().filter_map(|run| Some((run, run.failure.as_ref()?))) {
        any = true;
        table.write_record([&run.seed.to_string(), failure]).ok()?;
    }
    table.into_inner().ok().filter(|_| any)
}

/// The cells of one run in the order of [`COLUMNS`].
fn row(run: &Summary) -> [String; 17] {
    let number = |value: Option<f64>| value.filter(|v| v.is_finite()).map_or_else(String::new, |v| v.to_string());
    let estimate = run.estimate.as_ref();
    [
        run.seed.to_string(),
        run.outcome.name().to_owned(),
        run.claimed_home.to_string(),
        number(Some(run.start_distance_m)),
        number(Some(run.final_distance_m)),
        number(Some(run.time_s)),
        number(run.time_ratio),
        number(Some(run.path_length_m)),
        number(Some(run.odometry_drift_m)),
        run.collisions.to_string(),
        number(estimate.map(|e| e.range_error_m)),
        number(estimate.map(|e| e.bearing_error_rad)),
        number(estimate.map(|e| e.heading_error_rad)),
        number(estimate.and_then(|e| e.nees)),
        number(Some(run.landmarks.seen_mean)),
        number(Some(run.landmarks.matched_mean)),
        number(Some(run.landmarks.rejected_mean)),
    ]
}
