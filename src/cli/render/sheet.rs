//! `wayhome render --sheet`: several panoramas in one picture.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;
use wayhome::dataset::film;
use wayhome::draw::sheet::Sheet;
use wayhome::geometry::{Pose, Twist};
use wayhome::panorama::Panorama;
use wayhome::random::Seed;
use wayhome::render::{self, Camera, View};
use wayhome::storage::OutputFolder;
use wayhome::world::World;

use super::{RenderArgs, Take, check_place};
use crate::cli::Verdict;
use crate::cli::context::{Context, default_folder};

/// Pictures on a sheet.
const PICTURES: usize = 6;
/// Size of a picture without `--size`.
const SIZE: (u32, u32) = (720, 90);
const FILES: &[&str] = &["sheet.png"];

/// What `--json` prints.
#[derive(Serialize)]
struct Output {
    poses: Vec<wayhome::episode::PoseRecord>,
    out: String,
}

pub fn run(args: &RenderArgs, context: &Context, world: &World, pose: Option<Pose>, way: Option<&Path>) -> Result<Verdict> {
    let poses = match (pose, way) {
        (Some(pose), _) => {
            check_place(world, pose, "--pose")?;
            vec![pose]
        }
        (None, Some(path)) => film::pick(&super::film::checked(world, path)?, PICTURES).iter().map(|f| f.robot).collect(),
        (None, None) => film::poses(world, PICTURES, Seed(args.seed))?,
    };
    let (width, height) = args.size.unwrap_or(SIZE);
    let take = Take::new(args, world, world.projection_of_size(width, height), poses.len())?;
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["render", &world.spec.name, "sheet"]));
    let mut folder = OutputFolder::open(&out, "render --sheet", FILES)?;
    let mut renderer = render::create(args.renderer)?;
    let mut camera = Camera::new(take.optics);
    let (mut sheet, mut panorama, bodies) = (Sheet::new(), Panorama::empty(), world.body_poses());
    for robot in &poses {
        let view = View { projection: take.projection, robot: *robot, bodies: &bodies };
        camera.take(renderer.as_mut(), &take.scene, &view, Twist::default(), Seed(args.seed), &mut panorama)?;
        sheet.add(&panorama);
    }
    folder.write("sheet.png", &sheet.png("sheet.png")?)?;
    folder.finish()?;
    let output = Output { poses: poses.iter().map(|p| (*p).into()).collect(), out: out.display().to_string() };
    context.print(&output, || format!("{} panoramas on {}\n", poses.len(), out.join("sheet.png").display()))?;
    Ok(Verdict::Done)
}
