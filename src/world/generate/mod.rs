//! Worlds without end: rooms drawn from a seed.
//!
//! [`generate`] draws a world of a [`Kind`]. [`Knobs`] narrow what it is drawn from. One kind, seed and set of knobs is one world,
//! to the byte, on every machine. What comes out is an ordinary world file: nothing in the program asks where it came from.
//!
//! ```
//! use wayhome::world::World;
//! use wayhome::world::generate::{Kind, Knobs, generate};
//!
//! let mut knobs = Knobs::default();
//! knobs.set("length_m=6..7")?;
//! let office = generate(Kind::Office, 17, &knobs)?;
//! let world = World::from_toml(&office.toml, "office-17.toml")?;
//! assert_eq!(world.spec, office.spec);
//! # Ok::<(), wayhome::Error>(())
//! ```
//!
//! A room is furnished (`furnished`, `flat`, `large`) with things of human size (`furniture`) whose looks (`looks`) are as rich and as
//! alike as the knobs say, on a plan that knows what still fits (`plan`). Then a home is sought (`home`) that many places around
//! it see, on a grid of all places that the robot can drive to from there (`reach`). A drawing in which there is none is thrown
//! away, and the next one of the same seed is taken.

pub(in crate::world) mod dice;
mod flat;
mod furnished;
mod furniture;
mod home;
mod kind;
mod knobs;
mod large;
pub(in crate::world) mod looks;
mod outline;
mod plan;
mod reach;
pub(in crate::world) mod room;

pub use kind::Kind;
pub(in crate::world) use kind::did_you_mean;
pub use knobs::{Drawn, Knob, Knobs, OUTLINE, Ranges, usual_outlines};
pub use outline::Outline;

use super::WorldSpec;
use super::robot::RobotSpec;
use super::spec::{CameraSpec, FloorSpec, RoomSpec, TaskSpec};
use crate::error::{Error, Result};
use crate::random::Seed;
use dice::Dice;
use room::Room;

/// Begins the text of each generated world; it tells them from a user's own files.
pub const HEAD: &str = "# Made by `wayhome world generate ";
/// Drawings of a seed until it is given up.
const DRAWINGS: usize = 40;
/// The camera is on the robot's body up to this height, and on a mast above, m.
const MAST_FROM_M: f64 = 0.6;

/// A generated world.
#[derive(Debug, Clone, PartialEq)]
pub struct Generated {
    /// The kind of room: never a mixture.
    pub kind: Kind,
    /// Its seed.
    pub seed: u64,
    /// The world.
    pub spec: WorldSpec,
    /// The same as a file, with what was drawn as comments.
    pub toml: String,
    /// What was drawn for each knob.
    pub drawn: Drawn,
}

/// Draws a world.
///
/// # Errors
/// When the kind has no such knobs or does not allow such values, or no room with them has a place for home and starts.
pub fn generate(kind: Kind, seed: u64, knobs: &Knobs) -> Result<Generated> {
    knobs.check(kind)?;
    let kind = match kind {
        Kind::Mixture => {
            let rooms: Vec<Kind> = Kind::rooms().collect();
            *Dice::new(Seed(seed), "world/mixture").pick(&rooms)
        }
        room => room,
    };
    let base = Seed(seed).derive(&format!("world/{kind}"));
    let drawn = knobs.draw(kind, base);
    let spec = (0..DRAWINGS).find_map(|n| draw(kind, seed, &drawn, base.derive(&format!("drawing {n}"))));
    let Some(spec) = spec else {
        let asked = if knobs.is_usual() { String::new() } else { format!(" with {}", knobs.settings().join(", ")) };
        return Err(Error::Invalid {
            what: format!("{kind} of seed {seed}{asked}"),
            found: format!("in {DRAWINGS} drawings no place for home that the robot reaches from starts around it"),
            allowed: "more space, less clutter, or nearer starts (length_m, width_m, clutter, start_distance_m)".to_owned(),
        });
    };
    let toml = format!("{}\n{}", head(kind, seed, knobs, &drawn), spec.to_toml());
    Ok(Generated { kind, seed, spec, toml, drawn })
}

/// One drawing of a world; `None` if it has no place for home.
fn draw(kind: Kind, number: u64, drawn: &Drawn, seed: Seed) -> Option<WorldSpec> {
    let mut room: Room<'_> = match kind {
        Kind::Lab => furnished::lab(drawn, seed),
        Kind::Office => furnished::office(drawn, seed),
        Kind::Flat => flat::flat(drawn, seed),
        Kind::Corridor => large::corridor(drawn, seed),
        Kind::Hall => large::hall(drawn, seed),
        Kind::Warehouse => large::warehouse(drawn, seed),
        Kind::Bare | Kind::Mixture => furnished::bare(drawn, seed),
    };
    let mut robot = RobotSpec::default();
    let camera = CameraSpec { height_m: drawn.get(Knob::CameraHeightM), ..CameraSpec::default() };
    if camera.height_m > MAST_FROM_M {
        robot.height_m = dice::mm(camera.height_m + 0.01);
    }
    let task = home::choose(&room.plan, drawn, &robot, &mut Dice::new(seed, "home"))?;
    let people = home::walkers(&room.plan, &task, drawn.count(Knob::Walkers), &mut Dice::new(seed, "walkers"), &mut room.looks);
    let zones = home::zones(&room.plan, drawn, &mut Dice::new(seed, "zones"));
    let every_m = if matches!(kind, Kind::Hall | Kind::Warehouse) { 6.0 } else { 3.5 };
    let light = room.light(every_m);
    let size = format!("{} x {} m", drawn.get(Knob::LengthM), drawn.get(Knob::WidthM));
    let start_m = drawn.get(Knob::StartDistanceM);
    let Room { plan, walls, floor, ceiling, .. } = room;
    let obstacles = [plan.obstacles, people].concat();
    Some(WorldSpec {
        name: format!("{kind}-{number}"),
        description: format!("Drawn by seed: {}, {size}.", kind.meaning()),
        seed: Dice::new(seed, "textures").texture_seed(),
        room: RoomSpec {
            outline_m: plan.outline.iter().map(|c| [c.x, c.y]).collect(),
            height_m: plan.height_m,
            walls,
            floor,
            ceiling,
        },
        walls: plan.walls,
        floor: FloorSpec { friction: drawn.get(Knob::Friction), zones },
        light,
        landmarks: plan.landmarks,
        obstacles,
        robot,
        camera,
        home: task.home,
        start: task.start,
        // Time for the way at half the cruising speed, and for a turn and a look round.
        task: TaskSpec { time_limit_s: (60.0 + 20.0 * start_m).max(120.0).round(), ..TaskSpec::default() },
        disturbances: Vec::new(),
    })
}

/// The comments at the head of a world file: how to make it again, and what was drawn.
fn head(kind: Kind, seed: u64, knobs: &Knobs, drawn: &Drawn) -> String {
    use std::fmt::Write;
    let set: String = knobs.for_kind(kind).settings().iter().map(|s| format!(" --set {s}")).collect();
    let mut text =
        format!("{HEAD}{kind} --seed {seed}{set}`: {}.\n#\n# Drawn, each from the range behind it:\n", kind.meaning());
    let _ = writeln!(text, "#   {:<18} {:<10} {}", OUTLINE, drawn.outline.name(), knobs.outlines_of(kind));
    for (knob, value) in &drawn.values {
        let [low, high] = knobs.range(*knob, kind);
        let _ = writeln!(text, "#   {:<18} {value:<10} {low} to {high}: {}", knob.name(), knob.meaning());
    }
    text
}
