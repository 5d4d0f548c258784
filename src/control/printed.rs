//! The paper's two laws as they are printed: constant speed, no limit on the turn rate, no care for sampling.

use super::{Law, home_direction};
use crate::geometry::Pose;

/// Yaw rate (rad/s) for a robot at `pose` in the home frame, which drives at `pace` arrival radii a second (v / Rc).
///
/// The proportional law, omega = pi - (alpha - theta), is wrapped to (-pi, pi]: unwrapped it turns by whole turns where angles
/// are. In (16), omega = beta (v / Rc) sgn(theta'), theta' = v sin(alpha - theta) / R has the sign of sin(alpha - theta),
/// and sgn(0) = 0.
#[must_use]
pub fn turn_rate(law: Law, beta: f64, pace: f64, pose: &Pose) -> f64 {
    let error = home_direction(pose);
    match law {
        Law::Proportional => error,
        // sin(alpha - theta) = sin(pi - error) = sin(error)
        Law::Lyapunov => beta * pace * sign(libm::sin(error)),
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
        let rate = |law, pose: &Pose| turn_rate(law, 2.0, 0.12 / 0.05, pose);
        for k in 0..40 {
            let pose = Pose::new(0.4 - 0.03 * f64::from(k), 0.9, f64::from(k) * 0.7);
            let theta = angle_of(pose.position());
            let printed = std::f64::consts::PI - (pose.heading - theta);
            let turns = (rate(Law::Proportional, &pose) - printed) / std::f64::consts::TAU;
            assert!((turns - turns.round()).abs() < 1e-12, "equal up to whole turns: {turns}");
            let theta_dot = 0.12 * libm::sin(pose.heading - theta) / pose.position().norm();
            assert!((rate(Law::Lyapunov, &pose) - 4.8 * theta_dot.signum()).abs() < 1e-12);
        }
    }
}
