//! The same setup over a range of seeds.

use std::ops::RangeInclusive;

use serde::Serialize;

use super::pool::{Broken, Pool, Scenes};
use super::row::RunRow;
use super::tally::Tally;
use crate::episode::{Setup, SetupRecord, Summary};
use crate::error::Result;
use crate::geometry::Pose;
use crate::world::World;

/// One run of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Job {
    /// Which of the batch's worlds and setups it runs on.
    pub case: usize,
    /// Its seed.
    pub seed: u64,
    /// Where it starts in the room; `None` for the setup's start.
    pub start: Option<Pose>,
}

/// Runs every job and returns the summaries in the order of the jobs. `watch` is told of each run's end, from all threads.
///
/// # Errors
/// The first error of a run, or that the pool was stopped; the other runs are then given up. A run that panics is no result: it panics
/// here.
pub fn run_jobs(
    cases: &[(&World, &Setup)],
    jobs: &[Job],
    pool: &Pool<'_>,
    watch: &(dyn Fn(&Job, &Summary) + Sync),
) -> Result<Vec<Summary>> {
    let scenes = Scenes::of(pool);
    let begin = || (usize::MAX, None);
    pool.map(jobs, begin, |(case, ready), job, halted| {
        if *case != job.case {
            (*case, *ready) = (job.case, None);
        }
        let ran = scenes.episode(ready, cases[job.case], (job.seed, job.start), halted);
        let (_, summary) = ran.map_err(Broken::into_error)?;
        watch(job, &summary);
        Ok(summary)
    })
}

/// Runs every seed of the range and returns the summaries in the order of the seeds, as [`run_jobs`] does.
///
/// # Errors
/// As [`run_jobs`].
pub fn run_seeds(
    world: &World,
    setup: &Setup,
    seeds: RangeInclusive<u64>,
    pool: &Pool<'_>,
    watch: &(dyn Fn(&Summary) + Sync),
) -> Result<Vec<Summary>> {
    let jobs: Vec<Job> = seeds.map(|seed| Job { case: 0, seed, start: None }).collect();
    run_jobs(&[(world, setup)], &jobs, pool, &|_, summary| watch(summary))
}

/// A batch in numbers.
#[derive(Debug, Clone, Serialize)]
pub struct SeedsSummary {
    /// First and last seed.
    pub seeds: [u64; 2],
    /// Its runs.
    #[serde(flatten)]
    pub tally: Tally,
    /// The parts and settings.
    pub setup: SetupRecord,
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Version of this program.
    pub version: &'static str,
}

impl SeedsSummary {
    /// Of the runs of `setup` on `world`.
    pub fn new(rows: &[RunRow], seeds: &RangeInclusive<u64>, world: &World, setup: &Setup) -> Self {
        Self {
            seeds: [*seeds.start(), *seeds.end()],
            tally: Tally::of(rows),
            setup: SetupRecord::new(setup, world),
            world: world.spec.name.clone(),
            world_sha256: world.sha256.clone(),
            version: crate::VERSION,
        }
    }
}
