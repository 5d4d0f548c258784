//! Rooms of human size: lab, office, bare room.

use super::dice::Dice;
use super::furniture::*;
use super::knobs::{Drawn, Knob};
use super::looks::Tone;
use super::plan::{Part, Turn};
use super::room::{RICH, Room, Surfaces};
use crate::random::Seed;
use crate::world::spec::TextureFamily::{Noise, Plain, Planks, Tiles};

/// Free space around what stands in the room, so that the robot gets round it, m.
const ROUND_M: f64 = 0.55;

fn outline(drawn: &Drawn, seed: Seed) -> Vec<[f64; 2]> {
    let mut dice = Dice::new(seed, "corners");
    drawn.outline.corners(drawn.get(Knob::LengthM), drawn.get(Knob::WidthM), None, &mut dice)
}

pub(super) fn lab(drawn: &Drawn, seed: Seed) -> Room<'_> {
    let surfaces = Surfaces {
        paint: Tone::Paint,
        rich: RICH,
        floors: &[(Planks, Tone::Wood), (Tiles, Tone::Concrete), (Noise, Tone::Concrete)],
    };
    let mut room = Room::new(&outline(drawn, seed), drawn, seed, &surfaces);
    let clutter = drawn.get(Knob::Clutter);
    let doors = 1 + room.dice.below(2);
    room.doors(doors, [0.9, 2.05]);
    room.windows([0.9, 1.8], [0.8, 1.0], [1.1, 1.4]);
    let desks = room.dice.about(clutter * 1.5);
    for _ in 0..desks {
        let sides = room.sides(1.5);
        let (width_m, height_m, parts) = desk(&mut room.dice, &mut room.looks);
        room.plan.stand(&mut room.dice, &sides, [width_m, height_m], &parts, 0.05);
    }
    const WALL: &[Sort] = &[
        CABINET,
        CABINET,
        BOOKCASE,
        BOOKCASE,
        SHELF,
        SHELF,
        FILING_CABINET,
        LOCKERS,
        SIDEBOARD,
        BENCH,
        BENCH,
        MACHINE,
        SOFA,
        CRATE,
        PLANT,
        PLANT,
        BIN,
        BIN,
        DRUM,
    ];
    let count = room.dice.about(clutter * room.perimeter_m() / 1.7);
    room.along_walls(WALL, count, 0.03);
    let tables = room.dice.about(clutter * room.area_m2() / 40.0);
    for _ in 0..tables {
        let size = [room.dice.size([1.2, 2.0]), room.dice.size([0.7, 0.9])];
        let chairs = room.dice.below(4);
        let parts = table(&mut room.dice, &mut room.looks, size, chairs);
        room.plan.stand_free(&mut room.dice, &parts, Turn::Square(10.0), 0.5);
    }
    let count = room.dice.about(clutter * room.area_m2() / 9.0);
    room.about(&[PILLAR, STOOL, STOOL, LOW_BOX, LOW_BOX, CRATE, MACHINE, DRUM, PLANT], count, Turn::Any, ROUND_M);
    let count = room.dice.about(clutter * room.area_m2() / 30.0);
    room.cartons(count, ROUND_M);
    let count = room.dice.about(drawn.get(Knob::Richness) * room.perimeter_m() / 3.0);
    room.hang(&[POSTER, POSTER, WHITEBOARD, PINBOARD, CLOCK, SIGN, CUPBOARD], count);
    room
}

pub(super) fn office(drawn: &Drawn, seed: Seed) -> Room<'_> {
    let surfaces = Surfaces {
        paint: Tone::Paint,
        rich: &[(Noise, Tone::Pastel), (Planks, Tone::Wood), (Noise, Tone::Fabric)],
        floors: &[(Noise, Tone::Fabric), (Noise, Tone::Metal), (Planks, Tone::Wood), (Tiles, Tone::Fabric)],
    };
    let mut room = Room::new(&outline(drawn, seed), drawn, seed, &surfaces);
    let clutter = drawn.get(Knob::Clutter);
    room.doors(1, [0.9, 2.05]);
    room.windows([1.2, 2.0], [0.85, 1.0], [1.1, 1.4]);
    // Half of the offices have their desks at the walls, the others in islands of two or four.
    let wanted = room.dice.about(clutter * room.area_m2() / 8.0).max(1);
    if room.dice.chance(0.5) {
        let sides = room.sides(1.5);
        for _ in 0..wanted {
            let (width_m, height_m, parts) = desk(&mut room.dice, &mut room.looks);
            room.plan.stand(&mut room.dice, &sides, [width_m, height_m], &parts, 0.05);
        }
    } else {
        for _ in 0..wanted.div_ceil(3) {
            let wide = room.dice.chance(0.4);
            let parts = island(&mut room, if wide { 2 } else { 1 });
            room.plan.stand_free(&mut room.dice, &parts, Turn::Square(0.0), 0.45);
        }
    }
    let count = room.dice.about(clutter * room.perimeter_m() / 3.5);
    room.along_walls(
        &[CABINET, BOOKCASE, BOOKCASE, FILING_CABINET, FILING_CABINET, SIDEBOARD, COPIER, PLANT, PLANT, BIN, BIN],
        count,
        0.03,
    );
    let count = room.dice.about(clutter * room.area_m2() / 18.0);
    room.about(&[ROUND_CHAIR, PLANT, BIN, COLUMN, LOW_BOX, PARTITION], count, Turn::Square(4.0), ROUND_M);
    let count = room.dice.about((0.2 + drawn.get(Knob::Richness)) * room.perimeter_m() / 5.0);
    room.hang(&[POSTER, PICTURE, WHITEBOARD, CLOCK, PINBOARD, SIGN], count);
    room
}

/// Desks back to back, `pairs` of them side by side, with a screen of cloth between.
fn island(room: &mut Room<'_>, pairs: usize) -> Vec<Part> {
    let (length, depth) = (room.dice.size([1.2, 1.6]), room.dice.size([0.7, 0.8]));
    let mut all = Vec::new();
    for pair in 0..pairs {
        let x = (pair as f64 - 0.5 * (pairs as f64 - 1.0)) * (length + 0.02);
        for (y, turn_deg) in [(1.0, 0.0), (-1.0, 180.0)] {
            let frame = crate::geometry::Pose::new(x, y * (0.5 * depth + 0.03), f64::to_radians(turn_deg));
            for part in desk_parts(&mut room.dice, &mut room.looks, length, depth) {
                let at = frame.transform(part.at.into());
                all.push(Part::new(at.x, at.y, turn_deg + part.heading_deg, part.item));
            }
        }
    }
    all
}

pub(super) fn bare(drawn: &Drawn, seed: Seed) -> Room<'_> {
    let surfaces = Surfaces {
        paint: Tone::Pastel,
        rich: &[(Noise, Tone::Pastel)],
        floors: &[(Plain, Tone::Concrete), (Plain, Tone::Wood), (Noise, Tone::Concrete)],
    };
    let mut room = Room::new(&outline(drawn, seed), drawn, seed, &surfaces);
    let clutter = drawn.get(Knob::Clutter);
    room.doors(1, [0.9, 2.05]);
    room.windows([0.9, 1.4], [0.85, 1.0], [1.0, 1.3]);
    let count = room.dice.about(clutter * room.perimeter_m() / 2.5).max(1);
    room.along_walls(&[BOX, BOX, FRIDGE, FILING_CABINET, SIDEBOARD, COUNTER], count, 0.1);
    let count = room.dice.about(clutter * room.area_m2() / 9.0);
    room.about(&[COLUMN, COLUMN, BOX, LOW_BOX], count, Turn::Any, ROUND_M);
    let count = room.dice.about(drawn.get(Knob::Richness) * room.perimeter_m() / 4.0);
    room.hang(&[POSTER, PICTURE, CLOCK], count);
    room
}
