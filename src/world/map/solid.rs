//! What stands in free space, as walls and bodies of a world.
//!
//! A disc, a short rectangle or a convex shape is a body; a long rectangle is one wall. Any other shape gets a thin wall along each of its
//! sides, and thick ones inside wherever a robot could stand between them: what was solid in the map stays so.

use super::contour::{Border, PARTS, point};
use super::region::{Groups, Mask};
use super::shapes::{Form, Shape};
use crate::geometry::{Pose, Vector2, angle_of};
use crate::world::boundary::Boundary;
use crate::world::grid::{Grid, bounds_of};
use crate::world::polygon::edges;
use crate::world::spec::ShapeSpec;

/// A rectangle from which on it is a wall and no body: so many times as long as wide.
const LONG: f64 = 3.0;
/// Thickness of the walls along the sides of a shape, m, and the least that a wall can have.
const SHELL_M: f64 = 0.02;
const THINNEST_M: f64 = 0.005;
/// Greatest thickness of a wall, m.
const THICKEST_M: f64 = 2.0;
/// Radius of a disc that finds no place inside a shape, m: smaller than any robot.
const PROBE_M: f64 = 0.1;

/// Where the lattice of a map lies in a world.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub origin: Pose,
    pub resolution_m: f64,
}

impl Frame {
    /// A place of the lattice, in parts of a cell, as a place in the world, m, in tenths of a millimetre.
    pub(super) fn place(&self, p: Vector2<f64>) -> [f64; 2] {
        let at = self.origin.transform(p * self.part_m());
        [at.x, at.y].map(tenths)
    }

    /// A length in parts of a cell, m.
    pub(super) fn part_m(&self) -> f64 {
        self.resolution_m / f64::from(PARTS)
    }

    /// Heading of a direction of the lattice, degrees, in thousandths.
    fn heading_deg(&self, along: Vector2<f64>) -> f64 {
        (1000.0 * (angle_of(along) + self.origin.heading).to_degrees()).round() / 1000.0 + 0.0
    }
}

/// A length in tenths of a millimetre, m; no negative zero.
pub(super) fn tenths(length_m: f64) -> f64 {
    (1e4 * length_m).round() / 1e4 + 0.0
}

/// A wall as far as its place matters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub from_m: [f64; 2],
    pub to_m: [f64; 2],
    pub thickness_m: f64,
}

/// A body as far as its place matters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Standing {
    pub shape: ShapeSpec,
    pub position_m: [f64; 2],
    pub heading_deg: f64,
}

/// What a hole of the free space becomes.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Solid {
    Body(Standing),
    Wall(Segment),
    /// Thin walls along its sides, and thick ones that are never seen.
    Block {
        sides: Vec<Segment>,
        core: Vec<Segment>,
        /// Greatest distance to the border of a corner of a thin wall that sticks out of the shape, m.
        stray_m: f64,
    },
}

/// The solids of all holes; `shapes` begins with the outer border, as `borders` does.
pub(super) fn solids(borders: &[Border], shapes: &[Shape], beyond: &Groups, region: &Mask, frame: &Frame) -> Vec<Solid> {
    let shell = (SHELL_M / frame.part_m()).min(0.5 * f64::from(PARTS));
    // A body that stands closer than this to another shape might stand in the thin wall of its side.
    let reach = shell + 0.002 / frame.part_m();
    let boxes: Vec<_> = shapes.iter().map(|s| bounds_of(&s.corners, 0.0)).collect();
    let grid = Grid::new(&boxes[1..]);
    let is_close = |k: usize| {
        let near = grid.near(bounds_of(&shapes[k].corners, reach)).into_iter().map(|n| n + 1).filter(|n| *n != k);
        near.into_iter().any(|n| distance(&shapes[k].corners, &shapes[n].corners) < reach)
    };
    let outer = Boundary::new(&shapes[0].corners);
    let solid = |k: usize| {
        let shape = &shapes[k];
        let part_m = frame.part_m();
        match shape.form {
            Form::Rectangle { centre, along, size: [length, width] }
                if length >= LONG * width && width * part_m <= THICKEST_M && width * part_m >= THINNEST_M =>
            {
                let half = along * (0.5 * length);
                let [from_m, to_m] = [centre - half, centre + half].map(|p| frame.place(p));
                Solid::Wall(Segment { from_m, to_m, thickness_m: tenths(width * part_m) })
            }
            Form::Any => block(&borders[k], shape, shell, &outer, beyond, region, frame),
            _ if is_close(k) => block(&borders[k], shape, shell, &outer, beyond, region, frame),
            Form::Disc { centre, radius } => Solid::Body(Standing {
                shape: ShapeSpec::Disc { radius_m: tenths(radius * part_m) },
                position_m: frame.place(centre),
                heading_deg: 0.0,
            }),
            Form::Rectangle { centre, along, size } => Solid::Body(Standing {
                shape: ShapeSpec::Box { size_m: size.map(|s| tenths(s * part_m)) },
                position_m: frame.place(centre),
                heading_deg: frame.heading_deg(along),
            }),
            Form::Convex => {
                let centre = shape.corners.iter().sum::<Vector2<f64>>() / shape.corners.len() as f64;
                let middle = frame.place(centre);
                let corners = shape.corners.iter().map(|c| frame.place(*c));
                let corners_m = corners.map(|c| [tenths(c[0] - middle[0]), tenths(c[1] - middle[1])]).collect();
                Solid::Body(Standing { shape: ShapeSpec::Polygon { corners_m }, position_m: middle, heading_deg: 0.0 })
            }
        }
    };
    (1..shapes.len()).map(solid).collect()
}

/// Least distance from a corner of one polygon to the other.
fn distance(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> f64 {
    let to = |points: &[Vector2<f64>], polygon: &[Vector2<f64>]| {
        points.iter().map(|p| crate::world::polygon::distance_to_boundary(polygon, *p)).fold(f64::INFINITY, f64::min)
    };
    to(a, b).min(to(b, a))
}

fn block(border: &Border, shape: &Shape, shell: f64, outer: &Boundary, beyond: &Groups, region: &Mask, frame: &Frame) -> Solid {
    let exact = Boundary::new(&border.corners.iter().map(|c| point(*c)).collect::<Vec<_>>());
    let drawn = Boundary::new(&shape.corners);
    let (mut sides, mut stray) = (Vec::new(), 0.0_f64);
    for (a, b) in edges(&shape.corners) {
        if let Some((segment, inner)) = side(a, b, shell, outer, frame) {
            sides.push(segment);
            let out = inner.into_iter().filter(|p| !drawn.contains(*p)).map(|p| exact.distance(p));
            stray = out.fold(stray, f64::max);
        }
    }
    Solid::Block { sides, core: core(border, beyond, region, frame), stray_m: stray * frame.part_m() }
}

/// A thin wall on the left of the way from `a` to `b`, where the shape is. Its line stays inside the outer border, as that of a wall
/// must, if it has to be by being thinner or shorter. Also gives its corners on the inner side.
fn side(a: Vector2<f64>, b: Vector2<f64>, shell: f64, outer: &Boundary, frame: &Frame) -> Option<(Segment, [Vector2<f64>; 2])> {
    let length = (b - a).norm();
    let along = (b - a) / length;
    let inward = Vector2::new(-along.y, along.x);
    let thinnest = THINNEST_M / frame.part_m();
    let tries = [(shell, 0.0), (thinnest, 0.0), (thinnest, thinnest), (thinnest, 4.0 * thinnest), (thinnest, 0.5 * length)];
    let slack = 0.5e-3 / frame.part_m();
    tries.into_iter().map(|(thick, short)| (thick.max(thinnest), short)).find_map(|(thick, short)| {
        let middle = inward * (0.5 * thick);
        let (from, to) = (a + along * short + middle, b - along * short + middle);
        if 2.0 * short + thinnest > length || !outer.contains_segment(from, to, slack) {
            return None;
        }
        let thickness_m = tenths(thick * frame.part_m());
        let segment = Segment { from_m: frame.place(from), to_m: frame.place(to), thickness_m };
        Some((segment, [from + middle, to + middle]))
    })
}

/// Thick walls inside a hole, so that no disc of the probe's size finds a place between them and its sides.
fn core(border: &Border, beyond: &Groups, region: &Mask, frame: &Frame) -> Vec<Segment> {
    let [column, row] = border.beyond;
    let label = beyond.labels[row as usize * region.columns + column as usize];
    let group = beyond.groups[label as usize];
    let (left, low) = (group.columns[0], group.rows[0]);
    let mut hole = Mask::new(group.columns[1] + 1 - left, group.rows[1] + 1 - low);
    for y in 0..hole.rows {
        for x in 0..hole.columns {
            hole.cells[y * hole.columns + x] = beyond.labels[(y + low) * region.columns + x + left] == label;
        }
    }
    let clearance = hole.clearance();
    let probe = PROBE_M / frame.resolution_m;
    // A wall keeps a cell away from the sides, which may lie so much deeper than the cells' own.
    let is_inner = |x: usize, y: usize| clearance.at(x, y) >= 2.0;
    let mut order: Vec<usize> = (0..hole.cells.len())
        .filter(|k| is_inner(k % hole.columns, k / hole.columns) && clearance.at(k % hole.columns, k / hole.columns) > probe)
        .collect();
    order.sort_by(|a, b| {
        let of = |k: &usize| clearance.at(k % hole.columns, k / hole.columns);
        of(b).total_cmp(&of(a)).then(a.cmp(b))
    });
    let most = (THICKEST_M / frame.resolution_m).floor().max(1.0) as usize;
    let mut done = Mask::new(hole.columns, hole.rows);
    let mut walls = Vec::new();
    for k in order {
        if done.cells[k] {
            continue;
        }
        let (mut x, mut y) = ([k % hole.columns; 2], [k / hole.columns; 2]);
        // Evenly as far as the thickest wall goes, and then along.
        loop {
            let grown_x = (x[1] - x[0] + 1 < most || y[1] - y[0] < most)
                && grow(&mut x, hole.columns, |n| (y[0]..=y[1]).all(|m| is_inner(n, m)));
            let grown_y = (y[1] - y[0] + 1 < most || x[1] - x[0] < most)
                && grow(&mut y, hole.rows, |n| (x[0]..=x[1]).all(|m| is_inner(m, n)));
            if !grown_x && !grown_y {
                break;
            }
        }
        let is_flat = x[1] - x[0] >= y[1] - y[0];
        let around = probe.floor() as usize;
        for v in y[0].saturating_sub(around)..=(y[1] + around).min(hole.rows - 1) {
            let line = v * hole.columns;
            done.cells[line + x[0].saturating_sub(around)..=line + (x[1] + around).min(hole.columns - 1)].fill(true);
        }
        let corner = |x: usize, y: usize| Vector2::new((x + left) as f64, (y + low) as f64) * f64::from(PARTS);
        let (a, b) = (corner(x[0], y[0]), corner(x[1] + 1, y[1] + 1));
        let size = b - a;
        let half = if is_flat { Vector2::new(0.5 * size.x, 0.0) } else { Vector2::new(0.0, 0.5 * size.y) };
        let thick = if is_flat { size.y } else { size.x };
        let middle = (a + b) * 0.5;
        let [from_m, to_m] = [middle - half, middle + half].map(|p| frame.place(p));
        walls.push(Segment { from_m, to_m, thickness_m: tenths(thick * frame.part_m()).min(THICKEST_M) });
    }
    walls
}

/// Widens a range of columns or rows by one, at the one end or the other, where `fits` says so of the new one.
fn grow(range: &mut [usize; 2], count: usize, fits: impl Fn(usize) -> bool) -> bool {
    if range[1] + 1 < count && fits(range[1] + 1) {
        range[1] += 1;
    } else if range[0] > 0 && fits(range[0] - 1) {
        range[0] -= 1;
    } else {
        return false;
    }
    true
}
