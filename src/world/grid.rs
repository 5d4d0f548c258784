//! What lies near a place, among thousands of things: a grid of cells, each with the numbers of the things whose bounding boxes
//! meet it.

use crate::geometry::Vector2;

/// Lower left and upper right corner of a box, m.
pub(crate) type Bounds = (Vector2<f64>, Vector2<f64>);

/// Lower left and upper right corner of the bounding box of some points. No points give an inverted, infinite box.
#[must_use]
pub fn bounds(points: &[Vector2<f64>]) -> (Vector2<f64>, Vector2<f64>) {
    let mut low = Vector2::new(f64::INFINITY, f64::INFINITY);
    let mut high = -low;
    for p in points {
        low = Vector2::new(low.x.min(p.x), low.y.min(p.y));
        high = Vector2::new(high.x.max(p.x), high.y.max(p.y));
    }
    (low, high)
}

/// The bounding box of some points, grown by `margin_m` on all sides.
pub(crate) fn bounds_of(points: &[Vector2<f64>], margin_m: f64) -> Bounds {
    let margin = Vector2::repeat(margin_m);
    let (low, high) = bounds(points);
    (low - margin, high + margin)
}

/// Boxes by place. Numbers are those of the boxes in the order in which they were given.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Grid {
    low: Vector2<f64>,
    /// Edge length of a cell, m.
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// Where each cell's numbers begin, row by row, and where the last ones end.
    starts: Vec<u32>,
    numbers: Vec<u32>,
}

/// Most cells for each box.
const CELLS_PER_BOX: f64 = 2.0;

impl Grid {
    pub(crate) fn new(boxes: &[Bounds]) -> Self {
        let corners: Vec<_> = boxes.iter().flat_map(|(low, high)| [*low, *high]).collect();
        if corners.is_empty() || corners.iter().any(|c| !(c.x.is_finite() && c.y.is_finite())) {
            return Self::default();
        }
        let (low, high) = bounds(&corners);
        let size = high - low;
        let most = (CELLS_PER_BOX * boxes.len() as f64).max(1.0);
        // Cells are square, and never so many that a long and narrow room has more of them than things.
        let cell_m = (size.x * size.y / most).sqrt().max(size.x.max(size.y) / most).max(1e-3);
        let count = |length: f64| libm::floor(length / cell_m) as usize + 1;
        let mut grid = Self { low, cell_m, columns: count(size.x), rows: count(size.y), ..Self::default() };
        let cells = grid.columns * grid.rows;
        let mut counts = vec![0_u32; cells + 1];
        for bounds in boxes {
            grid.cells(*bounds).for_each(|cell| counts[cell + 1] += 1);
        }
        for k in 0..cells {
            counts[k + 1] += counts[k];
        }
        grid.numbers = vec![0; counts[cells] as usize];
        let mut next = counts.clone();
        for (k, bounds) in boxes.iter().enumerate() {
            for cell in grid.cells(*bounds) {
                grid.numbers[next[cell] as usize] = k as u32;
                next[cell] += 1;
            }
        }
        grid.starts = counts;
        grid
    }

    /// The cells that a box meets; those at the border stand for what lies beyond.
    fn cells(&self, (low, high): Bounds) -> impl Iterator<Item = usize> + use<> {
        let (origin, cell_m, columns, rows) = (self.low, self.cell_m, self.columns, self.rows);
        let at = move |x: f64, origin: f64, count: usize| (((x - origin) / cell_m).max(0.0) as usize).min(count.max(1) - 1);
        let (from, to) = (at(low.x, origin.x, columns), at(high.x, origin.x, columns));
        let (first, last) = (at(low.y, origin.y, rows), at(high.y, origin.y, rows));
        (first..=last).flat_map(move |row| (from..=to).map(move |column| row * columns + column))
    }

    /// Numbers of the boxes that may meet `bounds`, each once and rising: all that do, and some that lie near.
    pub(crate) fn near(&self, bounds: Bounds) -> Vec<usize> {
        let mut found = Vec::new();
        if self.numbers.is_empty() {
            return found;
        }
        for cell in self.cells(bounds) {
            let numbers = &self.numbers[self.starts[cell] as usize..self.starts[cell + 1] as usize];
            found.extend(numbers.iter().map(|&k| k as usize));
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The least of the distances from `point` to what is in the boxes, m, as `distance` tells them by their numbers; infinity
    /// where there is nothing.
    pub(crate) fn nearest(&self, point: Vector2<f64>, distance: impl Fn(usize) -> f64) -> f64 {
        let extent = self.cell_m * self.columns.max(self.rows) as f64;
        let mut reach = self.cell_m;
        loop {
            let near = self.near(bounds_of(&[point], reach));
            let least = near.into_iter().map(&distance).fold(f64::INFINITY, f64::min);
            // What was not looked at is farther away than the reach.
            let away = (point - self.low).abs().max();
            if least <= reach || reach > away + extent || self.numbers.is_empty() {
                return least;
            }
            reach *= 2.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::direction;

    #[test]
    fn a_grid_finds_what_a_look_at_everything_finds() {
        let point = |k: usize| direction(2.4 * k as f64) * (0.1 * k as f64);
        let boxes: Vec<Bounds> = (0..200).map(|k| bounds_of(&[point(k), point(k) + direction(k as f64)], 0.0)).collect();
        let grid = Grid::new(&boxes);
        let meet = |a: &Bounds, b: &Bounds| a.0.x <= b.1.x && b.0.x <= a.1.x && a.0.y <= b.1.y && b.0.y <= a.1.y;
        let distance =
            |p: Vector2<f64>, b: &Bounds| (p - Vector2::new(p.x.clamp(b.0.x, b.1.x), p.y.clamp(b.0.y, b.1.y))).norm();
        let mut looked_at = 0;
        for k in 0..300 {
            let at = direction(1.7 * k as f64) * (0.1 * k as f64);
            let asked = bounds_of(&[at], 0.3 + 0.01 * k as f64);
            let near = grid.near(asked);
            assert!(near.windows(2).all(|pair| pair[0] < pair[1]), "each once and rising");
            assert!((0..200).all(|b| near.contains(&b) || !meet(&boxes[b], &asked)), "{at}");
            looked_at += near.len();
            let least = boxes.iter().map(|b| distance(at, b)).fold(f64::INFINITY, f64::min);
            assert_eq!(grid.nearest(at, |b| distance(at, &boxes[b])), least, "{at}");
        }
        assert!(looked_at < 300 * 50, "{looked_at}");
        assert_eq!(Grid::new(&[]).nearest(Vector2::zeros(), |_| 0.0), f64::INFINITY);
    }
}
