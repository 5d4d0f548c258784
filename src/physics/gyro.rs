//! A rate gyro: what a robot knows of its turning when it does not trust its wheels.

use crate::random::{Seed, Stream, standard_normal};
use crate::world::robot::GyroSpec;

/// A gyro about the vertical axis.
#[derive(Debug, Clone)]
pub(super) struct Gyro {
    /// Bias of this run, rad/s.
    bias: f64,
    /// Density of the white noise, rad/s per square root of Hz.
    noise: f64,
    stream: Stream,
    /// Angle turned at the last reading, rad.
    turned: f64,
}

impl Gyro {
    /// A gyro with a bias drawn from its own stream.
    pub(super) fn new(spec: &GyroSpec, seed: Seed) -> Self {
        let mut stream = seed.stream("gyro");
        Self { bias: spec.bias_sd_rad_s * standard_normal(&mut stream), noise: spec.noise_rad_s_sqrt_hz, stream, turned: 0.0 }
    }

    /// The yaw rate since the last reading, `dt_s` ago, of a robot that has turned by `turned` (rad) since the start. White
    /// noise of density n, averaged over a time t, has the standard deviation n / sqrt(t).
    pub(super) fn read(&mut self, turned: f64, dt_s: f64) -> f64 {
        let rate = (turned - self.turned) / dt_s;
        self.turned = turned;
        rate + self.bias + self.noise / dt_s.sqrt() * standard_normal(&mut self.stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After a time t the integrated heading of many gyros has the variance (bias_sd t)^2 + noise^2 t.
    #[test]
    fn the_integrated_heading_wanders_by_the_book() {
        let spec = GyroSpec { bias_sd_rad_s: 0.01, noise_rad_s_sqrt_hz: 0.02 };
        let (steps, dt, runs) = (40, 0.05, 2000);
        let time = f64::from(steps) * dt;
        let mean_square: f64 = (0..runs)
            .map(|seed| {
                let mut gyro = Gyro::new(&spec, Seed(seed));
                let drift: f64 = (1..=steps).map(|k| gyro.read(0.3 * f64::from(k) * dt, dt) * dt).sum::<f64>() - 0.3 * time;
                drift * drift
            })
            .sum::<f64>()
            / runs as f64;
        let expected = (0.01 * time) * (0.01 * time) + 0.02 * 0.02 * time;
        // The mean of 2000 squares of normal draws scatters by sqrt(2 / 2000) = 3 %; five of that.
        assert!((mean_square / expected - 1.0).abs() < 0.16, "{mean_square} against {expected}");
    }
}
