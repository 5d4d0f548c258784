//! `wayhome home`: one closed-loop run, or one a seed.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Result, bail};
use clap::Args;
use serde::Serialize;
use wayhome::episode::{Outcome, Progress, Recorder, Setup, Simulation, Start, Summary};
use wayhome::geometry::Pose;
use wayhome::record::Format;
use wayhome::record::run::RunFiles;
use wayhome::report::{seeds as seeds_report, text};
use wayhome::study::row::RunRow;
use wayhome::study::seeds::{SeedsSummary, run_seeds};
use wayhome::study::sweep::Row;
use wayhome::study::sweep::store::StudyFolder;
use wayhome::world::World;

use super::changes::ChangeArgs;
use super::context::{Context, Verdict, folder_or, open_folder};
use super::setup::{MethodArgs, SetupArgs};
use super::threads::awake;
use super::values::{count, ending, pose, range, row, seeds, start};

/// Arguments of `home`.
#[derive(Debug, clap::Args)]
pub struct HomeArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "worlds/lab.toml")]
    pub world: String,
    #[command(flatten)]
    pub changes: ChangeArgs,
    #[command(flatten)]
    pub method: MethodArgs,
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Start: `random`, the name of one of the world's starts, or a pose x,y,heading_deg
    #[arg(long, default_value = "random", allow_hyphen_values = true, value_parser = start)]
    pub start: Start,
    /// Seed of the run
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Run all seeds from A to B, both included, in parallel and report on all of them together
    #[arg(long, value_name = "A..B", conflicts_with = "seed", value_parser = seeds)]
    pub seeds: Option<RangeInclusive<u64>>,
    /// Run an episode of a study again, exactly: the study's folder and the episode's number in its rows
    #[arg(long, value_name = "DIR:ROW", value_parser = row, conflicts_with_all = told_by_a_study())]
    pub replay: Option<(PathBuf, u64)>,
    /// Pose in the home frame at which a filter starts that has to be given one (paper-ekf): x,y,heading_deg
    #[arg(long, value_name = "x,y,heading_deg", allow_hyphen_values = true, value_parser = pose)]
    pub initial_estimate: Option<Pose>,
    /// Record the run as MCAP with Foxglove's schemas: poses, transforms, panoramas, bearings, estimate, commands, diagnostics
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "seeds", value_parser = ending("mcap"))]
    pub record: Option<PathBuf>,
    /// Record the run as an animated GIF: panorama and room
    #[arg(long, value_name = "FILE.gif", conflicts_with = "seeds", value_parser = ending("gif"))]
    pub video: Option<PathBuf>,
    /// Folder for the results [default: results/runs/home-WORLD-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// The arguments that an episode has from its study. Their groups would not do: clap takes one for not given where an argument of it
/// has a default.
fn told_by_a_study() -> Vec<clap::Id> {
    let shared = ChangeArgs::augment_args(clap::Command::new("shared"));
    let shared = SetupArgs::augment_args(MethodArgs::augment_args(shared));
    let own = ["world", "start", "seed", "seeds", "initial_estimate"].map(clap::Id::from);
    shared.get_arguments().map(|arg| arg.get_id().clone()).chain(own).collect()
}

/// What `--json` prints for a batch: its summary and those of the runs.
#[derive(Serialize)]
struct Batch<'a> {
    #[serde(flatten)]
    batch: &'a SeedsSummary,
    per_seed: &'a [Summary],
}

pub fn run(args: &HomeArgs, context: &Context) -> Result<Verdict> {
    if let Some((folder, episode)) = &args.replay {
        return replay(args, context, folder, *episode);
    }
    let setup = Setup {
        method: args.method.kind(),
        law: args.method.controller,
        start: args.start.clone(),
        initial_estimate: args.initial_estimate,
        ..args.setup.setup()
    };
    setup.check()?;
    let world = args.changes.open(&args.world)?;
    match &args.seeds {
        Some(seeds) => batch(args, context, &world, &setup, seeds),
        None => Ok(verdict(&single(args, context, &world, &setup, args.seed, [&world.spec.name, &args.seed.to_string()])?)),
    }
}

/// Runs an episode of a study again, and holds it against its row.
fn replay(args: &HomeArgs, context: &Context, folder: &Path, episode: u64) -> Result<Verdict> {
    let held = StudyFolder::open(folder)?;
    let row = held.row(episode)?;
    let study = held.study();
    let (world, setup) = study.case(&row.values, row.run.seed)?;
    let summary = single(args, context, &world, &setup, row.run.seed, [&study.name, &episode.to_string()])?;
    let again = Row::of(episode, row.cell, &row.values, &summary);
    if again != row {
        bail!("episode {episode} of {} did not run as its row says: another machine or build made it", folder.display());
    }
    Ok(verdict(&summary))
}

fn verdict(summary: &Summary) -> Verdict {
    if summary.outcome == Outcome::Home { Verdict::Done } else { Verdict::NotHome }
}

/// Runs once; `name` is for the folder where none is given.
fn single(args: &HomeArgs, context: &Context, world: &World, setup: &Setup, seed: u64, name: [&str; 2]) -> Result<Summary> {
    setup.start_pose(world, wayhome::random::Seed(seed))?; // before a folder is made for a run that cannot start
    let parts = ["home", name[0], name[1]];
    let out = folder_or(args.out.as_deref(), &parts);
    let asked = [(Format::Mcap, &args.record), (Format::Gif, &args.video)];
    let recordings: Vec<_> = asked.into_iter().filter_map(|(format, path)| Some((format, path.as_deref()?))).collect();
    recordings.iter().try_for_each(|(format, path)| format.check(path, &out))?;
    let files = RunFiles::open(&out, "home", world)?;
    let mut simulation = Simulation::new(world, setup)?;
    let recorders = recordings.into_iter().map(|(format, path)| format.open(path, world));
    let mut recorders: Vec<Box<dyn Recorder>> = recorders.collect::<Result<_, _>>()?;
    recorders.push(Box::new(files));
    simulation.record_to(recorders);
    let bar = context.progress(None)?;
    let mut watch = |progress: &Progress| bar.at(format!("{:.1} s, {:.2} m from home", progress.time_s, progress.distance_m));
    let mut run = || simulation.run(seed, &mut watch);
    let record = if setup.sensor.is_seeing() { awake(run)?? } else { run()? };
    drop(bar);
    let summary = Summary::new(&record, world, setup, seed);
    context.print_made(&summary, &out, || text::run(&summary, &out))?;
    Ok(summary)
}

fn batch(args: &HomeArgs, context: &Context, world: &World, setup: &Setup, seeds: &RangeInclusive<u64>) -> Result<Verdict> {
    let parts = ["home", &world.spec.name, &range(seeds)];
    let (out, folder) = open_folder(args.out.as_deref(), &parts, "home --seeds")?;
    let bar = context.progress(Some(count(seeds)))?;
    let home = AtomicUsize::new(0);
    let watch = |summary: &Summary| {
        let came = usize::from(summary.outcome == Outcome::Home);
        bar.done(format!("{} home", home.fetch_add(came, Ordering::Relaxed) + came));
    };
    let runs = run_seeds(world, setup, seeds.clone(), &context.pool(), &watch)?;
    drop(bar);
    let rows: Vec<RunRow> = runs.iter().map(RunRow::from).collect();
    let batch = SeedsSummary::new(&rows, seeds, world, setup);
    seeds_report::write(folder, &batch, &rows)?;
    context.print_made(&Batch { batch: &batch, per_seed: &runs }, &out, || text::seeds(&batch, &rows, &out))?;
    Ok(Verdict::Done)
}
