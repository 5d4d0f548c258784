//! A map as a world.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::Map;
use super::contour;
use super::region::{self, Clearance, Groups, Mask, NONE};
use super::shapes::{self, Shape};
use super::solid::{Frame, Segment, Solid, Standing, solids, tenths};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, direction};
use crate::random::Seed;
use crate::world::boundary::Boundary;
use crate::world::generate::dice::Dice;
use crate::world::generate::looks::{Looks, Tone};
use crate::world::generate::room::RICH;
use crate::world::polygon::edges;
use crate::world::spec::TextureFamily::{self, Bands, Brick, Noise, Plain, Planks, Posters, Shelves, Tiles};
use crate::world::spec::{
    BodySpec, CameraSpec, FloorSpec, LightSpec, PoseSpec, RoomSpec, ShapeSpec, StartSpec, TaskSpec, TextureSpec, WallSpec,
    WorldSpec,
};
use crate::world::{RobotSpec, World};

/// Begins the text of each imported world; it tells them from a user's own files.
pub const HEAD: &str = "# Made by `wayhome world import";
/// Least tolerance that is taken where none is asked for, m.
const USUAL_TOLERANCE_M: f64 = 0.02;
/// Greatest tolerance, m.
const GREATEST_TOLERANCE_M: f64 = 1.0;
/// Most walls and bodies of a world, as instance ids have 16 bits; walls inside the room count twice.
const MOST_INSTANCES: usize = 60_000;
/// Greatest coordinate of a world, m.
const GREATEST_M: f64 = 1000.0;
/// Free space around the robot's body at home and on the way from a start, m.
const SPARE_M: f64 = 0.05;
/// Greatest distance of a start, m, and the least that is wanted.
const FARTHEST_START_M: f64 = 3.0;
const NEAREST_START_M: f64 = 0.8;
/// Directions in which starts are looked for.
const RAYS: usize = 32;
/// Bodies up to this far across are landmarks, m.
const LANDMARK_M: f64 = 1.5;
/// How much a building's walls differ from one another; see the knobs of generated worlds.
const RICHNESS: f64 = 0.8;
/// What bodies look like.
const BODIES: &[(TextureFamily, Tone)] = &[
    (Posters, Tone::Paper),
    (Shelves, Tone::Wood),
    (Planks, Tone::Wood),
    (Tiles, Tone::Pastel),
    (Noise, Tone::Vivid),
    (Bands, Tone::Metal),
    (Brick, Tone::Clay),
];
const FLOORS: &[(TextureFamily, Tone)] =
    &[(Planks, Tone::Wood), (Tiles, Tone::Concrete), (Noise, Tone::Concrete), (Noise, Tone::Fabric)];

/// How a map becomes a world.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportSettings {
    /// Name of the world.
    pub name: String,
    /// What the map is called in messages, and the command that the world's file names.
    pub source: String,
    /// See above.
    pub command: String,
    /// Greatest distance that borders may move when they are simplified, m; one cell if it is not given, and 2 cm at least.
    pub tolerance_m: Option<f64>,
    /// Home in the map's frame; if it is not given, the place of the largest free region that is farthest from everything.
    pub home: Option<Pose>,
    /// Seed of the textures.
    pub seed: u64,
    /// Height of the room, its walls and all that stands in it, m: a map does not tell.
    pub height_m: f64,
}

impl Default for ImportSettings {
    fn default() -> Self {
        Self {
            name: "map".to_owned(),
            source: "map".to_owned(),
            command: "wayhome world import".to_owned(),
            tolerance_m: None,
            home: None,
            seed: 0,
            height_m: 2.5,
        }
    }
}

/// What came of a map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Columns and rows of the map.
    pub columns: usize,
    /// See above.
    pub rows: usize,
    /// Edge of a cell, m.
    pub resolution_m: f64,
    /// Area of the free cells that hang together with home, m^2.
    pub free_m2: f64,
    /// Area of the free cells that do not, m^2, and in how many regions they are.
    pub left_out_m2: f64,
    /// See above.
    pub left_out_regions: usize,
    /// Specks of the unknown inside free space that were taken for free.
    pub specks: usize,
    /// Walls of the room.
    pub outline: usize,
    /// Walls inside the room.
    pub walls: usize,
    /// Bodies.
    pub bodies: usize,
    /// How far borders might move, m.
    pub tolerance_m: f64,
    /// Greatest distance between the border of the free cells and that of the free space in the world, m.
    pub deviation_m: f64,
    /// Home: x and y, m, and heading, degrees.
    pub home: [f64; 3],
    /// What is allowed in the map and may still not be meant.
    pub warnings: Vec<String>,
}

/// An imported world.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The world.
    pub spec: WorldSpec,
    /// The same as a file, with the report as comments.
    pub toml: String,
    /// What came of the map.
    pub report: Report,
}

/// Makes a world of a map: the free cells that hang together with home become its free space, and all others are solid.
///
/// # Errors
/// When no cell is free, the robot does not fit in, home is not free, there is no start from which the robot sees it, the map reaches too
/// far, or there are too many walls.
pub fn import(map: &Map, settings: &ImportSettings) -> Result<Imported> {
    let tolerance_m = tolerance(map, settings)?;
    check_extent(map, settings)?;
    let robot = RobotSpec::default();
    let free = region::free(map);
    let groups = Groups::new(&free, false);
    let label = choose(map, &groups, settings)?;
    let mut mask = groups.mask(label, map.columns, map.rows);
    let cells = mask.count();
    let specks = region::fill_specks(&mut mask, map);
    let clearance = mask.clearance();
    let home = home(map, &mask, &clearance, &robot, settings)?;

    let borders = contour::borders(&mask);
    let frame = Frame { origin: map.origin, resolution_m: map.resolution_m };
    let shapes = shapes::shapes(&borders, tolerance_m / frame.part_m());
    let others = Mask { cells: mask.cells.iter().map(|c| !c).collect(), ..mask.clone() };
    let beyond = Groups::new(&others, true);
    let solids = solids(&borders, &shapes, &beyond, &mask, &frame);
    let deviations = borders.iter().zip(&shapes).map(|(b, s)| shapes::deviation(&b.corners, s) * frame.part_m());
    let stray = solids.iter().map(|s| if let Solid::Block { stray_m, .. } = s { *stray_m } else { 0.0 });
    let deviation_m = deviations.chain(stray).fold(0.0, f64::max);

    let start = start(map, &clearance, &shapes[0], &frame, home, &robot);
    let Some(start) = start else {
        return Err(Error::Unfit {
            what: format!("{}: starts around home at ({:.2}, {:.2}) m", settings.source, home.x, home.y),
            found: "no place that is in sight of home".to_owned(),
            needed: "more free space around home, or another one (--home)".to_owned(),
        });
    };
    let mut spec = furnish(&shapes[0], &solids, &frame, settings);
    spec.description = format!("From a map of {} x {} cells of {} m.", map.columns, map.rows, map.resolution_m);
    spec.home = PoseSpec { x_m: home.x, y_m: home.y, heading_deg: home.heading.to_degrees() };
    spec.start = start;
    let counts = (spec.room.outline_m.len(), spec.walls.len(), spec.landmarks.len() + spec.obstacles.len());
    let instances = counts.0 + 2 * counts.1 + counts.2;
    if instances > MOST_INSTANCES {
        return Err(Error::Unfit {
            what: format!("{}: walls and bodies, inner walls counted twice", settings.source),
            found: instances.to_string(),
            needed: format!("at most {MOST_INSTANCES}; a larger --tolerance-m makes fewer"),
        });
    }
    let cell_m2 = map.resolution_m * map.resolution_m;
    let report = Report {
        columns: map.columns,
        rows: map.rows,
        resolution_m: map.resolution_m,
        free_m2: cells as f64 * cell_m2,
        left_out_m2: (free.count() - cells) as f64 * cell_m2,
        left_out_regions: groups.groups.len() - 1,
        specks,
        outline: counts.0,
        walls: counts.1,
        bodies: counts.2,
        tolerance_m,
        deviation_m,
        home: [spec.home.x_m, spec.home.y_m, spec.home.heading_deg],
        warnings: map.warnings.clone(),
    };
    let toml = format!("{}\n{}", head(&report, settings), spec.to_toml());
    // What a file says is what counts; that it is a world, and that runs can start in it, is seen here and not by whoever opens it.
    let world = World::from_toml(&toml, Path::new(&settings.source))?;
    world.random_start(&mut Seed(settings.seed).stream("start"))?;
    Ok(Imported { spec, toml, report })
}

fn tolerance(map: &Map, settings: &ImportSettings) -> Result<f64> {
    let tolerance_m = settings.tolerance_m.unwrap_or_else(|| map.resolution_m.max(USUAL_TOLERANCE_M));
    if (0.0..=GREATEST_TOLERANCE_M.max(map.resolution_m)).contains(&tolerance_m) {
        return Ok(tolerance_m);
    }
    let allowed = format!("0 to {} m", GREATEST_TOLERANCE_M.max(map.resolution_m));
    Err(Error::Invalid { what: "tolerance".to_owned(), found: tolerance_m.to_string(), allowed })
}

/// Asks that the whole map lies where a world may be.
fn check_extent(map: &Map, settings: &ImportSettings) -> Result<()> {
    let size = Vector2::new(map.columns as f64, map.rows as f64) * map.resolution_m;
    let corners = [(0.0, 0.0), (size.x, 0.0), (size.x, size.y), (0.0, size.y)];
    let farthest = corners.map(|(x, y)| map.origin.transform(Vector2::new(x, y)).abs().max()).into_iter().fold(0.0, f64::max);
    if farthest <= GREATEST_M {
        return Ok(());
    }
    Err(Error::Unfit {
        what: format!("{}: origin, resolution and size", settings.source),
        found: format!("a corner at {farthest:.0} m"),
        needed: format!("a map within {GREATEST_M} m of its origin"),
    })
}

/// The group of free cells that holds home.
fn choose(map: &Map, groups: &Groups, settings: &ImportSettings) -> Result<u32> {
    if let Some(home) = settings.home {
        let cell = map.cell_at(home.position());
        let found = match cell {
            None => "outside the map",
            Some(cell) if groups.labels[cell] != NONE => return Ok(groups.labels[cell]),
            Some(cell) if map.is_occupied(cell) => "in an occupied cell",
            Some(_) => "in an unknown cell",
        };
        return Err(home_fault(&home, found, "a place in free space"));
    }
    // The paper goes on outside a drawn building, and is as white.
    let is_inside = |k: &u32| !map.drawn || !groups.groups[*k as usize].at_border;
    let size = |k: &u32| groups.groups[*k as usize].cells;
    let all = || 0..groups.groups.len() as u32;
    let largest = all().filter(is_inside).max_by_key(size).or_else(|| all().max_by_key(size));
    largest.ok_or_else(|| Error::Unfit {
        what: format!("{}: free cells", settings.source),
        found: format!("none among {} x {}", map.columns, map.rows),
        needed: "some; look at negate, free_thresh and mode".to_owned(),
    })
}

fn home_fault(home: &Pose, found: &str, allowed: &str) -> Error {
    Error::Invalid {
        what: "home".to_owned(),
        found: format!("({}, {}) m, {found}", home.x, home.y),
        allowed: allowed.to_owned(),
    }
}

/// Home in the map's frame, in millimetres.
fn home(map: &Map, mask: &Mask, clearance: &Clearance, robot: &RobotSpec, settings: &ImportSettings) -> Result<Pose> {
    let free_m = |cell: usize| clearance.at(cell % map.columns, cell / map.columns) * map.resolution_m;
    // From the middle of the cell to the edge of the nearest one that is not free.
    let needed_m = robot.radius_m + 0.5 * map.resolution_m;
    let Some(home) = settings.home else {
        let cells = (0..mask.cells.len()).filter(|cell| mask.cells[*cell]);
        let best = cells.fold(None, |best: Option<usize>, cell| match best {
            Some(other) if free_m(other) >= free_m(cell) => best,
            _ => Some(cell),
        });
        let best = best.unwrap_or(0);
        if free_m(best) < needed_m + SPARE_M {
            return Err(Error::Unfit {
                what: format!("{}: the largest free region", settings.source),
                found: format!(
                    "no place farther than {:.2} m from what is not free",
                    (free_m(best) - 0.5 * map.resolution_m).max(0.0)
                ),
                needed: format!("{} m, so that the robot fits in; is the resolution right?", robot.radius_m + SPARE_M),
            });
        }
        let at = map.middle(best);
        return Ok(Pose { x: tenths(at.x), y: tenths(at.y), heading: 0.0 });
    };
    let cell = map.cell_at(home.position()).unwrap_or(0);
    if free_m(cell) < needed_m {
        let found = format!("about {:.2} m from what is not free", (free_m(cell) - 0.5 * map.resolution_m).max(0.0));
        return Err(home_fault(&home, &found, &format!("a place with {} m around it, the robot's radius", robot.radius_m)));
    }
    Ok(home)
}

/// Where runs start: places in sight of home that the robot reaches straight. `None` where there are none.
fn start(map: &Map, clearance: &Clearance, outer: &Shape, frame: &Frame, home: Pose, robot: &RobotSpec) -> Option<StartSpec> {
    let needed = (robot.radius_m + SPARE_M) / map.resolution_m + 1.0;
    let is_wide =
        |p: Vector2<f64>| map.cell_at(p).is_some_and(|cell| clearance.at(cell % map.columns, cell / map.columns) >= needed);
    let at = home.position();
    let towards = |k: usize| direction(std::f64::consts::TAU * k as f64 / RAYS as f64);
    let step_m = 0.5 * map.resolution_m.min(0.1);
    let mut reach_m: Vec<f64> = (0..RAYS)
        .map(|k| {
            let steps = (1..).take_while(|n| {
                f64::from(*n) * step_m <= FARTHEST_START_M && is_wide(at + towards(k) * (f64::from(*n) * step_m))
            });
            (steps.count() as f64 * step_m).max(0.5 * robot.radius_m)
        })
        .collect();
    // No side of the region leaves the room, where a corner of it juts in between two directions.
    let room = Boundary::new(&outer.corners.iter().map(|c| Vector2::from(frame.place(*c))).collect::<Vec<_>>());
    for _ in 0..40 {
        let corner = |k: usize| at + towards(k % RAYS) * reach_m[k % RAYS];
        let leaves: Vec<usize> = (0..RAYS).filter(|&k| !room.contains_segment(corner(k), corner(k + 1), 0.0)).collect();
        if leaves.is_empty() {
            break;
        }
        for k in leaves {
            let longer = if reach_m[k] > reach_m[(k + 1) % RAYS] { k } else { (k + 1) % RAYS };
            reach_m[longer] *= 0.8;
        }
    }
    let farthest_m = reach_m.iter().fold(0.0_f64, |a, b| a.max(*b));
    let max_distance_m = (100.0 * farthest_m).floor() / 100.0;
    let min_distance_m = NEAREST_START_M.min((50.0 * farthest_m).floor() / 100.0);
    if min_distance_m < 2.0 * robot.radius_m {
        return None;
    }
    let region_m = (0..RAYS).map(|k| at + towards(k) * reach_m[k]).map(|p| [tenths(p.x), tenths(p.y)]).collect();
    Some(StartSpec { region_m: Some(region_m), min_distance_m, max_distance_m, ..StartSpec::default() })
}

/// The world without home and starts: its shapes, and looks drawn by the seed.
fn furnish(outer: &Shape, solids: &[Solid], frame: &Frame, settings: &ImportSettings) -> WorldSpec {
    let seed = Seed(settings.seed).derive("world/import");
    let mut looks = Looks::new(seed, RICHNESS, 0.0);
    let mut dice = Dice::new(seed, "bodies");
    let outline_m: Vec<[f64; 2]> = outer.corners.iter().map(|c| frame.place(*c)).collect();
    let lengths: Vec<f64> = edges(&outer.corners).map(|(a, b)| (b - a).norm() * frame.part_m()).collect();
    let walls_of_room = looks.walls(&lengths, Tone::Paint, RICH);
    let (low, high) = crate::world::polygon::bounds(&outer.corners);
    let longest_m = (high - low).max() * frame.part_m();
    let floor = looks.ground(longest_m, FLOORS, 0.5);
    let ceiling = looks.ground(longest_m, &[(Plain, Tone::Paint), (Tiles, Tone::Paint), (Noise, Tone::Paint)], 0.2);
    let wall = |s: &Segment, texture: TextureSpec| WallSpec {
        thickness_m: s.thickness_m,
        texture: Some(texture),
        ..WallSpec::new(s.from_m, s.to_m)
    };
    let length_m = |s: &Segment| WallSpec::new(s.from_m, s.to_m).length_m();
    let (mut walls, mut landmarks, mut obstacles) = (Vec::new(), Vec::new(), Vec::new());
    for solid in solids {
        match solid {
            Solid::Wall(segment) => {
                let texture = looks.walls(&[length_m(segment)], Tone::Pastel, RICH).remove(0);
                walls.push(wall(segment, texture));
            }
            Solid::Block { sides, core, .. } => {
                let lengths: Vec<f64> = sides.iter().map(length_m).collect();
                let textures = looks.walls(&lengths, Tone::Pastel, RICH);
                walls.extend(sides.iter().zip(textures).map(|(s, texture)| wall(s, texture)));
                walls.extend(core.iter().map(|s| wall(s, TextureSpec::new(Plain, [128; 3]))));
            }
            Solid::Body(Standing { shape, position_m, heading_deg }) => {
                let across_m = match shape {
                    ShapeSpec::Disc { radius_m } => 2.0 * radius_m,
                    ShapeSpec::Box { size_m } => size_m[0],
                    ShapeSpec::Polygon { corners_m } => {
                        2.0 * corners_m.iter().map(|[x, y]| libm::hypot(*x, *y)).fold(0.0, f64::max)
                    }
                };
                let &(family, tone) = dice.pick(BODIES);
                let list = if across_m <= LANDMARK_M { &mut landmarks } else { &mut obstacles };
                let sort = if across_m <= LANDMARK_M { "post" } else { "block" };
                list.push(BodySpec {
                    name: format!("{sort} {}", list.len() + 1),
                    shape: shape.clone(),
                    position_m: *position_m,
                    heading_deg: *heading_deg,
                    height_m: settings.height_m,
                    elevation_m: 0.0,
                    texture: looks.thing("body", family, tone, 4.0 * across_m),
                    glow: 0.0,
                    motion: None,
                });
            }
        }
    }
    WorldSpec {
        name: settings.name.clone(),
        description: String::new(),
        seed: dice.texture_seed(),
        room: RoomSpec { outline_m, height_m: settings.height_m, walls: walls_of_room, floor, ceiling },
        walls,
        floor: FloorSpec::default(),
        light: LightSpec::default(),
        landmarks,
        obstacles,
        robot: RobotSpec::default(),
        camera: CameraSpec::default(),
        home: PoseSpec { x_m: 0.0, y_m: 0.0, heading_deg: 0.0 },
        start: StartSpec::default(),
        task: TaskSpec::default(),
        disturbances: Vec::new(),
    }
}

/// The comments at the head of the file.
fn head(report: &Report, settings: &ImportSettings) -> String {
    let Report { columns, rows, resolution_m, free_m2, left_out_m2, left_out_regions, .. } = report;
    let mut text = format!("# Made by `{}`.\n#\n", settings.command);
    let _ = writeln!(text, "# Map: {columns} x {rows} cells of {resolution_m} m. Poses here are those of the map's frame.");
    let _ = writeln!(
        text,
        "# Free: {free_m2:.1} m^2 that hang together with home; left out: {left_out_m2:.1} m^2 in {left_out_regions} other regions."
    );
    if report.specks > 0 {
        let _ = writeln!(text, "# Taken for free: {} specks of the unknown in free space.", report.specks);
    }
    let _ = writeln!(
        text,
        "# Borders: at most {:.3} m from those of the cells, {} m being allowed. Heights are not in a map.",
        report.deviation_m, report.tolerance_m
    );
    for warning in &report.warnings {
        let _ = writeln!(text, "# Warning: {warning}.");
    }
    text
}
