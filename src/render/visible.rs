//! Which of thousands of walls a view can see.
//!
//! Most walls of a building are hidden by those around the camera. They are kept in a tree of boxes, and a view goes through it from
//! near to far with the distance of the nearest wall in each column at hand: a box that lies behind it in all the columns that it
//! spans is left out with all that is in it. What remains is put into the tables of the view, for either renderer, and gives the
//! same picture as all walls would.

use super::columns::{angle, hit_wall};
use super::records::{Edge, FAR};
use crate::geometry::Vector2;

/// Up to this many walls and blocks a room is not worth a tree.
const FEW: usize = 128;
/// Things in a leaf of a tree.
const LEAF: usize = 6;
/// Share by which a box counts as nearer than it is, for rounding.
const SLACK: f64 = 1e-4;

/// A box, lower left and upper right corner, m.
type Bounds = [Vector2<f64>; 2];

/// Things by place, told by their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    /// Of a leaf where its things are in the order, else the number of the second child; the first follows at once.
    first: u32,
    /// Of a leaf how many things it has, else 0.
    count: u32,
}

/// What goes through a tree.
trait Visitor {
    /// Whether what is in a box is of interest, `near_m` away at least.
    fn opens(&mut self, bounds: &Bounds, near_m: f64) -> bool;
    /// A thing of a box that was opened.
    fn take(&mut self, number: u32);
}

impl Tree {
    /// A tree of boxes.
    fn new(boxes: &[Bounds]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            let mut order = std::mem::take(&mut tree.order);
            tree.grow(boxes, &mut order, 0);
            tree.order = order;
        }
        tree
    }

    /// Adds a node for some things, of which the first has place `first` in the order.
    fn grow(&mut self, boxes: &[Bounds], order: &mut [u32], first: usize) {
        let all = order.iter().map(|&k| boxes[k as usize]);
        let bounds = all.reduce(|a, b| [a[0].inf(&b[0]), a[1].sup(&b[1])]).unwrap_or([Vector2::zeros(); 2]);
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, first: first as u32, count: order.len() as u32 });
        if order.len() <= LEAF {
            return;
        }
        let size = bounds[1] - bounds[0];
        let axis = usize::from(size.y > size.x);
        let middle = |k: u32| boxes[k as usize][0][axis] + boxes[k as usize][1][axis];
        order.sort_unstable_by(|&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
        let half = order.len() / 2;
        let (near, far) = order.split_at_mut(half);
        self.grow(boxes, near, first);
        self.nodes[node].count = 0;
        self.nodes[node].first = self.nodes.len() as u32;
        self.grow(boxes, far, first + half);
    }

    /// Shows what is in the tree to a visitor, from near to far as boxes go. Boxes are larger by `grown_m` on all sides.
    fn walk(&self, from: Vector2<f64>, grown_m: f64, visitor: &mut impl Visitor) {
        let grown = |node: usize| {
            let [low, high] = self.nodes[node].bounds;
            [low.add_scalar(-grown_m), high.add_scalar(grown_m)]
        };
        let mut stack = Vec::with_capacity(32);
        if !self.nodes.is_empty() {
            stack.push((0, distance(&grown(0), from)));
        }
        while let Some((k, near_m)) = stack.pop() {
            if !visitor.opens(&grown(k), near_m) {
                continue;
            }
            let Node { first, count, .. } = self.nodes[k];
            if count > 0 {
                self.order[first as usize..(first + count) as usize].iter().for_each(|&number| visitor.take(number));
                continue;
            }
            let mut children = [k + 1, first as usize].map(|child| (child, distance(&grown(child), from)));
            if children[0].1 < children[1].1 {
                children.swap(0, 1);
            }
            stack.extend(children);
        }
    }
}

/// Distance from a point to a box, m; 0 inside.
fn distance([low, high]: &Bounds, p: Vector2<f64>) -> f64 {
    let away = |axis: usize| (low[axis] - p[axis]).max(p[axis] - high[axis]).max(0.0);
    let (x, y) = (away(0), away(1));
    (x * x + y * y).sqrt()
}

fn box_of(points: &[Vector2<f64>]) -> Bounds {
    points.iter().fold([Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY)], |b, p| [b[0].inf(p), b[1].sup(p)])
}

/// Walls and blocks of a large room.
#[derive(Debug, Clone)]
pub(super) struct Index {
    /// Faces from floor to ceiling: walls of the room, then faces of inner walls.
    faces: Tree,
    blocks: Tree,
    /// Pieces of inner walls as wholes.
    solids: Tree,
}

impl Index {
    /// `None` for a room of few walls. Each thing is told by its corners.
    pub fn new<'a>(
        faces: impl Iterator<Item = [Vector2<f64>; 2]>,
        blocks: impl Iterator<Item = [Vector2<f64>; 4]>,
        solids: impl Iterator<Item = &'a [Vector2<f64>; 4]>,
    ) -> Option<Self> {
        let faces: Vec<_> = faces.map(|corners| box_of(&corners)).collect();
        let blocks: Vec<_> = blocks.map(|corners| box_of(&corners)).collect();
        let solids: Vec<_> = solids.map(|corners| box_of(corners)).collect();
        let many = faces.len() + blocks.len() > FEW;
        many.then(|| Self { faces: Tree::new(&faces), blocks: Tree::new(&blocks), solids: Tree::new(&solids) })
    }

    /// Numbers of the pieces whose boxes hold a point.
    pub fn solids_at(&self, point: Vector2<f64>) -> Vec<u32> {
        struct At(Vec<u32>);
        impl Visitor for At {
            fn opens(&mut self, _: &Bounds, near_m: f64) -> bool {
                near_m <= 0.0
            }
            fn take(&mut self, number: u32) {
                self.0.push(number);
            }
        }
        let mut at = At(Vec::new());
        self.solids.walk(point, 0.0, &mut at);
        at.0
    }
}

/// What the columns of a view see of the walls of a large room. Kept by a frame and used view by view.
#[derive(Debug, Default)]
pub(super) struct Sight {
    camera: Vector2<f64>,
    forward: [f32; 2],
    per_rad: f32,
    /// Horizontal distance of the nearest wall in each column, m.
    nearest: Vec<f32>,
    /// Numbers of faces that may be seen, rising.
    pub faces: Vec<u32>,
    /// Numbers of blocks that may be seen, rising.
    pub blocks: Vec<u32>,
}

impl Sight {
    /// Finds what a camera may see whose columns look along `directions`. `edge` makes the edge of a face by its number. Faces
    /// within `shade_m` of a place that is seen are found as well, where that is more than 0: they darken it.
    pub fn find(
        &mut self,
        index: &Index,
        camera: Vector2<f64>,
        directions: &[[f32; 2]],
        edge: impl Fn(u32) -> Edge,
        shade_m: f64,
    ) {
        self.camera = camera;
        self.forward = directions[0];
        self.per_rad = directions.len() as f32 / std::f32::consts::TAU;
        self.nearest.clear();
        self.nearest.resize(directions.len(), FAR);
        self.faces.clear();
        self.blocks.clear();
        index.faces.walk(camera, 0.0, &mut FaceSeeker { sight: self, directions, edge });
        let mut faces = std::mem::take(&mut self.faces);
        if shade_m > 0.0 {
            index.faces.walk(camera, shade_m, &mut Seeker { sight: self, found: &mut faces });
        }
        let mut blocks = std::mem::take(&mut self.blocks);
        index.blocks.walk(camera, 0.0, &mut Seeker { sight: self, found: &mut blocks });
        for found in [&mut faces, &mut blocks] {
            found.sort_unstable();
            found.dedup();
        }
        (self.faces, self.blocks) = (faces, blocks);
    }

    /// Whether a disc may be seen before the walls.
    pub fn sees_disc(&self, centre: Vector2<f64>, radius_m: f64) -> bool {
        let away = centre - self.camera;
        let far = away.norm();
        if far <= radius_m * (1.0 + SLACK) + SLACK {
            return true;
        }
        // The arc sine is at most this.
        let half = (radius_m / far * std::f64::consts::FRAC_PI_2) as f32;
        let middle = self.angle_of(self.forward, away);
        self.is_open(middle - half, middle + half, far - radius_m)
    }

    /// Angle from a direction to a vector, in (-pi, pi], to 1e-5 rad.
    fn angle_of(&self, from: [f32; 2], v: Vector2<f64>) -> f32 {
        let v = [v.x as f32, v.y as f32];
        angle(from[0] * v[1] - from[1] * v[0], from[0] * v[0] + from[1] * v[1])
    }

    /// Columns from an angle to another, both from the first column's direction, and one more on either side: the first, and how many.
    fn columns(&self, from: f32, to: f32) -> (usize, usize) {
        let width = self.nearest.len() as i64;
        let first = libm::floorf(from * self.per_rad) as i64 - 1;
        let count = (libm::ceilf(to * self.per_rad) as i64 + 2 - first).min(width);
        (first.rem_euclid(width) as usize, count as usize)
    }

    /// Whether a column between two angles sees farther than `near_m`.
    fn is_open(&self, from: f32, to: f32, near_m: f64) -> bool {
        let near = (near_m * (1.0 - SLACK)) as f32;
        let (first, count) = self.columns(from, to);
        let (before, after) = self.nearest.split_at(first);
        let tail = count.min(after.len());
        let open = |columns: &[f32]| columns.iter().any(|nearest| *nearest >= near);
        open(&after[..tail]) || open(&before[..(count - tail).min(before.len())])
    }

    /// Whether something in a box may be seen before the walls found so far.
    fn sees_box(&self, [low, high]: &Bounds, near_m: f64) -> bool {
        if near_m <= SLACK {
            return true;
        }
        let middle = (low + high) * 0.5 - self.camera;
        let forward = [middle.x as f32, middle.y as f32];
        let corners = [*low, Vector2::new(high.x, low.y), *high, Vector2::new(low.x, high.y)];
        let angles = corners.map(|corner| self.angle_of(forward, corner - self.camera));
        let turn = self.angle_of(self.forward, middle);
        let (from, to) = (angles.into_iter().fold(0.0, f32::min), angles.into_iter().fold(0.0, f32::max));
        self.is_open(turn + from, turn + to, near_m)
    }
}

/// Finds faces, and how far columns see because of them.
struct FaceSeeker<'a, E> {
    sight: &'a mut Sight,
    directions: &'a [[f32; 2]],
    edge: E,
}

impl<E: Fn(u32) -> Edge> Visitor for FaceSeeker<'_, E> {
    fn opens(&mut self, bounds: &Bounds, near_m: f64) -> bool {
        self.sight.sees_box(bounds, near_m)
    }

    fn take(&mut self, number: u32) {
        let edge = (self.edge)(number);
        if edge.distance >= 0.0 {
            return; // seen from behind
        }
        let [n, t] = [edge.normal, edge.tangent];
        let corner = |along: f32| [0, 1].map(|axis| n[axis] * edge.distance + t[axis] * along);
        let [a, b] = [corner(edge.along), corner(edge.along + edge.length)];
        let sight = &mut *self.sight;
        let forward = sight.forward;
        let turn = angle(forward[0] * a[1] - forward[1] * a[0], forward[0] * a[0] + forward[1] * a[1]);
        let across = angle(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
        let (first, count) = sight.columns(turn + across.min(0.0), turn + across.max(0.0));
        let mut seen = false;
        for column in first..first + count {
            let column = if column >= sight.nearest.len() { column - sight.nearest.len() } else { column };
            if let Some(hit) = hit_wall(&edge, number, self.directions[column]) {
                let nearest = &mut sight.nearest[column];
                // Of equally near ones the first in the order of the room is seen, whichever comes first here.
                seen |= hit.near <= *nearest;
                *nearest = nearest.min(hit.near);
            }
        }
        if seen {
            sight.faces.push(number);
        }
    }
}

/// Finds what may be seen before the walls that are known.
struct Seeker<'a> {
    sight: &'a Sight,
    found: &'a mut Vec<u32>,
}

impl Visitor for Seeker<'_> {
    fn opens(&mut self, bounds: &Bounds, near_m: f64) -> bool {
        self.sight.sees_box(bounds, near_m)
    }

    fn take(&mut self, number: u32) {
        self.found.push(number);
    }
}
