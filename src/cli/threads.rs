//! Threads for a single run.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anyhow::{Context as _, Result};
use rayon::Yield;

/// Most threads that share a panorama: pieces of it get too small for more.
const MOST: usize = 4;

/// Does `work` in a pool of a few threads, all of which stay awake until it is done.
///
/// A closed loop forks every fraction of a millisecond, and a thread that was put to sleep in between takes a good part of that
/// to wake up. Those that find nothing to do let other programs go first.
pub fn awake<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T> {
    let threads = rayon::current_num_threads().min(MOST);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().context("cannot start worker threads")?;
    let (waiting, done) = (AtomicUsize::new(1), AtomicBool::new(false));
    let result = pool.scope(|scope| {
        let worker = rayon::current_thread_index();
        let (waiting, done) = (&waiting, &done);
        scope.spawn_broadcast(move |_, context| {
            if Some(context.index()) == worker {
                return;
            }
            waiting.fetch_add(1, Ordering::Relaxed);
            while !done.load(Ordering::Relaxed) {
                if rayon::yield_now() != Some(Yield::Executed) {
                    std::thread::yield_now();
                }
            }
        });
        // Also when the work panics, or the scope would wait for the others, and they for it.
        let _ending = Ending(done);
        // A thread that got work before it got here would come here from within that work, and never end it.
        while waiting.load(Ordering::Relaxed) < threads {
            std::thread::yield_now();
        }
        work()
    });
    Ok(result)
}

/// Says at its end that the work is done.
struct Ending<'a>(&'a AtomicBool);

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::sync::Barrier;

    use rayon::prelude::*;

    /// Each piece waits for as many others as there are threads: one thread alone would never end.
    #[test]
    fn work_is_shared_by_all_threads() {
        let threads = awake(|| {
            let (count, together) = (rayon::current_num_threads(), Barrier::new(rayon::current_num_threads()));
            let piece = |_| {
                together.wait();
                rayon::current_thread_index()
            };
            let seen: BTreeSet<_> = (0..count as u32).into_par_iter().with_max_len(1).map(piece).collect();
            (count, seen.len())
        });
        let (count, seen) = threads.unwrap();
        assert!(seen == count && count <= MOST, "{seen} of {count}");
    }

    #[test]
    fn a_panic_gets_out() {
        assert!(std::panic::catch_unwind(|| awake(|| panic!("on purpose"))).is_err());
    }
}
