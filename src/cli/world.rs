//! `wayhome world`: check, draw and describe world files.

use anyhow::Result;
use serde::Serialize;
use wayhome::draw::map;
use wayhome::storage::write_atomically;
use wayhome::world::World;

use super::Verdict;
use super::args::{WorldArgs, WorldCommand};
use super::context::{Context, print};

/// What `world check --json` prints for a world without faults.
#[derive(Serialize)]
struct Checked<'a> {
    ok: bool,
    name: &'a str,
    source: String,
    sha256: &'a str,
    walls: usize,
    landmarks: usize,
    obstacles: usize,
    starts: usize,
}

pub fn run(args: &WorldArgs, context: &Context) -> Result<Verdict> {
    match &args.command {
        WorldCommand::Check { world } => check(&World::open(world)?, context)?,
        WorldCommand::Plot { world, out } => {
            let drawing = map::world_svg(&World::open(world)?);
            match out {
                Some(path) => write_atomically(path, drawing.as_bytes())?,
                None => print(&drawing)?,
            }
        }
        WorldCommand::Schema => print(&wayhome::storage::json(&World::json_schema()))?,
    }
    Ok(Verdict::Done)
}

fn check(world: &World, context: &Context) -> Result<()> {
    let checked = Checked {
        ok: true,
        name: &world.spec.name,
        source: world.source.display().to_string(),
        sha256: &world.sha256,
        walls: world.outline.len(),
        landmarks: world.landmark_count,
        obstacles: world.bodies.len() - world.landmark_count,
        starts: world.spec.start.named.len(),
    };
    context.print(&checked, || {
        format!(
            "OK: {} ({}): {} walls, {} landmarks, {} obstacles, {} named starts\n",
            checked.name, checked.source, checked.walls, checked.landmarks, checked.obstacles, checked.starts
        )
    })
}
