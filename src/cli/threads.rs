//! Threads for a single run.

use std::sync::atomic::{AtomicBool, Ordering};

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
    let done = AtomicBool::new(false);
    let result = pool.scope(|scope| {
        let worker = rayon::current_thread_index();
        let done = &done;
        scope.spawn_broadcast(move |_, context| {
            while Some(context.index()) != worker && !done.load(Ordering::Relaxed) {
                if rayon::yield_now() != Some(Yield::Executed) {
                    std::thread::yield_now();
                }
            }
        });
        // Also when the work panics, or the scope would wait for the others, and they for it.
        let _ending = Ending(done);
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
    use rayon::prelude::*;

    #[test]
    fn work_is_shared_and_what_it_gives_comes_back() {
        let sum = awake(|| {
            assert!(rayon::current_num_threads() <= MOST);
            (0..1000_u32).into_par_iter().with_max_len(1).sum::<u32>()
        });
        assert_eq!(sum.unwrap(), 499_500);
    }

    #[test]
    fn a_panic_gets_out() {
        assert!(std::panic::catch_unwind(|| awake(|| panic!("on purpose"))).is_err());
    }
}
