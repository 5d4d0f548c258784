//! `wayhome render --pose`: one panorama.

use anyhow::Result;
use serde::Serialize;
use wayhome::draw::image::{colours_png, instance_png, range_png};
use wayhome::episode::PoseRecord;
use wayhome::geometry::{Pose, Twist};
use wayhome::panorama::Panorama;
use wayhome::random::Seed;
use wayhome::render::{self, Camera, View};
use wayhome::storage::OutputFolder;
use wayhome::world::World;

use super::{Meta, RenderArgs, Take, check_place, projection};
use crate::cli::Verdict;
use crate::cli::context::{Context, default_folder};

/// Names of all files of a panorama.
const FILES: &[&str] = &["rgb.png", "range.png", "instance.png", "meta.json"];

/// `meta.json` of a single panorama.
#[derive(Serialize)]
struct StillMeta<'a> {
    pose: PoseRecord,
    #[serde(flatten)]
    meta: Meta<'a>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    meta: &'a StillMeta<'a>,
    out: String,
}

pub fn run(args: &RenderArgs, context: &Context, world: &World, pose: Pose) -> Result<Verdict> {
    check_place(world, pose, "--pose")?;
    let take = Take::new(args, world, projection(args, world), 1)?;
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["render", &world.spec.name]));
    let mut folder = OutputFolder::open(&out, "render", FILES)?;
    let mut renderer = render::create(args.renderer)?;
    let mut panorama = Panorama::empty();
    let view = View { projection: take.projection, robot: pose, bodies: &world.body_poses() };
    let mut camera = Camera::new(take.optics);
    camera.take(renderer.as_mut(), &take.scene, &view, Twist::default(), Seed(args.seed), &mut panorama)?;

    let meta = StillMeta { pose: pose.into(), meta: Meta::new(args, world, &take, renderer.info()) };
    folder.write("rgb.png", &colours_png(&panorama, "rgb.png")?)?;
    folder.write("range.png", &range_png(&panorama, "range.png")?)?;
    folder.write("instance.png", &instance_png(&panorama, "instance.png")?)?;
    folder.write("meta.json", wayhome::storage::json(&meta).as_bytes())?;
    folder.finish()?;
    let text = || {
        let (p, info) = (take.projection, renderer.info());
        format!(
            "{} x {} panorama from ({:.3}, {:.3}) m on {} ({})\nfiles in {}\n",
            p.width,
            p.height,
            pose.x,
            pose.y,
            info.kind,
            info.adapter,
            out.display()
        )
    };
    context.print(&Output { meta: &meta, out: out.display().to_string() }, text)?;
    Ok(Verdict::Done)
}
