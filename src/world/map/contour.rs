//! Borders of a mask as closed lines, exact and simplified.
//!
//! Corners are counted in quarters of a cell, so that all of them are whole numbers. A border has the mask on its left: the outer one runs
//! anti-clockwise, those of holes clockwise. Where two cells of the mask meet in a corner only, they do not hang together, and the
//! border passes that corner twice; each time it keeps a quarter of a cell away, so that no two borders meet anywhere.

use super::region::Mask;
use crate::geometry::{Vector2, cross};

/// Parts of a cell's edge that corners are counted in.
pub(super) const PARTS: i32 = 4;

/// Steps along a border: east, north, west, south.
const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// A closed border.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Border {
    /// Its corners, without those at which it goes straight on.
    pub corners: Vec<[i32; 2]>,
    /// Column and row of a cell on its other side.
    pub beyond: [i64; 2],
}

/// Borders of a mask. That of the lowest cell comes first.
pub(super) fn borders(mask: &Mask) -> Vec<Border> {
    let (columns, rows) = (mask.columns as i64, mask.rows as i64);
    // The cell ahead on the left, and the one on the right, of a place that is left in this direction.
    let left = |[x, y]: [i64; 2], step: usize| match step {
        0 => [x, y],
        1 => [x - 1, y],
        2 => [x - 1, y - 1],
        _ => [x, y - 1],
    };
    let right = |at: [i64; 2], step: usize| left(at, (step + 3) % 4);
    let holds = |[x, y]: [i64; 2]| mask.holds(x, y);
    let is_border = |at: [i64; 2], step: usize| holds(left(at, step)) && !holds(right(at, step));
    let mut seen = vec![false; (columns as usize + 1) * (rows as usize + 1)];
    let place = |[x, y]: [i64; 2]| y as usize * (columns as usize + 1) + x as usize;
    let mut all = Vec::new();
    for y in 0..=rows {
        for x in 0..=columns {
            // Each border goes east somewhere.
            if !is_border([x, y], 0) || seen[place([x, y])] {
                continue;
            }
            let mut corners = Vec::new();
            let (mut at, mut step) = ([x, y], 0);
            loop {
                if step == 0 {
                    if seen[place(at)] {
                        break;
                    }
                    seen[place(at)] = true;
                }
                at = [at[0] + STEPS[step][0], at[1] + STEPS[step][1]];
                let (ahead_left, ahead_right) = (holds(left(at, step)), holds(right(at, step)));
                let next = match (ahead_left, ahead_right) {
                    (true, true) => (step + 3) % 4,
                    (true, false) => step,
                    (false, _) => (step + 1) % 4,
                };
                if next != step {
                    let mut corner = at.map(|v| v as i32 * PARTS);
                    if !ahead_left && ahead_right {
                        // Into the cell on the left, which is behind this place.
                        let back = [STEPS[(step + 2) % 4], STEPS[(step + 1) % 4]];
                        corner = std::array::from_fn(|axis| corner[axis] + (back[0][axis] + back[1][axis]) as i32);
                    }
                    corners.push(corner);
                }
                step = next;
            }
            all.push(Border { corners, beyond: right([x, y], 0) });
        }
    }
    all
}

/// A corner as a point.
pub(super) fn point([x, y]: [i32; 2]) -> Vector2<f64> {
    Vector2::new(f64::from(x), f64::from(y))
}

/// The corners of a closed line that keep it within `tolerance` of itself: Douglas and Peucker's choice (1973).
pub(super) fn simplify(line: &[[i32; 2]], tolerance: f64) -> Vec<[i32; 2]> {
    let n = line.len();
    // Two corners that every choice must hold: one at the border of the box around the line, and the farthest from it.
    let first = (0..n).min_by_key(|&k| (line[k][1], line[k][0])).unwrap_or(0);
    let far = |k: &usize| (point(line[*k]) - point(line[first])).norm_squared();
    let second = (0..n).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
    let at = |k: usize| line[(first + k) % n];
    let halfway = (second + n - first) % n;
    let mut keep = vec![false; n + 1];
    keep[0] = true;
    keep[halfway] = true;
    let mut stack = vec![(0, halfway), (halfway, n)];
    while let Some((from, to)) = stack.pop() {
        let (a, b) = (point(at(from)), point(at(to)));
        let away = |k: usize| crate::world::polygon::distance_to_segment(point(at(k)), a, b);
        let farthest = (from + 1..to).map(|k| (away(k), k)).max_by(|p, q| p.0.total_cmp(&q.0));
        if let Some((distance, k)) = farthest.filter(|(distance, _)| *distance > tolerance) {
            debug_assert!(distance > 0.0);
            keep[k] = true;
            stack.extend([(from, k), (k, to)]);
        }
    }
    (0..n).filter(|&k| keep[k]).map(at).collect()
}

/// The convex hull of points, anti-clockwise, without corners at which it goes straight on: Andrew's monotone chain (1979).
pub(super) fn hull(points: &[[i32; 2]]) -> Vec<Vector2<f64>> {
    let mut sorted = points.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    let half = |points: &mut dyn Iterator<Item = [i32; 2]>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for p in points.map(point) {
            while let [.., a, b] = chain[..] {
                if cross(b - a, p - b) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut all = half(&mut sorted.iter().copied());
    all.extend(half(&mut sorted.iter().rev().copied()));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::polygon::{self_intersection, signed_area};

    fn mask(rows: &[&str]) -> Mask {
        let cells = rows.iter().rev().flat_map(|row| row.chars().map(|c| c == '#')).collect();
        Mask { columns: rows[0].len(), rows: rows.len(), cells }
    }

    #[test]
    fn borders_enclose_what_belongs_and_never_meet() {
        // The hole's two cells meet in a corner, which its border passes twice.
        let mask = mask(&["######", "##.###", "#.####", "######"]);
        let borders: Vec<Vec<_>> = borders(&mask).iter().map(|b| b.corners.iter().map(|c| point(*c)).collect()).collect();
        let areas: Vec<f64> = borders.iter().map(|b| signed_area(b) / f64::from(PARTS * PARTS)).collect();
        assert_eq!(areas.len(), 2);
        assert_eq!(areas[0], 24.0);
        // The hole keeps hanging together by a neck, a quarter of a cell at either side.
        assert!(areas[1] < -2.0 && areas[1] > -2.6, "{areas:?}");
        assert!(borders.iter().all(|b| self_intersection(b).is_none()), "{borders:?}");
    }

    #[test]
    fn a_slanting_wall_becomes_one_line() {
        let cells = (0..40 * 60).map(|k| 2 * (k / 60) < k % 60).collect();
        let borders = borders(&Mask { columns: 60, rows: 40, cells });
        assert_eq!(borders.len(), 1);
        let simple = simplify(&borders[0].corners, f64::from(PARTS));
        assert!(borders[0].corners.len() > 50 && simple.len() <= 5, "{simple:?}");
    }
}
