//! Named random streams: one seed gives a run, and each consumer draws from a stream of its own.
//!
//! A stream is derived by hashing (seed, name) with SHA-256, so adding a consumer, or drawing more often in one, never shifts
//! another. The generator is PCG-64, whose output is fixed across platforms and versions.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use sha2::{Digest, Sha256};

/// The generator behind every stream.
pub type Stream = Pcg64;

/// A seed and the streams derived from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seed(pub u64);

impl Seed {
    /// The stream called `name`. The same (seed, name) always gives the same stream.
    #[must_use]
    pub fn stream(self, name: &str) -> Stream {
        let mut hash = Sha256::new();
        hash.update(self.0.to_le_bytes());
        hash.update(name.as_bytes());
        Pcg64::from_seed(hash.finalize().into())
    }

    /// A seed of its own for the consumer called `name`, for code that derives further streams.
    #[must_use]
    pub fn derive(self, name: &str) -> Self {
        use rand_pcg::rand_core::Rng;
        Self(self.stream(name).next_u64())
    }
}

/// A draw from the standard normal distribution, by Box and Muller's transform (1958).
///
/// Every draw takes two numbers from the stream, and the logarithm comes from `libm`: unlike a ziggurat's, the result and the
/// state of the stream after it are the same on every machine.
pub fn standard_normal(stream: &mut Stream) -> f64 {
    use rand::RngExt;
    let radius = (-2.0 * libm::log(1.0 - stream.random::<f64>())).sqrt(); // the argument is in (0, 1]
    radius * libm::cos(std::f64::consts::TAU * stream.random::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::rand_core::Rng;

    #[test]
    fn streams_are_repeatable_and_apart() {
        let draw = |seed: u64, name: &str| Seed(seed).stream(name).next_u64();
        assert_eq!(draw(1, "slip"), draw(1, "slip"));
        assert_ne!(draw(1, "slip"), draw(1, "start"));
        assert_ne!(draw(1, "slip"), draw(2, "slip"));
    }

    #[test]
    fn standard_normal_has_its_moments() {
        let mut stream = Seed(3).stream("normal");
        let draws: Vec<f64> = (0..40_000).map(|_| standard_normal(&mut stream)).collect();
        let moment = |k: i32| draws.iter().map(|x| x.powi(k)).sum::<f64>() / draws.len() as f64;
        // Bounds at five standard errors; the fourth moment of a normal distribution is 3.
        assert!(moment(1).abs() < 0.025 && (moment(2) - 1.0).abs() < 0.036 && (moment(4) - 3.0).abs() < 0.25);
    }
}
