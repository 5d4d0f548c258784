//! Simpler shapes for borders: as coarse as a tolerance allows, and none that meets another or jumps over it.
//!
//! All lengths are in parts of a cell, as those of `contour`.

use super::contour::{Border, PARTS, hull, point, simplify};
use crate::geometry::{Vector2, angle_of, direction};
use crate::world::boundary::Boundary;
use crate::world::grid::{Bounds, Grid, bounds_of};
use crate::world::polygon::{anticlockwise, edges, segments_meet, self_intersection, signed_area};

/// What a border becomes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    pub form: Form,
    /// Corners, anti-clockwise; of a disc those of a polygon around it.
    pub corners: Vec<Vector2<f64>>,
}

/// Sorts of shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    Disc {
        centre: Vector2<f64>,
        radius: f64,
    },
    Rectangle {
        centre: Vector2<f64>,
        /// Unit vector along the longer side.
        along: Vector2<f64>,
        /// Length of the longer side and of the shorter one.
        size: [f64; 2],
    },
    Convex,
    Any,
}

/// A disc is taken where its radius is this or more; what is smaller has too few cells to tell.
const LEAST_RADIUS: f64 = 2.5 * PARTS as f64;
/// Corners of the polygon around a disc.
const DISC_CORNERS: usize = 32;
/// Ways to draw a border, from the coarsest to the exact one.
const LEVELS: usize = 7;

/// Shapes for the borders, the first of which is the outer one.
pub(super) fn shapes(borders: &[Border], tolerance: f64) -> Vec<Shape> {
    let draw = |k: usize, from: usize| {
        let all = (from..LEVELS).map(|level| (level, shape(&borders[k].corners, k > 0, level, tolerance)));
        // The last level always has a shape: the border itself.
        all.into_iter().find_map(|(level, shape)| Some((level, shape?))).unwrap_or((LEVELS, any(&borders[k].corners)))
    };
    let mut drawn: Vec<(usize, Shape)> = (0..borders.len()).map(|k| draw(k, 0)).collect();
    loop {
        let faulty = conflicts(&drawn);
        if faulty.is_empty() {
            return drawn.into_iter().map(|(_, shape)| shape).collect();
        }
        for k in faulty {
            drawn[k] = draw(k, drawn[k].0 + 1);
        }
    }
}

/// The shape of a border at a level; `None` where the level has none within the tolerance.
fn shape(border: &[[i32; 2]], is_hole: bool, level: usize, tolerance: f64) -> Option<Shape> {
    let fits = |shape: Shape| (deviation(border, &shape) <= tolerance).then_some(shape);
    match level {
        0 | 1 if !is_hole => None,
        0 => {
            let candidates = [disc(border), rectangle(border)].into_iter().flatten();
            let by_fit = candidates.map(|shape| (deviation(border, &shape), shape)).filter(|(d, _)| *d <= tolerance);
            by_fit.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, shape)| shape)
        }
        1 => fits(Shape { form: Form::Convex, corners: hull(border) }),
        2..=5 => {
            let shape = any(&simplify(border, tolerance / f64::from(1_u32 << (level - 2))));
            (shape.corners.len() >= 3).then_some(shape)
        }
        _ => Some(any(border)),
    }
}

/// The shape with these corners.
fn any(corners: &[[i32; 2]]) -> Shape {
    let corners: Vec<[f64; 2]> = corners.iter().map(|c| [point(*c).x, point(*c).y]).collect();
    Shape { form: Form::Any, corners: anticlockwise(&corners) }
}

/// The disc of the border's area around its middle.
fn disc(border: &[[i32; 2]]) -> Option<Shape> {
    let corners: Vec<_> = border.iter().map(|c| point(*c)).collect();
    let radius = libm::sqrt(signed_area(&corners).abs() / std::f64::consts::PI);
    if radius < LEAST_RADIUS {
        return None;
    }
    let (low, high) = crate::world::polygon::bounds(&corners);
    let centre = (low + high) * 0.5;
    let around = radius / crate::geometry::sin_cos(std::f64::consts::PI / DISC_CORNERS as f64).1;
    let turn = std::f64::consts::TAU / DISC_CORNERS as f64;
    let corners = (0..DISC_CORNERS).map(|k| centre + direction(turn * k as f64) * around).collect();
    Some(Shape { form: Form::Disc { centre, radius }, corners })
}

/// The smallest rectangle around the border, with a side on one of its hull's.
fn rectangle(border: &[[i32; 2]]) -> Option<Shape> {
    let hull = hull(border);
    let around = edges(&hull).map(|(a, b)| {
        let along = (b - a).normalize();
        let across = Vector2::new(-along.y, along.x);
        let range = |axis: Vector2<f64>| {
            let of = hull.iter().map(|c| axis.dot(c));
            of.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
        };
        (along, range(along), across, range(across))
    });
    let area = |[x, y]: [[f64; 2]; 2]| (x[1] - x[0]) * (y[1] - y[0]);
    let (along, x, across, y) = around.min_by(|p, q| area([p.1, p.3]).total_cmp(&area([q.1, q.3])))?;
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]].map(|[u, v]| along * u + across * v).to_vec();
    let centre = along * (0.5 * (x[0] + x[1])) + across * (0.5 * (y[0] + y[1]));
    let (length, width) = (x[1] - x[0], y[1] - y[0]);
    let (along, size) = if length >= width { (along, [length, width]) } else { (across, [width, length]) };
    Some(Shape { form: Form::Rectangle { centre, along, size }, corners })
}

/// Greatest distance from a point of a border to the shape's, or from one of the shape's to the border, where they are sampled every
/// half cell.
pub(super) fn deviation(border: &[[i32; 2]], shape: &Shape) -> f64 {
    let corners: Vec<_> = border.iter().map(|c| point(*c)).collect();
    let exact = Boundary::new(&corners);
    if let Form::Disc { centre, radius } = shape.form {
        let off = samples(&corners).map(|p| ((p - centre).norm() - radius).abs()).fold(0.0, f64::max);
        let back = samples(&shape.corners).map(|p| centre + direction(angle_of(p - centre)) * radius);
        return back.map(|p| exact.distance(p)).fold(off, f64::max);
    }
    let drawn = Boundary::new(&shape.corners);
    let there = samples(&corners).map(|p| drawn.distance(p)).fold(0.0, f64::max);
    samples(&shape.corners).map(|p| exact.distance(p)).fold(there, f64::max)
}

/// Points on the edges of a polygon, its corners included.
fn samples(polygon: &[Vector2<f64>]) -> impl Iterator<Item = Vector2<f64>> + '_ {
    edges(polygon).flat_map(|(a, b)| {
        let count = (2.0 * (b - a).norm() / f64::from(PARTS)).ceil().max(1.0) as usize;
        (0..count).map(move |k| a + (b - a) * (k as f64 / count as f64))
    })
}

/// Shapes that have to be drawn finer: those that cross themselves or another one, and holes that are not inside the outer shape or
/// are inside another hole. Of two that are at odds a hole gives way before the outer shape does.
fn conflicts(drawn: &[(usize, Shape)]) -> Vec<usize> {
    let mut faulty = vec![false; drawn.len()];
    let blame = |k: usize, l: usize, faulty: &mut Vec<bool>| {
        let holes: Vec<usize> = [k, l].into_iter().filter(|&n| n > 0 && drawn[n].0 + 1 < LEVELS).collect();
        let others = [k, l].into_iter().filter(|&n| drawn[n].0 + 1 < LEVELS);
        let at_fault = if holes.is_empty() { others.collect() } else { holes };
        at_fault.into_iter().for_each(|n| faulty[n] = true);
    };
    let mut sides = Vec::new();
    for (k, (level, shape)) in drawn.iter().enumerate() {
        if level + 1 < LEVELS && (signed_area(&shape.corners) <= 0.0 || self_intersection(&shape.corners).is_some()) {
            faulty[k] = true;
        }
        sides.extend(edges(&shape.corners).map(|(a, b)| (k, a, b)));
    }
    let boxes: Vec<Bounds> = sides.iter().map(|(_, a, b)| bounds_of(&[*a, *b], 0.0)).collect();
    let grid = Grid::new(&boxes);
    for (n, &(k, a, b)) in sides.iter().enumerate() {
        for m in grid.near(boxes[n]).into_iter().take_while(|m| *m < n) {
            let (l, c, d) = sides[m];
            if l != k && segments_meet(a, b, c, d) {
                blame(k, l, &mut faulty);
            }
        }
    }
    let outer = Boundary::new(&drawn[0].1.corners);
    let boxes: Vec<Bounds> = drawn.iter().map(|(_, shape)| bounds_of(&shape.corners, 0.0)).collect();
    let grid = Grid::new(&boxes);
    for k in 1..drawn.len() {
        let corner = drawn[k].1.corners[0];
        if !outer.contains(corner) {
            blame(0, k, &mut faulty);
        }
        for l in grid.near(bounds_of(&[corner], 0.0)) {
            if l > 0 && l != k && crate::world::polygon::contains(&drawn[l].1.corners, corner) {
                blame(k, l, &mut faulty);
            }
        }
    }
    (0..drawn.len()).filter(|&k| faulty[k]).collect()
}
