//! `wayhome compare`: every method from the same starts.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::episode::{PlantKind, SensorKind, Setup};
use wayhome::method::exec::ExecCommand;
use wayhome::render::RendererChoice;
use wayhome::report::compare as report;
use wayhome::storage::OutputFolder;
use wayhome::study::compare::{Comparison, Contender, compare, pick, runs};
use wayhome::world::World;

use super::Verdict;
use super::args::{BEARINGS, PLANTS, RENDERERS, bearings_name, choice, name_of, not_negative, positive, quoted, seeds, size};
use super::context::{Context, default_folder};
use super::method_args::{PatienceArgs, program};

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "lab")]
    pub world: String,
    /// What moves
    #[arg(long, default_value = "rapier", value_parser = choice(PLANTS))]
    pub plant: PlantKind,
    /// Where bearings come from
    #[arg(long, default_value = "noisy", value_parser = choice(BEARINGS))]
    pub bearings: SensorKind,
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
    /// Standard deviation of the compass of those that have one, degrees; programs have one if this is given [default: 0]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = not_negative)]
    pub compass_deg: Option<f64>,
    /// What renders
    #[arg(long, default_value = "auto", value_parser = choice(RENDERERS))]
    pub renderer: RendererChoice,
    /// Columns and rows of the panorama, 16x8 to 16384x4096 [default: the world's]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Time limit, s [default: the world's]
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
    pub time_limit_s: Option<f64>,
    /// Folder for the results [default: results/runs/compare-WORLD-SEEDS]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// What `--json` prints: the comparison and where the files are.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    comparison: &'a Comparison,
    out: String,
}

pub fn run(args: &CompareArgs, context: &Context) -> Result<Verdict> {
    let mut contenders = pick(&args.contenders)?;
    for (number, command) in (1..).zip(&args.method) {
        command.check()?;
        let command = command.clone().with_time_limit(args.patience.method_timeout_s);
        contenders.push(Contender::program(number, command, args.compass_deg.is_some()));
    }
    let world = World::open(&args.world)?;
    let setup = Setup {
        plant: args.plant,
        sensor: args.bearings,
        renderer: args.renderer,
        size_px: args.size,
        compass_sd_rad: Some(args.compass_deg.unwrap_or(0.0).to_radians()),
        time_limit_s: args.time_limit_s,
        ..Setup::default()
    };
    setup.check()?;
    let range = format!("{}..{}", args.seeds.start(), args.seeds.end());
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["compare", &world.spec.name, &range]));
    let folder = OutputFolder::open(&out, "compare", report::FILES)?;
    let places = usize::from(args.places);
    let bar = context.progress(Some(runs(&world, contenders.len(), &args.seeds, places)))?;
    bar.tick();
    let comparison = compare(&world, &setup, &contenders, &args.seeds, places, &context.pool(), &|contender| {
        bar.set_message(contender.key.to_string());
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    report::write(folder, &world, &comparison, &command(args))?;
    let output = Output { comparison: &comparison, out: out.display().to_string() };
    context.print(&output, || format!("{}\nfiles  {}\n", report::table(&comparison), out.display()))?;
    Ok(Verdict::Done)
}

/// The command that gives the same files, without what does not matter to them.
fn command(args: &CompareArgs) -> String {
    let mut words = vec![format!("wayhome compare {}", args.world)];
    let mut flag = |name: &str, value: String| words.push(format!("--{name} {value}"));
    flag("plant", name_of(PLANTS, &args.plant).to_owned());
    flag("bearings", bearings_name(args.bearings).to_owned());
    flag("seeds", format!("{}..{}", args.seeds.start(), args.seeds.end()));
    flag("places", args.places.to_string());
    if !args.contenders.is_empty() {
        flag("contenders", args.contenders.join(","));
    }
    for command in &args.method {
        flag("method", quoted(&format!("exec:{command}")));
    }
    // It matters for a program whether there is one; for the others only how good it is.
    if let Some(compass_deg) = args.compass_deg.filter(|deg| *deg > 0.0 || !args.method.is_empty()) {
        flag("compass-deg", compass_deg.to_string());
    }
    if args.bearings == SensorKind::Rendered {
        flag("renderer", name_of(RENDERERS, &args.renderer).to_owned());
    }
    if let Some((width, height)) = args.size {
        flag("size", format!("{width}x{height}"));
    }
    if let Some(limit) = args.time_limit_s {
        flag("time-limit-s", limit.to_string());
    }
    if let Some(out) = &args.out {
        flag("out", out.display().to_string());
    }
    words.join(" ")
}
