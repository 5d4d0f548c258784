//! `wayhome vision-report`: the extractor against ground truth, as a page.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::builder::RangedU64ValueParser;
use serde::Serialize;
use wayhome::Error;
use wayhome::draw::image::{colours_png, instance_png, range_png};
use wayhome::episode::PoseRecord;
use wayhome::panorama::Projection;
use wayhome::storage::{OutputFolder, write_atomically};
use wayhome::verify::vision::conditions::Axis;
use wayhome::verify::vision::outside;
use wayhome::verify::vision::page as report;
use wayhome::verify::vision::{Pair, VisionSettings, VisionStudy, cells, run as run_study};
use wayhome::vision::ExtractorSettings;
use wayhome::world::World;

use super::context::{Context, Verdict};
use super::values::choice;

/// Arguments of `vision-report`.
#[derive(Debug, clap::Args)]
pub struct VisionReportArgs {
    /// World files, or names of built-in worlds
    #[arg(default_values_t = ["lab".to_owned(), "slippery".to_owned(), "crowd".to_owned()], value_name = "WORLD")]
    pub worlds: Vec<String>,
    /// What is changed; several are separated by commas [default: all]
    #[arg(long, value_name = "AXIS", value_delimiter = ',', value_parser = choice::<Axis>())]
    pub axis: Vec<Axis>,
    /// Most features kept of a panorama, 16 to 10000 [default: the extractor's]
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(16..=10_000))]
    pub keypoints: Option<usize>,
    /// Seed of walkers, noise and what hides
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Folder, new or empty, for the panoramas of the distance axis, which tests/outside/opencv_features.py reads
    #[arg(long, value_name = "DIR")]
    pub pairs: Option<PathBuf>,
    /// Folder for the page; what other detectors made of the same pairs is shown if it lies there
    #[arg(long, value_name = "DIR", default_value = "results/vision")]
    pub out: PathBuf,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    study: &'a VisionStudy,
    out: String,
}

/// A panorama in `pairs.json`.
#[derive(Serialize)]
struct PairRecord {
    world: String,
    /// Start of its files' names.
    name: String,
    distance_m: f64,
    pose: PoseRecord,
    projection: Projection,
}

pub fn run(args: &VisionReportArgs, context: &Context) -> Result<Verdict> {
    let worlds = args.worlds.iter().map(|name| World::open(name)).collect::<Result<Vec<_>, _>>()?;
    if let Some(twice) = worlds.iter().enumerate().find(|(k, w)| worlds[..*k].iter().any(|v| v.spec.name == w.spec.name)) {
        let found = format!("two of the name `{}`", twice.1.spec.name);
        return Err(Error::Invalid { what: "worlds".into(), found, allowed: "worlds of different names".into() }.into());
    }
    let usual = ExtractorSettings::default();
    let keypoints = args.keypoints.unwrap_or(usual.features);
    let settings = VisionSettings {
        extractor: ExtractorSettings { features: keypoints, home_features: keypoints, ..usual },
        axes: Axis::ALL.into_iter().filter(|axis| args.axis.is_empty() || args.axis.contains(axis)).collect(),
        seed: args.seed,
    };
    let folder = OutputFolder::open(&args.out, "vision-report", report::FILES)?;
    if let Some(pairs) = &args.pairs {
        claim(pairs)?;
    }
    // What other detectors made of the same pairs is kept and shown.
    let outside = std::fs::read_to_string(args.out.join(outside::FILE)).ok();
    let bar = context.progress(Some((worlds.len() * cells(&settings)) as u64))?;
    bar.tick();
    let mut records = Vec::new();
    let mut take = |pair: &Pair<'_>| {
        args.pairs.as_deref().map_or(Ok(()), |folder| {
            records.push(write_pair(folder, pair)?);
            Ok(())
        })
    };
    let study = run_study(&worlds, &settings, &mut take, &|cell| {
        bar.set_message(format!("{} {} {}", cell.world, cell.axis.name(), cell.level));
        bar.inc(1);
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    bar.finish_and_clear();
    if let Some(pairs) = &args.pairs {
        write_atomically(&pairs.join("pairs.json"), wayhome::storage::json(&records).as_bytes())?;
    }
    report::write(folder, &study, &context.command_line(&["pairs"]), outside.as_deref())?;
    let output = Output { study: &study, out: args.out.display().to_string() };
    context.print(&output, || format!("{}files in {}\n", report::table(&study), args.out.display()))?;
    Ok(Verdict::Done)
}

/// Makes a folder for panoramas; one that holds anything is left alone.
fn claim(folder: &Path) -> Result<(), Error> {
    let failed = |action| move |source| Error::Io { action, path: folder.to_owned(), source };
    std::fs::create_dir_all(folder).map_err(failed("create folder"))?;
    match std::fs::read_dir(folder).map_err(failed("read folder"))?.next() {
        None => Ok(()),
        Some(entry) => {
            let found = entry.map_err(failed("read folder"))?.file_name();
            Err(Error::OutputTaken { path: folder.to_owned(), found: format!("`{}`", found.to_string_lossy()) })
        }
    }
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
        pose: pair.shot.pose.into(),
        projection: panorama.projection,
    })
}
