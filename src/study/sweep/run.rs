//! Running chunks of a study, in parallel, with nothing that an episode does able to end the study.

use std::any::Any;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::rows::{ERROR, PANIC, Row};
use super::spec::{Chunk, Study};
use super::value::Value;
use crate::episode::{Look, Progress, Record, Setup, Simulation, Summary};
use crate::error::{Error, Result};
use crate::render::Scene;
use crate::world::World;

/// Where a study's rows go.
pub trait Store: Sync {
    /// Keeps the rows of a chunk, all at once.
    ///
    /// # Errors
    /// When they cannot be kept; the study then ends.
    fn keep(&self, chunk: &Chunk, rows: &[Row]) -> Result<()>;

    /// Keeps the full record of an episode that did not end at home.
    ///
    /// # Errors
    /// When it cannot be kept; the study then ends.
    fn keep_failure(&self, failure: &Failure<'_>) -> Result<()>;
}

/// An episode that ran and did not end at home.
#[derive(Clone, Copy)]
pub struct Failure<'a> {
    /// Its row.
    pub row: &'a Row,
    /// The world.
    pub world: &'a World,
    /// What happened.
    pub record: &'a Record,
    /// The same in numbers.
    pub summary: &'a Summary,
}

/// Runs chunks of a study, `threads` at a time, and hands their rows to `store`, a whole chunk at once.
///
/// What a row says depends on the study and the episode's number alone. An episode that panics or cannot be run is a row that
/// says so. `watch` is called once an episode, from all threads.
///
/// # Errors
/// [`Error::Interrupted`] when `watch` breaks, and what the store fails with. Chunks that were under way are lost; those that
/// were done are kept.
pub fn run(
    study: &Study,
    chunks: &[u64],
    threads: usize,
    store: &dyn Store,
    watch: &(dyn Fn(&Row) -> ControlFlow<()> + Sync),
    stopped: &(dyn Fn() -> bool + Sync),
) -> Result<()> {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let work = || -> Result<()> {
        let mut packed = None;
        while let Some(&index) = chunks.get(next.fetch_add(1, Ordering::Relaxed)) {
            let halted = || stop.load(Ordering::Relaxed) || stopped();
            let chunk = study.chunk(index);
            let rows = run_chunk(study, &chunk, &mut packed, store, watch, &halted)?;
            store.keep(&chunk, &rows)?;
        }
        Ok(())
    };
    let results: Vec<Result<()>> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.clamp(1, chunks.len().max(1)))
            .map(|_| {
                scope.spawn(|| {
                    // A pool of one keeps a worker's data parallelism (rendering, matching) on the worker itself.
                    let pool =
                        rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| Error::Threads(e.to_string()))?;
                    let result = pool.install(work);
                    if result.is_err() {
                        stop.store(true, Ordering::Relaxed);
                    }
                    result
                })
            })
            .collect();
        workers.into_iter().map(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    let mut interrupted = Ok(());
    for result in results {
        match result {
            Err(Error::Interrupted) => interrupted = Err(Error::Interrupted),
            other => other?,
        }
    }
    interrupted
}

fn run_chunk(
    study: &Study,
    chunk: &Chunk,
    packed: &mut Option<Packed>,
    store: &dyn Store,
    watch: &(dyn Fn(&Row) -> ControlFlow<()> + Sync),
    halted: &dyn Fn() -> bool,
) -> Result<Vec<Row>> {
    let values: Arc<[Value]> = study.values(chunk.cell).into();
    let case = study.case(&values);
    let mut bench = None;
    let mut rows = Vec::new();
    for (episode, seed) in (chunk.first..).zip(chunk.seed..).take(chunk.count as usize) {
        let failed = |outcome, reason| Row::without_result(episode, (chunk.cell, seed), &values, outcome, reason);
        let row = match &case {
            Err(error) => failed(ERROR, in_full(error)),
            Ok((world, setup)) => {
                let ran = attempt(|| run_episode(&mut bench, packed, world, setup, seed, halted));
                match ran {
                    Ok(Ok((record, summary))) => {
                        let row = Row::of(episode, chunk.cell, &values, &summary);
                        if !row.is_home() {
                            store.keep_failure(&Failure { row: &row, world, record: &record, summary: &summary })?;
                        }
                        row
                    }
                    Ok(Err(Error::Interrupted)) => return Err(Error::Interrupted),
                    Ok(Err(error)) => failed(ERROR, in_full(&error)),
                    Err(reason) => {
                        bench = None; // nobody knows what state the panic left it in
                        failed(PANIC, reason)
                    }
                }
            }
        };
        if watch(&row).is_break() {
            return Err(Error::Interrupted);
        }
        rows.push(row);
    }
    Ok(rows)
}

/// A packed world that the next cell may be able to use: neighbouring cells often differ in other things than looks.
struct Packed {
    world_sha256: String,
    looks: [Look; 2],
    scenes: [Arc<Scene>; 2],
}

/// The bench of a cell, packed anew only where the last one was of another world or other looks.
fn bench_of<'a>(packed: &mut Option<Packed>, world: &'a World, setup: &'a Setup) -> Result<Simulation<'a>> {
    if let Some(Packed { world_sha256, looks, scenes }) = packed
        && *world_sha256 == world.sha256
        && *looks == setup.looks()
    {
        return Simulation::with_scenes(world, setup, scenes.clone());
    }
    let bench = Simulation::new(world, setup)?;
    let keep = |scenes| Packed { world_sha256: world.sha256.clone(), looks: setup.looks(), scenes };
    *packed = bench.scenes().map(keep);
    Ok(bench)
}

fn run_episode<'a>(
    bench: &mut Option<Simulation<'a>>,
    packed: &mut Option<Packed>,
    world: &'a World,
    setup: &'a Setup,
    seed: u64,
    halted: &dyn Fn() -> bool,
) -> Result<(Record, Summary)> {
    let bench = match bench {
        Some(bench) => bench,
        None => bench.insert(bench_of(packed, world, setup)?),
    };
    let watch = &mut |_: &Progress| if halted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let record = bench.run(seed, watch)?;
    let summary = Summary::new(&record, world, setup, seed);
    Ok((record, summary))
}

/// Runs one episode of a study again.
///
/// # Errors
/// When the study has no such episode, or it cannot be run.
pub fn replay(study: &Study, episode: u64) -> Result<(World, Setup, Record, Summary, Row)> {
    if episode >= study.episodes() {
        let allowed = format!("0 to {}", study.episodes() - 1);
        return Err(Error::Invalid { what: "row".into(), found: episode.to_string(), allowed });
    }
    let (cell, seed) = study.place(episode);
    let values: Arc<[Value]> = study.values(cell).into();
    let (world, setup) = study.case(&values)?;
    let (record, summary) = run_episode(&mut None, &mut None, &world, &setup, seed, &|| false)?;
    let row = Row::of(episode, cell, &values, &summary);
    Ok((world, setup, record, summary, row))
}

/// What `act` returns, or what it panicked with.
fn attempt<T>(act: impl FnOnce() -> T) -> std::result::Result<T, String> {
    catch_unwind(AssertUnwindSafe(act)).map_err(|panic| message(&*panic))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without words").to_owned()
}

/// An error with what caused it.
fn in_full(error: &Error) -> String {
    let cause = std::error::Error::source(error).map_or_else(String::new, |cause| format!(": {cause}"));
    format!("{error}{cause}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_caught_with_its_words() {
        assert_eq!(attempt(|| 3), Ok(3));
        assert_eq!(attempt(|| -> () { panic!("wheel {} fell off", 2) }), Err("wheel 2 fell off".to_owned()));
        assert_eq!(attempt(|| -> () { std::panic::panic_any(7) }), Err("a panic without words".to_owned()));
    }
}
