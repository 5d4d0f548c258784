//! The files of a batch of seeds.

use crate::error::Result;
use crate::storage::csv::{Columns, csv, number};
use crate::storage::{OutputFolder, json};
use crate::study::row::{Ending, RunRow};
use crate::study::seeds::SeedsSummary;

/// Columns of `seeds.csv`.
const COLUMNS: &Columns<RunRow> = &[
    ("seed", |r| r.seed.to_string()),
    ("outcome", |r| r.outcome.to_string()),
    ("claimed_home", |r| r.claimed_home.map_or_else(String::new, |claimed| claimed.to_string())),
    ("start_distance_m", |r| number(r.initial_distance_m)),
    ("final_distance_m", |r| number(r.final_distance_m)),
    ("time_s", |r| number(r.time_s)),
    ("time_ratio", |r| number(r.time_ratio)),
    ("path_length_m", |r| number(r.path_length_m)),
    ("odometry_drift_m", |r| number(r.odometry_drift_m)),
    ("collisions", |r| number(r.collisions.map(|n| n as f64))),
    ("range_error_m", |r| number(r.range_error_m)),
    ("bearing_error_rad", |r| number(r.bearing_error_rad)),
    ("heading_error_rad", |r| number(r.heading_error_rad)),
    ("nees", |r| number(r.nees)),
    ("seen_mean", |r| number(r.seen_mean)),
    ("matched_mean", |r| number(r.matched_mean)),
    ("rejected_mean", |r| number(r.rejected_mean)),
];
/// Columns of `failures.csv`.
const FAILURES: &Columns<RunRow> = &[("seed", |r| r.seed.to_string()), ("failure", |r| r.reason.clone())];

/// Writes all files of a batch.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, batch: &SeedsSummary, rows: &[RunRow]) -> Result<()> {
    folder.write("seeds.csv", csv(COLUMNS, rows).as_bytes())?;
    let failed: Vec<&RunRow> = rows.iter().filter(|row| row.outcome == Ending::Failed).collect();
    if !failed.is_empty() {
        folder.write("failures.csv", csv(FAILURES, failed).as_bytes())?;
    }
    folder.write("summary.json", json(batch).as_bytes())?;
    folder.finish()
}
