//! `wayhome world`: check, draw and describe world files.

use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::draw::map;
use wayhome::storage::write_atomically;
use wayhome::world::World;

use super::context::{Context, Verdict, print};

/// Arguments of `world`.
#[derive(Debug, clap::Args)]
pub struct WorldArgs {
    #[command(subcommand)]
    pub command: WorldCommand,
}

/// The subcommands of `world`.
#[derive(Debug, clap::Subcommand)]
pub enum WorldCommand {
    /// Check a world file and list all its faults
    Check {
        /// World file, or the name of a built-in world
        world: String,
    },
    /// Make worlds from a seed: rooms without end
    Generate(Box<super::generate::GenerateArgs>),
    /// Make a world of a ROS or Nav2 map, or of a floor plan
    Import(Box<super::map::ImportArgs>),
    /// Write a world as a map for ROS and Nav2, map.yaml and map.pgm, and for Gazebo, world.sdf
    Export(super::map::ExportArgs),
    /// Draw a world from above as SVG
    Plot {
        /// World file, or the name of a built-in world
        world: String,
        /// File for the drawing [default: stdout]
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Print the JSON Schema of world files
    Schema,
}

/// What `world check --json` prints for a world without faults.
#[derive(Serialize)]
struct Checked<'a> {
    ok: bool,
    name: &'a str,
    source: String,
    sha256: &'a str,
    walls: usize,
    inner_walls: usize,
    landmarks: usize,
    obstacles: usize,
    starts: usize,
    warnings: Vec<String>,
}

pub fn run(args: &WorldArgs, context: &Context) -> Result<Verdict> {
    match &args.command {
        WorldCommand::Check { world } => check(&World::open(world)?, context)?,
        WorldCommand::Generate(args) => return super::generate::run(args, context),
        WorldCommand::Import(args) => return super::map::import(args, context),
        WorldCommand::Export(args) => return super::map::export(args, context),
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
    let faults = world.unreachable_starts();
    if !faults.is_empty() {
        return Err(wayhome::Error::World { path: world.source.clone(), faults }.into());
    }
    let checked = Checked {
        ok: true,
        name: &world.spec.name,
        source: world.source.display().to_string(),
        sha256: &world.sha256,
        walls: world.outline.len(),
        inner_walls: world.partitions.len(),
        landmarks: world.landmark_count,
        obstacles: world.bodies.len() - world.landmark_count,
        starts: world.spec.start.named.len(),
        warnings: world.warnings.iter().map(ToString::to_string).collect(),
    };
    context.print(&checked, || {
        let Checked { name, source, walls, inner_walls, landmarks, obstacles, starts, .. } = &checked;
        let inner = if *inner_walls > 0 { format!("{inner_walls} inner walls, ") } else { String::new() };
        let mut text = format!(
            "OK: {name} ({source}): {walls} walls, {inner}{landmarks} landmarks, {obstacles} obstacles, {starts} named starts\n"
        );
        for warning in &checked.warnings {
            text += &format!("warning: {warning}\n");
        }
        text
    })
}
