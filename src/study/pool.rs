//! Many episodes at once: the one pool of workers that all studies run on, and the one place that runs their episodes.

use std::any::Any;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::episode::{Look, Progress, Record, SensorKind, Setup, Simulation, Summary};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::render::Scene;
use crate::world::World;

/// Workers side by side.
#[derive(Clone, Copy)]
pub struct Pool<'a> {
    /// How many.
    pub threads: usize,
    /// Whether they are to stop; looked at in every control step of every episode.
    pub stopped: &'a AtomicBool,
}

impl Pool<'static> {
    /// A pool that nobody stops.
    pub fn new(threads: usize) -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { threads, stopped: &NEVER }
    }
}

impl Pool<'_> {
    /// Does every job and returns the results in the order of the jobs.
    ///
    /// Each worker begins with a state of its own, takes the next job when it is done with one, and computes it alone: what a job
    /// gives may depend on neither the number of workers nor their order. `work` is told how to ask whether to give up.
    ///
    /// # Errors
    /// The first error of a job. The jobs under way are then asked to give up, with [`Error::Interrupted`], and no more are begun.
    pub fn map<J: Sync, S, R: Send>(
        &self,
        jobs: &[J],
        begin: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, &J, &dyn Fn() -> bool) -> Result<R> + Sync,
    ) -> Result<Vec<R>> {
        let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
        let halted = || failed.load(Ordering::Relaxed) || self.stopped.load(Ordering::Relaxed);
        let worker = || -> Result<Vec<(usize, R)>> {
            let (mut state, mut done) = (begin(), Vec::new());
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(job) = jobs.get(index) else { return Ok(done) };
                if halted() {
                    return Err(Error::Interrupted);
                }
                done.push((index, work(&mut state, job, &halted)?));
            }
        };
        let alone = || {
            // A pool of one keeps a worker's data parallelism (rendering, matching) on the worker itself: the runs side by side fill
            // the processor better than each of them spread over it.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| Error::Threads(e.to_string()))?;
            let result = pool.install(worker);
            failed.fetch_or(result.is_err(), Ordering::Relaxed);
            result
        };
        let results: Vec<Result<Vec<(usize, R)>>> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..self.threads.clamp(1, jobs.len().max(1))).map(|_| scope.spawn(alone)).collect();
            workers.into_iter().map(|w| w.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
        });
        let (mut all, mut interrupted) = (Vec::new(), false);
        for result in results {
            match result {
                Ok(done) => all.extend(done),
                // The other workers' consequence of the first error, or of a stop where there is no other.
                Err(Error::Interrupted) => interrupted = true,
                Err(error) => return Err(error),
            }
        }
        if interrupted {
            return Err(Error::Interrupted);
        }
        all.sort_by_key(|(index, _)| *index);
        Ok(all.into_iter().map(|(_, result)| result).collect())
    }
}

/// The worlds that a study has packed last, for all of its workers: packing one, its textures above all, takes longer than a short run,
/// and neighbouring cells often differ in other things than looks.
pub struct Scenes {
    most: usize,
    packed: Mutex<Vec<Arc<Packed>>>,
}

struct Packed {
    world_sha256: String,
    looks: [Look; 2],
    scenes: Mutex<Option<[Arc<Scene>; 2]>>,
}

impl Scenes {
    /// None yet, and at most one for each worker.
    pub fn of(pool: &Pool<'_>) -> Self {
        Self { most: pool.threads.max(1), packed: Mutex::default() }
    }

    /// Runs the episode of one seed, from the setup's start or from a pose in the room, until `halted` says so. It runs on `ready`, which
    /// is made where there is none, and is not there any more after a panic.
    ///
    /// # Errors
    /// What keeps it from its end.
    pub fn episode<'a>(
        &self,
        ready: &mut Option<Simulation<'a>>,
        (world, setup): (&'a World, &'a Setup),
        (seed, start): (u64, Option<Pose>),
        halted: &dyn Fn() -> bool,
    ) -> std::result::Result<(Record, Summary), Broken> {
        let watch = &mut |_: &Progress| if halted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let ran = attempt(|| {
            let simulation = match ready {
                Some(simulation) => simulation,
                None => ready.insert(self.simulation(world, setup)?),
            };
            match start {
                Some(start) => simulation.run_from(seed, start, watch),
                None => simulation.run(seed, watch),
            }
        });
        if matches!(ran, Err(Broken::Panic(_))) {
            *ready = None; // nobody knows what state the panic left it in
        }
        let record = ran?.map_err(Broken::Error)?;
        let summary = Summary::new(&record, world, setup, seed);
        Ok((record, summary))
    }

    /// A simulation for episodes of one setup on one world.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn simulation<'a>(&self, world: &'a World, setup: &'a Setup) -> Result<Simulation<'a>> {
        if setup.sensor != SensorKind::Rendered {
            return Simulation::new(world, setup);
        }
        let packed = self.packed(world, setup);
        // Workers that want the same world wait here for the first of them.
        let mut scenes = packed.scenes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(scenes) = &*scenes {
            return Simulation::with_scenes(world, setup, scenes.clone());
        }
        let simulation = Simulation::new(world, setup)?;
        *scenes = simulation.scenes();
        Ok(simulation)
    }

    fn packed(&self, world: &World, setup: &Setup) -> Arc<Packed> {
        let mut all = self.packed.lock().unwrap_or_else(PoisonError::into_inner);
        let looks = setup.looks();
        if let Some(known) = all.iter().find(|p| p.world_sha256 == world.sha256 && p.looks == looks) {
            return Arc::clone(known);
        }
        if all.len() == self.most {
            all.remove(0);
        }
        let new = Arc::new(Packed { world_sha256: world.sha256.clone(), looks, scenes: Mutex::default() });
        all.push(Arc::clone(&new));
        new
    }
}

/// Why an episode has no result.
#[derive(Debug)]
pub enum Broken {
    /// It could not be run, or was stopped.
    Error(Error),
    /// It panicked, with these words.
    Panic(String),
}

impl Broken {
    /// The error, for those who have no row for a panic: it goes on.
    pub fn into_error(self) -> Error {
        match self {
            Self::Error(error) => error,
            Self::Panic(words) => resume_unwind(Box::new(words)),
        }
    }
}

/// What `act` returns, or what it panicked with.
fn attempt<T>(act: impl FnOnce() -> T) -> std::result::Result<T, Broken> {
    catch_unwind(AssertUnwindSafe(act)).map_err(|panic| Broken::Panic(words(&*panic)))
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without words").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_jobs() {
        let jobs: Vec<u64> = (0..50).collect();
        for threads in [1, 3, 80] {
            let squares = Pool::new(threads).map(&jobs, || 0, |_, job, _| Ok(job * job)).unwrap();
            assert!(squares.iter().zip(&jobs).all(|(square, job)| *square == job * job) && squares.len() == 50);
        }
        assert!(Pool::new(2).map(&[] as &[u64], || (), |(), job, _| Ok(*job)).unwrap().is_empty());
    }

    #[test]
    fn the_first_error_ends_all_and_a_stop_is_an_interruption() {
        let fault = |job: &u64| Error::Threads(format!("job {job}"));
        // The other worker waits until it is asked to give up: it would wait for ever if it were not.
        let work = |(): &mut (), job: &u64, halted: &dyn Fn() -> bool| -> Result<()> {
            if *job == 1 {
                return Err(fault(job));
            }
            while !halted() {
                std::thread::yield_now();
            }
            Err(Error::Interrupted)
        };
        let result = Pool::new(2).map(&[0, 1, 2], || (), work);
        assert!(matches!(result, Err(Error::Threads(job)) if job == "job 1"));
        let stopped = Pool { threads: 2, stopped: &AtomicBool::new(true) };
        assert!(matches!(stopped.map(&[0, 1], || (), |(), _, _| Ok(())), Err(Error::Interrupted)));
    }

    #[test]
    fn a_panic_is_caught_with_its_words() {
        let told = |act: fn()| match attempt(act) {
            Err(Broken::Panic(words)) => words,
            other => panic!("{other:?}"),
        };
        assert!(matches!(attempt(|| 3), Ok(3)));
        assert_eq!(told(|| panic!("wheel {} fell off", 2)), "wheel 2 fell off");
        assert_eq!(told(|| std::panic::panic_any(7)), "a panic without words");
    }
}
