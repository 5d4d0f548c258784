//! Ordinary differential equations: the embedded Runge-Kutta method of order 5(4) by Dormand and Prince (1980), the one behind
//! MATLAB's ode45.

/// Error that one step may make in a component y: `absolute + relative * |y|`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// In proportion to the component.
    pub relative: f64,
    /// In the component's own unit.
    pub absolute: f64,
}

impl Tolerance {
    /// As near to exact as steps of reasonable length come.
    pub const TIGHT: Self = Self { relative: 1e-12, absolute: 1e-14 };
    /// What ode45 uses where it is told nothing.
    pub const ODE45: Self = Self { relative: 1e-3, absolute: 1e-6 };
}

/// Weights of earlier slopes in the stages 2 to 7; the last row is the solution of order 5.
const STAGES: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Weights of the slopes in the difference between the solutions of order 5 and 4.
const DIFFERENCE: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];
/// A step is never cut below this share of the whole, which bounds the work where a slope has no smooth solution.
const LEAST_SHARE: f64 = 1e-4;

/// The state after `duration` of y' = `slope`(y), from `start`. A step that cannot meet the tolerance at the least length is taken
/// all the same; a slope that is not finite spoils the result, as it must.
///
/// ```
/// use wayhome::ode::{Tolerance, integrate};
/// let [cos, sin] = integrate(|y: &[f64; 2]| [-y[1], y[0]], [1.0, 0.0], std::f64::consts::FRAC_PI_2, Tolerance::TIGHT);
/// assert!(cos.abs() < 1e-10 && (sin - 1.0).abs() < 1e-10);
/// ```
pub fn integrate<const N: usize>(
    slope: impl Fn(&[f64; N]) -> [f64; N],
    start: [f64; N],
    duration: f64,
    tolerance: Tolerance,
) -> [f64; N] {
    let (mut y, mut done, mut step) = (start, 0.0, duration);
    let least = LEAST_SHARE * duration;
    let mut first = slope(&y);
    while done < duration {
        let last = done + step >= duration;
        if last {
            step = duration - done;
        }
        let mut slopes = [[0.0; N]; 7];
        slopes[0] = first;
        let mut end = y;
        for (k, weights) in STAGES.iter().enumerate() {
            end = y;
            for (weight, slope) in weights.iter().zip(&slopes) {
                for n in 0..N {
                    end[n] += step * weight * slope[n];
                }
            }
            slopes[k + 1] = slope(&end);
        }
        let excess = (0..N).map(|n| {
            let difference: f64 = DIFFERENCE.iter().zip(&slopes).map(|(weight, slope)| weight * slope[n]).sum();
            (step * difference).abs() / (tolerance.absolute + tolerance.relative * y[n].abs().max(end[n].abs()))
        });
        let excess = excess.fold(0.0, f64::max);
        if excess <= 1.0 || step <= least || !excess.is_finite() {
            (y, first) = (end, slopes[6]);
            done = if last { duration } else { done + step };
        }
        let change = if excess > 0.0 { 0.9 * libm::pow(excess, -0.2) } else { 5.0 };
        step = (step * change.clamp(0.2, 5.0)).max(least);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose, Twist, sin_cos};

    /// The unicycle on a held command runs along an arc.
    #[test]
    fn the_unicycle_runs_along_its_arc() {
        let (twist, start) = (Twist { v: 0.12, omega: 2.4 }, Pose::new(-0.82, -0.68, 2.6));
        let unicycle = |s: &[f64; 3]| {
            let (sin, cos) = sin_cos(s[2]);
            [twist.v * cos, twist.v * sin, twist.omega]
        };
        let end = |tolerance| integrate(unicycle, [start.x, start.y, start.heading], 2.0, tolerance);
        let exact = start.advanced(twist, 2.0);
        let miss = |[x, y, _]: [f64; 3]| (Pose::new(x, y, 0.0).position() - exact.position()).norm();
        assert!(miss(end(Tolerance::TIGHT)) < 1e-10, "{}", miss(end(Tolerance::TIGHT)));
        let loose = miss(end(Tolerance::ODE45));
        assert!(loose > 1e-9 && loose < 1e-2, "{loose}");
    }

    /// A slope that grows steeply makes it cut its steps: y' = y^2 from 1 reaches 1 / (1 - t).
    #[test]
    fn steps_adapt() {
        let [end] = integrate(|y: &[f64; 1]| [y[0] * y[0]], [1.0], 0.99, Tolerance::TIGHT);
        assert!((end / 100.0 - 1.0).abs() < 1e-9, "{end}");
    }
}
