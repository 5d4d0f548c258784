//! `wayhome render --trajectory`: a panorama for each row of a table.

use std::path::Path;

use anyhow::Result;
use rayon::prelude::*;
use serde::Serialize;
use wayhome::Error;
use wayhome::dataset::film::{Frame, load};
use wayhome::draw::image::{colours_png, instance_png, range_png};
use wayhome::episode::PoseRecord;
use wayhome::panorama::Panorama;
use wayhome::random::Seed;
use wayhome::render::{self, Camera, View};
use wayhome::storage::OutputFolder;
use wayhome::world::World;

use super::{Meta, RenderArgs, Take, check_place, projection};
use crate::cli::Verdict;
use crate::cli::context::{Context, default_folder};

/// Names of all files of a film.
const FILES: &[&str] = &["rgb-#.png", "range-#.png", "instance-#.png", "meta.json"];

/// `meta.json` of a film.
#[derive(Serialize)]
struct FilmMeta<'a> {
    #[serde(flatten)]
    meta: Meta<'a>,
    frames: Vec<FrameRecord>,
}

/// A frame of it; its number is that in the files' names.
#[derive(Serialize)]
struct FrameRecord {
    number: usize,
    t_s: f64,
    pose: PoseRecord,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    meta: &'a FilmMeta<'a>,
    out: String,
}

pub fn run(args: &RenderArgs, context: &Context, world: &World, path: &Path) -> Result<Verdict> {
    let frames = checked(world, path)?;
    let projection = projection(args, world);
    let take = Take::new(args, world, projection, render::most_in_memory(projection).min(frames.len()))?;
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["render", &world.spec.name, "trajectory"]));
    let mut folder = OutputFolder::open(&out, "render --trajectory", FILES)?;
    let mut renderer = render::create(args.renderer)?;
    let bodies = world.body_poses();
    let views: Vec<_> = frames.iter().map(|f| View { projection, robot: f.robot, bodies: &bodies }).collect();
    let camera = Camera::new(take.optics);
    let bar = context.progress(Some(frames.len() as u64))?;
    renderer.render_batch(&take.scene, &views, &mut |first, panoramas| {
        if context.is_stopped() {
            return Err(Error::Interrupted);
        }
        let numbered = panoramas.par_iter_mut().enumerate();
        let files: Vec<_> = numbered.map(|(k, p)| develop(&camera, Seed(args.seed), first + k, p)).collect::<Result<_, _>>()?;
        for (name, bytes) in files.iter().flatten() {
            folder.write(name, bytes)?;
        }
        bar.inc(panoramas.len() as u64);
        Ok(())
    })?;
    bar.finish_and_clear();
    let record = |(number, f): (usize, &Frame)| FrameRecord { number, t_s: f.time_s, pose: f.robot.into() };
    let frames = frames.iter().enumerate().map(record).collect();
    let meta = FilmMeta { meta: Meta::new(args, world, &take, renderer.info()), frames };
    folder.write("meta.json", wayhome::storage::json(&meta).as_bytes())?;
    folder.finish()?;
    let text = || {
        let info = renderer.info();
        let (width, height) = (projection.width, projection.height);
        let count = meta.frames.len();
        format!("{count} panoramas of {width} x {height} on {} ({})\nfiles in {}\n", info.kind, info.adapter, out.display())
    };
    context.print(&Output { meta: &meta, out: out.display().to_string() }, text)?;
    Ok(Verdict::Done)
}

/// The frames of a way on which the camera never is outside the room or in a body.
pub fn checked(world: &World, path: &Path) -> Result<Vec<Frame>, Error> {
    let frames = load(path)?;
    for (k, frame) in frames.iter().enumerate() {
        check_place(world, frame.robot, &format!("{}, frame {k}", path.display()))?;
    }
    Ok(frames)
}

/// Takes the picture that a renderer made, and makes its files: names and bytes.
fn develop(camera: &Camera, seed: Seed, number: usize, panorama: &mut Panorama) -> Result<[(String, Vec<u8>); 3], Error> {
    camera.clone().develop(panorama, seed.derive(&format!("frame {number}")));
    let name = |channel: &str| format!("{channel}-{number:06}.png");
    let (rgb, range, instance) = (name("rgb"), name("range"), name("instance"));
    let bytes = (colours_png(panorama, &rgb)?, range_png(panorama, &range)?, instance_png(panorama, &instance)?);
    Ok([(rgb, bytes.0), (range, bytes.1), (instance, bytes.2)])
}
