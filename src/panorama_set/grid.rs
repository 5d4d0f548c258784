//! Where a set's panoramas were taken.

use crate::geometry::Vector2;

/// A place of a grid: row i and column j, both from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// Row.
    pub i: usize,
    /// Column.
    pub j: usize,
}

/// An even grid with home on one of its places.
///
/// In the home frame, columns run along x and rows against y: place (i, j) lies at ((j - home.j) s, (home.i - i) s) for a spacing
/// of s. The homing literature does not say so; up to mirroring it is the reading under which the starts of the papers lie on
/// their grids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Distance between neighbours, m.
    pub spacing_m: f64,
    /// Where home is.
    pub home: Place,
}

/// Four neighbouring places around a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Corners: (i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1).
    pub corners: [Place; 4],
    /// Weights of the corners in a bilinear interpolation; they sum to 1.
    pub weights: [f64; 4],
}

/// How far beyond the grid's rim a point may lie to be extrapolated from the rim's cell, as a share of the spacing.
const BEYOND: f64 = 0.5;

impl Grid {
    /// Position of a place in the home frame, m.
    #[must_use]
    pub fn position(&self, place: Place) -> Vector2<f64> {
        let steps = |to: usize, from: usize| to as f64 - from as f64;
        Vector2::new(steps(place.j, self.home.j), steps(self.home.i, place.i)) * self.spacing_m
    }

    /// All places, row by row.
    pub fn places(&self) -> impl Iterator<Item = Place> + use<> {
        let columns = self.columns;
        (0..self.rows).flat_map(move |i| (0..columns).map(move |j| Place { i, j }))
    }

    /// Index of a place in the order of [`places`](Self::places).
    #[must_use]
    pub fn index(&self, place: Place) -> usize {
        place.i * self.columns + place.j
    }

    /// The cell around a point of the home frame; `None` for a point more than half a spacing outside the grid, or for a grid of a
    /// single row or column.
    #[must_use]
    pub fn cell(&self, point: Vector2<f64>) -> Option<Cell> {
        let along = |at: f64, count: usize| -> Option<(usize, f64)> {
            let last = (count.checked_sub(2)?) as f64;
            let whole = libm::floor(at).clamp(0.0, last);
            let share = at - whole;
            (-BEYOND..=1.0 + BEYOND).contains(&share).then_some((whole as usize, share))
        };
        let (i, v) = along(self.home.i as f64 - point.y / self.spacing_m, self.rows)?;
        let (j, u) = along(self.home.j as f64 + point.x / self.spacing_m, self.columns)?;
        let corners = [Place { i, j }, Place { i, j: j + 1 }, Place { i: i + 1, j }, Place { i: i + 1, j: j + 1 }];
        Some(Cell { corners, weights: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { rows: 10, columns: 17, spacing_m: 0.3, home: Place { i: 4, j: 8 } };

    /// Bilinear weights give a linear function back, inside and a little beyond the rim.
    #[test]
    fn cells_interpolate() {
        assert_eq!(GRID.position(Place { i: 3, j: 9 }), Vector2::new(0.3, 0.3));
        assert!(GRID.places().enumerate().all(|(k, place)| GRID.index(place) == k));
        let linear = |p: Vector2<f64>| 1.0 + 2.0 * p.x - 3.0 * p.y;
        for point in [[0.0, 0.0], [1.59, 1.08], [-1.4, -1.02], [1.34, -1.40], [2.5, -1.6], [-2.4, 1.2]] {
            let point = Vector2::new(point[0], point[1]);
            let cell = GRID.cell(point).unwrap();
            let sum: f64 = cell.corners.iter().zip(cell.weights).map(|(c, w)| w * linear(GRID.position(*c))).sum();
            assert!((sum - linear(point)).abs() < 1e-12);
        }
        assert_eq!(GRID.cell(Vector2::new(2.6, 0.0)), None);
        assert_eq!(GRID.cell(Vector2::new(0.0, f64::NAN)), None);
    }
}
