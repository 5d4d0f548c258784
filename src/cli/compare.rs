//! `wayhome compare`: every method from the same starts.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use anyhow::Result;
use wayhome::episode::Setup;
use wayhome::method::exec::ExecCommand;
use wayhome::report::compare as report;
use wayhome::study::compare::{Contender, compare, pick, runs};

use super::changes::ChangeArgs;
use super::context::{Context, Verdict, open_folder};
use super::setup::{PatienceArgs, SetupArgs};
use super::values::{program, range, seeds};

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
#[command(mut_arg("bearings", |arg| arg.default_value("noisy")))]
#[command(mut_arg("compass_deg", |arg| arg.help(COMPASS_HELP)))]
pub struct CompareArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "lab")]
    pub world: String,
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// Random starts: one a seed from A to B, both included
    #[arg(long, value_name = "A..B", default_value = "1..20", value_parser = seeds)]
    pub seeds: RangeInclusive<u64>,
    /// About how many starts on an even grid there are beside, for AAE and catchment area; 0 for none
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u16).range(0..=2000))]
    pub places: u16,
    /// Contenders; several are separated by commas [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub contenders: Vec<String>,
    /// A program as one more contender, such as exec:"python3 my_method.py"; may be given several times
    #[arg(long, value_name = "exec:COMMAND", value_parser = program)]
    pub method: Vec<ExecCommand>,
    #[command(flatten)]
    pub patience: PatienceArgs,
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Folder for the results [default: results/runs/compare-WORLD-SEEDS]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

const COMPASS_HELP: &str =
    "Standard deviation of the compass of those that have one, degrees; programs have one if this is given [default: 0]";

pub fn run(args: &CompareArgs, context: &Context) -> Result<Verdict> {
    let setup = args.setup.setup();
    setup.check()?;
    let mut contenders = pick(&args.contenders)?;
    for (number, command) in (1..).zip(&args.method) {
        command.check()?;
        let command = command.clone().with_time_limit(args.patience.method_timeout_s);
        contenders.push(Contender::program(number, command, setup.compass_sd_rad.is_some()));
    }
    let setup = Setup { compass_sd_rad: Some(setup.compass_sd_rad.unwrap_or(0.0)), ..setup };
    let world = args.changes.open(&args.world)?;
    let parts = ["compare", &world.spec.name, &range(&args.seeds)];
    let (out, folder) = open_folder(args.out.as_deref(), &parts, "compare")?;
    let places = usize::from(args.places);
    let bar = context.progress(Some(runs(&world, contenders.len(), &args.seeds, places)))?;
    let watch = |contender: &Contender| bar.done(contender.key.to_string());
    let comparison = compare(&world, &setup, &contenders, &args.seeds, places, &context.pool(), &watch)?;
    drop(bar);
    report::write(folder, &world, &comparison, &context.command_line(&[]))?;
    context.print_made(&comparison, &out, || format!("{}\nfiles  {}\n", report::table(&comparison), out.display()))?;
    Ok(Verdict::Done)
}
