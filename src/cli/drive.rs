//! `wayhome drive`: a table of commands, open loop.

use std::ops::ControlFlow;

use anyhow::Result;
use serde::Serialize;
use wayhome::episode::Setup;
use wayhome::episode::open_loop::{Commands, DriveSummary, drive};
use wayhome::random::Seed;
use wayhome::record::drive::{DriveFiles, FILES};
use wayhome::report::text;
use wayhome::storage::OutputFolder;
use wayhome::world::World;

use super::Verdict;
use super::args::DriveArgs;
use super::context::{Context, default_folder};

/// What `--json` prints: the summary and where the files are.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    summary: &'a DriveSummary,
    out: String,
}

pub fn run(args: &DriveArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let commands = Commands::load(&args.commands)?;
    let start = match &args.start {
        None => world.home,
        Some(start) => Setup { start: start.clone(), ..Setup::default() }.start_pose(&world, Seed(args.seed))?,
    };
    let seed = args.seed.to_string();
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["drive", &world.spec.name, &seed]));
    let folder = OutputFolder::open(&out, "drive", FILES)?;
    let bar = context.progress(None)?;
    let mut files = DriveFiles::begin(folder, &world)?;
    let summary = drive(&world, start, Seed(args.seed), &commands, &mut |step, collisions| {
        files.add(step, collisions)?;
        bar.set_message(format!("{:.1} s", step.time_s));
        bar.tick();
        Ok(if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    })?;
    bar.finish_and_clear();
    files.finish(&summary)?;
    let output = Output { summary: &summary, out: out.display().to_string() };
    context.print(&output, || text::drive(&summary, &out))?;
    Ok(Verdict::Done)
}
