//! What stands and hangs in rooms, in the sizes that such things have.

use super::dice::{Dice, mm};
use super::looks::{Looks, Tone};
use super::plan::{Item, Part};
use crate::world::spec::TextureFamily::{self, Bands, Noise, Plain, Planks, Posters, Shelves, Tiles};
use crate::world::spec::{MotionSpec, ShapeSpec};

/// A sort of thing: its name, least and greatest sizes in m, and how it looks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sort {
    name: &'static str,
    /// Along its wall, away from it, and height; a round thing has its diameter as both.
    size_m: [[f64; 2]; 3],
    form: Form,
    family: TextureFamily,
    tone: Tone,
    landmark: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Cuboid,
    Disc,
    /// A round heap of leaves: a polygon of five to seven corners.
    Bush,
}

const fn sort(name: &'static str, size_m: [[f64; 2]; 3], family: TextureFamily, tone: Tone) -> Sort {
    Sort { name, size_m, form: Form::Cuboid, family, tone, landmark: true }
}

const fn round(name: &'static str, across_m: [f64; 2], height_m: [f64; 2], family: TextureFamily, tone: Tone) -> Sort {
    Sort { name, size_m: [across_m, across_m, height_m], form: Form::Disc, family, tone, landmark: true }
}

impl Sort {
    const fn obstacle(self) -> Self {
        Self { landmark: false, ..self }
    }

    /// One of this sort.
    pub(super) fn item(&self, dice: &mut Dice, looks: &mut Looks) -> Item {
        let [along, away, height] = self.size_m.map(|range| dice.size(range));
        let around = if self.form == Form::Cuboid { 2.0 * (along + away) } else { 3.2 * along };
        let texture = looks.thing(self.name, self.family, self.tone, around.max(height).max(0.6));
        let item = match self.form {
            Form::Cuboid => Item::cuboid(self.name, [along, away], height, texture),
            Form::Disc => Item::disc(self.name, 0.5 * along, height, texture),
            Form::Bush => {
                let count = 5 + dice.below(3);
                let corner = |k: usize| {
                    let at = crate::geometry::direction(std::f64::consts::TAU * k as f64 / count as f64) * (0.5 * along);
                    [mm(at.x), mm(at.y)]
                };
                let shape = ShapeSpec::Polygon { corners_m: (0..count).map(corner).collect() };
                Item { shape, ..Item::cuboid(self.name, [along, away], height, texture) }
            }
        };
        if self.landmark { item } else { item.obstacle() }
    }
}

/// A thing whose back is at the frame's x axis, in the middle.
pub(super) fn backed(item: Item) -> (f64, f64, Vec<Part>) {
    let [along, away] = item.size_m();
    let height = item.elevation_m + item.height_m;
    (along, height, vec![Part::new(0.0, 0.5 * away, 0.0, item)])
}

pub(super) const CABINET: Sort = sort("cabinet", [[0.8, 1.2], [0.38, 0.5], [1.1, 1.9]], Planks, Tone::Wood);
pub(super) const BOOKCASE: Sort = sort("bookcase", [[0.8, 1.8], [0.28, 0.35], [1.6, 2.1]], Shelves, Tone::Wood);
pub(super) const SHELF: Sort = sort("shelf", [[0.9, 1.5], [0.3, 0.45], [1.4, 2.0]], Shelves, Tone::Metal);
pub(super) const FILING_CABINET: Sort = sort("filing cabinet", [[0.4, 0.5], [0.55, 0.65], [0.7, 1.35]], Tiles, Tone::Metal);
pub(super) const LOCKERS: Sort = sort("lockers", [[0.9, 1.6], [0.45, 0.55], [1.7, 1.9]], Tiles, Tone::Vivid);
pub(super) const SIDEBOARD: Sort = sort("sideboard", [[1.2, 1.8], [0.4, 0.45], [0.7, 0.85]], Planks, Tone::Wood);
pub(super) const BENCH: Sort = sort("workbench", [[1.4, 2.0], [0.65, 0.8], [0.85, 0.95]], Planks, Tone::Wood);
pub(super) const MACHINE: Sort = sort("machine", [[0.7, 1.2], [0.6, 0.9], [1.0, 1.6]], Tiles, Tone::Metal);
pub(super) const SOFA: Sort = sort("sofa", [[1.5, 2.1], [0.8, 0.95], [0.7, 0.85]], Noise, Tone::Fabric);
pub(super) const ARMCHAIR: Sort = sort("armchair", [[0.75, 0.9], [0.75, 0.85], [0.7, 0.9]], Noise, Tone::Fabric);
pub(super) const BED: Sort = sort("bed", [[0.9, 1.6], [2.0, 2.1], [0.45, 0.6]], Noise, Tone::Fabric);
pub(super) const WARDROBE: Sort = sort("wardrobe", [[1.0, 2.0], [0.58, 0.64], [1.9, 2.2]], Planks, Tone::Wood);
pub(super) const CHEST: Sort = sort("chest of drawers", [[0.8, 1.2], [0.4, 0.5], [0.75, 1.0]], Bands, Tone::Wood);
pub(super) const KITCHEN_UNIT: Sort = sort("kitchen unit", [[1.2, 2.4], [0.6, 0.62], [0.88, 0.92]], Tiles, Tone::Paint);
pub(super) const FRIDGE: Sort = sort("fridge", [[0.58, 0.62], [0.6, 0.66], [1.4, 1.9]], Plain, Tone::Paint);
pub(super) const BATHTUB: Sort = sort("bathtub", [[1.5, 1.7], [0.7, 0.75], [0.55, 0.6]], Plain, Tone::Paint);
pub(super) const BASIN: Sort = sort("wash stand", [[0.5, 0.8], [0.42, 0.48], [0.82, 0.88]], Tiles, Tone::Paint);
pub(super) const WASHER: Sort = sort("washing machine", [[0.6, 0.6], [0.55, 0.6], [0.85, 0.85]], Posters, Tone::Paint);
pub(super) const TELEVISION: Sort = sort("low board", [[1.2, 1.8], [0.38, 0.45], [0.42, 0.55]], Planks, Tone::Wood);
pub(super) const COPIER: Sort = sort("copier", [[0.6, 0.7], [0.6, 0.7], [0.95, 1.15]], Tiles, Tone::Paint);
pub(super) const CRATE: Sort = sort("crate", [[0.4, 0.6], [0.4, 0.6], [0.35, 0.7]], Posters, Tone::Vivid);
pub(super) const PALLET: Sort = sort("pallet", [[1.15, 1.2], [0.8, 0.8], [0.5, 1.6]], Posters, Tone::Carton);
pub(super) const CONTAINER: Sort = sort("container", [[2.4, 3.0], [2.2, 2.4], [2.4, 2.6]], Planks, Tone::Vivid);
pub(super) const STAND: Sort = sort("stand", [[1.8, 3.0], [0.8, 1.2], [1.0, 2.4]], Posters, Tone::Vivid);
pub(super) const PLINTH: Sort = sort("plinth", [[0.5, 0.9], [0.5, 0.9], [0.8, 1.2]], Noise, Tone::Concrete);
pub(super) const SEATS: Sort = sort("row of seats", [[2.0, 4.0], [0.5, 0.6], [0.8, 0.9]], Tiles, Tone::Fabric);
pub(super) const VENDING: Sort = sort("vending machine", [[0.75, 0.95], [0.75, 0.85], [1.8, 1.9]], Posters, Tone::Vivid);
pub(super) const PARTITION: Sort = sort("partition", [[1.2, 1.8], [0.05, 0.05], [1.3, 1.6]], Noise, Tone::Fabric);
pub(super) const BOX: Sort = sort("plain box", [[0.5, 1.2], [0.4, 0.8], [0.5, 1.6]], Plain, Tone::Pastel);
pub(super) const COUNTER: Sort = sort("counter", [[1.2, 2.4], [0.55, 0.7], [0.95, 1.1]], Planks, Tone::Pastel);
pub(super) const SLIM_SHELF: Sort = sort("slim shelf", [[0.6, 1.2], [0.22, 0.3], [0.8, 1.8]], Shelves, Tone::Wood);

pub(super) const BIN: Sort = round("bin", [0.26, 0.36], [0.35, 0.65], Bands, Tone::Metal).obstacle();
pub(super) const STOOL: Sort = round("stool", [0.3, 0.36], [0.44, 0.6], Planks, Tone::Wood).obstacle();
pub(super) const DRUM: Sort = round("drum", [0.56, 0.6], [0.85, 0.9], Bands, Tone::Vivid);
pub(super) const PILLAR: Sort = round("pillar", [0.3, 0.5], [2.0, 2.0], Posters, Tone::Concrete);
pub(super) const LAMP: Sort = round("floor lamp", [0.26, 0.34], [1.5, 1.7], Bands, Tone::Paper);
pub(super) const COLUMN: Sort = round("plain column", [0.25, 0.4], [2.0, 2.0], Plain, Tone::Paint);
pub(super) const LOW_BOX: Sort = sort("low box", [[0.3, 0.6], [0.25, 0.45], [0.18, 0.34]], Posters, Tone::Carton).obstacle();
pub(super) const CHAIR: Sort = sort("chair", [[0.42, 0.48], [0.42, 0.48], [0.8, 0.95]], Noise, Tone::Fabric).obstacle();
pub(super) const ROUND_CHAIR: Sort = round("swivel chair", [0.46, 0.54], [0.85, 1.0], Noise, Tone::Fabric).obstacle();
pub(super) const PLANT: Sort = Sort { form: Form::Bush, ..round("plant", [0.35, 0.55], [0.7, 1.4], Noise, Tone::Leaf) };
pub(super) const CARTON: Sort = sort("carton", [[0.3, 0.5], [0.3, 0.4], [0.25, 0.4]], Posters, Tone::Carton).obstacle();

/// A picture, board or sign that hangs: name, least and greatest width, height and height of the lower edge, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hanging(&'static str, [f64; 2], [f64; 2], [f64; 2], TextureFamily, Tone);

pub(super) const POSTER: Hanging = Hanging("poster", [0.5, 1.0], [0.6, 1.2], [0.9, 1.2], Posters, Tone::Paper);
pub(super) const BANNER: Hanging = Hanging("banner", [1.0, 2.5], [1.4, 2.8], [1.0, 1.6], Posters, Tone::Vivid);
pub(super) const WHITEBOARD: Hanging = Hanging("whiteboard", [1.2, 2.0], [0.9, 1.2], [0.8, 0.95], Posters, Tone::Paper);
pub(super) const PICTURE: Hanging = Hanging("picture", [0.3, 0.9], [0.3, 0.7], [1.1, 1.5], Posters, Tone::Paper);
pub(super) const PINBOARD: Hanging = Hanging("pinboard", [0.9, 1.5], [0.7, 1.0], [0.9, 1.1], Posters, Tone::Carton);
pub(super) const CLOCK: Hanging = Hanging("clock", [0.28, 0.34], [0.28, 0.34], [1.8, 2.1], Posters, Tone::Paper);
pub(super) const SIGN: Hanging = Hanging("sign", [0.2, 0.4], [0.15, 0.35], [1.4, 1.7], Posters, Tone::Vivid);
pub(super) const CUPBOARD: Hanging = Hanging("wall cupboard", [0.6, 1.4], [0.5, 0.7], [1.4, 1.5], Planks, Tone::Wood);
pub(super) const MIRROR: Hanging = Hanging("mirror", [0.4, 0.7], [0.5, 0.9], [1.1, 1.3], Plain, Tone::Sky);

impl Hanging {
    pub(super) fn item(&self, dice: &mut Dice, looks: &mut Looks) -> Item {
        let &Self(name, width, height, low, family, tone) = self;
        let (width, height, low) = (dice.size(width), dice.size(height), dice.size(low));
        let depth = if name == CUPBOARD.0 { 0.32 } else { 0.02 };
        // As wide as its front, so that two of one size differ also where the colours agree.
        let texture = looks.thing(name, family, tone, 2.0 * width.max(height));
        Item::cuboid(name, [width, depth], height, texture).raised(low)
    }
}

/// A table with four legs and a top that the robot drives under; x along its longer side, around its middle.
pub(super) fn table(dice: &mut Dice, looks: &mut Looks, [length_m, depth_m]: [f64; 2], chairs: usize) -> Vec<Part> {
    let top = looks.thing("table", Planks, Tone::Wood, 2.0 * length_m);
    let legs = looks.thing("table leg", Plain, Tone::Metal, 1.0);
    let mut parts = vec![Part::new(0.0, 0.0, 0.0, Item::cuboid("table", [length_m, depth_m], 0.04, top).raised(0.7))];
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let at = (x * (0.5 * length_m - 0.06), y * (0.5 * depth_m - 0.06));
        parts.push(Part::new(at.0, at.1, 0.0, Item::disc("table leg", 0.03, 0.7, legs.clone()).obstacle()));
    }
    for k in 0..chairs {
        let chair = CHAIR.item(dice, looks);
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let places = (chairs as f64 / 2.0).ceil();
        let x = ((k / 2) as f64 + 0.5 - 0.5 * places) * (length_m / places) + dice.between(-0.08, 0.08);
        let y = side * (0.5 * depth_m + dice.between(0.34, 0.5));
        parts.push(Part::new(x, y, dice.between(-15.0, 15.0).round(), chair));
    }
    parts
}

/// A desk against a wall: a top on a chest of drawers and a panel, a chair before it, a screen on it; x along the wall.
pub(super) fn desk(dice: &mut Dice, looks: &mut Looks) -> (f64, f64, Vec<Part>) {
    let (length, depth) = (dice.size([1.2, 1.8]), dice.size([0.65, 0.8]));
    let mut parts = desk_parts(dice, looks, length, depth);
    for part in &mut parts {
        part.at[1] += 0.5 * depth;
    }
    (length, 1.3, parts)
}

/// The parts of a desk around its middle; who sits at it looks along -y.
pub(super) fn desk_parts(dice: &mut Dice, looks: &mut Looks, length: f64, depth: f64) -> Vec<Part> {
    let top = looks.thing("desk", Planks, Tone::Wood, 2.0 * length);
    let side = if dice.chance(0.5) { 1.0 } else { -1.0 };
    let drawers = looks.thing("drawers", Bands, Tone::Paint, 1.6);
    let panel = looks.thing("desk panel", Plain, Tone::Metal, 1.0);
    let mut parts = vec![
        Part::new(0.0, 0.0, 0.0, Item::cuboid("desk", [length, depth], 0.04, top).raised(0.7)),
        Part::new(side * (0.5 * length - 0.21), 0.0, 0.0, Item::cuboid("drawers", [0.42, mm(depth - 0.06)], 0.7, drawers)),
        Part::new(
            -side * (0.5 * length - 0.02),
            0.0,
            0.0,
            Item::cuboid("desk panel", [0.04, mm(depth - 0.06)], 0.7, panel).obstacle(),
        ),
    ];
    if dice.chance(0.8) {
        let x = -side * dice.between(0.0, 0.2) * length;
        let width = dice.size([0.5, 0.7]);
        let mut screen = Item::cuboid("screen", [width, 0.05], 0.4, looks.thing("screen", Posters, Tone::Sky, 2.0 * width));
        screen.glow = 0.2;
        parts.push(Part::new(x, 0.1 - 0.5 * depth, 0.0, screen.raised(0.74)));
    }
    if dice.chance(0.85) {
        let chair = ROUND_CHAIR.item(dice, looks);
        let x = -side * 0.15 * length + dice.between(-0.1, 0.1);
        parts.push(Part::new(x, 0.5 * depth + dice.between(0.3, 0.6), 0.0, chair));
    }
    parts
}

/// Makes something that the robot can push away.
pub(super) fn loose(item: Item, mass_kg: f64) -> Item {
    Item { motion: Some(MotionSpec::Pushed { mass_kg, friction: 0.4 }), ..item }.obstacle()
}

/// What a person wears.
pub(super) fn coat(dice: &mut Dice, looks: &mut Looks) -> crate::world::spec::TextureSpec {
    let tone = *dice.pick(&[Tone::Fabric, Tone::Vivid, Tone::Metal]);
    looks.thing("person", Posters, tone, 1.7)
}
