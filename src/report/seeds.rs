//! The files of a batch of seeds.

use serde::Serialize;

use crate::error::Result;
use crate::storage::{OutputFolder, csv, json};
use crate::study::row::{Ending, RunRow};
use crate::study::seeds::SeedsSummary;

/// Names of all files of a batch; the last is there when a method broke.
pub const FILES: &[&str] = &["summary.json", "seeds.csv", "failures.csv"];

/// A row of `failures.csv`.
#[derive(Serialize)]
struct FailureRow<'a> {
    seed: u64,
    failure: &'a str,
}

/// Writes all files of a batch.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, batch: &SeedsSummary, rows: &[RunRow]) -> Result<()> {
    folder.write("seeds.csv", csv(rows).as_bytes())?;
    let failed = rows.iter().filter(|row| row.outcome == Ending::Failed);
    let failures = csv(failed.map(|row| FailureRow { seed: row.seed, failure: &row.reason }));
    if !failures.is_empty() {
        folder.write("failures.csv", failures.as_bytes())?;
    }
    folder.write("summary.json", json(batch).as_bytes())?;
    folder.finish()
}
