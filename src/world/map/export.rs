//! A world as a map: what a robot that drives in it finds occupied.

use std::fmt::Write;

use super::{COARSEST_M, FINEST_M, FREE, Map, OCCUPIED, UNKNOWN};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2};
use crate::world::World;
use crate::world::convex::Convex;
use crate::world::polygon;

/// Cells around the room that belong to the map.
const MARGIN: f64 = 4.0;
/// A cell outside the room is one of its wall up to this far from it, in cells.
const WALL: f64 = 0.75;
/// Most cells of a map.
const MOST_CELLS: f64 = 6.4e7;
/// Greys of occupied, free and unknown cells, as `map_saver` writes them.
const OCCUPIED_GREY: u8 = 0;
const FREE_GREY: u8 = 254;
/// See above.
pub const UNKNOWN_GREY: u8 = 205;

/// Draws a world as a map in the world's own frame. Occupied are the cells that hold a part, however small, of what the robot cannot
/// pass: walls, and bodies that stand, up to the robot's height. What moves by itself is not in a map, and what is outside
/// the room is unknown.
///
/// # Errors
/// When the resolution is not allowed, or the map would be too large.
pub fn export(world: &World, resolution_m: f64) -> Result<Map> {
    let invalid = |found: String, allowed: String| Error::Invalid { what: "resolution".to_owned(), found, allowed };
    if !(FINEST_M..=COARSEST_M).contains(&resolution_m) {
        return Err(invalid(resolution_m.to_string(), format!("{FINEST_M} to {COARSEST_M} m")));
    }
    let (low, high) = polygon::bounds(&world.outline);
    // Whole cells, so that maps of one world and resolution lie on one lattice, whatever stands at its border.
    let first = (low / resolution_m).map(|v| (v - 1e-6).floor() - MARGIN);
    let count = (high / resolution_m).map(|v| (v + 1e-6).ceil() + MARGIN) - first;
    if count.x * count.y > MOST_CELLS {
        let found = format!("{resolution_m}, which makes {} x {} cells", count.x, count.y);
        return Err(invalid(found, format!("a coarser one: at most {MOST_CELLS} cells")));
    }
    let (columns, rows) = (count.x as usize, count.y as usize);
    let origin = first * resolution_m;
    let mut map = Map::new(columns, rows, resolution_m, Pose::new(origin.x, origin.y, 0.0), vec![UNKNOWN; columns * rows]);
    for cell in 0..map.cells.len() {
        let middle = map.middle(cell);
        map.cells[cell] = if world.boundary().contains(middle) {
            FREE
        } else if world.boundary().distance(middle) <= WALL * resolution_m {
            OCCUPIED
        } else {
            UNKNOWN
        };
    }
    for (a, b) in polygon::edges(&world.outline) {
        // Piece by piece, so that the box around a slanting wall holds few cells.
        let pieces = ((b - a).norm() / (8.0 * resolution_m)).ceil();
        let at = |k: usize| a + (b - a) * (k as f64 / pieces);
        (0..pieces as usize).for_each(|k| occupy(&mut map, &Convex::corridor(at(k), at(k + 1), 0.0)));
    }
    let robot_m = world.spec.robot.height_m;
    for body in world.bodies.iter().filter(|b| b.stands() && b.bottom_m < robot_m) {
        occupy(&mut map, &Convex::of_body(body, &body.pose));
    }
    for wall in &world.partitions {
        for stretch in wall.stretches(0.0, robot_m) {
            occupy(&mut map, &Convex::polygon(&wall.footprint(stretch), 0.0));
        }
    }
    Ok(map)
}

/// Occupies the free cells whose inside a shape meets.
fn occupy(map: &mut Map, shape: &Convex) {
    let resolution_m = map.resolution_m;
    let origin = map.origin.position();
    let (low, high) = shape.bounds(0.0);
    let at = |v: f64, count: usize| (v.max(0.0) as usize).min(count - 1);
    let (from, to) = ((low - origin) / resolution_m, (high - origin) / resolution_m);
    for row in at(from.y, map.rows)..=at(to.y, map.rows) {
        for column in at(from.x, map.columns)..=at(to.x, map.columns) {
            let cell = row * map.columns + column;
            if map.cells[cell] != FREE {
                continue;
            }
            let half = 0.5 * resolution_m;
            let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
            let middle = map.middle(cell);
            let square = Convex::polygon(&corners.map(|(x, y)| middle + Vector2::new(x, y)), 0.0);
            // A shape that only touches a cell, as a wall on a line of the lattice does, is not in it.
            if square.gap_m(shape) < -1e-6 * resolution_m.max(1.0) {
                map.cells[cell] = OCCUPIED;
            }
        }
    }
}

impl Map {
    /// The map as a binary PGM image, as `map_saver` writes it: black is occupied, light is free, grey is unknown.
    #[must_use]
    pub fn pgm(&self) -> Vec<u8> {
        let mut bytes = format!("P5\n{} {}\n255\n", self.columns, self.rows).into_bytes();
        for row in self.cells.chunks_exact(self.columns).rev() {
            bytes.extend(row.iter().map(|value| match *value {
                value if value < FREE => UNKNOWN_GREY,
                value if value <= self.free_most => FREE_GREY,
                value if value >= self.occupied_least => OCCUPIED_GREY,
                _ => UNKNOWN_GREY,
            }));
        }
        bytes
    }

    /// The description that goes with [`Map::pgm`], for `map_server` of ROS and Nav2; `image` is that file's name, and `comments` are
    /// lines at its head.
    #[must_use]
    pub fn description(&self, image: &str, comments: &[String]) -> String {
        let mut text = String::new();
        for comment in comments {
            let _ = writeln!(text, "# {comment}");
        }
        let Pose { x, y, heading } = self.origin;
        // No negative zero, and no digits that only rounding made.
        let tidy = |v: f64| (1e9 * v).round() / 1e9 + 0.0;
        let (resolution, x, y) = (self.resolution_m, tidy(x), tidy(y));
        let _ = write!(
            text,
            "image: {image}\nmode: trinary\nresolution: {resolution:?}\norigin: [{x:?}, {y:?}, {heading:?}]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        );
        text
    }
}
