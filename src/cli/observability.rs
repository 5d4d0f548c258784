//! `wayhome observability`: where in a world the paper's state can be told from bearings and motion, and how well.

use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::report::paper::{map_csv, map_summary, map_svg};
use wayhome::study::observability::{Facing, ObservabilityMap, map};
use wayhome::world::World;

use super::context::{Context, Verdict, open_folder};
use super::values::{number, positive};

/// Arguments of `observability`.
#[derive(Debug, clap::Args)]
pub struct ObservabilityArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "lab")]
    pub world: String,
    /// Heading of the robot everywhere, degrees in the room [default: towards home]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = number)]
    pub heading_deg: Option<f64>,
    /// Distance between places, m
    #[arg(long, value_name = "M", default_value = "0.1", allow_negative_numbers = true, value_parser = positive)]
    pub spacing_m: f64,
    /// Folder for the results [default: results/runs/observability-WORLD]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Mapped<'a> {
    #[serde(flatten)]
    map: &'a ObservabilityMap,
    degenerate_share: f64,
}

pub fn run(args: &ObservabilityArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let (facing, words) = match args.heading_deg {
        None => (Facing::Homeward, "driving towards home".to_owned()),
        Some(degrees) => (Facing::Heading(degrees.to_radians()), format!("facing {degrees} degrees")),
    };
    let map = map(&world, facing, args.spacing_m)?;
    let parts = ["observability", &world.spec.name];
    let (out, mut folder) = open_folder(args.out.as_deref(), &parts, "observability")?;
    folder.write("observability.svg", map_svg(&world, &map, &words).as_bytes())?;
    folder.write("observability.csv", map_csv(&map).as_bytes())?;
    folder.finish()?;
    let mapped = Mapped { map: &map, degenerate_share: map.degenerate_share() };
    context.print_made(&mapped, &out, || format!("{}  files  {}\n", map_summary(&map, &words), out.display()))?;
    Ok(Verdict::Done)
}
