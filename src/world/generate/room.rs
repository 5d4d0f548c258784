//! What all kinds have in common: outline, walls, floor, doors, windows, lamps, and furniture from lists.

use super::dice::{Dice, hundredths, mm};
use super::furniture::{self, Hanging, Sort};
use super::knobs::{Drawn, Knob};
use super::looks::{Looks, Tone};
use super::plan::{Item, Plan, Turn};
use crate::geometry::Vector2;
use crate::random::Seed;
use crate::world::polygon::{contains, signed_area};
use crate::world::spec::TextureFamily::{self, Brick, Noise, Planks, Posters, Shelves, Tiles};
use crate::world::spec::{LampSpec, LightSpec, TextureSpec};

/// Patterns that a rich wall bears.
pub(in crate::world) const RICH: &[(TextureFamily, Tone)] = &[
    (Posters, Tone::Pastel),
    (Posters, Tone::Paper),
    (Brick, Tone::Clay),
    (Brick, Tone::Concrete),
    (Noise, Tone::Pastel),
    (Planks, Tone::Wood),
    (Shelves, Tone::Wood),
    (Tiles, Tone::Pastel),
];
const CEILINGS: &[(TextureFamily, Tone)] = &[(TextureFamily::Plain, Tone::Paint), (Tiles, Tone::Paint), (Noise, Tone::Paint)];

/// A room that is being furnished.
pub(super) struct Room<'a> {
    pub plan: Plan,
    pub drawn: &'a Drawn,
    pub dice: Dice,
    pub looks: Looks,
    pub walls: Vec<TextureSpec>,
    pub floor: TextureSpec,
    pub ceiling: TextureSpec,
}

/// What the surfaces of a room are made of.
pub(super) struct Surfaces {
    pub paint: Tone,
    pub rich: &'static [(TextureFamily, Tone)],
    pub floors: &'static [(TextureFamily, Tone)],
}

impl<'a> Room<'a> {
    /// An empty room with this outline.
    pub(super) fn new(corners: &[[f64; 2]], drawn: &'a Drawn, seed: Seed, surfaces: &Surfaces) -> Self {
        let plan = Plan::new(corners, drawn.get(Knob::HeightM));
        let mut looks = Looks::new(seed, drawn.get(Knob::Richness), drawn.get(Knob::Repetition));
        let lengths: Vec<f64> = plan.sides.iter().map(|s| s.length_m).collect();
        let walls = looks.walls(&lengths, surfaces.paint, surfaces.rich);
        let (low, high) = plan.bounds();
        let longest_m = (high.x - low.x).max(high.y - low.y);
        let floor = looks.ground(longest_m, surfaces.floors, 0.5);
        let ceiling = looks.ground(longest_m, CEILINGS, 0.2);
        Self { plan, drawn, dice: Dice::new(seed, "layout"), looks, walls, floor, ceiling }
    }

    pub(super) fn area_m2(&self) -> f64 {
        signed_area(&self.plan.outline)
    }

    /// All sides of the room that are at least so long.
    pub(super) fn sides(&self, least_m: f64) -> Vec<usize> {
        (0..self.plan.sides.len()).filter(|&k| self.plan.sides[k].length_m >= least_m).collect()
    }

    /// Length of all walls, m.
    pub(super) fn perimeter_m(&self) -> f64 {
        self.plan.sides.iter().map(|s| s.length_m).sum()
    }

    /// Puts doors in the walls, with a plate beside each where there is room.
    pub(super) fn doors(&mut self, count: usize, [width_m, height_m]: [f64; 2]) {
        let sides: Vec<usize> = self.sides(width_m + 0.3).into_iter().filter(|&k| self.plan.sides[k].wall.is_some()).collect();
        if sides.is_empty() {
            return;
        }
        for _ in 0..count {
            for _ in 0..12 {
                let k = *self.dice.pick(&sides);
                let length_m = self.plan.sides[k].length_m;
                // Near a corner, as doors are, or anywhere.
                let margin_m = 0.5 * width_m + 0.15;
                let s = match self.dice.below(3) {
                    0 => margin_m,
                    1 => length_m - margin_m,
                    _ => self.dice.between(margin_m, length_m - margin_m),
                };
                let tone = *self.dice.pick(&[Tone::Wood, Tone::Paint, Tone::Pastel, Tone::Metal]);
                let texture = self.looks.thing("door", Planks, tone, 2.0 * height_m);
                let leaf = Item::cuboid("door", [width_m, 0.04], height_m.min(self.plan.height_m - 0.1), texture);
                if self.plan.door(k, mm(s), leaf) {
                    let plate = furniture::SIGN.item(&mut self.dice, &mut self.looks);
                    let beside_m = s + 0.5 * width_m + 0.3;
                    self.plan.hang_at(k, mm(beside_m), plate);
                    break;
                }
            }
        }
    }

    /// Puts as many windows as were drawn into the walls, all of one size.
    pub(super) fn windows(&mut self, width_m: [f64; 2], sill_m: [f64; 2], height_m: [f64; 2]) {
        let (width, sill, height) = (self.dice.size(width_m), self.dice.size(sill_m), self.dice.size(height_m));
        let top = mm((sill + height).min(self.plan.height_m - 0.15));
        let brightness = hundredths(self.drawn.get(Knob::Light) * self.dice.between(0.12, 0.35));
        let sides: Vec<usize> = self.sides(width + 0.4).into_iter().filter(|&k| self.plan.sides[k].wall.is_some()).collect();
        let mut left = self.drawn.count(Knob::Windows);
        // Windows keep company: a wall gets as many as it holds before the next one does.
        for _ in 0..3 * sides.len() {
            if left == 0 || top - sill < 0.3 {
                return;
            }
            let k = *self.dice.pick(&sides);
            let length_m = self.plan.sides[k].length_m;
            let fit = ((length_m - 0.4) / (width + 0.5)).floor().max(1.0).min(left as f64);
            for n in 0..fit as usize {
                let s = length_m * (n as f64 + 0.5) / fit;
                let seen = self.looks.thing("window", Posters, Tone::Sky, (2.0 * width).max(1.0));
                if self.plan.window(k, s, width, [sill, top], brightness, &seen) {
                    left -= 1;
                }
            }
        }
    }

    /// Stands things from a list with their backs to the walls.
    pub(super) fn along_walls(&mut self, sorts: &[Sort], count: usize, gap_m: f64) {
        let sides = self.sides(0.6);
        for _ in 0..count {
            let item = self.dice.pick(sorts).item(&mut self.dice, &mut self.looks);
            let (width_m, height_m, parts) = furniture::backed(item);
            self.plan.stand(&mut self.dice, &sides, [width_m, height_m], &parts, gap_m);
        }
    }

    /// Stands things from a list free in the room.
    pub(super) fn about(&mut self, sorts: &[Sort], count: usize, turn: Turn, gap_m: f64) {
        for _ in 0..count {
            let mut item = self.dice.pick(sorts).item(&mut self.dice, &mut self.looks);
            if matches!(item.name, "pillar" | "plain column") {
                item.height_m = self.plan.height_m; // they carry the ceiling
            }
            let parts = [super::plan::Part::new(0.0, 0.0, 0.0, item)];
            self.plan.stand_free(&mut self.dice, &parts, turn, gap_m);
        }
    }

    /// Hangs things from a list at the walls.
    pub(super) fn hang(&mut self, sorts: &[Hanging], count: usize) {
        let sides = self.sides(0.5);
        for _ in 0..count {
            let item = self.dice.pick(sorts).item(&mut self.dice, &mut self.looks);
            self.plan.hang(&mut self.dice, &sides, &item);
        }
    }

    /// Cartons that stand about; some of them the robot can push away.
    pub(super) fn cartons(&mut self, count: usize, gap_m: f64) {
        for _ in 0..count {
            let mut item = furniture::CARTON.item(&mut self.dice, &mut self.looks);
            if self.dice.chance(0.3) {
                let mass_kg = hundredths(self.dice.between(0.5, 3.0));
                item = furniture::loose(item, mass_kg);
            }
            self.plan.stand_free(&mut self.dice, &[super::plan::Part::new(0.0, 0.0, 0.0, item)], Turn::Any, gap_m);
        }
    }

    /// Lamps at the ceiling, about one for each square of `every_m`, and the ambient light that goes with them.
    pub(super) fn light(&mut self, every_m: f64) -> LightSpec {
        let light = self.drawn.get(Knob::Light);
        let share = self.dice.between(0.25, 0.5);
        let (low, high) = self.plan.bounds();
        let size = high - low;
        let [columns, rows] = [size.x, size.y].map(|s| (s / every_m).round().clamp(1.0, 8.0));
        let z = mm(self.plan.height_m - 0.1);
        // A lamp gives a third of its share right below it, whatever the height of the room.
        let intensity = hundredths(light * share * z * z / 3.0);
        let mut lamps = Vec::new();
        for k in 0..(columns * rows) as usize {
            let (column, row) = (k % columns as usize, k / columns as usize);
            let at = low + Vector2::new(size.x * (column as f64 + 0.5) / columns, size.y * (row as f64 + 0.5) / rows);
            if contains(&self.plan.outline, at) {
                lamps.push(LampSpec { position_m: [mm(at.x), mm(at.y), z], intensity });
            }
        }
        LightSpec {
            ambient: hundredths(light * (1.0 - share)),
            corner_shade: hundredths(self.dice.between(0.0, 0.5)),
            lamps,
            windows: std::mem::take(&mut self.plan.windows),
            ..LightSpec::default()
        }
    }
}
