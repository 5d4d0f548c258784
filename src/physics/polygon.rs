//! Plane polygons: what lies inside, how far away an outline is, whether two edges cross.

use crate::geometry::{Vector2, cross};
use crate::world::Footprint;

/// The edges of a closed polygon.
pub(super) fn edges(corners: &[Vector2<f64>]) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|(a, b)| (*a, *b))
}

/// Whether `point` lies inside a simple polygon of either sense. Points on the outline may fall on either side.
pub(super) fn contains(corners: &[Vector2<f64>], point: Vector2<f64>) -> bool {
    edges(corners).fold(false, |inside, (a, b)| {
        let passes = (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
        inside != passes
    })
}

/// The point of the segment from `a` to `b` that is closest to `point`, and its share of the way, 0 to 1.
pub(super) fn closest_on_segment(point: Vector2<f64>, a: Vector2<f64>, b: Vector2<f64>) -> (Vector2<f64>, f64) {
    let along = b - a;
    let length_squared = along.norm_squared();
    let t = if length_squared > 0.0 { ((point - a).dot(&along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (a + along * t, t)
}

/// Distance from `point` to the segment from `a` to `b`.
pub(super) fn distance_to_segment(point: Vector2<f64>, a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    (closest_on_segment(point, a, b).0 - point).norm()
}

/// Distance from `point`, given in the footprint's frame, to the footprint; zero inside.
pub(super) fn distance_to_footprint(footprint: &Footprint, point: Vector2<f64>) -> f64 {
    match footprint {
        Footprint::Disc(radius) => (point.norm() - radius).max(0.0),
        Footprint::Polygon(corners) if contains(corners, point) => 0.0,
        Footprint::Polygon(corners) => {
            edges(corners).map(|(a, b)| distance_to_segment(point, a, b)).fold(f64::INFINITY, f64::min)
        }
    }
}

/// Radius of the circle around the footprint's origin that holds all of it.
pub(super) fn bounding_radius(footprint: &Footprint) -> f64 {
    match footprint {
        Footprint::Disc(radius) => *radius,
        Footprint::Polygon(corners) => corners.iter().map(Vector2::norm).fold(0.0, f64::max),
    }
}

/// Whether the segments a-b and c-d cross at a point inside both.
pub(super) fn segments_cross(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>, d: Vector2<f64>) -> bool {
    let sides = |p: Vector2<f64>, q: Vector2<f64>, r: Vector2<f64>| cross(q - p, r - p);
    sides(a, b, c) * sides(a, b, d) < 0.0 && sides(c, d, a) * sides(c, d, b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contains_and_distance_agree_on_an_l_shaped_room() {
        let l = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]].map(|c| Vector2::new(c[0], c[1]));
        assert!(contains(&l, Vector2::new(0.5, 2.9)) && contains(&l, Vector2::new(3.9, 0.5)));
        assert!(!contains(&l, Vector2::new(1.5, 1.5)) && !contains(&l, Vector2::new(-0.1, 1.0)));
        let outside = Vector2::new(2.0, 1.75);
        assert!((distance_to_footprint(&Footprint::Polygon(l.to_vec()), outside) - 0.75).abs() < 1e-15);
        assert!(segments_cross(l[1], l[5], l[0], Vector2::new(3.0, 3.0)) && !segments_cross(l[0], l[1], l[1], l[2]));
    }
}
