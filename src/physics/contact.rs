//! One wheel contact: regularised Coulomb friction, solved exactly for a single contact.
//!
//! Friction asks for the impulse j over a substep that minimises the dissipation
//!
//! ```text
//!     1/2 j^T (A + gamma I) j - b^T j      subject to |j| <= limit = mu N dt
//! ```
//!
//! where A is the contact's inverse mass and b = A j0 - s the slip that j has to undo. Inside the disc the contact creeps:
//! slip s = -gamma j, which with gamma = v_s / (mu N dt) means that friction grows linearly with slip and saturates at the
//! slip speed v_s. On the rim it slides, with friction exactly opposite to the slip.

use crate::geometry::Vector2;

/// Inverse mass of a contact, a symmetric positive definite 2 x 2 matrix, 1/kg.
#[derive(Debug, Clone, Copy)]
pub(super) struct InverseMass {
    pub(super) xx: f64,
    pub(super) xy: f64,
    pub(super) yy: f64,
}

impl InverseMass {
    pub(super) fn apply(&self, v: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.xx * v.x + self.xy * v.y, self.xy * v.x + self.yy * v.y)
    }

    /// Solves (A + shift I) j = b.
    fn solve(&self, shift: f64, b: Vector2<f64>) -> Vector2<f64> {
        let (xx, yy) = (self.xx + shift, self.yy + shift);
        let scale = 1.0 / (xx * yy - self.xy * self.xy);
        Vector2::new((yy * b.x - self.xy * b.y) * scale, (xx * b.y - self.xy * b.x) * scale)
    }
}

/// Newton steps at most; from the last substep's multiplier one or two do, from none three or four.
const NEWTON_STEPS: usize = 12;

/// The friction impulse, N s, of a contact with inverse mass `a`, compliance `gamma` (1/kg) and `limit` = mu N dt (N s).
///
/// On the rim this is the secular equation |(A + (gamma + lambda) I)^-1 b| = limit in lambda >= 0, solved by Newton's method
/// on 1/limit - 1/|j| (Hebden; Moré and Sorensen 1983, "Computing a trust region step"). That function is convex, so a step
/// from anywhere lands left of the root, and from there on the steps approach it without overshoot. `lambda` is where the
/// search starts, from the last substep, and comes back as the solution.
pub(super) fn friction_impulse(a: &InverseMass, b: Vector2<f64>, gamma: f64, limit: f64, lambda: &mut f64) -> Vector2<f64> {
    let inside = a.solve(gamma, b);
    if inside.norm_squared() <= limit * limit {
        *lambda = 0.0;
        return inside;
    }
    for _ in 0..NEWTON_STEPS {
        let j = a.solve(gamma + *lambda, b);
        let length = j.norm();
        if (length - limit).abs() <= 1e-12 * limit {
            break;
        }
        let slope = j.dot(&a.solve(gamma + *lambda, j));
        *lambda = (*lambda + (length - limit) * length * length / (limit * slope)).max(0.0);
    }
    let j = a.solve(gamma + *lambda, b);
    j * (limit / j.norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{cross, direction};

    /// The solution is known by its properties: creep law inside the disc, sliding against the slip on the rim.
    #[test]
    fn impulse_creeps_inside_the_disc_and_opposes_the_slip_on_its_rim() {
        let a = InverseMass { xx: 4.2, xy: -0.03, yy: 0.5 };
        let (gamma, limit) = (1.5, 6e-3);
        let mut lambda = 0.0; // passed on from one direction to the next, as from one substep to the next
        for k in 0..40 {
            let b = direction(f64::from(k) * 0.37) * (1e-3 * f64::from(k));
            let j = friction_impulse(&a, b, gamma, limit, &mut lambda);
            let slip = a.apply(j) - b; // slip after the impulse
            if j.norm() < limit * (1.0 - 1e-9) {
                assert!((slip + j * gamma).norm() < 1e-15);
            } else {
                assert!((j.norm() / limit - 1.0).abs() < 1e-9);
                assert!(slip.dot(&j) < 0.0 && cross(slip, j).abs() < 1e-9 * slip.norm() * limit);
                assert!(slip.norm() >= gamma * limit * (1.0 - 1e-9));
            }
        }
    }
}
