//! Flats: a rectangle, an L or the like, parted into rooms by walls with doorways.
//!
//! The floor is cut in two again and again, each time the largest room across its longer side. Every new wall gets one doorway, so
//! that from each room one can walk to each other one.

use super::dice::{Dice, mm};
use super::furniture::*;
use super::knobs::{Drawn, Knob};
use super::looks::Tone;
use super::plan::{Part, Turn};
use super::room::{Room, Surfaces};
use crate::geometry::Vector2;
use crate::random::Seed;
use crate::world::polygon::{contains, contains_segment};
use crate::world::spec::TextureFamily::{self, Noise, Planks, Posters, Tiles};
use crate::world::spec::{OpeningKind, OpeningSpec, WallSpec};

/// Least width of a room, m.
const LEAST_M: f64 = 2.0;
/// Thickness of inner walls, m.
const WALL_M: f64 = 0.1;
/// Height of doorways, m.
const DOOR_TOP_M: f64 = 2.05;
/// Least distance of a doorway from the end of its wall, m: there is room for a frame.
const JAMB_M: f64 = 0.15;

const WALLS: &[(TextureFamily, Tone)] =
    &[(Noise, Tone::Pastel), (Posters, Tone::Paper), (Planks, Tone::Wood), (Tiles, Tone::Pastel), (Noise, Tone::Fabric)];

/// A rectangle: its lower and upper corner, m.
type Cell = [Vector2<f64>; 2];

/// What people do in a room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    Living,
    Kitchen,
    Bath,
    Bedroom,
    Study,
}

pub(super) fn flat(drawn: &Drawn, seed: Seed) -> Room<'_> {
    let floors = &[(Planks, Tone::Wood), (Planks, Tone::Wood), (Noise, Tone::Fabric), (Tiles, Tone::Concrete)];
    let surfaces = Surfaces { paint: Tone::Paint, rich: WALLS, floors };
    let mut dice = Dice::new(seed, "corners");
    let size = [drawn.get(Knob::LengthM), drawn.get(Knob::WidthM)];
    let corners = drawn.outline.corners(size[0], size[1], None, &mut dice);
    let mut room = Room::new(&corners, drawn, seed, &surfaces);
    let cells = part(&mut room, size);
    room.doors(1, [0.95, 2.05]);
    room.windows([0.9, 1.5], [0.85, 0.95], [1.1, 1.3]);
    let mut order: Vec<usize> = (0..cells.len()).collect();
    let area_m2 = |k: usize| (cells[k][1].x - cells[k][0].x) * (cells[k][1].y - cells[k][0].y);
    order.sort_by(|&a, &b| area_m2(b).total_cmp(&area_m2(a)));
    // The largest is the living room, the smallest the bath; what is between is drawn.
    for (rank, &k) in order.iter().enumerate() {
        let what = match rank {
            0 => Use::Living,
            _ if rank + 1 == order.len() && order.len() > 2 => Use::Bath,
            1 => Use::Bedroom,
            2 => Use::Kitchen,
            _ => *room.dice.pick(&[Use::Bedroom, Use::Study, Use::Kitchen]),
        };
        furnish(&mut room, cells[k], what);
    }
    let count = room.dice.about((0.2 + drawn.get(Knob::Richness)) * room.perimeter_m() / 6.0);
    room.hang(&[PICTURE, PICTURE, POSTER, MIRROR, CLOCK], count);
    room
}

/// Parts the flat into as many rooms as were asked for and fit; gives their rectangles.
fn part(room: &mut Room<'_>, size: [f64; 2]) -> Vec<Cell> {
    let mut cells: Vec<Cell> = vec![[Vector2::zeros(), Vector2::new(size[0], size[1])]];
    // What a wall joins must not be where another one has its doorway.
    let mut doorways: Vec<[Vector2<f64>; 2]> = Vec::new();
    while cells.len() < room.drawn.count(Knob::Rooms) {
        let longest = |c: &Cell| (c[1].x - c[0].x).max(c[1].y - c[0].y);
        let area = |c: &Cell| (c[1].x - c[0].x) * (c[1].y - c[0].y);
        let largest = (0..cells.len())
            .filter(|&k| longest(&cells[k]) >= 2.0 * LEAST_M + WALL_M)
            .max_by(|&a, &b| area(&cells[a]).total_cmp(&area(&cells[b])));
        let Some(k) = largest else { break };
        let Some((cut, doorway)) = (0..40).find_map(|_| wall(room, cells[k], &doorways)) else { break };
        doorways.push(doorway);
        let [low, high] = cells.swap_remove(k);
        let across = if high.x - low.x >= high.y - low.y { 0 } else { 1 };
        let (mut first, mut second) = ([low, high], [low, high]);
        first[1][across] = cut;
        second[0][across] = cut;
        cells.extend([first, second]);
    }
    cells
}

/// Puts up a wall across the longer side of a room; gives where it is along that side, and its doorway. `None` if it would end in
/// another doorway or has no room for its own.
fn wall(room: &mut Room<'_>, [low, high]: Cell, doorways: &[[Vector2<f64>; 2]]) -> Option<(f64, [Vector2<f64>; 2])> {
    let size = high - low;
    let across = if size.x >= size.y { 0 } else { 1 };
    let along = 1 - across;
    let margin = LEAST_M + 0.5 * WALL_M;
    let cut = low[across] + room.dice.between(margin, size[across] - margin);
    let cut = mm(cut);
    let at = |s: f64| {
        let mut point = low;
        point[across] = cut;
        point[along] = s;
        point
    };
    let mut beside = Vector2::zeros();
    beside[across] = 0.5 * LEAST_M;
    // Only what lies inside the outline: the room may be an L.
    let (from, to) = inside(room, &at, low[along], high[along])?;
    let [a, b] = [at(from), at(to)];
    let clear = |p: Vector2<f64>| {
        let gap = |d: &[Vector2<f64>; 2]| crate::world::polygon::distance_to_segment(p, d[0], d[1]);
        doorways.iter().all(|d| gap(d) > 0.35)
    };
    // In an L a wall could run just beside one of the room's own.
    let is_room = |s: f64| [-1.0, 1.0].iter().all(|side| contains(&room.plan.outline, at(s) + beside * *side));
    if ![0.1, 0.5, 0.9].iter().all(|share| is_room(from + share * (to - from))) {
        return None;
    }
    let door_m = mm(room.drawn.get(Knob::DoorM));
    let least = JAMB_M + 0.5 * WALL_M;
    if !clear(a) || !clear(b) || to - from < door_m + 2.0 * least {
        return None;
    }
    let free = to - from - door_m - 2.0 * least;
    // Doorways near a corner leave more wall for furniture.
    let share = match room.dice.below(3) {
        0 => 0.0,
        1 => 1.0,
        _ => room.dice.unit(),
    };
    let start = mm(least + share * free);
    let texture = room.looks.walls(&[to - from], Tone::Paint, WALLS).swap_remove(0);
    let opening = OpeningSpec {
        kind: Some(OpeningKind::Door),
        from_start_m: start,
        width_m: door_m,
        sill_m: None,
        top_m: Some(DOOR_TOP_M),
    };
    let wall = WallSpec {
        name: format!("wall {}", room.plan.walls.len() + 1),
        thickness_m: WALL_M,
        texture: Some(texture),
        openings: vec![opening],
        ..WallSpec::new([mm(a.x), mm(a.y)], [mm(b.x), mm(b.y)])
    };
    room.plan.wall(wall);
    Some((cut, [at(from + start), at(from + start + door_m)]))
}

/// The longest stretch of a line that lies inside the outline, in steps of 5 cm; `None` where it is too short for a doorway.
fn inside(room: &Room<'_>, at: &impl Fn(f64) -> Vector2<f64>, from: f64, to: f64) -> Option<(f64, f64)> {
    const STEP_M: f64 = 0.05;
    let steps = ((to - from) / STEP_M).floor() as usize;
    let place = |k: usize| from + (k as f64 + 0.5) * STEP_M;
    let within: Vec<usize> = (0..steps).filter(|&k| contains(&room.plan.outline, at(place(k)))).collect();
    let (&first, &last) = (within.first()?, within.last()?);
    if last - first + 1 != within.len() {
        return None; // out of the room and in again
    }
    // To the end where the room goes on, else to its wall, which lies within the next step.
    let edge = |mut within: f64, mut without: f64| {
        for _ in 0..8 {
            let middle = 0.5 * (within + without);
            *(if contains(&room.plan.outline, at(middle)) { &mut within } else { &mut without }) = middle;
        }
        within
    };
    let start = if first == 0 { from } else { edge(place(first), place(first - 1)) };
    let end = if last + 1 == steps { to } else { edge(place(last), place(last + 1)) };
    let whole = contains_segment(&room.plan.outline, at(start), at(end), 5e-4);
    (whole && end - start > 1.2).then_some((mm(start), mm(end)))
}

/// Furniture for a use, along the walls of a cell and in its middle.
fn furnish(room: &mut Room<'_>, [low, high]: Cell, what: Use) {
    let clutter = room.drawn.get(Knob::Clutter);
    let wide = Vector2::new(WALL_M, WALL_M);
    let near = |p: Vector2<f64>| p.x > low.x - wide.x && p.y > low.y - wide.y && p.x < high.x + wide.x && p.y < high.y + wide.y;
    // The sides that face this cell: a step into the room from their middle is in it.
    let sides: Vec<usize> = (0..room.plan.sides.len())
        .filter(|&k| {
            let side = &room.plan.sides[k];
            let faces = |s: f64| {
                let p = side.point(s, 0.3);
                near(side.point(s, 0.0)) && p.x > low.x && p.y > low.y && p.x < high.x && p.y < high.y
            };
            (0..5).any(|n| faces(side.length_m * (f64::from(n) + 0.5) / 5.0))
        })
        .collect();
    if sides.is_empty() {
        return;
    }
    let (must, may): (&[Sort], &[Sort]) = match what {
        Use::Living => (&[SOFA, TELEVISION], &[BOOKCASE, SIDEBOARD, ARMCHAIR, PLANT, LAMP, BOOKCASE, CHEST]),
        Use::Kitchen => (&[KITCHEN_UNIT, KITCHEN_UNIT, FRIDGE], &[KITCHEN_UNIT, SIDEBOARD, BIN]),
        Use::Bath => (&[BASIN, BATHTUB], &[WASHER, SHELF, BIN]),
        Use::Bedroom => (&[BED, WARDROBE], &[CHEST, BOOKCASE, LAMP, STOOL, PLANT]),
        Use::Study => (&[BOOKCASE], &[BOOKCASE, CABINET, FILING_CABINET, PLANT, BIN, ARMCHAIR]),
    };
    if what == Use::Study || (what == Use::Living && room.dice.chance(0.3)) {
        let (width_m, height_m, parts) = desk(&mut room.dice, &mut room.looks);
        room.plan.stand(&mut room.dice, &sides, [width_m, height_m], &parts, 0.05);
    }
    let area_m2 = (high.x - low.x) * (high.y - low.y);
    let more = room.dice.about(clutter * area_m2 / 5.0);
    let kept = must.iter().filter(|_| clutter > 0.0).copied().collect::<Vec<_>>();
    let chosen: Vec<Sort> = kept.into_iter().chain((0..more).map(|_| *room.dice.pick(may)).collect::<Vec<_>>()).collect();
    for sort in chosen {
        let item = sort.item(&mut room.dice, &mut room.looks);
        let (width_m, height_m, parts) = backed(item);
        room.plan.stand(&mut room.dice, &sides, [width_m, height_m], &parts, 0.05);
    }
    if matches!(what, Use::Living | Use::Kitchen) && room.dice.chance(clutter + 0.2) && area_m2 > 9.0 {
        let size = [room.dice.size([1.1, 1.6]), room.dice.size([0.7, 0.85])];
        let parts: Vec<Part> = table(&mut room.dice, &mut room.looks, size, 2);
        room.plan.stand_free_in(&mut room.dice, [low, high], &parts, Turn::Square(5.0), 0.45);
    }
}
