//! `wayhome home`: one closed-loop run, or one a seed.

use std::ops::{ControlFlow, RangeInclusive};
use std::path::Path;
use std::sync::Mutex;

use anyhow::{Result, bail};
use serde::Serialize;
use wayhome::Error;
use wayhome::episode::{Look, Outcome, Progress, Recorder, Setup, Simulation, Summary};
use wayhome::record::run::RunFiles;
use wayhome::report::{seeds as seeds_report, text};
use wayhome::sensor::Noise;
use wayhome::storage::OutputFolder;
use wayhome::study::row::RunRow;
use wayhome::study::seeds::{SeedsSummary, run_seeds};
use wayhome::study::sweep::Row;
use wayhome::study::sweep::store::StudyFolder;
use wayhome::vision::ExtractorSettings;
use wayhome::world::World;

use super::Verdict;
use super::args::HomeArgs;
use super::context::{Context, default_folder};
use super::threads::awake;

/// What `--json` prints for one run: its summary and where the files are.
#[derive(Serialize)]
struct RunOutput<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    out: String,
}

/// What `--json` prints for a batch: its summary, those of the runs, and where the files are.
#[derive(Serialize)]
struct BatchOutput<'a> {
    #[serde(flatten)]
    batch: &'a SeedsSummary,
    per_seed: &'a [Summary],
    out: String,
}

pub fn run(args: &HomeArgs, context: &Context) -> Result<Verdict> {
    if let Some((folder, episode)) = &args.replay {
        return replay(args, context, folder, *episode);
    }
    let setup = setup(args)?;
    let world = World::open(&args.world)?;
    match &args.seeds {
        Some(seeds) => batch(args, context, &world, &setup, seeds),
        None => {
            let out = args.out.clone();
            let out = out.unwrap_or_else(|| default_folder(&["home", &world.spec.name, &args.seed.to_string()]));
            Ok(verdict(&single(args, context, &world, &setup, args.seed, &out)?))
        }
    }
}

/// Runs an episode of a study again, and holds it against its row.
fn replay(args: &HomeArgs, context: &Context, folder: &Path, episode: u64) -> Result<Verdict> {
    let held = StudyFolder::open(folder)?;
    let row = held.row(episode)?;
    let study = held.study();
    let (world, setup) = study.case(&row.values)?;
    let out = args.out.clone();
    let out = out.unwrap_or_else(|| default_folder(&["home", &study.name, &episode.to_string()]));
    let summary = single(args, context, &world, &setup, row.run.seed, &out)?;
    let again = Row::of(episode, row.cell, &row.values, &summary);
    if again != row {
        bail!("episode {episode} of {} did not run as its row says: another machine or build made it", folder.display());
    }
    Ok(verdict(&summary))
}

fn verdict(summary: &Summary) -> Verdict {
    if summary.outcome == Outcome::Home { Verdict::Done } else { Verdict::NotHome }
}

fn single(args: &HomeArgs, context: &Context, world: &World, setup: &Setup, seed: u64, out: &Path) -> Result<Summary> {
    setup.check()?;
    setup.start_pose(world, wayhome::random::Seed(seed))?; // before a folder is made for a run that cannot start
    let recordings = args.recordings.recordings();
    recordings.iter().try_for_each(|(format, path)| format.check(path, out))?;
    let files = RunFiles::open(out, "home", world)?;
    let mut simulation = Simulation::new(world, setup)?;
    let mut recorders: Vec<Box<dyn Recorder>> = Vec::new();
    for (format, path) in recordings {
        recorders.push(format.open(&path, world)?);
    }
    recorders.push(Box::new(files));
    simulation.record_to(recorders);
    let bar = context.progress(None)?;
    let mut watch = |progress: &Progress| {
        bar.set_message(format!("{:.1} s, {:.2} m from home", progress.time_s, progress.distance_m));
        bar.tick();
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut run = || simulation.run(seed, &mut watch);
    let record = if setup.sensor.is_seeing() { awake(run)?? } else { run()? };
    bar.finish_and_clear();
    let summary = Summary::new(&record, world, setup, seed);
    let output = RunOutput { summary: &summary, out: out.display().to_string() };
    context.print(&output, || text::run(&summary, out))?;
    Ok(summary)
}

fn batch(args: &HomeArgs, context: &Context, world: &World, setup: &Setup, seeds: &RangeInclusive<u64>) -> Result<Verdict> {
    let range = format!("{}..{}", seeds.start(), seeds.end());
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["home", &world.spec.name, &range]));
    setup.check()?;
    let folder = OutputFolder::open(&out, "home --seeds", seeds_report::FILES)?;
    let bar = context.progress(Some(seeds.end() - seeds.start() + 1))?;
    bar.tick();
    let home = Mutex::new(0_usize);
    let runs = run_seeds(world, setup, seeds.clone(), &context.pool(), &|summary| {
        if let Ok(mut home) = home.lock() {
            *home += usize::from(summary.outcome == Outcome::Home);
            bar.set_message(format!("{home} home"));
        }
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    let rows: Vec<RunRow> = runs.iter().map(RunRow::from).collect();
    let batch = SeedsSummary::new(&rows, seeds, world, setup);
    seeds_report::write(folder, &batch, &rows)?;
    let output = BatchOutput { batch: &batch, per_seed: &runs, out: out.display().to_string() };
    context.print(&output, || text::seeds(&batch, &rows, &out))?;
    Ok(Verdict::Done)
}

/// The setup that the arguments ask for.
fn setup(args: &HomeArgs) -> Result<Setup, Error> {
    let (look, home_look) = (args.look.look(), Look { light: args.home_light, camera: args.home_camera });
    let noisy = args.noise_deg.is_some() || args.noise_dropout.is_some() || args.noise_false.is_some();
    let usual = Noise::default();
    let mut extractor = ExtractorSettings::default();
    extractor.landmarks = args.landmarks.unwrap_or(extractor.landmarks);
    Ok(Setup {
        plant: args.plant,
        sensor: args.bearings,
        method: args.patience.method(&args.method),
        law: args.controller,
        renderer: args.renderer,
        size_px: args.size,
        extractor,
        look,
        home_look,
        dataset: args.set.choice(),
        noise: noisy.then(|| Noise {
            sd_rad: args.noise_deg.map_or(usual.sd_rad, f64::to_radians),
            dropout: args.noise_dropout.unwrap_or(usual.dropout),
            false_match: args.noise_false.unwrap_or(usual.false_match),
        }),
        compass_sd_rad: args.compass_deg.map(f64::to_radians),
        start: args.start.clone(),
        initial_estimate: args.initial_estimate,
        time_limit_s: args.time_limit_s,
        ..Setup::default()
    })
}
