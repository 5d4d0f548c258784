//! `wayhome verify`: the project held against closed forms, other programs and its own speed, each as a page.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::builder::RangedU64ValueParser;
use serde::Serialize;
use strum::VariantArray;
use wayhome::Error;
use wayhome::draw::image::{colours_png, instance_png, range_png};
use wayhome::geometry::Pose;
use wayhome::panorama::Projection;
use wayhome::storage::{OutputFolder, write_atomically};
use wayhome::verify::vision::condition::Factor;
use wayhome::verify::vision::{Pair, VisionSettings};
use wayhome::verify::{dataset, physics, render, vision};
use wayhome::vision::ExtractorSettings;
use wayhome::world::World;

use super::context::{Context, Verdict};
use super::values::{choice, positive};

/// Arguments of `verify`.
#[derive(Debug, clap::Args)]
pub struct VerifyArgs {
    #[command(subcommand)]
    pub command: VerifyCommand,
}

/// What is verified.
#[derive(Debug, clap::Subcommand)]
pub enum VerifyCommand {
    /// Hold the physics against its closed forms: a page of charts, and the slip map
    Physics(PhysicsArgs),
    /// Hold the extractor against ground truth: a page of tables and charts
    Vision(VisionArgs),
    /// How fast the renderer is and what it shows: a page with the speeds, and sheets of all worlds and presets
    Render(RenderArgs),
    /// How fast sets are made, beside rendering and encoding alone, and what codings of pictures cost
    Dataset(DatasetArgs),
}

/// Arguments of `verify physics`.
#[derive(Debug, clap::Args)]
pub struct PhysicsArgs {
    /// Folder for the page; trajectories of another engine that lie there are shown too
    #[arg(long, value_name = "DIR", default_value = "results/physics")]
    out: PathBuf,
}

/// Arguments of `verify vision`.
#[derive(Debug, clap::Args)]
pub struct VisionArgs {
    /// World files, or names of built-in worlds
    #[arg(default_values_t = ["lab".to_owned(), "slippery".to_owned(), "crowd".to_owned()], value_name = "WORLD")]
    worlds: Vec<String>,
    /// What is changed; several are separated by commas [default: all]
    #[arg(long, value_name = "AXIS", value_delimiter = ',', value_parser = choice::<Factor>())]
    axis: Vec<Factor>,
    /// Most features kept of a panorama, 16 to 10000 [default: the extractor's]
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(16..=10_000))]
    keypoints: Option<usize>,
    /// Seed of walkers, noise and what hides
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Folder, new or empty, for the panoramas of the distance axis, which tests/outside/opencv_features.py reads
    #[arg(long, value_name = "DIR")]
    pairs: Option<PathBuf>,
    /// Folder for the page; what other detectors made of the same pairs is shown if it lies there
    #[arg(long, value_name = "DIR", default_value = "results/vision")]
    out: PathBuf,
}

/// Arguments of `verify render`.
#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    /// Seconds that go into each figure
    #[arg(long, value_name = "S", default_value = "2", allow_negative_numbers = true, value_parser = positive)]
    seconds: f64,
    /// Folder for the page
    #[arg(long, value_name = "DIR", default_value = "results/rendering")]
    out: PathBuf,
}

/// Arguments of `verify dataset`.
#[derive(Debug, clap::Args)]
pub struct DatasetArgs {
    /// World file, or the name of a built-in world
    #[arg(long, default_value = "lab")]
    world: String,
    /// Panoramas of a round
    #[arg(long, value_name = "N", default_value = "1500", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Folder for the page [default: none]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn run(args: &VerifyArgs, context: &Context) -> Result<Verdict> {
    match &args.command {
        VerifyCommand::Physics(args) => physics(args, context),
        VerifyCommand::Vision(args) => vision(args, context),
        VerifyCommand::Render(args) => render(args, context),
        VerifyCommand::Dataset(args) => dataset(args, context),
    }
}

/// Prints what was measured and where its page is.
fn print<T: Serialize>(context: &Context, found: &T, out: &Path, text: impl FnOnce(&T) -> String) -> Result<Verdict> {
    context.print_made(found, out, || format!("{}files in {}\n", text(found), out.display()))?;
    Ok(Verdict::Done)
}

pub fn physics(args: &PhysicsArgs, context: &Context) -> Result<Verdict> {
    let folder = OutputFolder::open_shared(&args.out, "verify physics", "physics-report", physics::page::OUTSIDE)?;
    let found = physics::measure()?;
    physics::page::write(folder, &found)?;
    print(context, &found, &args.out, physics::page::text)
}

pub fn render(args: &RenderArgs, context: &Context) -> Result<Verdict> {
    let folder = OutputFolder::open_shared(&args.out, "verify render", "render-report", &[])?;
    let sheets = render::page::sheets()?;
    let found = render_speeds(args.seconds, context)?;
    render::page::write(folder, &found, &sheets)?;
    print(context, &found, &args.out, render::page::text)
}

/// `render --bench`: the speeds alone.
pub fn render_bench(context: &Context) -> Result<Verdict> {
    let found = render_speeds(1.0, context)?;
    context.print(&found, || render::page::text(&found))?;
    Ok(Verdict::Done)
}

/// Measures, with what has been found so far as progress.
fn render_speeds(seconds: f64, context: &Context) -> Result<render::RenderSpeeds> {
    let bar = context.progress(None)?;
    let found = render::measure(seconds, &mut |speed| {
        bar.println(render::page::line(speed));
        bar.tick();
        bar.go_on()
    })?;
    drop(bar);
    Ok(found)
}

pub fn dataset(args: &DatasetArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let open = |out| OutputFolder::open_shared(out, "verify dataset", "dataset bench", &[]);
    let folder = args.out.as_deref().map(open).transpose()?;
    let bar = context.progress(None)?;
    let found = dataset::measure(&world, args.frames as usize, &std::env::temp_dir(), &|what| bar.at(what.to_owned()))?;
    drop(bar);
    if let Some(folder) = folder {
        dataset::page::write(folder, &found)?;
    }
    context.print(&found, || dataset::page::text(&found))?;
    Ok(Verdict::Done)
}

pub fn vision(args: &VisionArgs, context: &Context) -> Result<Verdict> {
    let worlds = args.worlds.iter().map(|name| World::open(name)).collect::<Result<Vec<_>, _>>()?;
    if let Some(twice) = worlds.iter().enumerate().find(|(k, w)| worlds[..*k].iter().any(|v| v.spec.name == w.spec.name)) {
        let found = format!("two of the name `{}`", twice.1.spec.name);
        return Err(Error::Invalid { what: "worlds".into(), found, allowed: "worlds of different names".into() }.into());
    }
    let usual = ExtractorSettings::default();
    let keypoints = args.keypoints.unwrap_or(usual.features);
    let factors = Factor::VARIANTS.iter().copied();
    let settings = VisionSettings {
        extractor: ExtractorSettings { features: keypoints, home_features: keypoints, ..usual },
        factors: factors.filter(|factor| args.axis.is_empty() || args.axis.contains(factor)).collect(),
        seed: args.seed,
    };
    let folder = OutputFolder::open_shared(&args.out, "verify vision", "vision-report", vision::page::OUTSIDE)?;
    if let Some(pairs) = &args.pairs {
        claim(pairs)?;
    }
    let bar = context.progress(Some((worlds.len() * settings.levels()) as u64))?;
    let mut records = Vec::new();
    let mut take = |pair: &Pair<'_>| {
        if let Some(pairs) = &args.pairs {
            records.push(write_pair(pairs, pair)?);
        }
        Ok(())
    };
    let found = vision::measure(&worlds, &settings, &mut take, &|done| {
        bar.done(format!("{} {} {}", done.world, done.factor.name(), done.level));
        bar.flow()
    })?;
    drop(bar);
    if let Some(pairs) = &args.pairs {
        write_atomically(&pairs.join("pairs.json"), wayhome::storage::json(&records).as_bytes())?;
    }
    vision::page::write(folder, &found, &context.command_line(&["pairs"]))?;
    print(context, &found, &args.out, vision::page::text)
}

/// Makes a folder for panoramas; one that holds anything is left alone.
fn claim(folder: &Path) -> Result<(), Error> {
    let failed = |action| wayhome::storage::io_error(action, folder);
    std::fs::create_dir_all(folder).map_err(failed("create folder"))?;
    match std::fs::read_dir(folder).map_err(failed("read folder"))?.next() {
        None => Ok(()),
        Some(entry) => {
            let found = entry.map_err(failed("read folder"))?.file_name();
            Err(Error::OutputTaken { path: folder.to_owned(), found: format!("`{}`", found.to_string_lossy()) })
        }
    }
}

/// A panorama in `pairs.json`.
#[derive(Serialize)]
struct PairRecord {
    world: String,
    /// Start of its files' names.
    name: String,
    distance_m: f64,
    pose: Pose,
    projection: Projection,
}

fn write_pair(folder: &Path, pair: &Pair<'_>) -> Result<PairRecord, Error> {
    let world = &pair.world.spec.name;
    let name = match pair.place {
        None => format!("{world}-home"),
        Some(place) => format!("{world}-{}-{place}", pair.distance_m),
    };
    let panorama = &pair.shot.panorama;
    for (what, bytes) in [
        ("rgb", colours_png(panorama, "rgb.png")?),
        ("range", range_png(panorama, "range.png")?),
        ("instance", instance_png(panorama, "instance.png")?),
    ] {
        write_atomically(&folder.join(format!("{name}-{what}.png")), &bytes)?;
    }
    Ok(PairRecord {
        world: world.clone(),
        name,
        distance_m: pair.distance_m,
        pose: pair.shot.pose,
        projection: panorama.projection,
    })
}
