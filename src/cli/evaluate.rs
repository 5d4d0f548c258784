//! `wayhome evaluate`: how well panoramas of a set show the way to one another.

use std::path::PathBuf;

use anyhow::Result;
use strum::VariantArray;
use wayhome::homing::HomingKind;
use wayhome::panorama_set::{LayoutKind, PanoramaSet};
use wayhome::report::pairs as report;
use wayhome::study::pairs::{PairSummary, Pairs, summaries};

use super::context::{Context, Verdict, open_folder};
use super::lens::LensArgs;
use super::values::{choice, positive};

/// Arguments of `evaluate`.
#[derive(Debug, clap::Args)]
pub struct EvaluateArgs {
    /// Folder of the set: one that this program or the field's tools wrote, or your own pictures with a table of poses
    pub set: PathBuf,
    /// Table of where pictures were taken: file, x_m, y_m, heading_deg and, where there are several, room [default: SET/poses.csv]
    #[arg(long, value_name = "FILE.csv")]
    pub poses: Option<PathBuf>,
    /// Condition of the set, where it has several [default: the first]
    #[arg(long)]
    pub condition: Option<String>,
    /// Methods; several are separated by commas [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = choice::<HomingKind>())]
    pub methods: Vec<HomingKind>,
    /// Pairs of one room that are farther apart are passed over, m
    #[arg(long, value_name = "M", default_value_t = 5.0, value_parser = positive)]
    pub farthest_m: f64,
    /// A landmark is right within this angle of where the poses put it
    #[arg(long, value_name = "DEG", default_value_t = 2.0, value_parser = positive)]
    pub tolerance_deg: f64,
    #[command(flatten)]
    pub lens: LensArgs,
    /// Folder for the results [default: results/runs/evaluate-SET]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

pub fn run(args: &EvaluateArgs, context: &Context) -> Result<Verdict> {
    let mut set = match &args.poses {
        Some(poses) => PanoramaSet::of_pictures(&args.set, Some(poses), args.lens.lens())?,
        None => PanoramaSet::open(&args.set)?,
    };
    if set.layout() == LayoutKind::Pictures {
        let lens = args.lens.lens_like(set.entries()[0].path())?;
        set = PanoramaSet::of_pictures(&args.set, args.poses.as_deref(), lens)?;
    }
    let first = set.conditions().first().map(|name| (*name).to_owned()).unwrap_or_default();
    let set = set.only(args.condition.as_ref().unwrap_or(&first))?;
    let mut methods = args.methods.clone();
    if methods.is_empty() {
        methods = HomingKind::VARIANTS.to_vec();
    }
    let name = args.set.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let (out, folder) = open_folder(args.out.as_deref(), &["evaluate", &name], "evaluate")?;
    let bar = context.progress(Some((methods.len() * set.entries().len()) as u64))?;
    let pairs = Pairs { methods, farthest_m: args.farthest_m, tolerance_rad: args.tolerance_deg.to_radians() };
    let rows = pairs.run(&set, &context.pool(), &|| bar.done(""))?;
    drop(bar);
    report::write(folder, &rows, args.tolerance_deg, &context.command_line(&["out"]))?;
    let summaries = summaries(&rows);
    let evaluated = Evaluated { summaries };
    context
        .print_made(&evaluated, &out, || format!("{}\nfiles  {}\n", report::summary(&evaluated.summaries), out.display()))?;
    Ok(Verdict::Done)
}

/// What `--json` prints beside the folder.
#[derive(serde::Serialize)]
struct Evaluated {
    summaries: Vec<PairSummary>,
}
