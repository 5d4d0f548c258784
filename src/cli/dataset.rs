//! `wayhome dataset`: panorama sets in the field's layouts, their check, and how fast they are made.

use std::f64::consts::PI;
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use serde::Serialize;
use wayhome::dataset::check::{Inspection, check};
use wayhome::dataset::conditions::{CHANGES, Condition};
use wayhome::dataset::pipeline::{Job, Outcome, Progress};
use wayhome::dataset::plan::{Headings, Places, Plan, Request};
use wayhome::dataset::series::{Series, SeriesJob};
use wayhome::panorama_set::LayoutKind;
use wayhome::render::{self, Renderer, RendererChoice};
use wayhome::report::dataset as report;

use super::changes::ChangeArgs;
use super::context::{Context, Verdict, folder_or};
use super::values::{choice, choice_of, number, pair, point, positive, shard, size};

/// Time between two lines of progress where no terminal shows a bar.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Shown under `dataset --help`.
const HELP: &str = "A route is CSV with columns x_m, y_m and perhaps heading_deg or heading_rad. Poses at which the robot cannot stand are left out
and listed. A set that was interrupted is gone on with by the same command. Shards may share a folder, or their folders may be
copied over one another; the same command without --shard then completes the set. `check` fails where it finds faults.";

/// Arguments of `dataset`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, after_help = HELP)]
#[command(group = clap::ArgGroup::new("places").args(["grid", "route", "random", "trajectory"]))]
pub struct DatasetArgs {
    #[command(subcommand)]
    pub command: Option<DatasetCommand>,
    /// World file, or the name of a built-in world
    #[arg(required_unless_present = "worlds")]
    pub world: Option<String>,
    /// Many worlds instead: `office:1..500,flat:7,FOLDER/,lab`, as many random places in each. Layouts folder, image-folder, webdataset
    #[arg(long, value_name = "SPEC", requires = "count", conflicts_with_all = ["world", "changes", "home", "places"])]
    pub worlds: Option<String>,
    /// Where: so many random places in all of --worlds together
    #[arg(long, value_name = "N", requires = "worlds")]
    pub count: Option<usize>,
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// Where: an even grid with so many places along x and y. One of --grid, --route, --random and --trajectory is needed
    #[arg(long, value_name = "NXxNY", value_parser = grid, requires = "spacing_m", required_unless_present_any = ["route", "random", "trajectory", "worlds"])]
    pub grid: Option<(usize, usize)>,
    /// Distance between places of the grid, m
    #[arg(long, value_name = "S", requires = "grid", allow_negative_numbers = true, value_parser = positive)]
    pub spacing_m: Option<f64>,
    /// Place of the grid with the least x and y [default: home on a place, the grid about the middle of the room]
    #[arg(long, value_name = "X,Y", requires = "grid", allow_hyphen_values = true, value_parser = point)]
    pub origin: Option<[f64; 2]>,
    /// Where: the points of a table, instead of --grid
    #[arg(long, value_name = "FILE.csv")]
    pub route: Option<PathBuf>,
    /// Where: so many random places, instead of --grid
    #[arg(long, value_name = "N")]
    pub random: Option<usize>,
    /// Where: the poses of a run, its folder or its trajectory.csv, instead of --grid
    #[arg(long, value_name = "RUN")]
    pub trajectory: Option<PathBuf>,
    /// Headings at every place, degrees, separated by commas; `random`, or `random:N` for N of them [default: as the places say, else
    /// home's]
    #[arg(long, value_name = "DEG,…", allow_hyphen_values = true, value_parser = headings)]
    pub headings: Option<HeadingsArg>,
    /// Conditions, separated by commas; changes of one are joined by `+`, as in `day,night+night-camera,moved:2+blur:0.2` [default:
    /// original]
    #[arg(long, value_name = "CONDITION,…", value_delimiter = ',', long_help = conditions_help())]
    pub conditions: Vec<Condition>,
    /// How files are named and coded
    #[arg(long, default_value = "folder", value_parser = choice_of(LayoutKind::written()))]
    pub layout: LayoutKind,
    /// Columns and rows of the panorama, 16x8 to 16384x4096 [default: the world's]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Seed of random poses, moved furniture, swapped textures and the camera's noise
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Licence that the set's card states, as an SPDX identifier
    #[arg(long, value_name = "SPDX", default_value = "Apache-2.0", value_parser = licence)]
    pub license: String,
    /// Make share I of N of the set
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub shard: Option<[u64; 2]>,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice::<RendererChoice>())]
    pub renderer: RendererChoice,
    /// Folder for the set [default: results/runs/dataset-WORLD-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Other things to do with sets.
#[derive(Debug, clap::Subcommand)]
pub enum DatasetCommand {
    /// Find missing, cut, altered and extra files of a set
    Check {
        /// Folder of the set
        dir: PathBuf,
    },
    /// The same as `wayhome verify dataset`
    #[command(hide = true)]
    Bench(super::verify::DatasetArgs),
}

/// Headings as the command line has them.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadingsArg(Headings);

fn conditions_help() -> String {
    format!(
        "Conditions, separated by commas; changes of one are joined by `+`, as in `day,night+night-camera,moved:2+blur:0.2` [default: \
         original]\n\nChanges: {CHANGES}"
    )
}

fn grid(text: &str) -> Result<(usize, usize), String> {
    let numbers = pair(text, "x").filter(|(x, y)| *x > 0 && *y > 0);
    numbers.ok_or_else(|| "a grid is NXxNY, such as 17x10, with at least one place".into())
}

fn headings(text: &str) -> Result<HeadingsArg, String> {
    let count =
        |text: &str| text.parse().ok().filter(|n| (1..=10_000).contains(n)).ok_or("allowed are 1 to 10000 random headings");
    Ok(HeadingsArg(match text.split_once(':') {
        None if text == "random" => Headings::Random(1),
        Some(("random", n)) => Headings::Random(count(n)?),
        _ => {
            let degrees = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
            Headings::Fixed(degrees.into_iter().map(|d| d / 180.0 * PI).collect())
        }
    }))
}

fn licence(text: &str) -> Result<String, String> {
    let plain = !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || "-.+".contains(c));
    if plain { Ok(text.to_owned()) } else { Err("an SPDX identifier has letters, digits, `-`, `.` and `+`".into()) }
}

/// What `--json` prints of a set.
#[derive(Serialize)]
struct Made {
    #[serde(skip_serializing_if = "Option::is_none")]
    worlds: Option<usize>,
    frames: usize,
    rendered: usize,
    found: usize,
    left_out: usize,
    parts: usize,
    complete: bool,
    layout: LayoutKind,
    renderer: render::RendererInfo,
}

/// What `--json` prints of a check.
#[derive(Serialize)]
struct Checked<'a> {
    whole: bool,
    #[serde(flatten)]
    inspection: &'a Inspection,
}

pub fn run(args: &DatasetArgs, context: &Context) -> Result<Verdict> {
    match &args.command {
        Some(DatasetCommand::Check { dir }) => inspect(dir, context),
        Some(DatasetCommand::Bench(args)) => super::verify::dataset(args, context),
        None => make(args, context),
    }
}

/// A set of one world or of many.
enum Work {
    One(Box<Plan>),
    Many(Box<Series>),
}

impl Work {
    fn new(args: &DatasetArgs, context: &Context) -> Result<(Self, String)> {
        let request = request(args, context);
        if let Some(given) = &args.worlds {
            return Ok((Self::Many(Box::new(Series::new(given, request)?)), "worlds".to_owned()));
        }
        let world = args.changes.open(args.world.as_deref().unwrap_or_default())?;
        Ok((Self::One(Box::new(Plan::new(&world, request)?)), world.spec.name))
    }

    fn frames(&self) -> usize {
        match self {
            Self::One(plan) => plan.frames(),
            Self::Many(series) => series.frames(),
        }
    }

    /// Makes what is missing of a share of it.
    fn run(
        &self,
        out: &Path,
        shard: (usize, usize),
        renderer: &mut dyn Renderer,
        watch: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> wayhome::Result<Outcome> {
        let extras = &report::card;
        match self {
            Self::One(plan) => Job { plan, out, shard, extras }.run(renderer, watch),
            Self::Many(series) => SeriesJob { series, out, shard, extras }.run(renderer, watch),
        }
    }
}

fn make(args: &DatasetArgs, context: &Context) -> Result<Verdict> {
    let (work, name) = Work::new(args, context)?;
    let out = folder_or(args.out.as_deref(), &["dataset", &name, &args.seed.to_string()]);
    let mut renderer = render::create(args.renderer)?;
    let bar = context.work(work.frames() as u64)?;
    let mut begun = None;
    let mut told = Instant::now();
    let shard = args.shard.map_or((1, 1), |[i, n]| (i as usize, n as usize));
    let outcome = work.run(&out, shard, renderer.as_mut(), &mut |progress| {
        let (start, found) = *begun.get_or_insert_with(|| {
            // What is there already says nothing about the rate.
            bar.set_length(progress.all as u64);
            bar.set_position(progress.done as u64);
            bar.reset_eta();
            (Instant::now(), progress.done)
        });
        // Where no terminal shows the bar, a line tells now and then; `--quiet` turns warnings off, too.
        if bar.is_hidden() && log::log_enabled!(log::Level::Warn) && told.elapsed() >= LINE_EVERY && progress.done > found {
            told = Instant::now();
            let per_s = (progress.done - found) as f64 / start.elapsed().as_secs_f64();
            let left_s = (progress.all - progress.done) as f64 / per_s;
            eprintln!("{} of {} panoramas, {per_s:.1} a second, {left_s:.0} s left", progress.done, progress.all);
        }
        bar.set_position(progress.done as u64);
        bar.flow()
    })?;
    drop(bar);
    let (worlds, left_out, parts) = match &work {
        Work::One(plan) => (None, plan.left_out(), plan.parts.len()),
        Work::Many(series) => (Some(series.worlds()), 0, series.parts()),
    };
    let made = Made {
        worlds,
        frames: work.frames(),
        rendered: outcome.rendered,
        found: outcome.found,
        left_out,
        parts,
        complete: outcome.complete,
        layout: args.layout,
        renderer: renderer.info().clone(),
    };
    context.print_made(&made, &out, || text(&made, &out))?;
    Ok(Verdict::Done)
}

fn text(o: &Made, out: &Path) -> String {
    let mut text = format!("{} of {} panoramas", o.rendered, o.frames);
    if let Some(worlds) = o.worlds {
        let _ = write!(text, " of {worlds} worlds");
    }
    let _ = write!(text, " rendered on {} ({})", o.renderer.kind, o.renderer.adapter);
    if o.found > 0 {
        let _ = write!(text, ", {} were there", o.found);
    }
    if o.left_out > 0 {
        let _ = write!(text, "; {} poses left out, see left-out.csv", o.left_out);
    }
    let state = if o.complete { "complete" } else { "not complete yet: other shards are missing" };
    let _ = writeln!(text, "\nset in {} is {state}", out.display());
    text
}

fn request(args: &DatasetArgs, context: &Context) -> Request {
    let places = match (&args.grid, &args.route, &args.trajectory) {
        (Some((columns, rows)), _, _) => Places::Grid {
            columns: *columns,
            rows: *rows,
            spacing_m: args.spacing_m.unwrap_or_default(),
            origin_m: args.origin,
        },
        (_, Some(path), _) => Places::Route(path.clone()),
        (_, _, Some(path)) => Places::Trajectory(path.clone()),
        _ => Places::Random(args.count.or(args.random).unwrap_or_default()),
    };
    let conditions = if args.conditions.is_empty() { vec![Condition::original()] } else { args.conditions.clone() };
    Request {
        places,
        headings: args.headings.as_ref().map_or(Headings::Own, |h| h.0.clone()),
        conditions,
        size_px: args.size,
        layout: args.layout,
        seed: args.seed,
        licence: args.license.clone(),
        // Without what the set's bytes do not depend on; the renderer is noted by itself.
        command: context.command_line(&["shard", "renderer", "out"]),
    }
}

fn inspect(dir: &Path, context: &Context) -> Result<Verdict> {
    let bar = context.work(0)?;
    let found = check(dir, &|done, all| {
        bar.set_length(all);
        bar.set_position(done);
        bar.flow()
    })?;
    drop(bar);
    let whole = found.faults.is_empty();
    context.print(&Checked { whole, inspection: &found }, || report::inspection(&found, dir))?;
    if !whole {
        bail!("{}: {} faults; remove what is extra and run the command of its README again", dir.display(), found.faults.len());
    }
    Ok(Verdict::Done)
}
