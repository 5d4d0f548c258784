//! `wayhome dataset`: panorama sets in the field's layouts, their check, and how fast they are made.

use std::f64::consts::PI;
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Result, bail};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use strum::EnumMessage;
use wayhome::dataset::check::{Inspection, check};
use wayhome::dataset::conditions::{CHANGES, Condition};
use wayhome::dataset::pipeline::Job;
use wayhome::dataset::plan::{Headings, Places, Plan, Request};
use wayhome::panorama_set::{LayoutKind, Place};
use wayhome::render::{self, RendererChoice};
use wayhome::report::dataset as report;
use wayhome::sensor::DatasetChoice;
use wayhome::storage::OutputFolder;
use wayhome::verify::dataset as speed;
use wayhome::world::World;

use super::Verdict;
use super::args::{RENDERERS, choice, number, positive, quoted, size};
use super::context::{Context, default_folder};

/// Shown under `dataset --help`.
pub const HELP: &str = "A route is CSV with columns x_m, y_m and perhaps heading_deg or heading_rad. Poses at which the robot cannot stand are left out
and listed. A set that was interrupted is gone on with by the same command. Shards may share a folder, or their folders may be
copied over one another; the same command without --shard then completes the set.

Exit codes:
  0    done
  1    failed: a file or a folder; or `check` found faults
  2    usage: an argument or one of its values is not allowed
  130  interrupted by Ctrl-C; what is there is whole";

/// The layouts that are written, with the first lines of their docs as help.
fn layouts() -> impl TypedValueParser<Value = LayoutKind> {
    let names = LayoutKind::written().map(|kind| {
        let about = kind.get_documentation().and_then(|text| text.lines().next()).unwrap_or_default();
        PossibleValue::new(kind.name()).help(about.trim_end_matches('.'))
    });
    PossibleValuesParser::new(names).try_map(|name| name.parse::<LayoutKind>())
}

/// Arguments of `dataset`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, after_help = HELP)]
#[command(group = clap::ArgGroup::new("places").args(["grid", "route", "random", "trajectory"]))]
pub struct DatasetArgs {
    #[command(subcommand)]
    pub command: Option<DatasetCommand>,
    /// World file, or the name of a built-in world
    #[arg(required = true)]
    pub world: Option<String>,
    /// Places along x and y
    #[arg(long, value_name = "NXxNY", value_parser = grid, requires = "spacing_m", required_unless_present_any = ["route", "random", "trajectory"])]
    pub grid: Option<(usize, usize)>,
    /// Distance between places of the grid, m
    #[arg(long, value_name = "S", requires = "grid", allow_negative_numbers = true, value_parser = positive)]
    pub spacing_m: Option<f64>,
    /// Place of the grid with the least x and y [default: home on a place, the grid about the middle of the room]
    #[arg(long, value_name = "X,Y", requires = "grid", allow_hyphen_values = true, value_parser = point)]
    pub origin: Option<[f64; 2]>,
    /// The points of a table
    #[arg(long, value_name = "FILE.csv")]
    pub route: Option<PathBuf>,
    /// So many random places
    #[arg(long, value_name = "N")]
    pub random: Option<usize>,
    /// The poses of a run: its folder or its trajectory.csv
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
    #[arg(long, default_value = "folder", value_parser = layouts())]
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
    pub shard: Option<(usize, usize)>,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice(RENDERERS))]
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
    /// How fast sets are made, beside rendering and encoding alone, and what codings of pictures cost
    Bench {
        /// World file, or the name of a built-in world
        #[arg(long, default_value = "lab")]
        world: String,
        /// Panoramas of a round
        #[arg(long, value_name = "N", default_value = "1500", value_parser = clap::value_parser!(u32).range(1..=100_000))]
        frames: u32,
        /// Folder for the page [default: none]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

/// The set that `--bearings dataset` looks at.
#[derive(Debug, Clone, clap::Args)]
pub struct SetArgs {
    /// Set of panoramas for `--bearings dataset`, in any layout that `dataset` writes, or a real one
    #[arg(long, value_name = "DIR", required_if_eq("bearings", "dataset"))]
    pub dataset: Option<PathBuf>,
    /// Condition of the set [default: its first]
    #[arg(long, value_name = "NAME", requires = "dataset")]
    pub dataset_condition: Option<String>,
    /// Condition of the home panorama, if another than on the way
    #[arg(long, value_name = "NAME", requires = "dataset")]
    pub dataset_home_condition: Option<String>,
    /// Distance between places of a set that does not tell it, m
    #[arg(long, value_name = "S", requires = "dataset", allow_negative_numbers = true, value_parser = positive)]
    pub dataset_spacing_m: Option<f64>,
    /// Row and column of home, from 0, of a set that does not tell it [default: the middle]
    #[arg(long, value_name = "I,J", requires = "dataset", value_parser = place)]
    pub dataset_home: Option<Place>,
}

impl SetArgs {
    /// What they stand for.
    pub fn choice(&self) -> Option<DatasetChoice> {
        self.dataset.as_ref().map(|folder| DatasetChoice {
            folder: folder.clone(),
            condition: self.dataset_condition.clone(),
            home_condition: self.dataset_home_condition.clone(),
            spacing_m: self.dataset_spacing_m,
            home: self.dataset_home,
        })
    }
}

fn place(text: &str) -> Result<Place, String> {
    let numbers = text.split_once(',').and_then(|(i, j)| Some((i.trim().parse().ok()?, j.trim().parse().ok()?)));
    numbers.map(|(i, j)| Place { i, j }).ok_or_else(|| "a place is I,J: its row and column, from 0".into())
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
    let numbers = text.split_once('x').and_then(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)));
    numbers.filter(|(x, y)| *x > 0 && *y > 0).ok_or_else(|| "a grid is NXxNY, such as 17x10, with at least one place".into())
}

fn point(text: &str) -> Result<[f64; 2], String> {
    let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    numbers.try_into().map_err(|_| "a point is X,Y".into())
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

fn shard(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    numbers.filter(|(i, n)| (1..=*n).contains(i)).ok_or_else(|| "a shard is I/N with I from 1 to N, such as 2/4".into())
}

/// What `--json` prints of a set.
#[derive(Serialize)]
struct Output {
    frames: usize,
    rendered: usize,
    found: usize,
    left_out: usize,
    parts: usize,
    complete: bool,
    layout: LayoutKind,
    renderer: render::RendererInfo,
    out: String,
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
        Some(DatasetCommand::Bench { world, frames, out }) => bench(world, *frames as usize, out.as_deref(), context),
        None => make(args, context),
    }
}

fn make(args: &DatasetArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(args.world.as_deref().unwrap_or_default())?;
    let plan = Plan::new(&world, request(args))?;
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["dataset", &world.spec.name, &args.seed.to_string()]));
    let mut renderer = render::create(args.renderer)?;
    let bar = context.work(plan.frames() as u64)?;
    let mut begun = false;
    let job = Job { plan: &plan, out: &out, shard: args.shard.unwrap_or((1, 1)), extras: &report::card };
    let outcome = job.run(renderer.as_mut(), &mut |progress| {
        if !begun {
            // What is there already says nothing about the rate.
            bar.set_length(progress.all as u64);
            bar.set_position(progress.done as u64);
            bar.reset_eta();
            begun = true;
        }
        bar.set_position(progress.done as u64);
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    bar.finish_and_clear();
    let output = Output {
        frames: plan.frames(),
        rendered: outcome.rendered,
        found: outcome.found,
        left_out: plan.left_out(),
        parts: plan.parts.len(),
        complete: outcome.complete,
        layout: args.layout,
        renderer: renderer.info().clone(),
        out: out.display().to_string(),
    };
    context.print(&output, || text(&output))?;
    Ok(Verdict::Done)
}

fn text(o: &Output) -> String {
    let mut text = format!("{} of {} panoramas rendered on {} ({})", o.rendered, o.frames, o.renderer.kind, o.renderer.adapter);
    if o.found > 0 {
        let _ = write!(text, ", {} were there", o.found);
    }
    if o.left_out > 0 {
        let _ = write!(text, "; {} poses left out, see left-out.csv", o.left_out);
    }
    let state = if o.complete { "complete" } else { "not complete yet: other shards are missing" };
    let _ = writeln!(text, "\nset in {} is {state}", o.out);
    text
}

fn request(args: &DatasetArgs) -> Request {
    let places = match (&args.grid, &args.route, &args.trajectory) {
        (Some((columns, rows)), _, _) => Places::Grid {
            columns: *columns,
            rows: *rows,
            spacing_m: args.spacing_m.unwrap_or_default(),
            origin_m: args.origin,
        },
        (_, Some(path), _) => Places::Route(path.clone()),
        (_, _, Some(path)) => Places::Trajectory(path.clone()),
        _ => Places::Random(args.random.unwrap_or_default()),
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
        command: command(args),
    }
}

/// The command, without what the set's bytes do not depend on: threads, shards, the folder.
fn command(args: &DatasetArgs) -> String {
    let mut text = format!("wayhome dataset {}", quoted(args.world.as_deref().unwrap_or_default()));
    let mut flag = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            let _ = write!(text, " --{name} {}", quoted(&value));
        }
    };
    let path = |path: &Option<PathBuf>| path.as_ref().map(|p| p.display().to_string());
    flag("grid", args.grid.map(|(x, y)| format!("{x}x{y}")));
    flag("spacing-m", args.spacing_m.map(|s| s.to_string()));
    flag("origin", args.origin.map(|[x, y]| format!("{x},{y}")));
    flag("route", path(&args.route));
    flag("random", args.random.map(|n| n.to_string()));
    flag("trajectory", path(&args.trajectory));
    flag(
        "headings",
        args.headings.as_ref().map(|h| match &h.0 {
            Headings::Own => String::new(),
            Headings::Random(n) => format!("random:{n}"),
            Headings::Fixed(all) => all.iter().map(|h| (h / PI * 180.0).to_string()).collect::<Vec<_>>().join(","),
        }),
    );
    let conditions: Vec<&str> = args.conditions.iter().map(Condition::given).collect();
    flag("conditions", (!conditions.is_empty()).then(|| conditions.join(",")));
    flag("layout", Some(args.layout.name().to_owned()));
    flag("size", args.size.map(|(w, h)| format!("{w}x{h}")));
    flag("seed", Some(args.seed.to_string()));
    flag("license", Some(args.license.clone()));
    text
}

fn inspect(dir: &Path, context: &Context) -> Result<Verdict> {
    let bar = Mutex::new(context.work(0)?);
    let found = check(dir, &|done, all| {
        if let Ok(bar) = bar.lock() {
            bar.set_length(all);
            bar.set_position(done);
        }
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    if let Ok(bar) = bar.lock() {
        bar.finish_and_clear();
    }
    let whole = found.faults.is_empty();
    context.print(&Checked { whole, inspection: &found }, || report::inspection(&found, dir))?;
    if !whole {
        bail!("{}: {} faults; remove what is extra and run the command of its README again", dir.display(), found.faults.len());
    }
    Ok(Verdict::Done)
}

fn bench(world: &str, frames: usize, out: Option<&Path>, context: &Context) -> Result<Verdict> {
    let world = World::open(world)?;
    let folder = out.map(|out| OutputFolder::open(out, "dataset bench", report::FILES)).transpose()?;
    let bar = context.progress(None)?;
    let found = speed::measure(&world, frames, &std::env::temp_dir(), &|what| {
        bar.set_message(what.to_owned());
        bar.tick();
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    bar.finish_and_clear();
    if let Some(mut folder) = folder {
        folder.write("README.md", report::speed_page(&found).as_bytes())?;
        folder.write("speed.json", wayhome::storage::json(&found).as_bytes())?;
        folder.finish()?;
    }
    context.print(&found, || report::speed_text(&found))?;
    Ok(Verdict::Done)
}
