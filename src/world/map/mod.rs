//! Maps as robots make them, and floor plans: people's own buildings as worlds, and worlds as maps.
//!
//! A [`Map`] is an occupancy grid as `map_server` of ROS and Nav2 read it (`read`). [`import`] turns the free cells that hang together
//! with home (`region`) into a world: their outer border becomes the outline of the room, and what stands in them becomes bodies and
//! walls (`contour`, `shapes`, `solid`), each within a stated tolerance of the cells. [`export`] draws what the robot cannot pass in a world as
//! such a grid. Both keep the map's frame, so that a pose means the same place in the map and in the world.
//!
//! ```
//! use wayhome::world::World;
//! use wayhome::world::map::{ImportSettings, Map, export, import};
//!
//! let lab = World::open("lab")?;
//! let map = export(&lab, 0.05)?;
//! let settings = ImportSettings { name: "lab-again".to_owned(), ..ImportSettings::default() };
//! let again = import(&map, &settings)?;
//! assert!(again.report.deviation_m <= again.report.tolerance_m);
//! let again = World::from_toml(&again.toml, "lab-again.toml")?;
//! assert!(again.is_free(&lab.home, 0.0, &again.body_poses()).is_ok());
//! # Ok::<(), wayhome::Error>(())
//! ```

mod contour;
mod export;
mod import;
mod read;
mod region;
mod shapes;
mod solid;

use crate::geometry::{Pose, Vector2};

pub use export::{UNKNOWN_GREY, export};
pub use import::{HEAD, ImportSettings, Imported, Report, import};
pub use read::{COARSEST_M, FINEST_M, is_description};

/// Value of a cell of which nothing is known.
pub const UNKNOWN: i8 = -1;
/// Value of a cell that is free for certain.
pub const FREE: i8 = 0;
/// Value of a cell that is occupied for certain.
pub const OCCUPIED: i8 = 100;

/// An occupancy grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Columns of cells, along x.
    pub columns: usize,
    /// Rows of cells, along y.
    pub rows: usize,
    /// Edge of a cell, m.
    pub resolution_m: f64,
    /// Lower left corner of the grid, and the direction of its rows.
    pub origin: Pose,
    /// Occupancy of each cell as `nav_msgs/OccupancyGrid` has it: 0 to 100 %, or [`UNKNOWN`]. Row by row, the lowest row first.
    pub cells: Vec<i8>,
    /// Cells up to this value are free.
    pub free_most: i8,
    /// Cells from this value on are occupied; between the two nothing is certain.
    pub occupied_least: i8,
    /// Whether it is a drawing of walls on paper, that goes on outside the building, rather than what a robot has seen.
    pub drawn: bool,
    /// What is allowed in the map and may still not be meant.
    pub warnings: Vec<String>,
}

impl Map {
    /// A grid of cells that are free, occupied or unknown.
    #[must_use]
    pub fn new(columns: usize, rows: usize, resolution_m: f64, origin: Pose, cells: Vec<i8>) -> Self {
        debug_assert_eq!(cells.len(), columns * rows, "one value a cell");
        let (free_most, occupied_least) = (FREE, OCCUPIED);
        Self { columns, rows, resolution_m, origin, cells, free_most, occupied_least, drawn: false, warnings: Vec::new() }
    }

    /// Whether a cell is free.
    #[must_use]
    pub fn is_free(&self, cell: usize) -> bool {
        (FREE..=self.free_most).contains(&self.cells[cell])
    }

    /// Whether a cell is occupied.
    #[must_use]
    pub fn is_occupied(&self, cell: usize) -> bool {
        self.cells[cell] >= self.occupied_least
    }

    /// The cell around a point of the map's frame, if there is one.
    #[must_use]
    pub fn cell_at(&self, point: Vector2<f64>) -> Option<usize> {
        let local = self.origin.inverse_transform(point) / self.resolution_m;
        let inside = local.x >= 0.0 && local.y >= 0.0 && local.x < self.columns as f64 && local.y < self.rows as f64;
        inside.then(|| local.y as usize * self.columns + local.x as usize)
    }

    /// Middle of a cell in the map's frame, m.
    #[must_use]
    pub fn middle(&self, cell: usize) -> Vector2<f64> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        self.origin.transform(Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * self.resolution_m)
    }
}
