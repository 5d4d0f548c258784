//! Noise of the sensor.

use crate::random::Seed;
use crate::world::spec::NoiseSpec;

/// Standard deviation of the sum of eight bytes, each uniform over 0 to 255: the root of 8 (256^2 - 1) / 12.
const DEVIATION: f32 = 209.021_53;
/// Its mean.
const MEAN: f32 = 1020.0;

/// Noise of a sensor, in levels of 255.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    /// Variance of reading a pixel.
    read: f32,
    /// Variance a level of light.
    shot: f32,
}

/// What tells the noise of one frame from that of others.
pub(super) fn key(frame: Seed) -> [u32; 2] {
    let Seed(bits) = frame.derive("camera noise");
    [bits as u32, (bits >> 32) as u32]
}

impl Noise {
    pub fn new(spec: &NoiseSpec) -> Self {
        let level_per_electron = 255.0 / spec.saturation_electrons;
        let read = spec.read_electrons * level_per_electron;
        Self { read: (read * read) as f32, shot: level_per_electron as f32 }
    }

    /// Adds noise to a row of channels of which the first is number `first` of the picture.
    #[inline(always)]
    pub fn add(&self, key: [u32; 2], first: u32, line: &mut [f32]) {
        for (k, light) in (first..).zip(line.iter_mut()) {
            let variance = self.read + self.shot * *light;
            *light += variance.sqrt() * normal(key, k);
        }
    }
}

/// A number that is normally distributed but for its tails, which end at 4.9 deviations: the sum of eight random bytes.
#[inline(always)]
fn normal([a, b]: [u32; 2], k: u32) -> f32 {
    let first = scramble(k ^ a);
    let second = scramble(first ^ b);
    (bytes(first) + bytes(second)) as f32 * (1.0 / DEVIATION) - MEAN / DEVIATION
}

/// Sum of the four bytes of a word.
#[inline(always)]
fn bytes(word: u32) -> u32 {
    let pairs = (word & 0x00ff_00ff) + (word >> 8 & 0x00ff_00ff);
    (pairs & 0xffff) + (pairs >> 16)
}

/// Every bit of the result depends on every bit of `x`: the last step of MurmurHash3 (Appleby).
#[inline(always)]
fn scramble(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_a_normal_distribution_and_neighbours_are_apart() {
        let draws: Vec<f64> = (0..200_000).map(|k| f64::from(normal(key(Seed(5)), k))).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..draws.len() - 4).map(f).sum::<f64>() / (draws.len() - 4) as f64;
        assert!(mean(&|k| draws[k]).abs() < 0.01);
        assert!((mean(&|k| draws[k] * draws[k]) - 1.0).abs() < 0.015);
        // A sum of eight has a fourth moment of 3 - 1.2/8.
        assert!((mean(&|k| draws[k].powi(4)) - 2.85).abs() < 0.08);
        for step in 1..=4 {
            assert!(mean(&|k| draws[k] * draws[k + step]).abs() < 0.01, "{step}");
        }
    }
}
