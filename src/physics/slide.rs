//! Things that slide over the floor: friction of a whole footprint.
//!
//! A body that slides and turns at once has friction at every point of its footprint against that point's own velocity. The
//! force and torque that this sums up to lie on a limit surface, which an ellipsoid approximates well (Goyal, Ruina and
//! Papadopoulos 1991, "Planar sliding with dry friction"; Howe and Cutkosky 1996): with the radius c at which all friction
//! would have to act to give the greatest torque, the velocity (v, c omega) loses speed mu g along itself.

use super::chassis::{PlanarVelocity, STANDARD_GRAVITY_M_S2};
use crate::geometry::Vector2;
use crate::world::Footprint;
use crate::world::polygon::contains;

/// Points along each side of the grid that a footprint's integrals are taken on.
const GRID: u32 = 64;

/// What it takes to slow a sliding body down.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlidingBody {
    /// Deceleration in pure sliding, m/s^2.
    deceleration: f64,
    /// Mean distance of the footprint from its centre, m.
    lever: f64,
    /// Its mean square, m^2: yaw inertia over mass.
    gyration_squared: f64,
}

impl SlidingBody {
    /// A body of even mass and pressure over its footprint.
    pub(super) fn new(footprint: &Footprint, friction: f64) -> Self {
        let (lever, gyration_squared) = match footprint {
            Footprint::Disc(radius) => (radius * 2.0 / 3.0, radius * radius * 0.5),
            Footprint::Polygon(corners) => {
                let low = corners.iter().fold(Vector2::repeat(f64::INFINITY), |m, c| m.inf(c));
                let high = corners.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |m, c| m.sup(c));
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(GRID);
                let points: Vec<Vector2<f64>> = (0..GRID * GRID)
                    .map(|k| low + (high - low).component_mul(&Vector2::new(at(k % GRID), at(k / GRID))))
                    .filter(|point| contains(corners, *point))
                    .collect();
                let count = points.len().max(1) as f64;
                let centre = points.iter().sum::<Vector2<f64>>() / count;
                let mean = |of: &dyn Fn(f64) -> f64| points.iter().map(|p| of((p - centre).norm())).sum::<f64>() / count;
                (mean(&|r| r), mean(&|r| r * r).max(1e-9))
            }
        };
        Self { deceleration: friction * STANDARD_GRAVITY_M_S2, lever, gyration_squared }
    }

    /// The velocity that friction leaves after `dt` seconds.
    pub(super) fn slowed(&self, velocity: &PlanarVelocity, dt: f64) -> PlanarVelocity {
        let rim = self.lever * velocity.yaw_rate;
        let speed = (velocity.linear.norm_squared() + rim * rim).sqrt();
        let loss = self.deceleration * dt;
        if speed <= loss {
            return PlanarVelocity::default();
        }
        let turning = loss * self.lever * self.lever / self.gyration_squared;
        PlanarVelocity {
            linear: velocity.linear * (1.0 - loss / speed),
            yaw_rate: velocity.yaw_rate * (1.0 - turning / speed).max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box's mean distance from its centre has a closed form, as has its radius of gyration; 0.1 %.
    #[test]
    fn the_lever_of_a_box_is_its_mean_distance() {
        let corners = [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]].map(|[x, y]| Vector2::new(x, y)).to_vec();
        let body = SlidingBody::new(&Footprint::Polygon(corners), 0.5);
        // Square of side a: a/6 (sqrt(2) + asinh(1)).
        let expected = 0.6 / 6.0 * (2.0_f64.sqrt() + 1.0_f64.asinh());
        assert!((body.lever / expected - 1.0).abs() < 1e-3, "{} {expected}", body.lever);
        assert!((body.gyration_squared / (0.6 * 0.6 / 6.0) - 1.0).abs() < 1e-3);
    }
}
