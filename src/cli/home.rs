//! `wayhome home`: one closed-loop run, or one a seed.

use std::ops::{ControlFlow, RangeInclusive};
use std::path::Path;
use std::sync::Mutex;

use anyhow::{Result, bail};
use serde::Serialize;
use wayhome::Error;
use wayhome::episode::{Bearings, Bench, Look, Outcome, Progress, Setup, Summary};
use wayhome::record::Recordings;
use wayhome::record::run as run_report;
use wayhome::report::{seeds as seeds_report, text};
use wayhome::sensor::Noise;
use wayhome::storage::OutputFolder;
use wayhome::study::seeds::{SeedEvent, SeedsSummary, run_seeds};
use wayhome::study::sweep::Row;
use wayhome::study::sweep::store::StudyFolder;
use wayhome::vision::ExtractorSettings;
use wayhome::world::World;

use super::Verdict;
use super::args::{self, HomeArgs};
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
    let summary = single(args, context, &world, &setup, row.seed, &out)?;
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
    setup.method.check()?;
    setup.start_pose(world, wayhome::random::Seed(seed))?; // before a folder is made for a run that cannot start
    let paths = args.recordings.paths();
    paths.check(out)?;
    let folder = OutputFolder::open(out, "home", run_report::FILES)?;
    let mut bench = Bench::new(world, setup)?;
    let mut recordings = Recordings::open(world, &paths)?;
    let bar = context.progress(None)?;
    let mut watch = |progress: &Progress| {
        bar.set_message(format!("{:.1} s, {:.2} m from home", progress.time_s, progress.distance_m));
        bar.tick();
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut run = || bench.run_recorded(seed, &mut watch, &mut recordings);
    let record = if setup.bearings.are_seen() { awake(run)?? } else { run()? };
    bar.finish_and_clear();
    let summary = Summary::new(&record, world, setup, seed);
    recordings.finish(&summary)?;
    run_report::write(folder, world, &record, &summary)?;
    let output = RunOutput { summary: &summary, out: out.display().to_string() };
    context.print(&output, || text::run(&summary, out))?;
    Ok(summary)
}

fn batch(args: &HomeArgs, context: &Context, world: &World, setup: &Setup, seeds: &RangeInclusive<u64>) -> Result<Verdict> {
    let range = format!("{}..{}", seeds.start(), seeds.end());
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["home", &world.spec.name, &range]));
    setup.method.check()?;
    let folder = OutputFolder::open(&out, "home --seeds", seeds_report::FILES)?;
    let bar = context.progress(Some(seeds.end() - seeds.start() + 1))?;
    bar.tick();
    let home = Mutex::new(0_usize);
    let watch = |event: SeedEvent<'_>| {
        if let SeedEvent::Done(summary) = event {
            if let Ok(mut home) = home.lock() {
                *home += usize::from(summary.outcome == Outcome::Home);
                bar.set_message(format!("{home} home"));
            }
            bar.inc(1);
        }
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let runs = run_seeds(world, setup, seeds.clone(), rayon::current_num_threads(), &watch)?;
    bar.finish_and_clear();
    let batch = SeedsSummary::new(&runs, seeds, world, setup);
    seeds_report::write(folder, &batch, &runs)?;
    let output = BatchOutput { batch: &batch, per_seed: &runs, out: out.display().to_string() };
    context.print(&output, || text::seeds(&batch, &runs, &out))?;
    Ok(Verdict::Done)
}

/// The setup that the arguments ask for.
fn setup(args: &HomeArgs) -> Result<Setup, Error> {
    let noisy = args.noise_deg.is_some() || args.noise_dropout.is_some() || args.noise_false.is_some();
    needs_bearings(noisy, "--noise-*", args.bearings, Bearings::Noisy)?;
    needs_bearings(args.size.is_some(), "--size", args.bearings, Bearings::Rendered)?;
    needs_bearings(args.set.is_given(), "--dataset*", args.bearings, Bearings::Dataset)?;
    if args.bearings != Bearings::Dataset {
        needs_bearings(args.landmarks.is_some(), "--landmarks", args.bearings, Bearings::Rendered)?;
    }
    let (look, home_look) = (args.look.look(), Look { light: args.home_light, camera: args.home_camera });
    needs_bearings(look.or(home_look) != Look::default(), "--light and --camera", args.bearings, Bearings::Rendered)?;
    let usual = Noise::default();
    let mut extractor = ExtractorSettings::default();
    extractor.landmarks = args.landmarks.unwrap_or(extractor.landmarks);
    Ok(Setup {
        plant: args.plant,
        bearings: args.bearings,
        method: args.patience.method(&args.method),
        law: args.controller,
        renderer: args.renderer,
        size_px: args.size,
        extractor,
        look,
        home_look,
        dataset: args.set.choice(),
        noise: Noise {
            sd_rad: args.noise_deg.map_or(usual.sd_rad, f64::to_radians),
            dropout: args.noise_dropout.unwrap_or(usual.dropout),
            false_match: args.noise_false.unwrap_or(usual.false_match),
        },
        compass_sd_rad: args.compass_deg.map(f64::to_radians),
        start: args.start.clone(),
        initial_estimate: args.initial_estimate,
        time_limit_s: args.time_limit_s,
        ..Setup::default()
    })
}

/// Refuses a flag that would do nothing with the sensor that was chosen.
pub fn needs_bearings(given: bool, flag: &str, found: Bearings, needed: Bearings) -> Result<(), Error> {
    if !given || found == needed {
        return Ok(());
    }
    let name = |bearings| format!("--bearings {}", args::bearings_name(bearings));
    Err(Error::Invalid { what: format!("sensor for {flag}"), found: name(found), allowed: name(needed) })
}
