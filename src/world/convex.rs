//! Gaps between convex shapes: how far apart two footprints are, or how deep they overlap.
//!
//! One type covers all that stands or moves in a room: a point, a segment or a convex polygon, grown by a radius. A disc is a
//! grown point, a straight corridor a grown segment. Everything is f64 and exact up to rounding; the physics engine has its
//! own f32 shapes.

use crate::geometry::{Pose, Vector2};

use super::grid::{Bounds, bounds_of};
use super::polygon::{contains, distance_to_segment, edges};
use super::{Body, Footprint};

/// A convex polygon (or segment, or point) grown by a radius.
#[derive(Debug, Clone, PartialEq)]
pub struct Convex {
    /// Corners of the core, m; at least one.
    core: Vec<Vector2<f64>>,
    /// How far the shape reaches beyond its core, m.
    radius_m: f64,
}

impl Convex {
    /// A disc.
    #[must_use]
    pub fn disc(centre: Vector2<f64>, radius_m: f64) -> Self {
        Self { core: vec![centre], radius_m }
    }

    /// All points within `radius_m` of the segment from `a` to `b`: what a disc sweeps on its way.
    #[must_use]
    pub fn corridor(a: Vector2<f64>, b: Vector2<f64>, radius_m: f64) -> Self {
        Self { core: vec![a, b], radius_m }
    }

    /// A convex polygon, grown by `radius_m`.
    #[must_use]
    pub fn polygon(corners: &[Vector2<f64>], radius_m: f64) -> Self {
        Self { core: corners.to_vec(), radius_m }
    }

    /// A body's footprint with the body at `pose`.
    #[must_use]
    pub fn of_body(body: &Body, pose: &Pose) -> Self {
        match &body.footprint {
            Footprint::Disc(radius_m) => Self::disc(pose.position(), *radius_m),
            Footprint::Polygon(corners) => {
                let core: Vec<_> = corners.iter().map(|&c| pose.transform(c)).collect();
                Self { core, radius_m: 0.0 }
            }
        }
    }

    /// Distance to the other shape, m; negative where they overlap, and then the least way by which either must move to part
    /// them.
    #[must_use]
    pub fn gap_m(&self, other: &Self) -> f64 {
        core_gap(&self.core, &other.core) - self.radius_m - other.radius_m
    }

    /// Whether it could meet a disc; where it could not, it is told by the box around it.
    pub(crate) fn may_reach(&self, centre: Vector2<f64>, radius_m: f64) -> bool {
        let (low, high) = self.bounds(radius_m);
        low.x <= centre.x && centre.x <= high.x && low.y <= centre.y && centre.y <= high.y
    }

    /// The box around the shape, grown by `margin_m` on all sides.
    pub(crate) fn bounds(&self, margin_m: f64) -> Bounds {
        bounds_of(&self.core, self.radius_m + margin_m)
    }

    /// Mean of the core's corners: a point inside the shape, m.
    #[must_use]
    pub fn middle(&self) -> Vector2<f64> {
        self.core.iter().sum::<Vector2<f64>>() / self.core.len() as f64
    }
}

/// Gap between two convex cores.
fn core_gap(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> f64 {
    // If some direction separates the cores, the shortest way runs from a corner of one to an edge of the other. If none
    // does, the least overlap over the edge normals is the depth (separating axis theorem).
    let separation = largest_separation(a, b).max(largest_separation(b, a));
    let apart = separation > 0.0 || (a.len() == 1 && b.len() == 1);
    if !apart {
        return separation;
    }
    let to_edges = |points: &[Vector2<f64>], core: &[Vector2<f64>]| {
        let mut least = f64::INFINITY;
        for &p in points {
            for (c, d) in edges(core) {
                least = least.min(distance_to_segment(p, c, d));
            }
        }
        least
    };
    to_edges(a, b).min(to_edges(b, a))
}

/// Largest signed distance between the projections of `a` and `b`, over the normals of the edges of `a`.
fn largest_separation(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> f64 {
    let mut largest = f64::NEG_INFINITY;
    for (p, q) in edges(a) {
        let along = q - p;
        let length = along.dot(&along).sqrt();
        if length == 0.0 {
            continue;
        }
        let normal = Vector2::new(along.y, -along.x) / length;
        // A segment also ends: beyond its ends it is its own direction that separates.
        let ends = if a.len() == 2 { along / length } else { normal };
        for n in [normal, -normal, ends, -ends] {
            let reach = a.iter().map(|v| n.dot(v)).fold(f64::NEG_INFINITY, f64::max);
            let nearest = b.iter().map(|v| n.dot(v)).fold(f64::INFINITY, f64::min);
            largest = largest.max(nearest - reach);
        }
    }
    largest
}

/// Gap between a shape and the nearest wall of a room, m: how far it is from touching, or, negative, how deep it stands in a
/// wall. A shape whose middle lies outside the room gets minus infinity.
#[must_use]
pub fn gap_to_walls_m(outline: &[Vector2<f64>], shape: &Convex) -> f64 {
    if !contains(outline, shape.middle()) {
        return f64::NEG_INFINITY;
    }
    edges(outline).map(|(a, b)| shape.gap_m(&Convex::corridor(a, b, 0.0))).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::direction;

    fn square(x: f64, y: f64, heading: f64) -> Convex {
        let corners: Vec<_> = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
            .iter()
            .map(|&(u, v)| Pose::new(x, y, heading).transform(Vector2::new(u, v)))
            .collect();
        Convex::polygon(&corners, 0.0)
    }

    #[test]
    fn gaps_of_known_pairs() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        let disc = |x, y, r| Convex::disc(Vector2::new(x, y), r);
        close(disc(0.0, 0.0, 1.0).gap_m(&disc(3.0, 4.0, 1.5)), 2.5);
        close(square(0.0, 0.0, 0.0).gap_m(&square(1.2, 0.3, 0.0)), 0.2);
        close(square(0.0, 0.0, 0.0).gap_m(&square(0.9, 0.3, 0.0)), -0.1);
        // Corner to corner, along the diagonal.
        close(square(0.0, 0.0, 0.0).gap_m(&square(2.0, 2.0, 0.0)), 2.0_f64.sqrt());
        // A square on its tip above an edge.
        close(square(0.0, 0.0, 0.0).gap_m(&square(0.0, 2.0, std::f64::consts::FRAC_PI_4)), 1.5 - 0.5_f64.sqrt());
        // A disc inside a square, near one side.
        close(square(0.0, 0.0, 0.0).gap_m(&disc(0.3, 0.0, 0.1)), -0.3);
        let corridor = Convex::corridor(Vector2::new(-3.0, 0.8), Vector2::new(3.0, 0.8), 0.2);
        close(square(0.0, 0.0, 0.0).gap_m(&corridor), 0.1);
        // In line with a segment, beyond its end, beside it and on it.
        close(corridor.gap_m(&disc(5.0, 0.8, 0.5)), 1.3);
        close(corridor.gap_m(&Convex::corridor(Vector2::new(4.0, 0.8), Vector2::new(7.0, 0.8), 0.5)), 0.3);
        close(corridor.gap_m(&disc(1.0, 1.8, 0.5)), 0.3);
        close(corridor.gap_m(&disc(1.0, 0.8, 0.5)), -0.7);
    }

    #[test]
    fn gap_agrees_with_parry() {
        use parry2d::math::{Pose2, Vec2};
        use parry2d::query::distance;
        use parry2d::shape::Cuboid;
        let cuboid = Cuboid::new(Vec2::new(0.5, 0.5));
        for k in 0..200 {
            let t = f64::from(k);
            let (at, turn) = (direction(0.7 * t) * (0.6 + 0.01 * t), 0.3 * t);
            let ours = square(0.0, 0.0, 0.4).gap_m(&square(at.x, at.y, turn));
            let there = Pose2::new(Vec2::new(at.x as f32, at.y as f32), turn as f32);
            let theirs = distance(&Pose2::new(Vec2::new(0.0, 0.0), 0.4), &cuboid, &there, &cuboid).expect("supported pair");
            assert!((ours.max(0.0) - f64::from(theirs.distance)).abs() < 1e-4, "{k}: {ours} {theirs:?}");
        }
    }
}
