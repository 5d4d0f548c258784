//! What a set will hold: places, headings, conditions, and the parts that the work is cut into.

use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

use rand::RngExt;

use super::conditions::{Condition, Staged};
use crate::dataset::film;
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, angle_of, wrap};
use crate::panorama::Projection;
use crate::panorama_set::{
    ConditionDocument, Document, Frame, GridDocument, Instance, LayoutKind, MOST_PLACES, Place, WorldDocument, WorldRef,
};
use crate::random::{Seed, Stream};
use crate::render::RendererInfo;
use crate::storage::sha256;
use crate::world::World;
use crate::world::polygon::{bounds, contains_within};

/// Most frames of a part. A part is the unit of work: it is whole or not there, and a shard takes whole parts.
pub const PART_FRAMES: usize = 64;
/// Most beginnings of a grid that are tried along each axis.
const MOST_BEGINS: usize = 40;
/// Tries for each random place before the room is called too crowded.
const TRIES: usize = 1000;
/// Home lies on a place of the grid if it is as near as this, m.
const ON_PLACE_M: f64 = 1e-6;

/// Where panoramas are taken.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// An even grid.
    Grid {
        /// Places along x.
        columns: usize,
        /// Places along y.
        rows: usize,
        /// Distance between neighbours, m.
        spacing_m: f64,
        /// Place with the least x and y, m; by default the grid lies about the middle of the room with home on a place.
        origin_m: Option<[f64; 2]>,
    },
    /// The points of a table with columns `x_m`, `y_m` and, perhaps, `heading_deg` or `heading_rad`.
    Route(PathBuf),
    /// So many random places where the robot can stand.
    Random(usize),
    /// The poses of a run: its folder, or its `trajectory.csv`.
    Trajectory(PathBuf),
}

/// Which way the robot looks.
#[derive(Debug, Clone, PartialEq)]
pub enum Headings {
    /// As the places say; else as at home, and along the way on a route without headings.
    Own,
    /// Each of these at every place, rad.
    Fixed(Vec<f64>),
    /// So many random ones at every place.
    Random(usize),
}

/// What a set is asked to be.
#[derive(Debug, Clone)]
pub struct Request {
    /// Where.
    pub places: Places,
    /// Which way.
    pub headings: Headings,
    /// Under which conditions, at least one.
    pub conditions: Vec<Condition>,
    /// Columns and rows where they differ from the world's.
    pub size_px: Option<(u32, u32)>,
    /// How files are named.
    pub layout: LayoutKind,
    /// Seed of all that is random.
    pub seed: u64,
    /// SPDX identifier.
    pub licence: String,
    /// The command, as far as the set's bytes depend on it.
    pub command: String,
}

/// A pose of the set, the same in all conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spot {
    place: Option<Place>,
    robot: Pose,
    time_s: Option<f64>,
}

/// A condition with the poses that can be taken in it.
#[derive(Debug, Clone)]
pub struct Stage {
    /// The world under the condition.
    pub staged: Staged,
    /// Numbers of the poses that are taken.
    kept: Vec<usize>,
    /// Numbers of those that are not, and what is in the way.
    left_out: Vec<(usize, String)>,
}

/// A unit of work: some frames of one condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number in the set.
    pub number: usize,
    /// Number of its condition.
    pub stage: usize,
    /// First of the condition's frames.
    pub first: usize,
    /// How many.
    pub count: usize,
}

/// Where a world's frames are among those of a set of several worlds.
#[derive(Debug, Clone, Default)]
pub(super) struct Numbering {
    /// The world, in a set of several.
    pub world: Option<WorldRef>,
    /// Number of its first spot.
    pub first_spot: usize,
    /// Spots of the whole set.
    pub all_spots: usize,
    /// Number of its first part.
    pub first_part: usize,
}

/// All of a set before any of it is rendered: of a set of several worlds all of one world.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The world as its file has it.
    pub world: World,
    /// Conditions.
    pub stages: Vec<Stage>,
    /// Parts, in order.
    pub parts: Vec<Part>,
    /// Projection of the panoramas.
    pub projection: Projection,
    request: Request,
    spots: Vec<Spot>,
    grid: Option<GridDocument>,
    numbering: Numbering,
}

impl Plan {
    /// Lays a set out: finds the poses, stages the conditions, leaves out where the robot cannot stand.
    ///
    /// # Errors
    /// When the places do not fit the room, a table cannot be read, the layout cannot hold them, or nothing is left to take.
    pub fn new(world: &World, request: Request) -> Result<Self> {
        Self::numbered(world, request, None)
    }

    /// The same for a world of a set of several. Its random places are free under all conditions, so that their number is known.
    pub(super) fn numbered(world: &World, request: Request, numbering: Option<Numbering>) -> Result<Self> {
        let seed = Seed(request.seed);
        let all_staged = || request.conditions.iter().map(|condition| condition.stage(world, seed));
        let conditions = numbering.as_ref().map(|_| all_staged().collect::<Result<Vec<_>>>()).transpose()?;
        let name = numbering.as_ref().and_then(|n| n.world.as_ref()).map(|w| w.world.as_str());
        let (spots, grid) = spots(world, conditions.as_deref().unwrap_or_default(), name, &request)?;
        check_layout(&request, grid.as_ref())?;
        let projection = request.layout.layout().projection(
            request.size_px.map_or_else(|| world.projection(), |(width, height)| world.projection_of_size(width, height)),
        );
        let mut names: Vec<String> = request.conditions.iter().map(Condition::name).collect();
        names.sort();
        if let Some(twice) = names.windows(2).find(|w| w[0] == w[1]) {
            return Err(invalid("--conditions", format!("`{}` twice", twice[0]), "each condition once"));
        }
        let mut stages = Vec::new();
        for staged in conditions.map_or_else(|| all_staged().collect::<Result<Vec<_>>>(), Ok)? {
            let bodies = staged.world.body_poses();
            let (mut kept, mut left_out) = (Vec::new(), Vec::new());
            for (k, spot) in spots.iter().enumerate() {
                match staged.world.is_free(&spot.robot, 0.0, &bodies) {
                    Ok(()) => kept.push(k),
                    Err(what) => left_out.push((k, what)),
                }
            }
            stages.push(Stage { staged, kept, left_out });
        }
        let numbering = numbering.unwrap_or_else(|| Numbering { all_spots: spots.len(), ..Numbering::default() });
        let mut parts = Vec::new();
        for (stage, Stage { kept, .. }) in stages.iter().enumerate() {
            for first in (0..kept.len()).step_by(PART_FRAMES) {
                let count = PART_FRAMES.min(kept.len() - first);
                parts.push(Part { number: numbering.first_part + parts.len(), stage, first, count });
            }
        }
        if parts.is_empty() {
            let what = stages.first().and_then(|s| s.left_out.first()).map_or("", |(_, what)| what.as_str());
            let found = format!("{} poses, and the robot can stand at none of them (`{what}` is in the way)", spots.len());
            let (what, needed) = ("poses of the set".to_owned(), "poses in the room and outside its bodies".to_owned());
            return Err(match request.places {
                Places::Route(_) | Places::Trajectory(_) => Error::Unfit { what, found, needed },
                Places::Grid { .. } | Places::Random(_) => Error::Invalid { what, found, allowed: needed },
            });
        }
        Ok(Self { world: world.clone(), stages, parts, projection, request, spots, grid, numbering })
    }

    /// What was asked for.
    pub fn request(&self) -> &Request {
        &self.request
    }

    /// Frames in all.
    pub fn frames(&self) -> usize {
        self.stages.iter().map(|s| s.kept.len()).sum()
    }

    /// Poses left out, in all conditions.
    pub fn left_out(&self) -> usize {
        self.stages.iter().map(|s| s.left_out.len()).sum()
    }

    /// The frames of a part.
    pub fn part_frames(&self, part: Part) -> impl Iterator<Item = Frame> + '_ {
        self.stage_frames(part.stage).skip(part.first).take(part.count)
    }

    /// The frames of a condition.
    pub fn stage_frames(&self, stage: usize) -> impl Iterator<Item = Frame> + '_ {
        let (condition, kept) = (self.stages[stage].staged.condition.name(), &self.stages[stage].kept);
        kept.iter().map(move |&k| {
            let Spot { place, robot, time_s } = self.spots[k];
            let Numbering { world, first_spot, all_spots, .. } = &self.numbering;
            let (spot, world) = (first_spot + k, world.clone());
            Frame { number: stage * all_spots + spot, spot, condition: condition.clone(), place, robot, time_s, world }
        })
    }

    /// The poses that were left out, as a table.
    pub fn left_out_csv(&self) -> String {
        use std::fmt::Write;
        let mut text = "condition,spot,row,column,x_m,y_m,heading_rad,in_the_way\n".to_owned();
        for stage in &self.stages {
            for (k, what) in &stage.left_out {
                let Spot { place, robot: p, .. } = self.spots[*k];
                let [i, j] = place.map_or([const { String::new() }; 2], |p| [p.i.to_string(), p.j.to_string()]);
                let what = what.replace('"', "\"\"");
                let name = stage.staged.condition.name();
                let _ = writeln!(text, "{name},{k},{i},{j},{},{},{},\"{what}\"", p.x, p.y, p.heading);
            }
        }
        text
    }

    /// What the set is, for its `dataset.json`.
    pub fn document(&self, renderer: &RendererInfo) -> Document {
        let (world, request) = (&self.world, &self.request);
        let heading_rad = self.spots.first().map(|s| s.robot.heading);
        let heading_rad = heading_rad.filter(|h| self.spots.iter().all(|s| s.robot.heading == *h));
        let conditions = self.stages.iter().map(|stage| ConditionDocument {
            name: stage.staged.condition.name(),
            given: stage.staged.condition.given().to_owned(),
            description: stage.staged.description.clone(),
            world_sha256: stage.staged.world.sha256.clone(),
            frames: stage.kept.len(),
            left_out: stage.left_out.len(),
        });
        Document {
            format: "wayhome-dataset/1".into(),
            layout: request.layout.name().into(),
            command: request.command.clone(),
            version: crate::VERSION.into(),
            seed: request.seed,
            licence: request.licence.clone(),
            world: world.spec.name.clone(),
            world_sha256: world.sha256.clone(),
            renderer: match renderer.kind.as_str() {
                // The bytes of the CPU renderer do not depend on the processor.
                "cpu" => "cpu".into(),
                kind => format!("{kind}: {}, {}", renderer.adapter, renderer.driver),
            },
            projection: self.projection,
            columns: if request.layout.layout().is_clockwise() { "clockwise" } else { "anticlockwise" }.into(),
            camera_height_m: world.spec.camera.height_m,
            range_unit: "mm; 65535 stands for all that is farther".into(),
            home: world.home.into(),
            poses_sha256: sha256(&self.spots.iter().flat_map(pose_bytes).collect::<Vec<u8>>()),
            heading_rad,
            grid: self.grid.clone(),
            instances: self.instances(),
            conditions: conditions.collect(),
            frames: self.frames(),
            parts: self.parts.len(),
            frames_per_part: PART_FRAMES,
            series: None,
        }
    }

    fn instances(&self) -> Vec<Instance> {
        let landmark = |id: u16| self.world.landmarks().iter().any(|b| b.instance == id);
        self.world.instances().into_iter().map(|(id, name)| Instance { id, name, landmark: landmark(id) }).collect()
    }

    /// What the world of this plan is, in a set of several.
    #[must_use]
    pub fn world_document(&self) -> Option<WorldDocument> {
        Some(WorldDocument {
            named: self.numbering.world.clone()?,
            sha256: self.world.sha256.clone(),
            first_spot: self.numbering.first_spot,
            spots: self.spots.len(),
            camera_height_m: self.world.spec.camera.height_m,
            home: self.world.home.into(),
            instances: self.instances(),
        })
    }
}

fn pose_bytes(spot: &Spot) -> impl Iterator<Item = u8> + use<> {
    let Pose { x, y, heading } = spot.robot;
    [x, y, heading, spot.time_s.unwrap_or(f64::NAN)].into_iter().flat_map(f64::to_le_bytes)
}

pub(super) fn invalid(what: &str, found: impl Into<String>, allowed: impl Into<String>) -> Error {
    Error::Invalid { what: what.into(), found: found.into(), allowed: allowed.into() }
}

/// Refuses what a layout cannot hold.
fn check_layout(request: &Request, grid: Option<&GridDocument>) -> Result<()> {
    let kind = request.layout;
    if !kind.layout().is_written() {
        let written: Vec<&str> = LayoutKind::written().map(LayoutKind::name).collect();
        return Err(invalid("--layout", kind.name(), format!("a layout that is written: {}", written.join(", "))));
    }
    let one_heading = match &request.headings {
        Headings::Own => true,
        Headings::Fixed(headings) => headings.len() == 1,
        Headings::Random(_) => false,
    };
    match kind.layout().refuses(grid, one_heading) {
        Some((found, allowed)) => Err(invalid(&format!("poses for layout {}", kind.name()), found, allowed)),
        None => Ok(()),
    }
}

/// The poses of a set, and the grid that they are on. Random places are free in the world and under all of the conditions given; the
/// name tells the draws of one world from those of another.
fn spots(world: &World, staged: &[Staged], name: Option<&str>, request: &Request) -> Result<(Vec<Spot>, Option<GridDocument>)> {
    let seed = name.map_or(Seed(request.seed), |name| Seed(request.seed).derive(&format!("dataset of {name}")));
    let mut grid = None;
    let (mut own, mut places): (bool, Vec<Spot>) = (true, Vec::new());
    match &request.places {
        Places::Grid { columns, rows, spacing_m, origin_m } => {
            let laid = lay_grid(world, (*columns, *rows), *spacing_m, *origin_m)?;
            // x fastest, from the least y up.
            let all = (0..*rows).rev().flat_map(|i| (0..*columns).map(move |j| Place { i, j }));
            let spot = |place| Spot { place: Some(place), robot: laid.pose(place, world.home.heading), time_s: None };
            places.extend(all.map(spot));
            grid = Some(laid);
        }
        Places::Route(path) => places = route(path)?,
        Places::Random(count) => {
            if !(1..=MOST_PLACES).contains(count) {
                return Err(invalid("--random", count.to_string(), format!("1 to {MOST_PLACES}")));
            }
            own = false;
            let worlds: Vec<&World> = std::iter::once(world).chain(staged.iter().map(|s| &s.world)).collect();
            places = random_places(&worlds, *count, &mut seed.stream("dataset/places"))?;
        }
        Places::Trajectory(path) => {
            let file = if path.is_dir() { path.join("trajectory.csv") } else { path.clone() };
            let spot = |frame: film::Frame| Spot { place: None, robot: frame.robot, time_s: Some(frame.time_s) };
            places = film::load(&file)?.into_iter().map(spot).collect();
        }
    }
    let each = match &request.headings {
        Headings::Own => 1,
        Headings::Fixed(headings) => headings.len(),
        Headings::Random(count) => *count,
    };
    if !(1..=MOST_PLACES).contains(&places.len().saturating_mul(each)) {
        let found = format!("{} places with {each} headings", places.len());
        return Err(invalid("poses of the set", found, format!("1 to {MOST_PLACES} poses")));
    }
    let mut turns = seed.stream("dataset/headings");
    let spots = places.into_iter().flat_map(|spot| {
        let headings: Vec<f64> = match &request.headings {
            Headings::Own if own => vec![spot.robot.heading],
            Headings::Own => vec![world.home.heading],
            Headings::Fixed(headings) => headings.iter().map(|h| wrap(*h)).collect(),
            Headings::Random(count) => (0..*count).map(|_| wrap(TAU * turns.random::<f64>() - PI)).collect(),
        };
        headings.into_iter().map(move |heading| Spot { robot: Pose { heading, ..spot.robot }, ..spot })
    });
    Ok((spots.collect(), grid))
}

/// Places where the robot can stand in all of some worlds that have the same outline.
fn random_places(worlds: &[&World], count: usize, stream: &mut Stream) -> Result<Vec<Spot>> {
    let world = worlds[0];
    let (low, high) = bounds(&world.outline);
    let bodies: Vec<Vec<Pose>> = worlds.iter().map(|w| w.body_poses()).collect();
    let mut places = Vec::with_capacity(count);
    let mut tries = 0;
    while places.len() < count {
        if tries > TRIES * (places.len() + 10) {
            let found = format!("{} free places in {tries} tries", places.len());
            let (what, needed) =
                (format!("random places in world {}", world.spec.name), "a room with free places for the robot");
            return Err(Error::Unfit { what, found, needed: needed.into() });
        }
        tries += 1;
        let [u, v] = std::array::from_fn(|_| stream.random::<f64>());
        let robot = Pose::new(low.x + u * (high.x - low.x), low.y + v * (high.y - low.y), 0.0);
        if worlds.iter().zip(&bodies).all(|(world, bodies)| world.is_free(&robot, 0.0, bodies).is_ok()) {
            places.push(Spot { place: None, robot, time_s: None });
        }
    }
    Ok(places)
}

/// Puts a grid into the room.
fn lay_grid(
    world: &World,
    (columns, rows): (usize, usize),
    spacing_m: f64,
    origin_m: Option<[f64; 2]>,
) -> Result<GridDocument> {
    if !(spacing_m > 0.0 && spacing_m.is_finite()) {
        return Err(invalid("--spacing-m", spacing_m.to_string(), "a length greater than 0"));
    }
    if columns == 0 || rows == 0 || columns.saturating_mul(rows) > MOST_PLACES {
        return Err(invalid("--grid", format!("{columns}x{rows}"), format!("1 to {MOST_PLACES} places")));
    }
    let (low, high) = bounds(&world.outline);
    let size = |count: usize| (count - 1) as f64 * spacing_m;
    // Place (i, j) of a grid whose least x and y are `lowest`.
    let at = |lowest: Vector2<f64>, (i, j): (usize, usize)| lowest + Vector2::new(j as f64, (rows - 1 - i) as f64) * spacing_m;
    let inside = |lowest: Vector2<f64>, place| contains_within(&world.outline, at(lowest, place), ON_PLACE_M);
    let places = || (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    let rim = [(0, 0), (0, columns - 1), (rows - 1, 0), (rows - 1, columns - 1)];
    let home = world.home.position();
    // Where the grid may begin along an axis, and how far its middle then is from the room's: with home on a place, those nearest
    // to the middle first; where it fits in no such way, about the middle.
    let axis = |home: f64, low: f64, high: f64, count: usize| -> Vec<(f64, f64)> {
        let centred = 0.5 * (low + high - size(count));
        let fits = |begin: &f64| *begin >= low && begin + size(count) <= high;
        let on_place = (0..count).map(|k| home - k as f64 * spacing_m).filter(fits);
        let mut begins: Vec<(f64, f64)> = on_place.map(|b| ((b - centred).abs(), b)).collect();
        begins.sort_by(|a, b| a.0.total_cmp(&b.0));
        begins.truncate(MOST_BEGINS);
        if begins.is_empty() && fits(&centred) {
            begins.push((0.0, centred));
        }
        begins
    };
    let lowest = origin_m.map(Vector2::from).or_else(|| {
        let (along_x, along_y) = (axis(home.x, low.x, high.x, columns), axis(home.y, low.y, high.y, rows));
        let pair = |(dx, x): &(f64, f64), (dy, y): &(f64, f64)| (dx * dx + dy * dy, Vector2::new(*x, *y));
        let mut begins: Vec<_> = along_x.iter().flat_map(|x| along_y.iter().map(move |y| pair(x, y))).collect();
        begins.sort_by(|a, b| a.0.total_cmp(&b.0));
        // In a room with corners that reach in, the first that is all inside; where none is, the first tells what is not.
        let all_inside = |begin: &Vector2<f64>| rim.into_iter().chain(places()).all(|place| inside(*begin, place));
        begins.iter().map(|(_, begin)| *begin).find(all_inside).or(begins.first().map(|(_, begin)| *begin))
    });
    let fits = |p: &Vector2<f64>| p.x >= low.x && p.y >= low.y && p.x + size(columns) <= high.x && p.y + size(rows) <= high.y;
    let lowest = lowest.filter(fits).ok_or_else(|| {
        let found =
            format!("{columns}x{rows} places {spacing_m} m apart, which take {:.2} x {:.2} m", size(columns), size(rows));
        let room = high - low;
        invalid("--grid", found, format!("what fits into the room of {:.2} x {:.2} m", room.x, room.y))
    })?;
    if let Some(place) = places().find(|&place| !inside(lowest, place)) {
        let (p, n) = (at(lowest, place), columns * rows);
        let found = format!("place {place:?} of {n} at ({:.3}, {:.3}) m, outside the room", p.x, p.y);
        return Err(invalid("--grid", found, "a grid inside the room; --origin moves it"));
    }
    let home = places().find(|&place| (at(lowest, place) - home).norm() < ON_PLACE_M).map(|(i, j)| [i, j]);
    Ok(GridDocument { rows, columns, spacing_m, first_m: at(lowest, (0, 0)).into(), home })
}

/// Reads a route. Without headings the robot looks along the way: to the next point, at the end as before, and on one point alone
/// along x.
fn route(path: &Path) -> Result<Vec<Spot>> {
    let points = film::points(path, &[])?;
    let along = |k: usize| {
        let k = k.min(points.len().saturating_sub(2));
        points.get(k + 1).map_or(0.0, |next| angle_of(next.at - points[k].at))
    };
    let robot = |(k, p): (usize, &film::Point)| Pose::new(p.at.x, p.at.y, p.heading.unwrap_or_else(|| along(k)));
    Ok(points.iter().enumerate().map(robot).map(|robot| Spot { place: None, robot, time_s: None }).collect())
}
