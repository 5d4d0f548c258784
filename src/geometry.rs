//! Planar geometry: angles, poses and twists.
//!
//! Frames follow REP-103: x forward, y left, angles anti-clockwise in radians. Angles that describe a direction are wrapped
//! to (-pi, pi].
//!
//! All trigonometry of the project goes through this module. It calls `libm`, which is plain Rust, instead of the platform's
//! mathematical library, so that a seed gives the same bytes on every machine.

use std::f64::consts::{PI, TAU};

pub use nalgebra::{Matrix3, Vector2};
use serde::Serialize;

/// Sine and cosine of `angle_rad`.
#[must_use]
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    libm::sincos(angle_rad)
}

/// Angle of the vector (x, y), in (-pi, pi].
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Wraps an angle to (-pi, pi]. NaN stays NaN.
///
/// ```
/// use std::f64::consts::PI;
/// assert_eq!(wayhome::geometry::wrap(-PI), PI);
/// assert!((wayhome::geometry::wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
/// ```
#[must_use]
pub fn wrap(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let turned = angle_rad - TAU * libm::floor(angle_rad / TAU); // [0, 2 pi], both ends possible by rounding
    if turned > PI { turned - TAU } else { turned }
}

/// Unit vector at `angle_rad` from the x axis.
#[must_use]
pub fn direction(angle_rad: f64) -> Vector2<f64> {
    let (s, c) = sin_cos(angle_rad);
    Vector2::new(c, s)
}

/// Angle of a vector from the x axis, in (-pi, pi].
#[must_use]
pub fn angle_of(v: Vector2<f64>) -> f64 {
    atan2(v.y, v.x)
}

/// Third component of the cross product of two plane vectors.
#[must_use]
pub fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Position (m) and heading (rad) of a frame in the plane. Files call them `x_m`, `y_m` and `heading_rad`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Pose {
    /// Position along x, m.
    #[serde(rename = "x_m")]
    pub x: f64,
    /// Position along y, m.
    #[serde(rename = "y_m")]
    pub y: f64,
    /// Heading, rad, anti-clockwise from x.
    #[serde(rename = "heading_rad")]
    pub heading: f64,
}

impl Pose {
    /// The frame of reference itself.
    pub const IDENTITY: Self = Self { x: 0.0, y: 0.0, heading: 0.0 };

    /// A pose from metres and radians. The heading is wrapped.
    #[must_use]
    pub fn new(x: f64, y: f64, heading: f64) -> Self {
        Self { x, y, heading: wrap(heading) }
    }

    /// Position as a vector, m.
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        Vector2::new(self.x, self.y)
    }

    /// A point given in this frame, in the outer frame.
    #[must_use]
    pub fn transform(&self, point: Vector2<f64>) -> Vector2<f64> {
        let (s, c) = sin_cos(self.heading);
        Vector2::new(self.x + c * point.x - s * point.y, self.y + s * point.x + c * point.y)
    }

    /// A point given in the outer frame, in this frame.
    #[must_use]
    pub fn inverse_transform(&self, point: Vector2<f64>) -> Vector2<f64> {
        let (s, c) = sin_cos(self.heading);
        let d = point - self.position();
        Vector2::new(c * d.x + s * d.y, -s * d.x + c * d.y)
    }

    /// A pose given in this frame, in the outer frame.
    #[must_use]
    pub fn compose(&self, inner: &Self) -> Self {
        let p = self.transform(inner.position());
        Self::new(p.x, p.y, self.heading + inner.heading)
    }

    /// `other`, which is given in the outer frame, as seen from this frame.
    #[must_use]
    pub fn to_local(&self, other: &Self) -> Self {
        let p = self.inverse_transform(other.position());
        Self::new(p.x, p.y, other.heading - self.heading)
    }

    /// The pose after moving with a constant twist for `dt` seconds (exact arc of the unicycle).
    #[must_use]
    pub fn advanced(&self, twist: Twist, dt: f64) -> Self {
        let turn = twist.omega * dt;
        let forward = twist.v * dt;
        // Chord of the arc: length v dt sinc(turn/2), half the turn to the left.
        let half = 0.5 * turn;
        let sinc = if half.abs() < 1e-6 { 1.0 - half * half / 6.0 } else { libm::sin(half) / half };
        let chord = direction(self.heading + half) * (forward * sinc);
        Self::new(self.x + chord.x, self.y + chord.y, self.heading + turn)
    }

    /// Whether all three numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.heading.is_finite()
    }
}

/// Forward speed (m/s) and yaw rate (rad/s, anti-clockwise) of a robot that moves along its heading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// Forward speed, m/s.
    pub v: f64,
    /// Yaw rate, rad/s.
    pub omega: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrap_covers_the_half_open_interval() {
        for k in -5..=5 {
            for a in [-3.0, -1.0, 0.0, 0.5, PI] {
                let w = wrap(a + f64::from(k) * TAU);
                assert!(w > -PI && w <= PI, "{w}");
                assert!((direction(w) - direction(a)).norm() < 1e-12);
            }
        }
        assert!(wrap(f64::NAN).is_nan());
    }

    #[test]
    fn compose_and_to_local_are_inverse() {
        let a = Pose::new(1.0, -2.0, 2.5);
        let b = Pose::new(-0.3, 0.7, 1.9);
        let back = a.to_local(&a.compose(&b));
        assert!((back.position() - b.position()).norm() < 1e-12 && wrap(back.heading - b.heading).abs() < 1e-12);
    }

    #[test]
    fn advanced_closes_a_circle() {
        let twist = Twist { v: 0.4, omega: 0.8 };
        let mut p = Pose::new(0.2, 0.1, 0.3);
        let start = p;
        for _ in 0..100 {
            p = p.advanced(twist, TAU / 0.8 / 100.0);
        }
        assert!((p.position() - start.position()).norm() < 1e-12);
    }
}
