//! A room in the making: what stands where, and what still fits.

use std::collections::BTreeMap;

use super::dice::{Dice, mm};
use crate::geometry::{Pose, Vector2, angle_of};
use crate::world::convex::Convex;
use crate::world::polygon::{bounds, contains, edges};
use crate::world::spec::{BodySpec, MotionSpec, ShapeSpec, TextureSpec, WallSpec, WindowSpec};

/// How often a place for one thing is looked for.
const TRIES: usize = 12;
/// Free space between a wall and what stands or hangs at it, m: rounded numbers never reach into the wall.
const OFF_WALL_M: f64 = 0.002;
/// Least distance between things that stand beside one another along a wall, m.
const BESIDE_M: f64 = 0.04;

/// Something to be placed.
#[derive(Debug, Clone)]
pub(super) struct Item {
    pub name: &'static str,
    pub shape: ShapeSpec,
    pub height_m: f64,
    pub elevation_m: f64,
    pub texture: TextureSpec,
    pub glow: f64,
    pub landmark: bool,
    pub motion: Option<MotionSpec>,
}

impl Item {
    pub(super) fn cuboid(name: &'static str, size_m: [f64; 2], height_m: f64, texture: TextureSpec) -> Self {
        let shape = ShapeSpec::Box { size_m };
        Self { name, shape, height_m, elevation_m: 0.0, texture, glow: 0.0, landmark: true, motion: None }
    }

    pub(super) fn disc(name: &'static str, radius_m: f64, height_m: f64, texture: TextureSpec) -> Self {
        Self { shape: ShapeSpec::Disc { radius_m }, ..Self::cuboid(name, [1.0; 2], height_m, texture) }
    }

    pub(super) fn raised(self, elevation_m: f64) -> Self {
        Self { elevation_m, ..self }
    }

    pub(super) fn obstacle(self) -> Self {
        Self { landmark: false, ..self }
    }

    /// Length along its own x and y, m.
    pub(super) fn size_m(&self) -> [f64; 2] {
        match &self.shape {
            ShapeSpec::Disc { radius_m } => [2.0 * radius_m; 2],
            ShapeSpec::Box { size_m } => *size_m,
            ShapeSpec::Polygon { corners_m } => {
                [0, 1].map(|axis| 2.0 * corners_m.iter().map(|c| c[axis].abs()).fold(0.0, f64::max))
            }
        }
    }
}

/// A thing of a group: where it stands in the group's frame, and what it is.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub at: [f64; 2],
    pub heading_deg: f64,
    pub item: Item,
}

impl Part {
    pub(super) fn new(x: f64, y: f64, heading_deg: f64, item: Item) -> Self {
        Self { at: [x, y], heading_deg, item }
    }
}

/// Space that something takes.
#[derive(Debug, Clone)]
pub(super) struct Solid {
    pub convex: Convex,
    pub pose: Pose,
    pub shape: ShapeSpec,
    /// Radius of the circle around it, m.
    pub reach_m: f64,
    pub bottom_m: f64,
    pub top_m: f64,
}

impl Solid {
    pub(super) fn new(shape: &ShapeSpec, pose: Pose, bottom_m: f64, top_m: f64) -> Self {
        let (convex, reach_m) = match shape {
            ShapeSpec::Disc { radius_m } => (Convex::disc(pose.position(), *radius_m), *radius_m),
            ShapeSpec::Box { size_m: [x, y] } => {
                let (x, y) = (0.5 * x, 0.5 * y);
                (hull(&[[-x, -y], [x, -y], [x, y], [-x, y]], &pose), (x * x + y * y).sqrt())
            }
            ShapeSpec::Polygon { corners_m } => {
                let reach = corners_m.iter().map(|[x, y]| (x * x + y * y).sqrt()).fold(0.0, f64::max);
                (hull(corners_m, &pose), reach)
            }
        };
        Self { convex, pose, shape: shape.clone(), reach_m, bottom_m, top_m }
    }

    /// Whether the two are nearer to one another than `gap_m` at some height.
    fn crowds(&self, other: &Self, gap_m: f64) -> bool {
        let d = self.pose.position() - other.pose.position();
        let far = self.reach_m + other.reach_m + gap_m;
        self.bottom_m < other.top_m
            && other.bottom_m < self.top_m
            && d.dot(&d) < far * far
            && self.convex.gap_m(&other.convex) < gap_m
    }
}

fn hull(corners: &[[f64; 2]], pose: &Pose) -> Convex {
    let corners: Vec<_> = corners.iter().map(|&[x, y]| pose.transform(Vector2::new(x, y))).collect();
    Convex::polygon(&corners, 0.0)
}

/// The side of a wall that faces a room.
#[derive(Debug, Clone)]
pub(super) struct Side {
    pub start: Vector2<f64>,
    /// Direction of the wall; the room is to its left.
    pub along: Vector2<f64>,
    pub length_m: f64,
    pub heading_deg: f64,
    /// Number of the wall of the outline.
    pub wall: Option<usize>,
    /// What is taken of it: from and to along the wall, from and to in height, m.
    taken: Vec<[f64; 4]>,
}

impl Side {
    fn new(a: Vector2<f64>, b: Vector2<f64>, wall: Option<usize>) -> Self {
        let length_m = (b - a).norm();
        let along = (b - a) / length_m;
        let heading_deg = (1000.0 * angle_of(along).to_degrees()).round() / 1000.0 + 0.0;
        Self { start: a, along, length_m, heading_deg, wall, taken: Vec::new() }
    }

    /// A point `s` m along the wall and `off` m into the room.
    pub(super) fn point(&self, s: f64, off: f64) -> Vector2<f64> {
        self.start + self.along * s + Vector2::new(-self.along.y, self.along.x) * off
    }

    fn is_free(&self, [from, to]: [f64; 2], [low, high]: [f64; 2]) -> bool {
        from >= 0.0
            && to <= self.length_m
            && !self.taken.iter().any(|t| from < t[1] + BESIDE_M && t[0] < to + BESIDE_M && low < t[3] && t[2] < high)
    }
}

/// A room in the making.
pub(super) struct Plan {
    pub outline: Vec<Vector2<f64>>,
    pub height_m: f64,
    pub sides: Vec<Side>,
    pub landmarks: Vec<BodySpec>,
    pub obstacles: Vec<BodySpec>,
    pub windows: Vec<WindowSpec>,
    pub walls: Vec<WallSpec>,
    pub solids: Vec<Solid>,
    /// Pieces of inner walls between their doorways; things may touch them.
    pub partitions: Vec<Solid>,
    /// Space that stays free of what stands: before doors.
    keep: Vec<Solid>,
    names: BTreeMap<&'static str, usize>,
}

impl Plan {
    pub(super) fn new(corners: &[[f64; 2]], height_m: f64) -> Self {
        let outline: Vec<_> = corners.iter().map(|&[x, y]| Vector2::new(x, y)).collect();
        let sides = edges(&outline).enumerate().map(|(k, (a, b))| Side::new(a, b, Some(k))).collect();
        Self {
            outline,
            height_m,
            sides,
            landmarks: Vec::new(),
            obstacles: Vec::new(),
            windows: Vec::new(),
            walls: Vec::new(),
            solids: Vec::new(),
            partitions: Vec::new(),
            keep: Vec::new(),
            names: BTreeMap::new(),
        }
    }

    pub(super) fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        bounds(&self.outline)
    }

    /// Keeps a box free of whatever stands: `size_m` along and across the heading.
    pub(super) fn keep_free(&mut self, centre: Vector2<f64>, size_m: [f64; 2], heading_deg: f64) {
        let pose = Pose::new(centre.x, centre.y, heading_deg.to_radians());
        self.keep.push(Solid::new(&ShapeSpec::Box { size_m }, pose, 0.0, self.height_m));
    }

    /// Puts up an inner wall: nothing stands in it, both of its sides are there for what stands along walls, and the floor before
    /// its doors stays free. Gives the numbers of its sides.
    pub(super) fn wall(&mut self, wall: WallSpec) -> [usize; 2] {
        let [from, to] = [wall.from_m, wall.to_m].map(|[x, y]| Vector2::new(x, y));
        let (along, half_m, length_m) = ((to - from) / wall.length_m(), 0.5 * wall.thickness_m, wall.length_m());
        let heading = angle_of(along);
        let across = Vector2::new(-along.y, along.x) * half_m;
        let mut sides = [Side::new(from + across, to + across, None), Side::new(to - across, from - across, None)];
        let mut jambs = vec![0.0];
        for opening in &wall.openings {
            let ends = [opening.from_start_m, opening.from_start_m + opening.width_m];
            jambs.extend(ends);
            // The frame is a hand's breadth wide.
            let (a, b) = (ends[0] - 0.1, ends[1] + 0.1);
            sides[0].taken.push([a, b, 0.0, self.height_m]);
            sides[1].taken.push([length_m - b, length_m - a, 0.0, self.height_m]);
            let middle = from + along * (0.5 * (ends[0] + ends[1]));
            self.keep_free(middle, [opening.width_m + 0.2, 1.6 + wall.thickness_m], heading.to_degrees());
        }
        jambs.push(length_m);
        for piece in jambs.chunks_exact(2).filter(|piece| piece[1] - piece[0] > 1e-6) {
            let middle = from + along * (0.5 * (piece[0] + piece[1]));
            let shape = ShapeSpec::Box { size_m: [piece[1] - piece[0], wall.thickness_m] };
            self.partitions.push(Solid::new(&shape, Pose::new(middle.x, middle.y, heading), 0.0, self.height_m));
        }
        let first = self.sides.len();
        self.sides.extend(sides);
        self.walls.push(wall);
        [first, first + 1]
    }

    /// A name that nothing else has.
    fn name(&mut self, base: &'static str) -> String {
        let count = self.names.entry(base).or_default();
        *count += 1;
        if *count == 1 { base.to_owned() } else { format!("{base} {count}") }
    }

    /// Whether something fits: inside the room, `gap_m` from all that is as high, and off what is to stay free.
    fn fits(&self, solid: &Solid, gap_m: f64) -> bool {
        let at = solid.pose.position();
        contains(&self.outline, at)
            && edges(&self.outline).all(|(a, b)| {
                crate::world::polygon::distance_to_segment(at, a, b) > solid.reach_m + OFF_WALL_M
                    || solid.convex.gap_m(&Convex::corridor(a, b, 0.0)) > 0.5 * OFF_WALL_M
            })
            && !self.partitions.iter().any(|s| s.crowds(solid, 0.5 * OFF_WALL_M))
            && !self.solids.iter().any(|s| s.crowds(solid, gap_m))
            && (solid.bottom_m > 2.0 || !self.keep.iter().any(|s| s.crowds(solid, 0.0)))
    }

    /// Puts one thing down, if it fits.
    pub(super) fn put(&mut self, item: Item, at: Vector2<f64>, heading_deg: f64, gap_m: f64) -> bool {
        self.put_group(&[Part::new(0.0, 0.0, 0.0, item)], at, heading_deg, gap_m)
    }

    /// Puts all parts of a group down, if all of them fit; they may touch one another.
    pub(super) fn put_group(&mut self, parts: &[Part], at: Vector2<f64>, heading_deg: f64, gap_m: f64) -> bool {
        let frame = Pose::new(at.x, at.y, heading_deg.to_radians());
        let mut placed: Vec<(&Item, f64, Solid)> = Vec::with_capacity(parts.len());
        for Part { at: [x, y], heading_deg: turn_deg, item } in parts {
            let at = frame.transform(Vector2::new(*x, *y)).map(mm);
            let heading_deg = wrapped_deg(heading_deg + turn_deg);
            let pose = Pose::new(at.x, at.y, heading_deg.to_radians());
            let solid = Solid::new(&item.shape, pose, item.elevation_m, item.elevation_m + item.height_m);
            let crowded = placed.iter().any(|(_, _, other)| other.crowds(&solid, -5e-4));
            if crowded || solid.top_m > self.height_m || !self.fits(&solid, gap_m) {
                return false;
            }
            placed.push((item, heading_deg, solid));
        }
        for (item, heading_deg, solid) in placed {
            let name = self.name(item.name);
            let body = BodySpec {
                name,
                shape: item.shape.clone(),
                position_m: [solid.pose.x, solid.pose.y],
                heading_deg,
                height_m: item.height_m,
                elevation_m: item.elevation_m,
                texture: item.texture.clone(),
                glow: item.glow,
                motion: item.motion.clone(),
            };
            if item.landmark {
                self.landmarks.push(body);
            } else {
                self.obstacles.push(body);
            }
            self.solids.push(solid);
        }
        true
    }

    /// A stretch of a side that is free over `heights`, its middle; sides are drawn by their length.
    fn stretch(&self, dice: &mut Dice, sides: &[usize], width_m: f64, heights: [f64; 2]) -> Option<(usize, f64)> {
        let total: f64 = sides.iter().map(|&k| self.sides[k].length_m).sum();
        let mut at = dice.between(0.0, total);
        let k = *sides.iter().find(|&&k| {
            at -= self.sides[k].length_m;
            at < 0.0
        })?;
        let side = &self.sides[k];
        let s = mm(dice.between(0.5 * width_m, side.length_m - 0.5 * width_m));
        (side.length_m > width_m && side.is_free([s - 0.5 * width_m, s + 0.5 * width_m], heights)).then_some((k, s))
    }

    /// Stands a group with its back at one of the sides. The group's frame is in the middle of its back, x along the wall, y
    /// into the room; `width_m` and `height_m` are what it takes of the wall. Gives the side and the place along it.
    pub(super) fn stand(
        &mut self,
        dice: &mut Dice,
        sides: &[usize],
        [width_m, height_m]: [f64; 2],
        parts: &[Part],
        gap_m: f64,
    ) -> Option<(usize, f64)> {
        for _ in 0..TRIES {
            let Some((k, s)) = self.stretch(dice, sides, width_m, [0.0, height_m]) else { continue };
            if self.stand_at(k, s, [width_m, height_m], parts, gap_m) {
                return Some((k, s));
            }
        }
        None
    }

    /// Stands a group with its back at a side, `s` m along it.
    pub(super) fn stand_at(&mut self, k: usize, s: f64, [width_m, height_m]: [f64; 2], parts: &[Part], gap_m: f64) -> bool {
        let side = &self.sides[k];
        let span = [s - 0.5 * width_m, s + 0.5 * width_m];
        let (at, heading_deg) = (side.point(s, OFF_WALL_M), side.heading_deg);
        if !side.is_free(span, [0.0, height_m]) || !self.put_group(parts, at, heading_deg, gap_m) {
            return false;
        }
        self.sides[k].taken.push([span[0], span[1], 0.0, height_m]);
        true
    }

    /// Hangs a thin thing at one of the sides.
    pub(super) fn hang(&mut self, dice: &mut Dice, sides: &[usize], item: &Item) -> bool {
        (0..TRIES).any(|_| {
            let heights = [item.elevation_m, item.elevation_m + item.height_m];
            let place = self.stretch(dice, sides, item.size_m()[0], heights);
            place.is_some_and(|(k, s)| self.hang_at(k, s, item.clone()))
        })
    }

    /// Hangs a thin thing at a side, `s` m along it.
    pub(super) fn hang_at(&mut self, k: usize, s: f64, item: Item) -> bool {
        let [width_m, depth_m] = item.size_m();
        let heights = [item.elevation_m, item.elevation_m + item.height_m];
        let side = &self.sides[k];
        let span = [s - 0.5 * width_m, s + 0.5 * width_m];
        let (at, heading_deg) = (side.point(s, OFF_WALL_M + 0.5 * depth_m), side.heading_deg);
        if !side.is_free(span, heights) || !self.put(item, at, heading_deg, 0.0) {
            return false;
        }
        self.sides[k].taken.push([span[0], span[1], heights[0], heights[1]]);
        true
    }

    /// A door leaf in a side with free floor before it.
    pub(super) fn door(&mut self, k: usize, s: f64, leaf: Item) -> bool {
        let width_m = leaf.size_m()[0];
        let side = &self.sides[k];
        let (before, heading_deg) = (side.point(s, 0.5), side.heading_deg);
        let floor = Solid::new(
            &ShapeSpec::Box { size_m: [width_m + 0.2, 0.9] },
            Pose::new(before.x, before.y, heading_deg.to_radians()),
            0.0,
            2.0,
        );
        if self.solids.iter().any(|s| s.crowds(&floor, 0.0)) || !self.hang_at(k, s, leaf) {
            return false;
        }
        self.keep_free(before, [width_m + 0.2, 0.96], heading_deg);
        true
    }

    /// A window in a side of the outline.
    pub(super) fn window(
        &mut self,
        k: usize,
        s: f64,
        width_m: f64,
        heights: [f64; 2],
        brightness: f64,
        seen: &TextureSpec,
    ) -> bool {
        let Some(wall) = self.sides[k].wall else { return false };
        let span = [mm(s - 0.5 * width_m), mm(s + 0.5 * width_m)];
        // A hand's breadth of wall beside it.
        let free = [span[0] - 0.1, span[1] + 0.1];
        if heights[1] > self.height_m || !self.sides[k].is_free(free, heights) {
            return false;
        }
        let name = self.name("window");
        self.windows.push(WindowSpec { name, wall, along_m: span, height_m: heights, brightness, texture: seen.clone() });
        self.sides[k].taken.push([span[0], span[1], heights[0], heights[1]]);
        true
    }

    /// Stands a group free in the room, turned as `turns` allow: any way, or square to the walls give or take some degrees.
    pub(super) fn stand_free(&mut self, dice: &mut Dice, parts: &[Part], turn: Turn, gap_m: f64) -> bool {
        let (low, high) = self.bounds();
        self.stand_free_in(dice, [low, high], parts, turn, gap_m)
    }

    /// Stands a group free in a rectangle.
    pub(super) fn stand_free_in(
        &mut self,
        dice: &mut Dice,
        [low, high]: [Vector2<f64>; 2],
        parts: &[Part],
        turn: Turn,
        gap_m: f64,
    ) -> bool {
        (0..TRIES).any(|_| {
            let at = Vector2::new(dice.between(low.x, high.x), dice.between(low.y, high.y));
            let heading_deg = match turn {
                Turn::Any => dice.between(-180.0, 180.0).round(),
                Turn::Square(slack_deg) => 90.0 * dice.below(4) as f64 - 90.0 + dice.between(-slack_deg, slack_deg).round(),
            };
            self.put_group(parts, at, heading_deg, gap_m)
        })
    }
}

/// How something that stands free is turned.
#[derive(Debug, Clone, Copy)]
pub(super) enum Turn {
    /// Any way.
    Any,
    /// Square to the walls, give or take so many degrees.
    Square(f64),
}

/// A heading in (-180, 180], in whole thousandths of a degree.
fn wrapped_deg(heading_deg: f64) -> f64 {
    let turns = ((heading_deg - 180.0) / 360.0).ceil();
    (1000.0 * (heading_deg - 360.0 * turns)).round() / 1000.0 + 0.0
}
