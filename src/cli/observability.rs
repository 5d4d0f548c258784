//! `wayhome observability`: where in a world the paper's state can be told from bearings and motion, and how well.

use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::report::paper::{map_summary, map_svg};
use wayhome::storage::OutputFolder;
use wayhome::study::observability::{Facing, ObservabilityMap, map};
use wayhome::world::World;

use super::Verdict;
use super::args::{number, positive};
use super::context::{Context, default_folder};

/// Names of all files.
const FILES: &[&str] = &["observability.svg", "observability.csv"];

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
struct Output<'a> {
    #[serde(flatten)]
    map: &'a ObservabilityMap,
    degenerate_share: f64,
    out: String,
}

pub fn run(args: &ObservabilityArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let (facing, words) = match args.heading_deg {
        None => (Facing::Homeward, "driving towards home".to_owned()),
        Some(degrees) => (Facing::Heading(degrees.to_radians()), format!("facing {degrees} degrees")),
    };
    let map = map(&world, facing, args.spacing_m)?;
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["observability", &world.spec.name]));
    let mut folder = OutputFolder::open(&out, "observability", FILES)?;
    folder.write("observability.svg", map_svg(&world, &map, &words).as_bytes())?;
    folder.write("observability.csv", csv(&map).as_bytes())?;
    folder.finish()?;
    let output = Output { map: &map, degenerate_share: map.degenerate_share(), out: out.display().to_string() };
    context.print(&output, || format!("{}  files  {}\n", map_summary(&map, &words), out.display()))?;
    Ok(Verdict::Done)
}

/// One row a place; `inf` where the block is singular.
fn csv(map: &ObservabilityMap) -> String {
    let mut text = "x_m,y_m,landmarks,rank,condition,best_condition,median_condition\n".to_owned();
    for p in &map.places {
        text += &format!(
            "{},{},{},{},{},{},{}\n",
            p.x_m,
            p.y_m,
            p.landmarks,
            p.landmarks + p.rank,
            p.condition,
            p.best_condition,
            p.median_condition
        );
    }
    text
}
