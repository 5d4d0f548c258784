//! `wayhome drive`: a table of commands, open loop.

use std::path::PathBuf;

use anyhow::Result;
use wayhome::episode::open_loop::{Commands, drive};
use wayhome::episode::{Setup, Start};
use wayhome::random::Seed;
use wayhome::record::drive::DriveFiles;
use wayhome::report::text;
use wayhome::world::World;

use super::context::{Context, Verdict, open_folder};
use super::values::start;

/// Shown under `drive --help`.
const HELP: &str = "Commands are CSV with a header, times from 0 on:
  t_s,v_m_s,omega_rad_s
  0,0.3,0
  2,0.2,0.8
  5,0,0
Each row holds until the time of the next; the last row is the end.";

/// Arguments of `drive`.
#[derive(Debug, clap::Args)]
#[command(after_help = HELP)]
pub struct DriveArgs {
    /// World file, or the name of a built-in world
    pub world: String,
    /// Table of commands: t_s, v_m_s, omega_rad_s
    #[arg(long, value_name = "FILE.csv")]
    pub commands: PathBuf,
    /// Start: `random`, the name of one of the world's starts, or a pose x,y,heading_deg [default: the world's home]
    #[arg(long, allow_hyphen_values = true, value_parser = start)]
    pub start: Option<Start>,
    /// Seed of the run
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Folder for the results [default: results/runs/drive-WORLD-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

pub fn run(args: &DriveArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let commands = Commands::load(&args.commands)?;
    let start = match &args.start {
        None => world.home,
        Some(start) => Setup { start: start.clone(), ..Setup::default() }.start_pose(&world, Seed(args.seed))?,
    };
    let parts = ["drive", &world.spec.name, &args.seed.to_string()];
    let (out, folder) = open_folder(args.out.as_deref(), &parts, "drive")?;
    let bar = context.progress(None)?;
    let mut files = DriveFiles::begin(folder, &world)?;
    let summary = drive(&world, start, Seed(args.seed), &commands, &mut |step, collisions| {
        files.add(step, collisions)?;
        Ok(bar.at(format!("{:.1} s", step.time_s)))
    })?;
    drop(bar);
    files.finish(&summary)?;
    context.print_made(&summary, &out, || text::drive(&summary, &out))?;
    Ok(Verdict::Done)
}
