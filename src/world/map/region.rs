//! Free cells that hang together, and how far each is from all others.

use super::Map;

/// Which cells of a grid belong to something, row by row, the lowest row first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mask {
    pub columns: usize,
    pub rows: usize,
    pub cells: Vec<bool>,
}

impl Mask {
    pub(super) fn new(columns: usize, rows: usize) -> Self {
        Self { columns, rows, cells: vec![false; columns * rows] }
    }

    /// Whether a cell belongs; none outside the grid does.
    pub(super) fn holds(&self, column: i64, row: i64) -> bool {
        let inside = column >= 0 && row >= 0 && (column as usize) < self.columns && (row as usize) < self.rows;
        inside && self.cells[row as usize * self.columns + column as usize]
    }

    pub(super) fn count(&self) -> usize {
        self.cells.iter().filter(|c| **c).count()
    }

    /// Distance of each cell to the nearest one that does not belong, in cells from middle to middle; 0 for those that do not
    /// belong. What is outside the grid does not belong. Steps are straight (5) or diagonal (7), which is at most 4 % off.
    pub(super) fn clearance(&self) -> Clearance {
        let (columns, rows) = (self.columns, self.rows);
        let width = columns + 2;
        let mut steps = vec![0_u32; width * (rows + 2)];
        for row in 0..rows {
            for column in 0..columns {
                if self.cells[row * columns + column] {
                    steps[(row + 1) * width + column + 1] = u32::MAX / 2;
                }
            }
        }
        for row in 1..=rows {
            for k in row * width + 1..=row * width + columns {
                let straight = steps[k - 1].min(steps[k - width]) + 5;
                let diagonal = steps[k - width - 1].min(steps[k - width + 1]) + 7;
                steps[k] = steps[k].min(straight).min(diagonal);
            }
        }
        for row in (1..=rows).rev() {
            for k in (row * width + 1..=row * width + columns).rev() {
                let straight = steps[k + 1].min(steps[k + width]) + 5;
                let diagonal = steps[k + width + 1].min(steps[k + width - 1]) + 7;
                steps[k] = steps[k].min(straight).min(diagonal);
            }
        }
        Clearance { width, steps }
    }
}

/// Distances to what does not belong to a mask.
pub(super) struct Clearance {
    width: usize,
    steps: Vec<u32>,
}

impl Clearance {
    /// Of a cell, in cells.
    pub(super) fn at(&self, column: usize, row: usize) -> f64 {
        f64::from(self.steps[(row + 1) * self.width + column + 1]) / 5.0
    }
}

/// Cells in groups: those of a group hang together, by their edges or also by their corners.
pub(super) struct Groups {
    /// Group of each cell; [`NONE`] where it is in none.
    pub labels: Vec<u32>,
    pub groups: Vec<Group>,
}

/// Marks a cell of no group.
pub(super) const NONE: u32 = u32::MAX;

/// Cells that hang together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    /// How many.
    pub cells: usize,
    /// Whether one of them is at the border of the grid.
    pub at_border: bool,
    /// Lowest and highest column and row.
    pub columns: [usize; 2],
    pub rows: [usize; 2],
}

impl Groups {
    /// Groups of the cells of a mask; `corners` says whether cells that meet in a corner hang together.
    pub(super) fn new(mask: &Mask, corners: bool) -> Self {
        let (columns, rows) = (mask.columns, mask.rows);
        let mut labels = vec![NONE; columns * rows];
        let mut groups = Vec::new();
        let mut queue = Vec::new();
        for first in 0..labels.len() {
            if !mask.cells[first] || labels[first] != NONE {
                continue;
            }
            let label = groups.len() as u32;
            let (column, row) = (first % columns, first / columns);
            let mut group = Group { cells: 0, at_border: false, columns: [column; 2], rows: [row; 2] };
            labels[first] = label;
            queue.push(first);
            while let Some(cell) = queue.pop() {
                let (column, row) = (cell % columns, cell / columns);
                group.cells += 1;
                group.at_border |= column == 0 || row == 0 || column + 1 == columns || row + 1 == rows;
                group.columns = [group.columns[0].min(column), group.columns[1].max(column)];
                group.rows = [group.rows[0].min(row), group.rows[1].max(row)];
                for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)] {
                    if !corners && dx != 0 && dy != 0 {
                        continue;
                    }
                    let (x, y) = (column as i64 + dx, row as i64 + dy);
                    if mask.holds(x, y) {
                        let next = y as usize * columns + x as usize;
                        if labels[next] == NONE {
                            labels[next] = label;
                            queue.push(next);
                        }
                    }
                }
            }
            groups.push(group);
        }
        Self { labels, groups }
    }

    /// The cells of one group.
    pub(super) fn mask(&self, label: u32, columns: usize, rows: usize) -> Mask {
        Mask { columns, rows, cells: self.labels.iter().map(|l| *l == label).collect() }
    }
}

/// The free cells of a map.
pub(super) fn free(map: &Map) -> Mask {
    Mask { columns: map.columns, rows: map.rows, cells: (0..map.cells.len()).map(|cell| map.is_free(cell)).collect() }
}

/// Takes specks of the unknown in free space for free: groups of cells of which none is occupied, none is at the border of the
/// grid, and each has a free neighbour. Gives how many there were.
///
/// A robot that maps a room leaves them where no ray happened to pass; nothing stands there that was seen.
pub(super) fn fill_specks(region: &mut Mask, map: &Map) -> usize {
    let others = Mask { cells: region.cells.iter().map(|c| !c).collect(), ..*region };
    let groups = Groups::new(&others, true);
    let mut is_speck: Vec<bool> = groups.groups.iter().map(|g| !g.at_border).collect();
    for (cell, label) in groups.labels.iter().enumerate() {
        if *label == NONE || !is_speck[*label as usize] {
            continue;
        }
        let (column, row) = ((cell % map.columns) as i64, (cell / map.columns) as i64);
        let touches = [(-1, 0), (1, 0), (0, -1), (0, 1)].iter().any(|(dx, dy)| region.holds(column + dx, row + dy));
        if map.is_occupied(cell) || map.is_free(cell) || !touches {
            is_speck[*label as usize] = false;
        }
    }
    for (cell, label) in groups.labels.iter().enumerate() {
        region.cells[cell] |= *label != NONE && is_speck[*label as usize];
    }
    is_speck.iter().filter(|s| **s).count()
}
