//! `wayhome render`: panoramas of a pose or along a way, contact sheets, and how fast all that is.

mod bench;
mod film;
mod sheet;
mod still;

use anyhow::Result;
use serde::Serialize;
use wayhome::Error;
use wayhome::geometry::Pose;
use wayhome::panorama::Projection;
use wayhome::render::{RendererInfo, Scene};
use wayhome::world::{CameraPreset, Footprint, LightPreset, OpticsSpec, World, polygon};

use super::Verdict;
use super::args::RenderArgs;
use super::context::Context;
pub use bench::measured;

pub fn run(args: &RenderArgs, context: &Context) -> Result<Verdict> {
    if args.bench {
        return bench::run(context);
    }
    // Clap asks for a world where there is no `--bench`.
    let world = World::open(args.world.as_deref().unwrap_or_default())?;
    match (&args.pose, &args.trajectory) {
        (way, path) if args.sheet => sheet::run(args, context, &world, *way, path.as_deref()),
        (_, Some(path)) => film::run(args, context, &world, path),
        (Some(pose), None) => still::run(args, context, &world, *pose),
        (None, None) => Err(Error::Invalid {
            what: "what to render".into(),
            found: "nothing".into(),
            allowed: "--pose, --trajectory, --sheet or --bench".into(),
        }
        .into()),
    }
}

/// What a picture depends on beside its pose.
struct Take {
    projection: Projection,
    scene: Scene,
    optics: OpticsSpec,
}

impl Take {
    /// `pictures` of them will be in memory at once.
    fn new(args: &RenderArgs, world: &World, projection: Projection, pictures: usize) -> Result<Self> {
        check_memory(&projection, pictures)?;
        let look = args.look.look();
        Ok(Self { projection, scene: look.scene(&Scene::new(world)?, world), optics: look.optics(world) })
    }
}

/// Size and projection that the arguments ask for.
fn projection(args: &RenderArgs, world: &World) -> Projection {
    args.size.map_or_else(|| world.projection(), |(width, height)| world.projection_of_size(width, height))
}

/// `meta.json`: what it takes to read the pictures.
#[derive(Serialize)]
struct Meta<'a> {
    projection: Projection,
    camera_height_m: f64,
    light: LightPreset,
    camera: CameraPreset,
    optics: &'a OpticsSpec,
    seed: u64,
    range_unit: &'static str,
    instances: Vec<Instance>,
    renderer: &'a RendererInfo,
    world: &'a str,
    world_sha256: &'a str,
    version: &'static str,
}

/// What an instance id stands for.
#[derive(Serialize)]
struct Instance {
    id: u16,
    name: String,
}

impl<'a> Meta<'a> {
    fn new(args: &RenderArgs, world: &'a World, take: &'a Take, renderer: &'a RendererInfo) -> Self {
        let look = args.look.look();
        Self {
            projection: take.projection,
            camera_height_m: world.spec.camera.height_m,
            range_unit: "mm; 65535 stands for all that is farther",
            light: look.light(world),
            camera: look.camera(world),
            optics: &take.optics,
            seed: args.seed,
            instances: world.instances().into_iter().map(|(id, name)| Instance { id, name }).collect(),
            renderer,
            world: &world.spec.name,
            world_sha256: &world.sha256,
            version: wayhome::VERSION,
        }
    }
}

/// A camera nearer to a wall than this, m, may be in the wall's plane, and such a camera looks past it.
const IN_WALL_M: f64 = 1e-9;

/// The camera must be in the room and in no body; the robot's own size does not matter for a picture. `what` is what the error
/// calls the pose.
fn check_place(world: &World, pose: Pose, what: &str) -> Result<(), Error> {
    let camera = world.camera_pose(&pose).position();
    let refuse = |reason: String| Error::Invalid {
        what: what.into(),
        found: format!("({}, {}) m, {reason}", pose.x, pose.y),
        allowed: "a place in the room and outside its bodies".into(),
    };
    if !polygon::contains(&world.outline, camera) {
        return Err(refuse("outside the room".into()));
    }
    if polygon::distance_to_boundary(&world.outline, camera) < IN_WALL_M {
        return Err(refuse("in a wall of the room".into()));
    }
    let height_m = world.spec.camera.height_m;
    let within = world.bodies.iter().filter(|b| b.bottom_m <= height_m && height_m <= b.top_m).find(|body| {
        let point = body.pose.inverse_transform(camera);
        match &body.footprint {
            Footprint::Disc(radius_m) => point.norm() <= *radius_m,
            Footprint::Polygon(corners) => polygon::contains(corners, point),
        }
    });
    within.map_or(Ok(()), |body| Err(refuse(format!("inside `{}`", body.name))))
}

/// Bytes that a pixel takes at most: in the panorama, as a picture to encode, and as the file's bytes.
const PIXEL_BYTES: u64 = 24;

/// Refuses pictures that the memory that is free does not hold; the system would end the process half-way.
fn check_memory(projection: &Projection, pictures: usize) -> Result<(), Error> {
    let needed = PIXEL_BYTES * projection.pixels() as u64 * pictures as u64;
    match free_memory() {
        Some(free) if needed > free => Err(Error::Invalid {
            what: "panorama size".into(),
            found: format!("{} x {}, which takes up to {} MB", projection.width, projection.height, needed / 1_000_000),
            allowed: format!("what the {} MB of free memory hold", free / 1_000_000),
        }),
        _ => Ok(()),
    }
}

/// Bytes of memory that are free, where the system tells.
fn free_memory() -> Option<u64> {
    let known = std::fs::read_to_string("/proc/meminfo").ok()?;
    let kilobytes = known.lines().find_map(|l| l.strip_prefix("MemAvailable:")?.trim().strip_suffix("kB"))?;
    Some(1024 * kilobytes.trim().parse::<u64>().ok()?)
}
