//! Draws from a named stream, the same on every machine.

use rand_pcg::rand_core::Rng;

use crate::random::{Seed, Stream};

/// A stream with the draws that a generator needs.
pub(in crate::world) struct Dice(Stream);

impl Dice {
    pub(in crate::world) fn new(seed: Seed, name: &str) -> Self {
        Self(seed.stream(name))
    }

    /// Uniform in [0, 1), with 53 random bits.
    pub(in crate::world) fn unit(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.0.next_u64() >> 11) as f64 * STEP
    }

    /// Uniform in [low, high).
    pub(in crate::world) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A length from `low` to `high`, m, in whole centimetres, as furniture is made.
    pub(in crate::world) fn size(&mut self, [low, high]: [f64; 2]) -> f64 {
        (100.0 * self.between(low, high)).round() / 100.0
    }

    /// 0 to `count` - 1, all as likely. `count` is small, so that the bias of the multiplication is below 1e-9.
    pub(in crate::world) fn below(&mut self, count: usize) -> usize {
        (((self.0.next_u64() >> 32) * count as u64) >> 32) as usize
    }

    /// Whether something of this probability happens.
    pub(in crate::world) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of the choices, of which there is at least one.
    pub(in crate::world) fn pick<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.below(choices.len())]
    }

    /// A whole number near `expected` whose mean is `expected`.
    pub(in crate::world) fn about(&mut self, expected: f64) -> usize {
        (expected + self.unit()).max(0.0) as usize
    }

    /// A seed for a texture. TOML has no integers beyond 63 bits, and shorter ones are easier to read.
    pub(in crate::world) fn texture_seed(&mut self) -> u64 {
        self.0.next_u64() >> 40
    }
}

/// A length in whole millimetres, m: what a world file says.
pub(in crate::world) fn mm(length_m: f64) -> f64 {
    // No negative zero, which would be written as such.
    (1000.0 * length_m).round() / 1000.0 + 0.0
}

/// A share in whole hundredths.
pub(in crate::world) fn hundredths(share: f64) -> f64 {
    (100.0 * share).round() / 100.0 + 0.0
}
