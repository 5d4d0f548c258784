//! The outline of a room as a place to ask about: inside or outside, which of its walls are near.
//!
//! The answers are those of the functions of [`super::polygon`] to the last bit. An outline of many corners has its walls in a grid,
//! so that a question looks at the few that matter.

use super::grid::{Bounds, Grid, bounds_of};
use super::polygon::{self, distance_to_segment};
use crate::geometry::{Vector2, cross};

/// Up to this many walls are looked at one by one, which is faster than to look them up.
const FEW: usize = 48;

/// The outline of a room, anti-clockwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Boundary {
    corners: Vec<Vector2<f64>>,
    /// Walls by place, where there are more than [`FEW`].
    grid: Option<Grid>,
}

impl Boundary {
    pub(in crate::world) fn new(corners: &[Vector2<f64>]) -> Self {
        let boxes = || polygon::edges(corners).map(|(a, b)| bounds_of(&[a, b], 0.0)).collect::<Vec<_>>();
        Self { corners: corners.to_vec(), grid: (corners.len() > FEW).then(|| Grid::new(&boxes())) }
    }

    /// Ends of wall `k`, m.
    #[must_use]
    pub fn wall(&self, k: usize) -> (Vector2<f64>, Vector2<f64>) {
        (self.corners[k], self.corners[(k + 1) % self.corners.len()])
    }

    /// Numbers of walls that may meet the box from `low` to `high`, rising: all that do, and others.
    #[must_use]
    pub fn walls_near(&self, low: Vector2<f64>, high: Vector2<f64>) -> Vec<usize> {
        self.near((low, high))
    }

    fn near(&self, bounds: Bounds) -> Vec<usize> {
        self.grid.as_ref().map_or_else(|| (0..self.corners.len()).collect(), |grid| grid.near(bounds))
    }

    /// Whether `point` lies inside; see [`polygon::contains`].
    #[must_use]
    pub fn contains(&self, point: Vector2<f64>) -> bool {
        let Some(grid) = &self.grid else { return polygon::contains(&self.corners, point) };
        // Walls to the right of the point and level with it; no other changes the answer.
        let right = Vector2::new(f64::MAX, point.y);
        let passes = |&k: &usize| {
            let (a, b) = self.wall(k);
            (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        grid.near((point, right)).iter().filter(|k| passes(k)).count() % 2 == 1
    }

    /// Distance from `point` to the nearest wall, m, whether it lies inside or outside.
    #[must_use]
    pub fn distance(&self, point: Vector2<f64>) -> f64 {
        let distance = |k: usize| {
            let (a, b) = self.wall(k);
            distance_to_segment(point, a, b)
        };
        match &self.grid {
            Some(grid) => grid.nearest(point, distance),
            None => (0..self.corners.len()).map(distance).fold(f64::INFINITY, f64::min),
        }
    }

    /// Whether `point` lies inside or within `tolerance_m` of a wall.
    #[must_use]
    pub fn contains_within(&self, point: Vector2<f64>, tolerance_m: f64) -> bool {
        let near_wall = |k: &usize| {
            let (a, b) = self.wall(*k);
            distance_to_segment(point, a, b) <= tolerance_m
        };
        self.contains(point) || self.near(bounds_of(&[point], tolerance_m)).iter().any(near_wall)
    }

    /// Whether the segment from `a` to `b` stays inside, give or take `tolerance_m` at the walls.
    #[must_use]
    pub fn contains_segment(&self, a: Vector2<f64>, b: Vector2<f64>, tolerance_m: f64) -> bool {
        // Between two neighbouring crossings a segment is wholly inside or wholly outside: one point of each piece tells.
        let along = b - a;
        let mut cuts = vec![0.0, 1.0];
        for k in self.near(bounds_of(&[a, b], tolerance_m)) {
            let (c, d) = self.wall(k);
            let wall = d - c;
            let denominator = cross(along, wall);
            if denominator != 0.0 {
                let t = cross(c - a, wall) / denominator;
                if t > 0.0 && t < 1.0 {
                    cuts.push(t);
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        let ends = [a, b].iter().all(|&p| self.contains_within(p, tolerance_m));
        ends && cuts.windows(2).all(|w| self.contains_within(a + along * (0.5 * (w[0] + w[1])), tolerance_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::direction;

    /// A star of 400 corners, which its grid must not tell from what the plain loops say.
    #[test]
    fn a_boundary_of_many_corners_answers_as_plain_loops_do() {
        let radius = |k: usize| if k.is_multiple_of(2) { 3.0 } else { 4.0 + 0.01 * k as f64 };
        let corners: Vec<_> = (0..400).map(|k| direction(0.005 * std::f64::consts::PI * k as f64) * radius(k)).collect();
        let boundary = Boundary::new(&corners);
        assert!(boundary.grid.is_some());
        let mut inside = 0;
        for k in 0..2000 {
            let p = direction(0.77 * k as f64) * (0.005 * k as f64);
            assert_eq!(boundary.contains(p), polygon::contains(&corners, p), "{p}");
            assert_eq!(boundary.distance(p), polygon::distance_to_boundary(&corners, p), "{p}");
            assert_eq!(boundary.contains_within(p, 0.05), polygon::contains_within(&corners, p, 0.05), "{p}");
            let q = p + direction(1.3 * k as f64) * 0.7;
            assert_eq!(boundary.contains_segment(p, q, 1e-3), polygon::contains_segment(&corners, p, q, 1e-3), "{p} {q}");
            inside += usize::from(boundary.contains(p));
        }
        assert!((600..1400).contains(&inside), "{inside}");
    }
}
