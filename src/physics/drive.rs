//! The robot's electronics: from a commanded twist to wheel speeds, and from turned wheels to odometry.
//!
//! Both sides believe in the nominal wheel radius and never see the true ones.

use std::f64::consts::TAU;

use rand::RngExt;

use super::finite_or_stop;
use crate::geometry::Twist;
use crate::observation::Odometry;
use crate::random::Seed;
use crate::world::RobotSpec;

/// Share of the no-load speed up to which wheels are commanded: above it the motors have no torque left to hold a speed.
const USABLE_SPEED: f64 = 0.9;

/// Turns commanded twists into wheel-speed references within the robot's limits.
#[derive(Debug, Clone)]
pub(super) struct CommandLimiter {
    max_speed: f64,
    max_turn_rate: f64,
    max_acceleration: f64,
    max_rim_speed: f64,
    half_track: f64,
    nominal_radius: f64,
    /// References of the left and right rim, m/s.
    rim_speeds: [f64; 2],
}

impl CommandLimiter {
    pub(super) fn new(robot: &RobotSpec) -> Self {
        Self {
            max_speed: robot.max_speed_m_s,
            max_turn_rate: robot.max_turn_rate_rad_s,
            max_acceleration: robot.max_acceleration_m_s2,
            max_rim_speed: USABLE_SPEED * robot.no_load_speed_rad_s * robot.wheel_radius_m,
            half_track: 0.5 * robot.track_m,
            nominal_radius: robot.wheel_radius_m,
            rim_speeds: [0.0; 2],
        }
    }

    /// Rim speeds, m/s, for a command: forward speed and yaw rate are clamped each by its limit; where the motors cannot turn
    /// a wheel that fast, both wheels slow down by the same factor, which keeps the commanded curve.
    pub(super) fn target(&self, command: Twist) -> [f64; 2] {
        let command = finite_or_stop(command);
        let v = command.v.clamp(-self.max_speed, self.max_speed);
        let turn = command.omega.clamp(-self.max_turn_rate, self.max_turn_rate) * self.half_track;
        let fastest = v.abs() + turn.abs();
        let scale = if fastest > self.max_rim_speed { self.max_rim_speed / fastest } else { 1.0 };
        [(v - turn) * scale, (v + turn) * scale]
    }

    /// Moves the references towards `target` (m/s) for `dt` seconds and returns them as wheel speeds, rad/s. The wheel with
    /// the larger change changes by the greatest acceleration and the other in proportion, so both arrive together.
    pub(super) fn slew(&mut self, target: [f64; 2], dt: f64) -> [f64; 2] {
        let gap = [target[0] - self.rim_speeds[0], target[1] - self.rim_speeds[1]];
        let largest = gap[0].abs().max(gap[1].abs());
        let reach = self.max_acceleration * dt;
        if largest <= reach {
            self.rim_speeds = target;
        } else {
            for (speed, gap) in self.rim_speeds.iter_mut().zip(gap) {
                *speed += gap * (reach / largest);
            }
        }
        self.rim_speeds.map(|speed| speed / self.nominal_radius)
    }
}

/// Wheel encoders that count whole steps, and the odometry made of them.
#[derive(Debug, Clone)]
pub(super) struct Encoders {
    counts_per_radian: f64,
    /// Rim travel of one count at the nominal radius, m.
    travel_per_count: f64,
    track: f64,
    /// Where between two counts each wheel stood at the start, in counts.
    phase: [f64; 2],
    /// Whole counts at the last reading.
    counts: [f64; 2],
    /// Which encoders count nothing.
    dead: [bool; 2],
}

impl Encoders {
    /// Encoders of wheels at angle 0, which stand anywhere between two counts.
    pub(super) fn new(robot: &RobotSpec, seed: Seed) -> Self {
        let mut stream = seed.stream("encoder");
        let phase = [stream.random::<f64>(), stream.random::<f64>()];
        Self {
            counts_per_radian: robot.encoder_counts_per_turn / TAU,
            travel_per_count: robot.wheel_radius_m * TAU / robot.encoder_counts_per_turn,
            track: robot.track_m,
            phase,
            counts: [0.0; 2],
            dead: [false; 2],
        }
    }

    /// From now on encoder `k` counts nothing.
    pub(super) fn kill(&mut self, k: usize) {
        self.dead[k] = true;
    }

    /// Odometry since the last reading, `dt_s` ago, of wheels that have turned by `angles` (rad) since the start. The part of
    /// a count that is left over goes to the next reading.
    pub(super) fn read(&mut self, angles: [f64; 2], dt_s: f64) -> Odometry {
        let mut travel = [0.0; 2];
        for k in 0..2 {
            let counts = libm::floor(angles[k] * self.counts_per_radian + self.phase[k]);
            travel[k] = if self.dead[k] { 0.0 } else { (counts - self.counts[k]) * self.travel_per_count };
            self.counts[k] = counts;
        }
        let [left, right] = travel;
        let twist = Twist { v: 0.5 * (left + right) / dt_s, omega: (right - left) / (self.track * dt_s) };
        Odometry { twist, dt_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_keep_their_curve_and_their_limits() {
        let robot = RobotSpec { max_speed_m_s: 1.0, max_turn_rate_rad_s: 9.0, ..RobotSpec::default() };
        let limiter = CommandLimiter::new(&robot);
        let [left, right] = limiter.target(Twist { v: 0.6, omega: 2.0 });
        let fastest = USABLE_SPEED * robot.no_load_speed_rad_s * robot.wheel_radius_m;
        assert!((right - fastest).abs() < 1e-12);
        let curvature = 2.0 * (right - left) / (right + left) / robot.track_m;
        assert!((curvature - 2.0 / 0.6).abs() < 1e-12);
        assert_eq!(limiter.target(Twist { v: f64::NAN, omega: 1.0 }), [0.0, 0.0]);
    }

    #[test]
    fn encoders_lose_no_part_of_a_count() {
        let robot = RobotSpec::default();
        let mut encoders = Encoders::new(&robot, Seed(3));
        let mut travel = 0.0;
        for k in 1..=1000 {
            let angle = f64::from(k) * 1.7e-3;
            travel += encoders.read([angle, -angle], 0.01).twist.omega * 0.01 * robot.track_m;
        }
        let count = TAU * robot.wheel_radius_m / robot.encoder_counts_per_turn;
        assert!((travel + 2.0 * 1.7 * robot.wheel_radius_m).abs() < 2.0 * count);
    }
}
