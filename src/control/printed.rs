//! The paper's two laws as they are printed: constant speed, no limit on the turn rate, no care for sampling.

use super::{Law, home_direction};
use crate::geometry::Pose;

/// A steering law of the paper with its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintedLaw {
    /// Which of the two.
    pub law: Law,
    /// v, m/s.
    pub speed_m_s: f64,
    /// Rc, m.
    pub radius_m: f64,
    /// Free parameter of (16), more than 1. The paper does not say which one it used.
    pub beta: f64,
}

impl PrintedLaw {
    /// Yaw rate (rad/s) for a robot at `pose` in the home frame.
    ///
    /// The proportional law, omega = pi - (alpha - theta), is wrapped to (-pi, pi]: unwrapped it turns by whole turns where angles
    /// are. In (16), omega = beta (v / Rc) sgn(theta'), theta' = v sin(alpha - theta) / R has the sign of sin(alpha - theta),
    /// and sgn(0) = 0.
    #[must_use]
    pub fn turn_rate(&self, pose: &Pose) -> f64 {
        let error = home_direction(pose);
        match self.law {
            Law::Proportional => error,
            // sin(alpha - theta) = sin(pi - error) = sin(error)
            Law::Lyapunov => self.beta * self.speed_m_s / self.radius_m * sign(libm::sin(error)),
        }
    }
}

/// -1, 0 or 1.
fn sign(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::angle_of;

    /// Both against the formulas with alpha and theta.
    #[test]
    fn they_are_what_the_paper_prints() {
        let law = |law| PrintedLaw { law, speed_m_s: 0.12, radius_m: 0.05, beta: 2.0 };
        for k in 0..40 {
            let pose = Pose::new(0.4 - 0.03 * f64::from(k), 0.9, f64::from(k) * 0.7);
            let theta = angle_of(pose.position());
            let printed = std::f64::consts::PI - (pose.heading - theta);
            let turns = (law(Law::Proportional).turn_rate(&pose) - printed) / std::f64::consts::TAU;
            assert!((turns - turns.round()).abs() < 1e-12, "equal up to whole turns: {turns}");
            let theta_dot = 0.12 * libm::sin(pose.heading - theta) / pose.position().norm();
            assert!((law(Law::Lyapunov).turn_rate(&pose) - 4.8 * theta_dot.signum()).abs() < 1e-12);
        }
    }
}
