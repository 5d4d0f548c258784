//! Large rooms: hall, warehouse, corridor.

use super::dice::{Dice, mm};
use super::furniture::*;
use super::knobs::{Drawn, Knob};
use super::looks::Tone;
use super::outline::Outline;
use super::plan::{Item, Turn};
use super::room::{Room, Surfaces};
use crate::geometry::Vector2;
use crate::random::Seed;
use crate::world::spec::TextureFamily::{self, Brick, Noise, Plain, Planks, Posters, Shelves, Tiles};

const HALL_WALLS: &[(TextureFamily, Tone)] = &[
    (Brick, Tone::Clay),
    (Brick, Tone::Concrete),
    (Noise, Tone::Concrete),
    (Planks, Tone::Wood),
    (Tiles, Tone::Concrete),
    (Posters, Tone::Pastel),
];

pub(super) fn hall(drawn: &Drawn, seed: Seed) -> Room<'_> {
    let floors = &[(Planks, Tone::Wood), (Noise, Tone::Concrete), (Tiles, Tone::Concrete)];
    let surfaces = Surfaces { paint: Tone::Paint, rich: HALL_WALLS, floors };
    let corners =
        drawn.outline.corners(drawn.get(Knob::LengthM), drawn.get(Knob::WidthM), None, &mut Dice::new(seed, "corners"));
    let mut room = Room::new(&corners, drawn, seed, &surfaces);
    let clutter = drawn.get(Knob::Clutter);
    room.doors(2, [1.8, 2.2]);
    room.windows([1.5, 3.0], [1.2, 2.2], [1.0, 2.0]);
    if room.dice.chance(0.5) {
        pillars(&mut room);
    }
    let count = room.dice.about(clutter * room.perimeter_m() / 5.0);
    room.along_walls(&[SEATS, SEATS, STAND, LOCKERS, VENDING, CABINET, BENCH, CONTAINER, PLANT, BIN, COUNTER], count, 0.05);
    let count = room.dice.about(clutter * room.area_m2() / 30.0);
    room.about(&[STAND, STAND, PLINTH, PLINTH, CONTAINER, CRATE, PALLET, PLANT, DRUM, STOOL], count, Turn::Square(12.0), 0.9);
    let tables = room.dice.about(clutter * room.area_m2() / 120.0);
    for _ in 0..tables {
        let parts = table(&mut room.dice, &mut room.looks, [1.6, 0.8], 4);
        room.plan.stand_free(&mut room.dice, &parts, Turn::Square(10.0), 0.7);
    }
    let count = room.dice.about(drawn.get(Knob::Richness) * room.perimeter_m() / 5.0);
    room.hang(&[BANNER, BANNER, POSTER, SIGN], count);
    room
}

/// A grid of pillars up to the ceiling, all alike or each with its own look.
fn pillars(room: &mut Room<'_>) {
    let (low, high) = room.plan.bounds();
    let (step_x, step_y) = (room.dice.between(4.0, 6.5), room.dice.between(4.0, 6.5));
    let sort = if room.dice.chance(0.5) { PILLAR } else { COLUMN };
    let [columns, rows] = [(high.x - low.x) / step_x, (high.y - low.y) / step_y].map(|n| n.floor() as usize);
    for k in 0..columns * rows {
        let mut item = sort.item(&mut room.dice, &mut room.looks);
        item.height_m = room.plan.height_m;
        let step = |k: usize, count: usize, from: f64, to: f64| from + (to - from) * (k as f64 + 1.0) / (count as f64 + 1.0);
        let at = Vector2::new(step(k % columns, columns, low.x, high.x), step(k / columns, rows, low.y, high.y));
        room.plan.put(item, at, 0.0, 0.8);
    }
}

pub(super) fn warehouse(drawn: &Drawn, seed: Seed) -> Room<'_> {
    let floors = &[(Noise, Tone::Concrete), (Plain, Tone::Concrete)];
    let surfaces = Surfaces {
        paint: Tone::Concrete,
        rich: &[(Brick, Tone::Concrete), (Noise, Tone::Concrete), (Planks, Tone::Metal)],
        floors,
    };
    let (length_m, width_m) = (drawn.get(Knob::LengthM), drawn.get(Knob::WidthM));
    let corners = drawn.outline.corners(length_m, width_m, None, &mut Dice::new(seed, "corners"));
    let mut room = Room::new(&corners, drawn, seed, &surfaces);
    let clutter = drawn.get(Knob::Clutter);
    // Rows run along x; goods come and go at one end.
    let aisle_m = drawn.get(Knob::AisleM);
    let dock_m = room.dice.between(0.18, 0.3) * length_m;
    let at_start = room.dice.chance(0.5);
    let span = if at_start { [dock_m, length_m - 0.9 * aisle_m] } else { [0.9 * aisle_m, length_m - dock_m] };
    rows(&mut room, span, [0.0, width_m], aisle_m);
    room.doors(2, [2.6, 2.8]);
    room.doors(1, [0.9, 2.05]);
    room.windows([1.2, 2.0], [2.0, 2.6], [0.8, 1.2]);
    let count = room.dice.about(clutter * room.area_m2() / 22.0);
    room.about(&[PALLET, PALLET, PALLET, CRATE, DRUM, MACHINE], count, Turn::Square(8.0), 0.6);
    let count = room.dice.about(clutter * room.perimeter_m() / 8.0);
    room.along_walls(&[BENCH, LOCKERS, DRUM, CRATE, BIN, PALLET], count, 0.3);
    let count = room.dice.about(clutter * room.area_m2() / 60.0);
    room.cartons(count, 0.5);
    let count = room.dice.about(drawn.get(Knob::Richness) * room.perimeter_m() / 7.0);
    room.hang(&[SIGN, SIGN, POSTER, BANNER], count);
    room
}

/// Rows of racks, each a few bays long, with a way across in the middle of long ones and a plate at the ends of some.
fn rows(room: &mut Room<'_>, [from, to]: [f64; 2], [low, high]: [f64; 2], aisle_m: f64) {
    let bay_m = room.dice.size([1.8, 2.7]);
    let depth_m = room.dice.size([0.8, 1.1]);
    let height_m = room.dice.size([2.0, 4.0]).min(room.plan.height_m - 0.5);
    let bays = ((to - from) / bay_m).floor() as usize;
    let cross_m = 1.0_f64.max(0.8 * aisle_m);
    // A row at each of the walls would leave no room for doors: the first aisle is at the wall.
    let mut y = low + aisle_m + 0.5 * depth_m;
    while y + 0.5 * depth_m + 0.8 * aisle_m <= high {
        let pieces: Vec<(f64, usize)> = if bays >= 5 {
            let kept = bays - (cross_m / bay_m).ceil() as usize;
            let first = kept / 2;
            let second = kept - first;
            vec![(from, first), (to - second as f64 * bay_m, second)]
        } else {
            vec![(from, bays)]
        };
        for (x, count) in pieces {
            // A piece that does not fit loses bays until it does: the room may be an L.
            let fits = |room: &mut Room<'_>, count: usize| {
                let length_m = mm(count as f64 * bay_m);
                let alike = room.drawn.get(Knob::Repetition) > 0.0;
                let period_m = if alike { bay_m } else { 2.0 * (length_m + depth_m) };
                let texture = room.looks.thing("rack", Shelves, Tone::Metal, period_m);
                let rack = Item::cuboid("rack", [length_m, depth_m], height_m, texture);
                room.plan.put(rack, Vector2::new(mm(x + 0.5 * length_m), mm(y)), 0.0, 0.8 * cross_m)
            };
            let placed = (1..=count).rev().find(|&n| fits(room, n));
            if let Some(n) = placed {
                let ends = [x - 0.014, x + n as f64 * bay_m + 0.014];
                for end in ends {
                    if room.dice.chance(0.4 + 0.4 * room.drawn.get(Knob::Richness)) {
                        let plate = SIGN.item(&mut room.dice, &mut room.looks);
                        room.plan.put(plate, Vector2::new(end, y + room.dice.between(-0.2, 0.2)), 90.0, 0.0);
                    }
                }
            }
        }
        y += depth_m + aisle_m;
    }
}

/// Depth of the recess that a corridor's door stands in, and its width beside the leaf, m.
const RECESS_M: [f64; 2] = [0.15, 0.04];

pub(super) fn corridor(drawn: &Drawn, seed: Seed) -> Room<'_> {
    let floors = &[(Noise, Tone::Fabric), (Tiles, Tone::Concrete), (Plain, Tone::Concrete), (Noise, Tone::Concrete)];
    let surfaces =
        Surfaces { paint: Tone::Paint, rich: &[(Noise, Tone::Pastel), (Brick, Tone::Paint), (Tiles, Tone::Pastel)], floors };
    let mut dice = Dice::new(seed, "corners");
    let (length_m, width_m) = (drawn.get(Knob::LengthM), drawn.get(Knob::WidthM));
    // The arms of an L or a T share the length.
    let along_m = if drawn.outline == Outline::Rectangle { length_m } else { mm(dice.between(0.5, 0.65) * length_m) };
    let across_m = if drawn.outline == Outline::Rectangle { width_m } else { mm(length_m - along_m).max(2.0 * width_m) };
    let base = drawn.outline.corners(along_m, across_m, Some(width_m), &mut dice);
    let plain_sides = dice.chance(0.5);
    let (corners, leaves) = recessed(&base, drawn.get(Knob::DoorSpacingM), plain_sides, &mut dice);
    let mut room = Room::new(&corners, drawn, seed, &surfaces);
    let tone = *room.dice.pick(&[Tone::Wood, Tone::Pastel, Tone::Metal, Tone::Vivid]);
    for &k in &leaves {
        room.walls[k] = room.looks.thing("door", Planks, tone, 2.0);
        let side = &room.plan.sides[k];
        let (at, heading_deg) = (side.point(0.5 * side.length_m, 0.3), side.heading_deg);
        let width_m = side.length_m;
        room.plan.keep_free(at, [width_m, 0.5], heading_deg);
    }
    plates(&mut room, &leaves);
    room.windows([1.0, 1.6], [0.8, 1.0], [1.1, 1.4]);
    let clutter = drawn.get(Knob::Clutter);
    let narrow = width_m < 1.9;
    let count = room.dice.about(clutter * room.perimeter_m() / 9.0);
    let wide: &[Sort] = &[SIDEBOARD, CABINET, BOOKCASE, PLANT, BIN, SEATS, VENDING, COPIER];
    room.along_walls(if narrow { &[SLIM_SHELF, BIN, BIN] } else { wide }, count, 0.6);
    let count = room.dice.about((0.2 + drawn.get(Knob::Richness)) * room.perimeter_m() / 9.0);
    room.hang(&[SIGN, SIGN, PICTURE, PINBOARD, POSTER, CLOCK], count);
    room
}

/// The outline with a recess for each door, and the numbers of the walls that the leaves are. Doors stand at equal distances along
/// both sides of a passage, or along every other one where `plain_sides`.
fn recessed(base: &[[f64; 2]], spacing_m: f64, plain_sides: bool, dice: &mut Dice) -> (Vec<[f64; 2]>, Vec<usize>) {
    let [deep, beside] = RECESS_M;
    let width = dice.size([0.85, 1.0]) + 2.0 * beside;
    let phase = dice.unit();
    let (mut corners, mut leaves) = (Vec::new(), Vec::new());
    for (k, &a) in base.iter().enumerate() {
        let b = base[(k + 1) % base.len()];
        let length = (b[0] - a[0]).abs() + (b[1] - a[1]).abs(); // all edges are parallel to an axis
        let along = [0, 1].map(|c| (b[c] - a[c]) / length);
        let out = [along[1], -along[0]];
        corners.push(a);
        let free = length - 1.2;
        if free < width || (plain_sides && k % 4 == 2) {
            continue;
        }
        // The ends keep 0.6 m of wall.
        let count = ((free - width) / spacing_m).floor() as usize + 1;
        let rest = free - width - (count - 1) as f64 * spacing_m;
        for n in 0..count {
            let s = 0.6 + phase * rest + n as f64 * spacing_m;
            let corner = |s: f64, off: f64| [0, 1].map(|c| mm(a[c] + s * along[c] + off * out[c]));
            corners.extend([corner(s, 0.0), corner(s, deep)]);
            leaves.push(corners.len() - 1);
            corners.extend([corner(s + width, deep), corner(s + width, 0.0)]);
        }
    }
    (corners, leaves)
}

/// Plates with numbers beside the doors: what tells equal doors apart.
fn plates(room: &mut Room<'_>, leaves: &[usize]) {
    for &leaf in leaves {
        // The wall after the recess's second jamb.
        let k = (leaf + 2) % room.plan.sides.len();
        if room.plan.sides[k].length_m > 0.6 && room.dice.chance(0.8) {
            let plate = SIGN.item(&mut room.dice, &mut room.looks);
            let s = 0.12 + 0.5 * plate.size_m()[0];
            room.plan.hang_at(k, mm(s), plate);
        }
    }
}
