//! What is solid of the walls inside a room, by place.

use crate::geometry::Vector2;
use crate::world::grid::{Grid, bounds_of};
use crate::world::polygon::distance_to_polygon;
use crate::world::{Partition, World};

/// What a robot of a world cannot pass of its inner walls. A door whose lintel is higher than the robot parts two stretches; a
/// sill, however low, or a lower lintel does not.
#[derive(Debug, Clone)]
pub(super) struct Stretches {
    /// For each stretch the number of its wall, and its corners in the room, anti-clockwise.
    pub(super) all: Vec<(usize, [Vector2<f64>; 4])>,
    grid: Grid,
}

impl Stretches {
    pub(super) fn new(world: &World) -> Self {
        let height_m = world.spec.robot.height_m;
        let of_wall = |(k, wall): (usize, &Partition)| -> Vec<_> {
            wall.stretches(0.0, height_m).into_iter().map(|stretch| (k, wall.footprint(stretch))).collect()
        };
        let all: Vec<_> = world.partitions.iter().enumerate().flat_map(of_wall).collect();
        let boxes: Vec<_> = all.iter().map(|(_, corners)| bounds_of(corners, 0.0)).collect();
        Self { all, grid: Grid::new(&boxes) }
    }

    /// Those that may be within `reach_m` of a point: all that are, and others.
    pub(super) fn near(&self, point: Vector2<f64>, reach_m: f64) -> impl Iterator<Item = &(usize, [Vector2<f64>; 4])> {
        self.grid.near(bounds_of(&[point], reach_m)).into_iter().map(|k| &self.all[k])
    }

    /// Distance from a point to the nearest, m; infinity where there is none.
    pub(super) fn distance(&self, point: Vector2<f64>) -> f64 {
        self.grid.nearest(point, |k| distance_to_polygon(&self.all[k].1, point))
    }
}
