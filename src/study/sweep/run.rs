//! Running chunks of a study, in parallel, with nothing that an episode does able to end the study.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use super::duels::failures;
use super::rows::{Row, without_result};
use super::spec::{Chunk, Study};
use super::value::Value;
use crate::episode::{Record, Setup, Simulation, Summary};
use crate::error::{Error, Result, go_on};
use crate::study::pool::{Broken, Pool, Scenes};
use crate::study::row::Ending;
use crate::world::World;

/// Where a study's rows go.
pub trait Store: Sync {
    /// Keeps the rows of a chunk, all at once.
    ///
    /// # Errors
    /// When they cannot be kept; the study then ends.
    fn keep(&self, chunk: &Chunk, rows: &[Row]) -> Result<()>;

    /// Keeps the full record of an episode that ran in `world` and did not end at home, and the same in numbers.
    ///
    /// # Errors
    /// When it cannot be kept; the study then ends.
    fn keep_failure(&self, row: &Row, world: &World, record: &Record, summary: &Summary) -> Result<()>;
}

/// Keeps rows in memory, in the order in which chunks end, and no records.
impl Store for Mutex<Vec<Row>> {
    fn keep(&self, _chunk: &Chunk, rows: &[Row]) -> Result<()> {
        self.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(rows);
        Ok(())
    }

    fn keep_failure(&self, _: &Row, _: &World, _: &Record, _: &Summary) -> Result<()> {
        Ok(())
    }
}

/// Runs chunks of a study and hands their rows to `store`, a whole chunk at once.
///
/// What a row says depends on the study and the episode's number alone. An episode that panics or cannot be run is a row that
/// says so. `watch` is called once an episode, from all threads.
///
/// # Errors
/// [`Error::Interrupted`] when the pool is stopped, and what the store fails with. Chunks that were under way are lost; those that
/// were done are kept.
pub fn run(study: &Study, chunks: &[u64], pool: &Pool<'_>, store: &dyn Store, watch: &(dyn Fn(&Row) + Sync)) -> Result<()> {
    let scenes = Scenes::of(pool);
    pool.map(
        chunks,
        || (),
        |(), index, halted| {
            let chunk = study.chunk(*index);
            store.keep(&chunk, &run_chunk(study, &chunk, &scenes, store, watch, halted)?)
        },
    )?;
    Ok(())
}

fn run_chunk(
    study: &Study,
    chunk: &Chunk,
    scenes: &Scenes,
    store: &dyn Store,
    watch: &(dyn Fn(&Row) + Sync),
    halted: &dyn Fn() -> bool,
) -> Result<Vec<Row>> {
    let values: Arc<[Value]> = study.values(chunk.cell).into();
    let shared = (!study.draws_worlds()).then(|| study.case(&values, chunk.seed));
    let mut ready = None;
    let mut rows = Vec::new();
    for (number, seed) in (chunk.first..).zip(chunk.seed..).take(chunk.count as usize) {
        let episode = Episode { number, seed, cell: chunk.cell, values: &values };
        let row = match &shared {
            Some(case) => episode.run(case, &mut ready, scenes, store, halted)?,
            None => episode.run(&study.case(&values, seed), &mut None, scenes, store, halted)?,
        };
        watch(&row);
        rows.push(row);
    }
    Ok(rows)
}

/// An episode of a study.
struct Episode<'a> {
    number: u64,
    seed: u64,
    cell: u64,
    values: &'a Arc<[Value]>,
}

impl Episode<'_> {
    /// Its row, whatever becomes of it but an interruption; `ready` is the simulation of the case, kept from one episode to the next.
    fn run<'c>(
        &self,
        case: &'c Result<(World, Setup)>,
        ready: &mut Option<Simulation<'c>>,
        scenes: &Scenes,
        store: &dyn Store,
        halted: &dyn Fn() -> bool,
    ) -> Result<Row> {
        let failed = |outcome, reason| without_result(self.number, (self.cell, self.seed), self.values, outcome, reason);
        let (world, setup) = match case {
            Ok((world, setup)) => (world, setup),
            Err(error) => return Ok(failed(Ending::Error, in_full(error))),
        };
        Ok(match scenes.episode(ready, (world, setup), (self.seed, None), halted) {
            Ok((record, summary)) => {
                let row = Row::of(self.number, self.cell, self.values, &summary);
                if !row.run.is_home() {
                    store.keep_failure(&row, world, &record, &summary)?;
                }
                row
            }
            Err(Broken::Error(Error::Interrupted)) => return Err(Error::Interrupted),
            Err(Broken::Error(error)) => failed(Ending::Error, in_full(&error)),
            Err(Broken::Panic(reason)) => failed(Ending::Panic, reason),
        })
    }
}

/// Runs one episode of a study again.
///
/// # Errors
/// When the study has no such episode, or it cannot be run.
pub fn replay(study: &Study, number: u64) -> Result<(World, Setup, Record, Summary, Row)> {
    if number >= study.episodes() {
        let allowed = format!("0 to {}", study.episodes() - 1);
        return Err(Error::Invalid { what: "row".into(), found: number.to_string(), allowed });
    }
    let (cell, seed) = study.place(number);
    let values: Arc<[Value]> = study.values(cell).into();
    let (world, setup) = study.case(&values, seed)?;
    let ran = Scenes::of(&Pool::new(1)).episode(&mut None, (&world, &setup), (seed, None), &|| false);
    let (record, summary) = ran.map_err(Broken::into_error)?;
    let row = Row::of(number, cell, &values, &summary);
    Ok((world, setup, record, summary, row))
}

/// A failed run that was run again.
pub struct Exhibit {
    /// Its row.
    pub row: Row,
    /// The world it ran in.
    pub world: World,
    /// What happened.
    pub record: Record,
}

/// Runs failures worth a look again, at most `most`, and tells how many did not run as their rows say, because another machine's graphics
/// or another build made them. `watch` is called before each.
///
/// # Errors
/// What a run fails with; [`Error::Interrupted`] when `watch` breaks.
pub fn exhibits(
    study: &Study,
    rows: &[Row],
    most: usize,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<(Vec<Exhibit>, usize)> {
    let (mut shown, mut withheld) = (Vec::new(), 0);
    for row in failures(study, rows, most) {
        go_on(watch())?;
        let (world, _, record, _, again) = replay(study, row.episode)?;
        if again == *row { shown.push(Exhibit { row: again, world, record }) } else { withheld += 1 }
    }
    Ok((shown, withheld))
}

/// An error with what caused it.
fn in_full(error: &Error) -> String {
    let cause = std::error::Error::source(error).map_or_else(String::new, |cause| format!(": {cause}"));
    format!("{error}{cause}")
}
