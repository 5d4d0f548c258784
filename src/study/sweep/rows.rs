//! An episode as a row of the study's table.

use std::sync::Arc;

use super::spec::{Levels, Study};
use super::value::Value;
use crate::episode::{Outcome, Summary};
use crate::table::{Cells, Table};

/// Outcome of a row whose episode ended the program's thread.
pub const PANIC: &str = "panic";
/// Outcome of a row whose episode could not be run.
pub const ERROR: &str = "error";

/// Real numbers of a row: column and where they come from.
type Measure = (&'static str, fn(&Summary) -> Option<f64>);

/// All real numbers of a row, in the order of the table's columns.
const MEASURES: [Measure; 21] = [
    ("final_distance_m", |s| Some(s.final_distance_m)),
    ("final_heading_error_rad", |s| Some(s.final_heading_error_rad)),
    ("time_s", |s| Some(s.time_s)),
    ("straight_line_time_s", |s| s.straight_line_time_s),
    ("time_ratio", |s| s.time_ratio),
    ("path_length_m", |s| Some(s.path_length_m)),
    ("initial_distance_m", |s| Some(s.start_distance_m)),
    ("start_x_m", |s| Some(s.start.x_m)),
    ("start_y_m", |s| Some(s.start.y_m)),
    ("start_heading_rad", |s| Some(s.start.heading_rad)),
    ("odometry_drift_m", |s| Some(s.odometry_drift_m)),
    ("range_error_m", |s| Some(s.estimate?.range_error_m)),
    ("bearing_error_rad", |s| Some(s.estimate?.bearing_error_rad)),
    ("heading_error_rad", |s| Some(s.estimate?.heading_error_rad)),
    ("range_rmse_m", |s| Some(s.estimate?.range_rmse_m)),
    ("bearing_rmse_rad", |s| Some(s.estimate?.bearing_rmse_rad)),
    ("heading_rmse_rad", |s| Some(s.estimate?.heading_rmse_rad)),
    ("nees", |s| s.estimate?.nees),
    ("seen_mean", |s| Some(s.landmarks.seen_mean)),
    ("matched_mean", |s| Some(s.landmarks.matched_mean)),
    ("rejected_mean", |s| Some(s.landmarks.rejected_mean)),
];
/// A whole number of a summary.
type Count = fn(&Summary) -> usize;
/// Whole numbers of a row.
const COUNTS: [(&str, Count); 3] =
    [("collisions", |s| s.collisions), ("home_landmarks", |s| s.landmarks.home), ("steps", |s| s.steps)];

/// One episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its number in the study, from 0.
    pub episode: u64,
    /// Its cell.
    pub cell: u64,
    /// Its seed.
    pub seed: u64,
    /// The values of the study's axes.
    pub values: Arc<[Value]>,
    /// `home`, `timeout`, `lost`, `stuck`, [`PANIC`] or [`ERROR`].
    pub outcome: String,
    /// Why it did not end at home; empty where it did.
    pub reason: String,
    /// Whether the method claimed to be home, rightly or not.
    pub claimed_home: Option<bool>,
    /// What rendered: `cpu` or `gpu`.
    pub renderer: Option<String>,
    counts: [Option<i64>; COUNTS.len()],
    measures: [Option<f64>; MEASURES.len()],
}

impl Row {
    /// The row of an episode that ran.
    #[must_use]
    pub fn of(episode: u64, cell: u64, values: &Arc<[Value]>, summary: &Summary) -> Self {
        let reason = match summary.outcome {
            Outcome::Home => String::new(),
            Outcome::Timeout => format!("{:.1} m from home at the time limit", summary.final_distance_m),
            Outcome::Lost if summary.claimed_home => {
                format!("claimed to be home {:.1} cm from it", 100.0 * summary.final_distance_m)
            }
            Outcome::Lost => "the method gave up".to_owned(),
            Outcome::Stuck => match summary.collision_list.last() {
                Some(hit) => format!("did not move although told to; last ran into {}", hit.with),
                None => "did not move although told to".to_owned(),
            },
            Outcome::Failed => summary.failure.clone().unwrap_or_else(|| "the method failed".to_owned()),
        };
        let finite = |value: Option<f64>| value.filter(|v| v.is_finite());
        Self {
            episode,
            cell,
            seed: summary.seed,
            values: Arc::clone(values),
            outcome: summary.outcome.name().to_owned(),
            reason,
            claimed_home: Some(summary.claimed_home),
            renderer: summary.renderer.as_ref().map(|r| r.kind.clone()),
            counts: COUNTS.map(|(_, of)| Some(of(summary) as i64)),
            measures: MEASURES.map(|(_, of)| finite(of(summary))),
        }
    }

    /// The row of an episode that has no result: `outcome` is [`PANIC`] or [`ERROR`].
    #[must_use]
    pub fn without_result(
        episode: u64,
        (cell, seed): (u64, u64),
        values: &Arc<[Value]>,
        outcome: &str,
        reason: String,
    ) -> Self {
        Self {
            episode,
            cell,
            seed,
            values: Arc::clone(values),
            outcome: outcome.to_owned(),
            reason,
            claimed_home: None,
            renderer: None,
            counts: [None; COUNTS.len()],
            measures: [None; MEASURES.len()],
        }
    }

    /// Whether the robot came home.
    #[must_use]
    pub fn is_home(&self) -> bool {
        self.outcome == Outcome::Home.name()
    }

    /// Whether the method claimed to be home and the robot came to rest outside the arrival radius, as
    /// [`Summary::is_wrong_claim`].
    #[must_use]
    pub fn is_wrong_claim(&self) -> bool {
        self.claimed_home == Some(true) && !self.is_home()
    }

    /// The number in a column of whole numbers.
    #[must_use]
    pub fn count(&self, column: &str) -> Option<i64> {
        COUNTS.iter().position(|(name, _)| *name == column).and_then(|k| self.counts[k])
    }

    /// The number in a column of real numbers.
    #[must_use]
    pub fn measure(&self, column: &str) -> Option<f64> {
        MEASURES.iter().position(|(name, _)| *name == column).and_then(|k| self.measures[k])
    }
}

/// The rows as a table: where they belong, the axes' values, how they ended, and in numbers.
#[must_use]
pub fn table(study: &Study, rows: &[Row]) -> Table {
    let mut table = Table::default()
        .ints("episode", rows.iter().map(|r| r.episode as i64))
        .ints("cell", rows.iter().map(|r| r.cell as i64))
        .ints("seed", rows.iter().map(|r| r.seed as i64));
    for (k, axis) in study.axes.iter().enumerate() {
        let (name, values) = (&axis.setting, rows.iter().map(|r| &r.values[k]));
        let all = |fits: fn(&Value) -> bool| match &axis.levels {
            Levels::Listed(values) => values.iter().all(fits),
            Levels::Between { low, .. } => fits(&Value::Real(*low)),
        };
        // The type follows from the study, not from the rows at hand, so that all chunks have the same columns.
        table = if all(|v| matches!(v, Value::Whole(_))) {
            table.ints(name, values.map(|v| if let Value::Whole(n) = v { Some(*n) } else { None }))
        } else if all(|v| v.number().is_some()) {
            table.reals(name, values.map(Value::number))
        } else if all(|v| matches!(v, Value::Truth(_))) {
            table.bools(name, values.map(|v| if let Value::Truth(b) = v { Some(*b) } else { None }))
        } else {
            table.texts(name, values.map(Value::to_string))
        };
    }
    table = table
        .texts("outcome", rows.iter().map(|r| r.outcome.clone()))
        .texts("reason", rows.iter().map(|r| r.reason.clone()))
        .bools("claimed_home", rows.iter().map(|r| r.claimed_home))
        .bools("wrong_claim", rows.iter().map(Row::is_wrong_claim));
    for (k, (name, _)) in MEASURES.iter().enumerate() {
        table = table.reals(name, rows.iter().map(|r| r.measures[k]));
    }
    for (k, (name, _)) in COUNTS.iter().enumerate() {
        table = table.ints(name, rows.iter().map(|r| r.counts[k]));
    }
    table.texts("renderer", rows.iter().map(|r| r.renderer.clone()))
}

/// The rows of a table that [`table`] made of the same study.
///
/// # Errors
/// What is missing or does not fit.
pub fn from_table(study: &Study, table: &Table) -> Result<Vec<Row>, String> {
    let unfit = |name: &str| format!("column {name}: missing or of another type");
    let ints = |name: &str| match table.column(name) {
        Some(Cells::Int(cells)) => Ok(cells),
        _ => Err(unfit(name)),
    };
    let reals = |name: &str| match table.column(name) {
        Some(Cells::Real(cells)) => Ok(cells),
        _ => Err(unfit(name)),
    };
    let texts = |name: &str| match table.column(name) {
        Some(Cells::Text(cells)) => Ok(cells),
        _ => Err(unfit(name)),
    };
    let Some(Cells::Bool(claims)) = table.column("claimed_home") else { return Err(unfit("claimed_home")) };
    let (episodes, outcomes, reasons, renderers) = (ints("episode")?, texts("outcome")?, texts("reason")?, texts("renderer")?);
    let counts = COUNTS.iter().map(|(name, _)| ints(name)).collect::<Result<Vec<_>, _>>()?;
    let measures = MEASURES.iter().map(|(name, _)| reals(name)).collect::<Result<Vec<_>, _>>()?;
    let mut values: (u64, Arc<[Value]>) = (u64::MAX, Arc::new([]));
    let mut rows = Vec::with_capacity(episodes.len());
    for (k, episode) in episodes.iter().enumerate() {
        let episode = episode.and_then(|n| u64::try_from(n).ok()).filter(|n| *n < study.episodes());
        let episode = episode.ok_or_else(|| format!("row {k}: an episode that the study does not have"))?;
        let (cell, seed) = study.place(episode);
        if values.0 != cell {
            values = (cell, study.values(cell).into());
        }
        rows.push(Row {
            episode,
            cell,
            seed,
            values: Arc::clone(&values.1),
            outcome: outcomes[k].clone().unwrap_or_default(),
            reason: reasons[k].clone().unwrap_or_default(),
            claimed_home: claims[k],
            renderer: renderers[k].clone(),
            counts: std::array::from_fn(|c| counts[c][k]),
            measures: std::array::from_fn(|m| measures[m][k]),
        });
    }
    Ok(rows)
}
