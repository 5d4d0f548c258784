//! An episode as a row of the study's table.

use std::sync::Arc;

use super::spec::{Levels, Study};
use super::value::Value;
use crate::episode::Summary;
use crate::study::row::{Ending, INTS, REALS, RunRow};
use crate::table::{Cells, Table};

/// One episode of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its number in the study, from 0.
    pub episode: u64,
    /// Its cell.
    pub cell: u64,
    /// The values of the study's axes.
    pub values: Arc<[Value]>,
    /// What its run says.
    pub run: RunRow,
}

impl Row {
    /// The row of an episode that ran.
    pub fn of(episode: u64, cell: u64, values: &Arc<[Value]>, summary: &Summary) -> Self {
        Self { episode, cell, values: Arc::clone(values), run: summary.into() }
    }
}

impl Study {
    /// Where a row lies in the study, in words.
    pub fn place_in_words(&self, row: &Row) -> String {
        let set = self.axes.iter().zip(row.values.iter()).filter(|(_, value)| **value != Value::Unset);
        let words = set.map(|(axis, value)| format!("{} {value}", axis.label));
        words.chain([format!("seed {}", row.run.seed)]).collect::<Vec<_>>().join(", ")
    }
}

/// The rows as a table: where they belong, the axes' values, how they ended, and in numbers.
pub fn table(study: &Study, rows: &[Row]) -> Table {
    let mut table = Table::default()
        .ints("episode", rows.iter().map(|r| r.episode as i64))
        .ints("cell", rows.iter().map(|r| r.cell as i64))
        .ints("seed", rows.iter().map(|r| r.run.seed as i64));
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
            table.texts(name, values.map(|v| (*v != Value::Unset).then(|| v.to_string())))
        };
    }
    let mut runs: Vec<RunRow> = rows.iter().map(|r| r.run.clone()).collect();
    table = table
        .texts("outcome", runs.iter().map(|r| r.outcome.to_string()))
        .texts("reason", runs.iter().map(|r| r.reason.clone()))
        .bools("claimed_home", runs.iter().map(|r| r.claimed_home))
        .bools("wrong_claim", runs.iter().map(RunRow::is_wrong_claim));
    for (name, field) in REALS {
        table = table.reals(name, runs.iter_mut().map(|r| *field(r)));
    }
    for (name, field) in INTS {
        table = table.ints(name, runs.iter_mut().map(|r| *field(r)));
    }
    table.texts("renderer", runs.into_iter().map(|r| r.renderer))
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
    let texts = |name: &str| match table.column(name) {
        Some(Cells::Text(cells)) => Ok(cells),
        _ => Err(unfit(name)),
    };
    let Some(Cells::Bool(claims)) = table.column("claimed_home") else { return Err(unfit("claimed_home")) };
    let (outcomes, reasons, renderers) = (texts("outcome")?, texts("reason")?, texts("renderer")?);
    let mut values: (u64, Arc<[Value]>) = (u64::MAX, Arc::new([]));
    let mut rows = Vec::with_capacity(table.rows());
    for (k, episode) in ints("episode")?.iter().enumerate() {
        let episode = episode.and_then(|n| u64::try_from(n).ok()).filter(|n| *n < study.episodes());
        let episode = episode.ok_or_else(|| format!("row {k}: an episode that the study does not have"))?;
        let (cell, seed) = study.place(episode);
        if values.0 != cell {
            values = (cell, study.values(cell).into());
        }
        let outcome = outcomes[k].as_deref().unwrap_or_default();
        let run = RunRow {
            seed,
            outcome: outcome.parse().map_err(|_| format!("row {k}: an outcome `{outcome}`, which there is not"))?,
            reason: reasons[k].clone().unwrap_or_default(),
            claimed_home: claims[k],
            renderer: renderers[k].clone(),
            ..RunRow::default()
        };
        rows.push(Row { episode, cell, values: Arc::clone(&values.1), run });
    }
    for (name, field) in REALS {
        let Some(Cells::Real(cells)) = table.column(name) else { return Err(unfit(name)) };
        rows.iter_mut().zip(cells).for_each(|(row, cell)| *field(&mut row.run) = *cell);
    }
    for (name, field) in INTS {
        rows.iter_mut().zip(ints(name)?).for_each(|(row, cell)| *field(&mut row.run) = *cell);
    }
    Ok(rows)
}

/// The row of an episode that has no result, and why.
pub fn without_result(episode: u64, (cell, seed): (u64, u64), values: &Arc<[Value]>, outcome: Ending, reason: String) -> Row {
    Row { episode, cell, values: Arc::clone(values), run: RunRow { seed, outcome, reason, ..RunRow::default() } }
}

#[cfg(all(test, feature = "rapier"))]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn every_number_of_a_run_comes_back_from_the_table() {
        let text =
            "name = \"t\"\nworld = \"lab\"\nseeds = \"1..2\"\n[[axes]]\nsetting = \"hidden_share\"\nvalues = [0.0, 0.5]\n";
        let study = Study::from_toml(text, Path::new("t.toml"), None).unwrap();
        let world = crate::world::World::open("lab").unwrap();
        let (sensor, time_limit_s) = (crate::episode::SensorKind::Noisy, Some(3.0));
        let setup = crate::episode::Setup { sensor, time_limit_s, ..Default::default() };
        let pool = crate::study::pool::Pool::new(1);
        let summaries = crate::study::seeds::run_seeds(&world, &setup, 1..=2, &pool, &|_| ()).unwrap();
        let row = |(k, summary)| Row::of(k, 0, &study.values(0).into(), summary);
        let mut rows: Vec<Row> = (0..).zip(&summaries).map(row).collect();
        rows.push(without_result(2, (1, 1), &study.values(1).into(), Ending::Panic, "wheel off".into()));
        assert!(rows[0].run.range_rmse_m.is_some() && !rows[0].run.reason.is_empty(), "{:?}", rows[0]);
        assert_eq!(from_table(&study, &table(&study, &rows)).unwrap(), rows);
    }
}
