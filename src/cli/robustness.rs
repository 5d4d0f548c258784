//! `wayhome robustness`: success against conditions that worsen one at a time.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use anyhow::Result;
use wayhome::Error;
use wayhome::episode::{PlantKind, Setup};
use wayhome::report::robustness as report;
use wayhome::study::robustness::{Axis, run as run_study, study};
use wayhome::world::World;

use super::context::{Context, Verdict, open_folder};
use super::setup::{MethodArgs, SetupArgs};
use super::values::{choice, range, seeds};

/// Arguments of `robustness`.
#[derive(Debug, clap::Args)]
#[command(mut_arg("bearings", |arg| arg.help("Where bearings come from, before they are made worse")))]
pub struct RobustnessArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "lab")]
    pub world: String,
    /// Run all seeds from A to B, both included, at every level
    #[arg(long, value_name = "A..B", default_value = "1..40", value_parser = seeds)]
    pub seeds: RangeInclusive<u64>,
    /// What gets worse; several are separated by commas [default: all]
    #[arg(long, value_name = "AXIS", value_delimiter = ',', value_parser = choice::<Axis>())]
    pub axis: Vec<Axis>,
    #[command(flatten)]
    pub method: MethodArgs,
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Folder for the results [default: results/runs/robustness-WORLD-SEEDS]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

pub fn run(args: &RobustnessArgs, context: &Context) -> Result<Verdict> {
    let setup = Setup { method: args.method.kind(), law: args.method.controller, ..args.setup.setup() };
    setup.check()?;
    let study = study(&args.world, &setup, &args.axis, &args.seeds)?;
    if setup.plant == PlantKind::Unicycle && (args.axis.is_empty() || args.axis.contains(&Axis::Friction)) {
        let (found, allowed) = ("--plant unicycle, which does not slip".into(), "--plant rapier, or other axes".into());
        return Err(Error::Invalid { what: "plant for --axis friction".into(), found, allowed }.into());
    }
    let parts = ["robustness", &World::open(&args.world)?.spec.name, &range(&args.seeds)];
    let (out, folder) = open_folder(args.out.as_deref(), &parts, "robustness")?;
    let bar = context.progress(Some(study.episodes()))?;
    let study = run_study(&study, &context.pool(), &|row| bar.done(study.place_in_words(row)))?;
    drop(bar);
    report::write(folder, &study, &context.command_line(&[]))?;
    context.print_made(&study, &out, || format!("{}\nfiles  {}\n", report::table(&study), out.display()))?;
    Ok(Verdict::Done)
}
