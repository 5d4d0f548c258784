//! Where a robot can drive: a grid of its free places, and which of them hang together.
//!
//! A cell is free where a disc around its middle, as large as the robot and half a cell's edge larger, touches nothing that
//! reaches down to the robot's height. Between the middles of two neighbouring free cells the robot is never farther than half an
//! edge from one of them, so that a chain of free cells is a way that the robot itself can drive: what the grid calls reachable
//! is. What it calls unreachable may be a way that is narrower than one edge plus the robot.

use super::plan::{Plan, Solid};
use crate::geometry::Vector2;
use crate::world::polygon::{distance_to_segment, edges};
use crate::world::spec::ShapeSpec;

/// Edge of a cell, m.
pub(super) const CELL_M: f64 = 0.1;
/// Marks a cell that no robot can stand in.
const BLOCKED: u16 = 0;

/// The free places of a room.
pub(super) struct Grid {
    low: Vector2<f64>,
    columns: usize,
    rows: usize,
    /// Steps of a chamfer distance (3 straight, 4 diagonal) to the nearest blocked cell; [`BLOCKED`] is 0.
    clearance: Vec<u16>,
}

impl Grid {
    /// The grid of a disc of this radius, for bodies whose underside is below `height_m`.
    pub(super) fn new(plan: &Plan, radius_m: f64, height_m: f64) -> Self {
        let (low, high) = plan.bounds();
        let size = high - low;
        let [columns, rows] = [size.x, size.y].map(|s| (s / CELL_M).ceil() as usize + 2);
        let low = low - Vector2::new(CELL_M, CELL_M);
        let mut grid = Self { low, columns, rows, clearance: vec![BLOCKED; columns * rows] };
        grid.fill_inside(&plan.outline);
        let reach_m = radius_m + 0.5 * CELL_M;
        for (a, b) in edges(&plan.outline) {
            // Piece by piece, so that the box around a slanting wall holds few cells.
            let pieces = (b - a).norm().ceil();
            for k in 0..pieces as usize {
                let [c, d] = [k, k + 1].map(|k| a + (b - a) * (k as f64 / pieces));
                grid.block((c + d) * 0.5, (d - c).map(f64::abs) * 0.5, reach_m, |p| distance_to_segment(p, c, d));
            }
        }
        for solid in plan.solids.iter().chain(&plan.partitions).filter(|s| s.bottom_m < height_m) {
            grid.block_solid(solid, reach_m);
        }
        grid.measure();
        grid
    }

    /// Middle of a cell, m.
    pub(super) fn middle(&self, cell: usize) -> Vector2<f64> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        self.low + Vector2::new((column as f64 + 0.5) * CELL_M, (row as f64 + 0.5) * CELL_M)
    }

    /// The cell around a point, if the grid has one there.
    pub(super) fn cell(&self, point: Vector2<f64>) -> Option<usize> {
        let d = (point - self.low) / CELL_M;
        let inside = d.x >= 0.0 && d.y >= 0.0 && d.x < self.columns as f64 && d.y < self.rows as f64;
        inside.then(|| d.y as usize * self.columns + d.x as usize)
    }

    /// Lower and upper corner of the grid, m.
    pub(super) fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        (self.low, self.low + Vector2::new(self.columns as f64, self.rows as f64) * CELL_M)
    }

    pub(super) fn cells(&self) -> usize {
        self.clearance.len()
    }

    pub(super) fn is_free(&self, cell: usize) -> bool {
        self.clearance[cell] != BLOCKED
    }

    /// About how far a cell is from the nearest blocked one, m.
    pub(super) fn clearance_m(&self, cell: usize) -> f64 {
        f64::from(self.clearance[cell]) * CELL_M / 3.0
    }

    /// Whether all cells on the straight way between two points are free.
    pub(super) fn sees(&self, from: Vector2<f64>, to: Vector2<f64>) -> bool {
        let d = to - from;
        let steps = (d.norm() / (0.5 * CELL_M)).ceil().max(1.0);
        (0..=steps as usize).all(|k| self.cell(from + d * (k as f64 / steps)).is_some_and(|c| self.is_free(c)))
    }

    /// The cells that hang together with one, by shared edges; none if it is blocked.
    pub(super) fn component(&self, start: usize) -> Vec<bool> {
        let mut reached = vec![false; self.clearance.len()];
        let mut queue = Vec::new();
        if self.is_free(start) {
            reached[start] = true;
            queue.push(start);
        }
        // The outermost cells are blocked: no neighbour leaves the grid.
        while let Some(cell) = queue.pop() {
            for next in [cell - 1, cell + 1, cell - self.columns, cell + self.columns] {
                if !reached[next] && self.is_free(next) {
                    reached[next] = true;
                    queue.push(next);
                }
            }
        }
        reached
    }

    /// Frees all cells whose middle is inside the outline.
    fn fill_inside(&mut self, outline: &[Vector2<f64>]) {
        let mut crossings = Vec::new();
        for row in 1..self.rows - 1 {
            let y = self.low.y + (row as f64 + 0.5) * CELL_M;
            crossings.clear();
            let crossed = edges(outline).filter(|(a, b)| (a.y > y) != (b.y > y));
            crossings.extend(crossed.map(|(a, b)| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x)));
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let [from, to] = [pair[0], pair[1]].map(|x| ((x - self.low.x) / CELL_M - 0.5).ceil().max(1.0) as usize);
                let line = row * self.columns;
                self.clearance[line + from..line + to.min(self.columns - 1)].fill(u16::MAX);
            }
        }
    }

    /// Blocks the cells whose middle is nearer than `reach_m` to something within `half` of `centre`.
    fn block(&mut self, centre: Vector2<f64>, half: Vector2<f64>, reach_m: f64, distance_m: impl Fn(Vector2<f64>) -> f64) {
        let first = |low: f64, from: f64| ((from - low) / CELL_M - 0.5).ceil().max(0.0) as usize;
        let last = |low: f64, to: f64, count: usize| (((to - low) / CELL_M + 0.5).floor().max(0.0) as usize).min(count);
        let grown = half + Vector2::new(reach_m, reach_m);
        let (from, to) = (centre - grown, centre + grown);
        for row in first(self.low.y, from.y)..last(self.low.y, to.y, self.rows) {
            for column in first(self.low.x, from.x)..last(self.low.x, to.x, self.columns) {
                let cell = row * self.columns + column;
                if self.clearance[cell] != BLOCKED && distance_m(self.middle(cell)) < reach_m {
                    self.clearance[cell] = BLOCKED;
                }
            }
        }
    }

    fn block_solid(&mut self, solid: &Solid, reach_m: f64) {
        let centre = solid.pose.position();
        let half = Vector2::new(solid.reach_m, solid.reach_m);
        match &solid.shape {
            ShapeSpec::Disc { radius_m } => self.block(centre, half, reach_m, |p| (p - centre).norm() - radius_m),
            ShapeSpec::Box { size_m } => {
                let (sin, cos) = crate::geometry::sin_cos(solid.pose.heading);
                let (hx, hy) = (0.5 * size_m[0], 0.5 * size_m[1]);
                let half = Vector2::new(hx * cos.abs() + hy * sin.abs(), hx * sin.abs() + hy * cos.abs());
                self.block(centre, half, reach_m, |p| {
                    let d = p - centre;
                    let x = ((cos * d.x + sin * d.y).abs() - hx).max(0.0);
                    let y = ((cos * d.y - sin * d.x).abs() - hy).max(0.0);
                    (x * x + y * y).sqrt()
                });
            }
            // The circle around it: polygons here are nearly round.
            ShapeSpec::Polygon { .. } => self.block(centre, half, reach_m, |p| (p - centre).norm() - solid.reach_m),
        }
    }

    /// Distances to the nearest blocked cell, by two passes.
    fn measure(&mut self) {
        let (columns, rows) = (self.columns, self.rows);
        for row in 1..rows - 1 {
            for cell in row * columns + 1..(row + 1) * columns - 1 {
                let c = &self.clearance;
                let straight = c[cell - 1].min(c[cell - columns]).saturating_add(3);
                let diagonal = c[cell - columns - 1].min(c[cell - columns + 1]).saturating_add(4);
                self.clearance[cell] = c[cell].min(straight).min(diagonal);
            }
        }
        for row in (1..rows - 1).rev() {
            for cell in (row * columns + 1..(row + 1) * columns - 1).rev() {
                let c = &self.clearance;
                let straight = c[cell + 1].min(c[cell + columns]).saturating_add(3);
                let diagonal = c[cell + columns + 1].min(c[cell + columns - 1]).saturating_add(4);
                self.clearance[cell] = c[cell].min(straight).min(diagonal);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::plan::Item;
    use super::*;
    use crate::world::spec::{TextureFamily, TextureSpec};

    /// Two halves of a room of 4 x 2 m, with a gap of this width between the boxes that part them.
    fn halves(gap_m: f64) -> bool {
        let mut plan = Plan::new(&[[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]], 2.5);
        let length = 1.0 - 0.5 * gap_m - 0.01;
        for y in [0.005 + 0.5 * length, 1.995 - 0.5 * length] {
            let texture = TextureSpec::new(TextureFamily::Plain, [0; 3]);
            assert!(plan.put(Item::cuboid("wall", [0.1, length], 2.0, texture), Vector2::new(2.0, y), 0.0, 0.0));
        }
        let grid = Grid::new(&plan, 0.164, 0.35);
        let [a, b] = [1.0, 3.0].map(|x| grid.cell(Vector2::new(x, 1.0)).unwrap());
        assert!(grid.is_free(a) && grid.is_free(b));
        grid.component(a)[b]
    }

    #[test]
    fn a_door_is_passed_where_the_robot_fits() {
        assert!(!halves(0.3), "the robot is 0.328 m wide");
        assert!(halves(0.8));
    }

    #[test]
    fn free_cells_keep_their_distance() {
        let mut plan = Plan::new(&[[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [1.0, 3.0]], 2.5);
        let texture = TextureSpec::new(TextureFamily::Plain, [0; 3]);
        assert!(plan.put(Item::cuboid("box", [0.6, 0.3], 1.0, texture.clone()), Vector2::new(1.4, 1.3), 30.0, 0.1));
        assert!(plan.put(Item::cuboid("shelf", [0.5, 0.3], 0.1, texture).raised(1.0), Vector2::new(2.3, 0.6), 0.0, 0.1));
        let grid = Grid::new(&plan, 0.2, 0.35);
        let free: Vec<_> = (0..grid.cells()).filter(|&c| grid.is_free(c)).map(|c| grid.middle(c)).collect();
        let disc = |p, r| crate::world::convex::Convex::disc(p, r);
        for &p in &free {
            assert!(crate::world::polygon::contains(&plan.outline, p));
            assert!(crate::world::polygon::distance_to_boundary(&plan.outline, p) >= 0.25 - 1e-9);
            assert!(plan.solids[0].convex.gap_m(&disc(p, 0.25)) >= -1e-9);
        }
        // As many as a finer count finds room for, by the distances themselves.
        let fine = |k: u32| f64::from(k % 150).mul_add(0.02, 0.01);
        let points = (0..150 * 150).map(|k| Vector2::new(fine(k), fine(k / 150)));
        let count = points.filter(|&p| {
            crate::world::polygon::contains(&plan.outline, p)
                && crate::world::polygon::distance_to_boundary(&plan.outline, p) >= 0.25
                && plan.solids[0].convex.gap_m(&disc(p, 0.25)) >= 0.0
        });
        let (area, wanted) = (0.01 * free.len() as f64, 0.0004 * count.count() as f64);
        assert!((area / wanted - 1.0).abs() < 0.08, "{area} m^2, {wanted} m^2 by a finer count");
        assert!(grid.is_free(grid.cell(Vector2::new(2.3, 0.6)).unwrap()), "what hangs is driven under");
    }
}
