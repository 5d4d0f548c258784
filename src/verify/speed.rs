//! What all measurements of speed share: the clock, the median of rounds, threads, and the machine.

use std::hint::black_box;
use std::time::Instant;

use crate::error::{Error, Result};
use crate::statistics::quantile;

/// Bytes whose filling is what memory allows.
const FILLED_BYTES: usize = 256 << 20;

/// Name of the processor, where the system tells it.
pub(super) fn processor() -> String {
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = known.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
    line.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

/// Seconds that some work takes.
pub(super) fn seconds(work: impl FnOnce() -> Result<()>) -> Result<f64> {
    let start = Instant::now();
    work()?;
    Ok(start.elapsed().as_secs_f64())
}

/// The median; NaN of nothing.
pub(super) fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5).unwrap_or(f64::NAN)
}

/// So many worker threads.
pub(super) fn pool_of(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| Error::Threads(error.to_string()))
}

/// Memory that one thread fills as fast as it can.
pub(super) struct Memory(Vec<u8>);

impl Memory {
    pub(super) fn new() -> Self {
        // Written once, so that the pages are there.
        Self(vec![1; FILLED_BYTES])
    }

    /// Bytes a second.
    pub(super) fn fill_bytes_per_s(&mut self) -> f64 {
        let start = Instant::now();
        self.0.fill(black_box(0));
        black_box(&mut self.0);
        self.0.len() as f64 / start.elapsed().as_secs_f64()
    }
}
