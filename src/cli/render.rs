//! `wayhome render`: panoramas of a pose or along a way, contact sheets, and how fast all that is.

use std::path::{Path, PathBuf};

use anyhow::Result;
use rayon::prelude::*;
use serde::Serialize;
use wayhome::Error;
use wayhome::dataset::film::{self, Frame};
use wayhome::draw::image::{colours_png, instance_png, range_png};
use wayhome::draw::sheet::Sheet;
use wayhome::geometry::{Pose, Twist};
use wayhome::panorama::{Panorama, Projection};
use wayhome::random::Seed;
use wayhome::render::{self, Camera, Renderer, RendererChoice, RendererInfo, Scene, View};
use wayhome::storage::{free_memory, json};
use wayhome::world::{CameraPreset, LightPreset, OpticsSpec, World};

use super::changes::ChangeArgs;
use super::context::{Context, Verdict, open_folder};
use super::setup::LookArgs;
use super::values::{choice, pose, size};

/// Arguments of `render`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("what").args(["pose", "trajectory", "sheet", "bench"]).multiple(true).required(true))]
pub struct RenderArgs {
    /// World file, or the name of a built-in world
    #[arg(required_unless_present = "bench")]
    pub world: Option<String>,
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// Pose of the robot that carries the camera
    #[arg(long, value_name = "x,y,heading_deg", allow_hyphen_values = true, value_parser = pose)]
    pub pose: Option<Pose>,
    /// A panorama for each row of a table that begins with t_s,x_m,y_m,heading_rad, such as the trajectory.csv of `home`; the
    /// robot stands still in each, and bodies stand where the world has them
    #[arg(long, value_name = "FILE.csv", conflicts_with = "pose")]
    pub trajectory: Option<PathBuf>,
    /// One picture of several poses, each with range and instances in false colours: of the pose or some along the trajectory,
    /// without those of home and places where a run may start
    #[arg(long)]
    pub sheet: bool,
    /// Time the renderers of this machine: panoramas a second by size, instruction set and threads, beside the filling of memory
    #[arg(long, conflicts_with_all = ["world", "changes", "home", "pose", "trajectory", "sheet", "light", "camera", "seed", "size", "renderer", "out"])]
    pub bench: bool,
    #[command(flatten)]
    pub look: LookArgs,
    /// Seed of the camera's noise, and of the places on a sheet
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Columns and rows of the panorama, 16x8 to 16384x4096 [default: the world's; on a sheet 720x90]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice::<RendererChoice>())]
    pub renderer: RendererChoice,
    /// Folder for the results [default: results/runs/render-WORLD, with -trajectory or -sheet]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

pub fn run(args: &RenderArgs, context: &Context) -> Result<Verdict> {
    if args.bench {
        return super::verify::render_bench(context);
    }
    // Clap asks for a world and for something to render where there is no `--bench`.
    let world = args.changes.open(args.world.as_deref().unwrap_or_default())?;
    match (&args.pose, &args.trajectory) {
        (pose, path) if args.sheet => sheet(args, context, &world, *pose, path.as_deref())?,
        (_, Some(path)) => film(args, context, &world, path)?,
        (pose, None) => still(args, context, &world, pose.unwrap_or(world.home))?,
    }
    Ok(Verdict::Done)
}

/// What pictures depend on beside their poses.
struct Take {
    projection: Projection,
    scene: Scene,
    optics: OpticsSpec,
    renderer: Box<dyn Renderer>,
}

impl Take {
    /// `pictures` of them will be in memory at once.
    fn new(args: &RenderArgs, world: &World, projection: Projection, pictures: usize) -> Result<Self> {
        check_memory(&projection, pictures)?;
        let look = args.look.look();
        let scene = look.scene(&Scene::new(world)?, world);
        Ok(Self { projection, scene, optics: look.optics(world), renderer: render::create(args.renderer)? })
    }

    /// Takes one picture with a camera at rest.
    fn shoot(&mut self, camera: &mut Camera, world: &World, robot: Pose, seed: u64, out: &mut Panorama) -> Result<()> {
        let view = View { projection: self.projection, robot, bodies: &world.body_poses() };
        Ok(camera.take(self.renderer.as_mut(), &self.scene, &view, Twist::default(), Seed(seed), out)?)
    }
}

/// Size and projection that the arguments ask for.
fn projection(args: &RenderArgs, world: &World) -> Projection {
    args.size.map_or_else(|| world.projection(), |(width, height)| world.projection_of_size(width, height))
}

/// `meta.json`: what it takes to read the pictures, of one pose or of several frames.
#[derive(Serialize)]
struct Meta<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<Pose>,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<Vec<FrameRecord>>,
}

/// A frame of several; its number is that in the files' names.
#[derive(Serialize)]
struct FrameRecord {
    number: usize,
    t_s: f64,
    pose: Pose,
}

/// What an instance id stands for.
#[derive(Serialize)]
struct Instance {
    id: u16,
    name: String,
}

impl<'a> Meta<'a> {
    fn new(args: &RenderArgs, world: &'a World, take: &'a Take) -> Self {
        let look = args.look.look();
        Self {
            pose: None,
            projection: take.projection,
            camera_height_m: world.spec.camera.height_m,
            range_unit: "mm; 65535 stands for all that is farther",
            light: look.light(world),
            camera: look.camera(world),
            optics: &take.optics,
            seed: args.seed,
            instances: world.instances().into_iter().map(|(id, name)| Instance { id, name }).collect(),
            renderer: take.renderer.info(),
            world: &world.spec.name,
            world_sha256: &world.sha256,
            version: wayhome::VERSION,
            frames: None,
        }
    }
}

/// Bytes that a pixel takes at most: in the panorama, as a picture to encode, and as the file's bytes.
const PIXEL_BYTES: u64 = 24;

/// Refuses pictures that the memory that is free does not hold; the system would end the process half-way.
fn check_memory(projection: &Projection, pictures: usize) -> Result<(), Error> {
    let needed = PIXEL_BYTES * projection.pixels() as u64 * pictures as u64;
    match free_memory() {
        Some(free) if needed > free => Err(Error::Lacking {
            what: "panorama size".into(),
            found: format!("{} x {}, which takes up to {} MB", projection.width, projection.height, needed / 1_000_000),
            needed: format!("what the {} MB of free memory hold", free / 1_000_000),
        }),
        _ => Ok(()),
    }
}

/// One panorama.
fn still(args: &RenderArgs, context: &Context, world: &World, pose: Pose) -> Result<()> {
    check_place(world, &pose)?;
    let mut take = Take::new(args, world, projection(args, world), 1)?;
    let (out, mut folder) = open_folder(args.out.as_deref(), &["render", &world.spec.name], "render")?;
    let mut panorama = Panorama::empty();
    take.shoot(&mut Camera::new(take.optics), world, pose, args.seed, &mut panorama)?;
    for (name, bytes) in encode(&panorama, "")? {
        folder.write(&name, &bytes)?;
    }
    let meta = Meta { pose: Some(pose), ..Meta::new(args, world, &take) };
    folder.write("meta.json", json(&meta).as_bytes())?;
    folder.finish()?;
    let what = format!("panorama from ({:.3}, {:.3}) m", pose.x, pose.y);
    context.print_made(&meta, &out, || told(&take, &what, &out))
}

/// A panorama for each row of a table.
fn film(args: &RenderArgs, context: &Context, world: &World, path: &Path) -> Result<()> {
    let frames = checked(world, path)?;
    let projection = projection(args, world);
    let mut take = Take::new(args, world, projection, render::most_in_memory(projection).min(frames.len()))?;
    let parts = ["render", &world.spec.name, "trajectory"];
    let (out, mut folder) = open_folder(args.out.as_deref(), &parts, "render --trajectory")?;
    let bodies = world.body_poses();
    let views: Vec<_> = frames.iter().map(|f| View { projection, robot: f.robot, bodies: &bodies }).collect();
    let camera = Camera::new(take.optics);
    // Takes the picture that the renderer made, and makes its files.
    let develop = |number: usize, panorama: &mut Panorama| {
        camera.clone().develop(panorama, Seed(args.seed).derive(&format!("frame {number}")));
        encode(panorama, &format!("-{number:06}"))
    };
    let bar = context.progress(Some(frames.len() as u64))?;
    take.renderer.render_batch(&take.scene, &views, &mut |first, panoramas| {
        bar.go_on()?;
        let numbered = panoramas.par_iter_mut().enumerate();
        let files: Vec<_> = numbered.map(|(k, panorama)| develop(first + k, panorama)).collect::<Result<_, _>>()?;
        for (name, bytes) in files.iter().flatten() {
            folder.write(name, bytes)?;
        }
        bar.inc(panoramas.len() as u64);
        Ok(())
    })?;
    drop(bar);
    let record = |(number, f): (usize, &Frame)| FrameRecord { number, t_s: f.time_s, pose: f.robot };
    let meta = Meta { frames: Some(frames.iter().enumerate().map(record).collect()), ..Meta::new(args, world, &take) };
    folder.write("meta.json", json(&meta).as_bytes())?;
    folder.finish()?;
    context.print_made(&meta, &out, || told(&take, &format!("panoramas, {} of them,", frames.len()), &out))
}

/// Several panoramas in one picture.
fn sheet(args: &RenderArgs, context: &Context, world: &World, pose: Option<Pose>, way: Option<&Path>) -> Result<()> {
    /// What `--json` prints.
    #[derive(Serialize)]
    struct Shown {
        poses: Vec<Pose>,
    }
    /// Pictures on a sheet.
    const PICTURES: usize = 6;
    /// Size of a picture without `--size`.
    const SIZE: (u32, u32) = (720, 90);
    let poses = match (pose, way) {
        (Some(pose), _) => {
            check_place(world, &pose)?;
            vec![pose]
        }
        (None, Some(path)) => film::pick(&checked(world, path)?, PICTURES).iter().map(|f| f.robot).collect(),
        (None, None) => film::poses(world, PICTURES, Seed(args.seed))?,
    };
    let (width, height) = args.size.unwrap_or(SIZE);
    let mut take = Take::new(args, world, world.projection_of_size(width, height), poses.len())?;
    let parts = ["render", &world.spec.name, "sheet"];
    let (out, mut folder) = open_folder(args.out.as_deref(), &parts, "render --sheet")?;
    let (mut sheet, mut panorama, mut camera) = (Sheet::new(), Panorama::empty(), Camera::new(take.optics));
    for robot in &poses {
        take.shoot(&mut camera, world, *robot, args.seed, &mut panorama)?;
        sheet.add(&panorama);
    }
    folder.write("sheet.png", &sheet.png("sheet.png")?)?;
    folder.finish()?;
    let shown = Shown { poses };
    context.print_made(&shown, &out, || format!("{} panoramas on {}\n", shown.poses.len(), out.join("sheet.png").display()))
}

/// The frames of a way on which the camera never is outside the room or in a body.
fn checked(world: &World, path: &Path) -> Result<Vec<Frame>, Error> {
    let frames = film::load(path)?;
    for (k, frame) in frames.iter().enumerate() {
        world.camera_is_free(&frame.robot).map_err(|reason| {
            let message = format!("frame {k}: found {}, expected {PLACES}", place(&frame.robot, &reason));
            Error::Parse { path: path.to_owned(), message }
        })?;
    }
    Ok(frames)
}

/// Where a camera may be.
const PLACES: &str = "a place in the room and outside its bodies";

/// The camera must be in the room and in no body; the robot's own size does not matter for a picture.
fn check_place(world: &World, pose: &Pose) -> Result<(), Error> {
    let refuse = |reason: String| Error::Invalid { what: "--pose".into(), found: place(pose, &reason), allowed: PLACES.into() };
    world.camera_is_free(pose).map_err(refuse)
}

fn place(pose: &Pose, reason: &str) -> String {
    format!("({}, {}) m, {reason}", pose.x, pose.y)
}

/// The files of a panorama: names, with `number` before the ending, and bytes.
fn encode(panorama: &Panorama, number: &str) -> Result<[(String, Vec<u8>); 3], Error> {
    let [rgb, range, instance] = ["rgb", "range", "instance"].map(|channel| format!("{channel}{number}.png"));
    let bytes = (colours_png(panorama, &rgb)?, range_png(panorama, &range)?, instance_png(panorama, &instance)?);
    Ok([(rgb, bytes.0), (range, bytes.1), (instance, bytes.2)])
}

/// What was made, for a person.
fn told(take: &Take, what: &str, out: &Path) -> String {
    let (p, info) = (take.projection, take.renderer.info());
    format!("{} x {} {what} on {} ({})\nfiles in {}\n", p.width, p.height, info.kind, info.adapter, out.display())
}
