//! Simple polygons: area, orientation, point location, distance to the boundary, containment.
//!
//! Corners are in metres; a polygon is closed from its last corner to its first. Unless a function says otherwise the order of
//! the corners does not matter. These are plain loops over all
//! corners; [`super::Boundary`] answers the same for rooms of thousands.

pub use super::grid::bounds;
use super::grid::{Grid, bounds_of};
use crate::geometry::{Vector2, cross};

/// Edges of a polygon as pairs of corners; edge k runs from corner k to corner k + 1.
pub fn edges(polygon: &[Vector2<f64>]) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
    (0..polygon.len()).map(|k| (polygon[k], polygon[(k + 1) % polygon.len()]))
}

/// Area, m^2; positive where the corners run anti-clockwise.
#[must_use]
pub fn signed_area(polygon: &[Vector2<f64>]) -> f64 {
    // Relative to a corner, so that a polygon far from the origin loses no digits.
    let Some(&origin) = polygon.first() else { return 0.0 };
    0.5 * edges(polygon).map(|(a, b)| cross(a - origin, b - origin)).sum::<f64>()
}

/// The corners in anti-clockwise order, starting with the first as given.
#[must_use]
pub fn anticlockwise(corners: &[[f64; 2]]) -> Vec<Vector2<f64>> {
    let mut corners: Vec<_> = corners.iter().map(|c| Vector2::new(c[0], c[1])).collect();
    if signed_area(&corners) < 0.0 {
        corners[1..].reverse();
    }
    corners
}

/// Whether `point` lies inside (even-odd rule). A point exactly on the boundary may count as either.
#[must_use]
pub fn contains(polygon: &[Vector2<f64>], point: Vector2<f64>) -> bool {
    let mut inside = false;
    for (a, b) in edges(polygon) {
        // Half-open in y, so that a corner on the ray counts once.
        if (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
    }
    inside
}

/// The point of the segment from `a` to `b` that is closest to `point`, and its share of the way from `a`, 0 to 1.
#[must_use]
pub fn closest_on_segment(point: Vector2<f64>, a: Vector2<f64>, b: Vector2<f64>) -> (Vector2<f64>, f64) {
    let along = b - a;
    let length_squared = along.norm_squared();
    let t = if length_squared > 0.0 { ((point - a).dot(&along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (a + along * t, t)
}

/// Distance from `point` to the segment from `a` to `b`, m.
#[must_use]
pub fn distance_to_segment(point: Vector2<f64>, a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    (point - closest_on_segment(point, a, b).0).norm()
}

/// Distance from `point` to the nearest edge, m, whether it lies inside or outside.
#[must_use]
pub fn distance_to_boundary(polygon: &[Vector2<f64>], point: Vector2<f64>) -> f64 {
    edges(polygon).map(|(a, b)| distance_to_segment(point, a, b)).fold(f64::INFINITY, f64::min)
}

/// Distance from `point` to the polygon, m; zero inside.
#[must_use]
pub fn distance_to_polygon(polygon: &[Vector2<f64>], point: Vector2<f64>) -> f64 {
    if contains(polygon, point) { 0.0 } else { distance_to_boundary(polygon, point) }
}

/// Whether `point` lies inside or within `tolerance_m` of the boundary.
#[must_use]
pub fn contains_within(polygon: &[Vector2<f64>], point: Vector2<f64>, tolerance_m: f64) -> bool {
    contains(polygon, point) || distance_to_boundary(polygon, point) <= tolerance_m
}

/// Whether the segment from `a` to `b` stays inside the polygon, give or take `tolerance_m` at the boundary.
#[must_use]
pub fn contains_segment(polygon: &[Vector2<f64>], a: Vector2<f64>, b: Vector2<f64>, tolerance_m: f64) -> bool {
    // Between two neighbouring crossings a segment is wholly inside or wholly outside: one point of each piece tells.
    let along = b - a;
    let mut cuts = vec![0.0, 1.0];
    for (c, d) in edges(polygon) {
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
    let ends = [a, b].iter().all(|&p| contains_within(polygon, p, tolerance_m));
    ends && cuts.windows(2).all(|w| contains_within(polygon, a + along * (0.5 * (w[0] + w[1])), tolerance_m))
}

/// From this many edges on, those near an edge are looked up, and not all are compared with it.
const MANY: usize = 64;

/// The first pair of edges (k, l) that cross or touch although they are not neighbours, or that fold back onto each other;
/// `None` for a simple polygon.
#[must_use]
pub fn self_intersection(polygon: &[Vector2<f64>]) -> Option<(usize, usize)> {
    let n = polygon.len();
    let corner = |k: usize| polygon[k % n];
    // Edges that meet have boxes that meet.
    let boxes = || edges(polygon).map(|(a, b)| bounds_of(&[a, b], 0.0)).collect::<Vec<_>>();
    let grid = (n > MANY).then(|| Grid::new(&boxes()));
    for k in 0..n {
        // Neighbours share a corner by right; they must not share more.
        let (back, ahead) = (corner(k) - corner(k + 1), corner(k + 2) - corner(k + 1));
        if cross(back, ahead) == 0.0 && back.dot(&ahead) > 0.0 {
            return Some((k, (k + 1) % n));
        }
        let others = match &grid {
            Some(grid) => grid.near(bounds_of(&[corner(k), corner(k + 1)], 0.0)),
            None => (k + 2..n).collect(),
        };
        for l in others.into_iter().filter(|l| *l >= k + 2) {
            let neighbours = k == 0 && l == n - 1;
            if !neighbours && segments_meet(corner(k), corner(k + 1), corner(l), corner(l + 1)) {
                return Some((k, l));
            }
        }
    }
    None
}

/// On which sides of the line from `a` to `b` lie c and d, and of the line from `c` to `d` a and b: positive to the left.
fn sides(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>, d: Vector2<f64>) -> [f64; 4] {
    [cross(b - a, c - a), cross(b - a, d - a), cross(d - c, a - c), cross(d - c, b - c)]
}

/// Whether the segments a-b and c-d cross at a point inside both.
#[must_use]
pub fn segments_cross(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>, d: Vector2<f64>) -> bool {
    let [c_side, d_side, a_side, b_side] = sides(a, b, c, d);
    c_side * d_side < 0.0 && a_side * b_side < 0.0
}

/// Whether two closed segments have a point in common.
pub(crate) fn segments_meet(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>, d: Vector2<f64>) -> bool {
    let in_box = |p: Vector2<f64>, q: Vector2<f64>, r: Vector2<f64>| {
        r.x >= p.x.min(q.x) && r.x <= p.x.max(q.x) && r.y >= p.y.min(q.y) && r.y <= p.y.max(q.y)
    };
    let [c_side, d_side, a_side, b_side] = sides(a, b, c, d);
    segments_cross(a, b, c, d)
        || (c_side == 0.0 && in_box(a, b, c))
        || (d_side == 0.0 && in_box(a, b, d))
        || (a_side == 0.0 && in_box(c, d, a))
        || (b_side == 0.0 && in_box(c, d, b))
}

/// The first corner at which the polygon does not turn to the same side as it does overall; `None` for a strictly convex one.
///
/// A polygon that winds round more than once passes this test; [`self_intersection`] finds those.
#[must_use]
pub fn reflex_corner(polygon: &[Vector2<f64>]) -> Option<usize> {
    let sense = signed_area(polygon);
    let n = polygon.len();
    (0..n).find(|&k| {
        let (before, here, after) = (polygon[(k + n - 1) % n], polygon[k], polygon[(k + 1) % n]);
        cross(here - before, after - here) * sense <= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(corners: &[[f64; 2]]) -> Vec<Vector2<f64>> {
        corners.iter().map(|c| Vector2::new(c[0], c[1])).collect()
    }

    /// An L: the unit square scaled by 2 without its upper right quarter.
    fn ell() -> Vec<Vector2<f64>> {
        polygon(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])
    }

    #[test]
    fn area_and_containment_of_an_l() {
        assert!((signed_area(&ell()) - 3.0).abs() < 1e-15);
        assert!(contains(&ell(), Vector2::new(0.5, 1.5)) && !contains(&ell(), Vector2::new(1.5, 1.5)));
        // Level with a corner and an edge: the ray through them must count them once.
        assert!(contains(&ell(), Vector2::new(0.5, 1.0)) && !contains(&ell(), Vector2::new(-0.5, 1.0)));
        assert!((distance_to_boundary(&ell(), Vector2::new(1.5, 1.4)) - 0.4).abs() < 1e-15);
        let diagonal = [Vector2::new(0.1, 0.1), Vector2::new(1.9, 1.9)];
        assert!(segments_cross(diagonal[0], diagonal[1], ell()[1], ell()[5]));
        assert!(!segments_cross(ell()[0], ell()[1], ell()[1], ell()[2]), "they meet at an end");
    }

    #[test]
    fn a_segment_across_the_notch_is_not_inside() {
        let p = |x, y| Vector2::new(x, y);
        assert!(!contains_segment(&ell(), p(1.5, 0.5), p(0.5, 1.9), 1e-3));
        assert!(!contains_segment(&ell(), p(2.0, 1.0), p(1.0, 2.0), 1e-3), "touches the boundary at its ends only");
        assert!(contains_segment(&ell(), p(2.0, 1.0), p(0.0, 1.0), 1e-3), "runs along an edge");
        assert!(contains_segment(&ell(), p(0.1, 0.1), p(1.9, 0.9), 1e-3));
    }

    #[test]
    fn crossing_and_folded_polygons_are_found() {
        assert_eq!(self_intersection(&ell()), None);
        assert_eq!(self_intersection(&polygon(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])), Some((0, 2)));
        assert!(self_intersection(&polygon(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]])).is_some());
        assert_eq!(reflex_corner(&ell()), Some(3));
        assert_eq!(reflex_corner(&polygon(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])), None);
    }
}
