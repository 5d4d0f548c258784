//! `wayhome render`: one panorama.

use anyhow::Result;
use serde::Serialize;
use wayhome::Error;
use wayhome::episode::PoseRecord;
use wayhome::geometry::{Pose, Twist};
use wayhome::panorama::{Panorama, Projection};
use wayhome::random::Seed;
use wayhome::render::{self, Camera, RendererInfo, Scene, View};
use wayhome::report::OutputFolder;
use wayhome::report::image::{colours_png, instance_png, range_png};
use wayhome::world::{CameraPreset, Footprint, LightPreset, OpticsSpec, World, polygon};

use super::Verdict;
use super::args::RenderArgs;
use super::context::{Context, default_folder};

/// Names of all files of a panorama.
const FILES: &[&str] = &["rgb.png", "range.png", "instance.png", "meta.json"];

/// `meta.json`: what it takes to read the pictures.
#[derive(Serialize)]
struct Meta<'a> {
    pose: PoseRecord,
    projection: Projection,
    camera_height_m: f64,
    light: LightPreset,
    camera: CameraPreset,
    optics: OpticsSpec,
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

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    meta: &'a Meta<'a>,
    out: String,
}

pub fn run(args: &RenderArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    check_place(&world, args.pose)?;
    let projection = args.size.map_or_else(|| world.projection(), |(width, height)| world.projection_of_size(width, height));
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["render", &world.spec.name]));
    let mut folder = OutputFolder::open(&out, "render", FILES)?;
    let mut renderer = render::create(args.renderer)?;
    let mut panorama = Panorama::black(projection);
    let view = View { projection, robot: args.pose, bodies: &world.body_poses() };
    let look = args.look.look();
    let scene = look.scene(&Scene::new(&world)?, &world);
    let optics = look.optics(&world);
    Camera::new(optics).take(renderer.as_mut(), &scene, &view, Twist::default(), Seed(args.seed), &mut panorama)?;

    let meta = Meta {
        pose: args.pose.into(),
        projection,
        camera_height_m: world.spec.camera.height_m,
        range_unit: "mm; 65535 stands for all that is farther",
        light: look.light(&world),
        camera: look.camera(&world),
        optics,
        seed: args.seed,
        instances: instances(&world),
        renderer: renderer.info(),
        world: &world.spec.name,
        world_sha256: &world.sha256,
        version: env!("CARGO_PKG_VERSION"),
    };
    folder.write("rgb.png", &colours_png(&panorama, "rgb.png")?)?;
    folder.write("range.png", &range_png(&panorama, "range.png")?)?;
    folder.write("instance.png", &instance_png(&panorama, "instance.png")?)?;
    folder.write("meta.json", wayhome::report::json(&meta).as_bytes())?;
    folder.finish()?;
    let text = || {
        let info = renderer.info();
        format!(
            "{} x {} panorama from ({:.3}, {:.3}) m on {} ({})\nfiles in {}\n",
            projection.width,
            projection.height,
            args.pose.x,
            args.pose.y,
            info.kind,
            info.adapter,
            out.display()
        )
    };
    context.print(&Output { meta: &meta, out: out.display().to_string() }, text)?;
    Ok(Verdict::Done)
}

/// The camera must be in the room and in no body; the robot's own size does not matter for a picture.
fn check_place(world: &World, pose: Pose) -> Result<(), Error> {
    let camera = world.camera_pose(&pose).position();
    let refuse = |reason: String| Error::Invalid {
        what: "--pose".into(),
        found: format!("({}, {}) m, {reason}", pose.x, pose.y),
        allowed: "a place in the room and outside its bodies".into(),
    };
    if !polygon::contains(&world.outline, camera) {
        return Err(refuse("outside the room".into()));
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

/// All instance ids of a world's panoramas.
fn instances(world: &World) -> Vec<Instance> {
    world.instances().into_iter().map(|(id, name)| Instance { id, name }).collect()
}
