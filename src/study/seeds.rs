//! The same setup over a range of seeds, in parallel.

use std::ops::{ControlFlow, RangeInclusive};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use serde::Serialize;

use super::statistics::{quantile, wilson_95};
use crate::episode::{Outcome, Progress, Setup, SetupRecord, Simulation, Summary};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::world::World;

/// What a watcher of a batch is told.
#[derive(Debug, Clone, Copy)]
pub enum SeedEvent<'a> {
    /// A run has taken a control step.
    Step(&'a Progress),
    /// A run has ended.
    Done(&'a Summary),
}

/// Runs every seed of the range and returns the summaries in the order of the seeds, as [`run_jobs`] does.
///
/// # Errors
/// As [`run_jobs`].
pub fn run_seeds(
    world: &World,
    setup: &Setup,
    seeds: RangeInclusive<u64>,
    threads: usize,
    watch: &(dyn Fn(SeedEvent<'_>) -> ControlFlow<()> + Sync),
) -> Result<Vec<Summary>> {
    let jobs: Vec<Job> = seeds.map(|seed| Job { seed, start: None }).collect();
    run_jobs(world, setup, &jobs, threads, watch)
}

/// One run of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Job {
    /// Its seed.
    pub seed: u64,
    /// Where it starts in the room; `None` for the setup's start.
    pub start: Option<Pose>,
}

/// Runs every job and returns the summaries in the order of the jobs.
///
/// Each of `threads` workers takes the next job when it is done with one, and computes it alone: what a job gives depends on
/// neither the number of workers nor their order. `watch` is called from all of them.
///
/// # Errors
/// The first error of a run; [`Error::Interrupted`] when `watch` breaks. The other runs are then given up.
pub fn run_jobs(
    world: &World,
    setup: &Setup,
    jobs: &[Job],
    threads: usize,
    watch: &(dyn Fn(SeedEvent<'_>) -> ControlFlow<()> + Sync),
) -> Result<Vec<Summary>> {
    let mut benches = vec![Simulation::new(world, setup)?];
    for _ in 1..threads.min(jobs.len()) {
        benches.push(benches[0].another()?);
    }
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let work = |bench: &mut Simulation<'_>| -> Result<Vec<(usize, Summary)>> {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(&Job { seed, start }) = jobs.get(index).filter(|_| !stop.load(Ordering::Relaxed)) else {
                return Ok(done);
            };
            let watch_step = &mut |progress: &Progress| {
                if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { watch(SeedEvent::Step(progress)) }
            };
            let record = match start {
                Some(start) => bench.run_from(seed, start, watch_step)?,
                None => bench.run(seed, watch_step)?,
            };
            let summary = Summary::new(&record, world, setup, seed);
            let carry_on = watch(SeedEvent::Done(&summary));
            done.push((index, summary));
            if carry_on.is_break() {
                return Err(Error::Interrupted);
            }
        }
    };
    let results: Vec<Result<Vec<(usize, Summary)>>> = std::thread::scope(|scope| {
        let workers: Vec<_> = benches
            .into_iter()
            .map(|mut bench| {
                scope.spawn(|| {
                    // A pool of one keeps a worker's data parallelism (rendering, matching) on the worker itself: the runs side by
                    // side fill the processor better than each of them spread over it.
                    let pool =
                        rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| Error::Threads(e.to_string()))?;
                    let result = pool.install(move || work(&mut bench));
                    if result.is_err() {
                        stop.store(true, Ordering::Relaxed);
                    }
                    result
                })
            })
            .collect();
        workers.into_iter().map(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    let mut summaries = Vec::new();
    let mut interrupted = false;
    for result in results {
        match result {
            Ok(done) => summaries.extend(done),
            // The other workers' consequence of the first error, or of Ctrl-C where there is no other.
            Err(Error::Interrupted) => interrupted = true,
            Err(error) => return Err(error),
        }
    }
    if interrupted {
        return Err(Error::Interrupted);
    }
    summaries.sort_by_key(|(index, _)| *index);
    Ok(summaries.into_iter().map(|(_, summary)| summary).collect())
}

/// A batch in numbers.
#[derive(Debug, Clone, Serialize)]
pub struct SeedsSummary {
    /// First and last seed.
    pub seeds: [u64; 2],
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
    /// The parts and settings.
    pub setup: SetupRecord,
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Version of this program.
    pub version: &'static str,
}

/// Runs by outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct OutcomeCounts {
    /// Home reached.
    pub home: usize,
    /// Out of time.
    pub timeout: usize,
    /// Gave up, or a wrong claim.
    pub lost: usize,
    /// Did not move.
    pub stuck: usize,
    /// The method broke; left out where it never did.
    #[serde(skip_serializing_if = "is_zero")]
    pub failed: usize,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Median and outer values; each `None` where there are none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// How many values.
    pub count: usize,
    /// Median.
    pub median: Option<f64>,
    /// 90 % quantile.
    pub p90: Option<f64>,
    /// Greatest.
    pub max: Option<f64>,
}

impl Spread {
    /// Of the given values.
    #[must_use]
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let at = |share| quantile(&values, share);
        Self { count: values.len(), median: at(0.5), p90: at(0.9), max: at(1.0) }
    }
}

impl SeedsSummary {
    /// Of the runs of `setup` on `world`.
    #[must_use]
    pub fn new(runs: &[Summary], seeds: &RangeInclusive<u64>, world: &World, setup: &Setup) -> Self {
        let count = |outcome: Outcome| runs.iter().filter(|r| r.outcome == outcome).count();
        let home = count(Outcome::Home);
        Self {
            seeds: [*seeds.start(), *seeds.end()],
            runs: runs.len(),
            home,
            home_share: home as f64 / runs.len().max(1) as f64,
            home_share_95: wilson_95(home, runs.len()),
            outcomes: OutcomeCounts {
                home,
                timeout: count(Outcome::Timeout),
                lost: count(Outcome::Lost),
                stuck: count(Outcome::Stuck),
                failed: count(Outcome::Failed),
            },
            wrong_claims: runs.iter().filter(|r| r.is_wrong_claim()).count(),
            time_ratio: Spread::of(runs.iter().filter_map(|r| r.time_ratio)),
            final_distance_m: Spread::of(runs.iter().map(|r| r.final_distance_m)),
            claimed_distance_m: Spread::of(runs.iter().filter(|r| r.claimed_home).map(|r| r.final_distance_m)),
            range_error_m: Spread::of(runs.iter().filter_map(|r| Some(r.estimate?.range_error_m.abs()))),
            nees: Spread::of(runs.iter().filter_map(|r| r.estimate?.nees)),
            odometry_drift_m: Spread::of(runs.iter().map(|r| r.odometry_drift_m)),
            runs_with_collisions: runs.iter().filter(|r| r.collisions > 0).count(),
            setup: SetupRecord::new(setup, world),
            world: world.spec.name.clone(),
            world_sha256: world.sha256.clone(),
            version: crate::VERSION,
        }
    }
}
