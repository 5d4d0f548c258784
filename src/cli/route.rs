//! `wayhome route`: teaching a chain of snapshots, and repeating it.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Subcommand};
use wayhome::geometry::Vector2;
use wayhome::render::RendererChoice;
use wayhome::report::route::{self as report, RepeatSummary};
use wayhome::route::follow::{Begin, Engine, Way};
use wayhome::route::measure::{Measures, RepeatRow, RouteFigures};
use wayhome::route::repeat::{Repeat, Repeating, repeat};
use wayhome::route::rule::SnapshotRule;
use wayhome::route::scene::{EVERY, Stage};
use wayhome::route::store::{FileStore, Form, SnapshotStore};
use wayhome::route::teach::{Teaching, teach};
use wayhome::route::tour::tour;
use wayhome::world::World;

use super::changes::ChangeArgs;
use super::context::{Context, Verdict, folder_or, open_folder};
use super::setup::LookArgs;
use super::values::{choice, count, point, positive, range, seeds, share, size};

/// Arguments of `route`.
#[derive(Debug, Args)]
pub struct RouteArgs {
    #[command(subcommand)]
    command: RouteCommand,
}

#[derive(Debug, Subcommand)]
enum RouteCommand {
    /// Drive the robot along a way and have it keep snapshots
    Teach(Box<TeachArgs>),
    /// Follow a taught route by visual homing, once a seed, and hold it against the truth
    Repeat(Box<RepeatArgs>),
}

/// The camera of routes.
#[derive(Debug, Args)]
struct EyeArgs {
    /// Columns and rows of the panorama
    #[arg(long, value_name = "WxH", default_value = "720x90", value_parser = size)]
    size: (u32, u32),
    /// Control steps from one picture to the next
    #[arg(long, value_name = "N", default_value_t = EVERY, value_parser = clap::value_parser!(u64).range(1..=10))]
    every: u64,
    /// What renders
    #[arg(long, default_value = "cpu", value_parser = choice::<RendererChoice>())]
    renderer: RendererChoice,
    #[command(flatten)]
    look: LookArgs,
}

/// Arguments of `route teach`.
#[derive(Debug, Args)]
pub struct TeachArgs {
    /// World file, or the name of a built-in world
    world: String,
    #[command(flatten)]
    changes: ChangeArgs,
    /// Way-points x,y in the room, m, from the start to the end; those with a negative x come in a table
    #[arg(long, value_name = "x,y", num_args = 2.., value_parser = point, group = "way")]
    through: Vec<[f64; 2]>,
    /// Table of way-points: CSV with the columns x_m,y_m
    #[arg(long, value_name = "FILE", group = "way")]
    waypoints: Option<PathBuf>,
    /// Table of a path to be driven as it is, such as one drawn or recorded: CSV with the columns x_m,y_m
    #[arg(long, value_name = "FILE", group = "way")]
    path: Option<PathBuf>,
    /// Length of a tour from one far place to the next, m, for who names no way [default: 30]
    #[arg(long, value_name = "M", group = "way", value_parser = positive)]
    tour_m: Option<f64>,
    /// When a snapshot is kept: every, drift, shared, locale or waypoints
    #[arg(long, default_value = "every", value_parser = rule)]
    rule: SnapshotRule,
    /// Number of the rule: metres of `every`; share of the catchment or of the features of `drift` and `shared`; radians of `locale`
    #[arg(long, value_name = "X", value_parser = positive)]
    spacing: Option<f64>,
    /// Most features of a snapshot
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u16).range(8..=300))]
    features: u16,
    /// How much of their looks is kept
    #[arg(long, default_value = "full", value_parser = choice::<Form>())]
    form: Form,
    #[command(flatten)]
    eye: EyeArgs,
    /// Seed of slip, encoders and camera noise, and of a tour
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Folder for the route [default: results/runs/route-WORLD-SEED]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Arguments of `route repeat`.
#[derive(Debug, Args)]
pub struct RepeatArgs {
    /// Folder that `route teach` has written
    route: PathBuf,
    /// World in which it is repeated
    #[arg(long, value_name = "WORLD")]
    world: String,
    #[command(flatten)]
    changes: ChangeArgs,
    /// Seeds of the repeats, both included
    #[arg(long, value_name = "A..B", default_value = "1..10", value_parser = seeds)]
    seeds: RangeInclusive<u64>,
    /// What drives the legs: local-map, odometry, or any homing method
    #[arg(long, value_name = "METHOD", default_value = "local-map", value_parser = engine)]
    method: Engine,
    /// Drive it from its end to its start
    #[arg(long)]
    backwards: bool,
    /// Start anywhere along it, facing anywhere, without being told where
    #[arg(long)]
    anywhere: bool,
    /// Lift the robot on the way and set it down elsewhere along the route
    #[arg(long, conflicts_with = "anywhere")]
    kidnap: bool,
    /// Rounds, of a route that ends where it began
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    laps: u32,
    /// Share of the taught features that are hidden
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    hidden: f64,
    /// Friction of the floor [default: the world's]
    #[arg(long, value_name = "MU", value_parser = positive)]
    friction: Option<f64>,
    #[command(flatten)]
    eye: EyeArgs,
    /// Folder for the results [default: results/runs/repeat-WORLD-SEEDS]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn engine(name: &str) -> std::result::Result<Engine, String> {
    name.parse().map_err(|e: wayhome::Error| e.to_string())
}

fn rule(name: &str) -> std::result::Result<SnapshotRule, String> {
    SnapshotRule::named(name).map_err(|e| e.to_string())
}

pub fn run(args: &RouteArgs, context: &Context) -> Result<Verdict> {
    match &args.command {
        RouteCommand::Teach(args) => run_teach(args, context),
        RouteCommand::Repeat(args) => run_repeat(args, context),
    }
}

fn run_teach(args: &TeachArgs, context: &Context) -> Result<Verdict> {
    let world = args.changes.open(&args.world)?;
    let points = match (&args.waypoints, &args.path) {
        (Some(file), _) | (_, Some(file)) => report::read_points(file)?,
        _ if !args.through.is_empty() => args.through.iter().map(|[x, y]| Vector2::new(*x, *y)).collect(),
        _ => tour(&world, args.seed, args.tour_m.unwrap_or(30.0))?,
    };
    let rule = args.spacing.map_or(Ok(args.rule), |number| args.rule.with(number))?;
    let node_m = if args.form == Form::Small { 0.25 } else { Teaching::default().node_m };
    let teaching = Teaching { rule, features: args.features.into(), node_m, look: args.eye.look.look(), seed: args.seed };
    wayhome::route::teach::way(&world, &points)?; // before a folder is made for a way that cannot be driven
    let (out, folder) = open_folder(args.out.as_deref(), &["route", &world.spec.name, &args.seed.to_string()], "route teach")?;
    let stage = Stage::new(&world, args.eye.size, args.eye.every, args.eye.renderer)?;
    let bar = context.progress(None)?;
    let lesson = teach(&stage, &points, &teaching, &mut |share| bar.at(format!("{:.0} % of the way", 100.0 * share)))?;
    drop(bar);
    let figures = report::write_lesson(folder, &lesson, args.form, &world)?;
    context.print_made(&figures, &out, || format!("{}in           {}\n", report::lesson_text(&figures), out.display()))?;
    Ok(Verdict::Done)
}

fn run_repeat(args: &RepeatArgs, context: &Context) -> Result<Verdict> {
    let file = args.route.join(report::ROUTE_FILE);
    let route = FileStore { path: file.clone(), form: Form::Full }.recall()?;
    let (truth, taught_s) = report::read_truth(&args.route.join(report::TRUTH_FILE))?;
    let world: World = args.changes.open(&args.world)?;
    let stage = Stage::new(&world, args.eye.size, args.eye.every, args.eye.renderer)?;
    wayhome::route::repeat::check(&stage, &route, &truth)?;
    let repeating = Repeating {
        engine: args.method.clone(),
        way: if args.backwards { Way::Backwards } else { Way::Forwards },
        laps: args.laps,
        begin: if args.anywhere { Begin::Anywhere } else { Begin::AtStart },
        kidnap: args.kidnap,
        look: args.eye.look.look(),
        friction: args.friction,
        hidden: args.hidden,
    };
    let parts = ["repeat", &world.spec.name, &range(&args.seeds)];
    let out = folder_or(args.out.as_deref(), &parts);
    let (_, folder) = open_folder(Some(&out), &parts, "route repeat")?;
    let bar = context.progress(Some(count(&args.seeds)))?;
    let jobs: Vec<u64> = args.seeds.clone().collect();
    let work = |(): &mut (), seed: &u64, halted: &dyn Fn() -> bool| {
        let go_on = |_: f64| if halted() { std::ops::ControlFlow::Break(()) } else { std::ops::ControlFlow::Continue(()) };
        let done = repeat(&stage, &route, &truth, &repeating, *seed, &mut { go_on })?;
        bar.done("");
        Ok(done)
    };
    let repeats: Vec<Repeat> = context.pool().map(&jobs, || (), work)?;
    drop(bar);
    let rows: Vec<RepeatRow> = repeats.iter().map(RepeatRow::new).collect();
    let bytes = std::fs::metadata(&file).map_or(0, |data| data.len() as usize);
    let summary = RepeatSummary {
        route: RouteFigures::new(&route, &truth, bytes, taught_s, 0),
        measures: Measures::new(&rows, taught_s * f64::from(args.laps)),
        conditions: format!("`{}`\n", context.command_line(&["out"])),
        version: wayhome::VERSION,
    };
    report::write_repeats(folder, &summary, &rows, &repeats, (&world, &route, &truth))?;
    context.print_made(&summary, &out, || format!("{}in           {}\n", report::text(&summary), out.display()))?;
    Ok(Verdict::Done)
}
