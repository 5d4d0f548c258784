//! `wayhome vision-report`: the extractor against ground truth, as a page.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
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

use super::Verdict;
use super::args::{VisionReportArgs, quoted};
use super::context::Context;

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
    report::write(folder, &study, &command(args), outside.as_deref())?;
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

/// The command that gives the same files, without what does not matter to them.
fn command(args: &VisionReportArgs) -> String {
    let mut words = vec!["wayhome vision-report".to_owned()];
    words.extend(args.worlds.iter().map(|w| quoted(w)));
    if !args.axis.is_empty() {
        words.push(format!("--axis {}", args.axis.iter().map(|a| a.name()).collect::<Vec<_>>().join(",")));
    }
    if let Some(keypoints) = args.keypoints {
        words.push(format!("--keypoints {keypoints}"));
    }
    if args.seed != 0 {
        words.push(format!("--seed {}", args.seed));
    }
    words.push(format!("--out {}", quoted(&args.out.display().to_string())));
    words.join(" ")
}
