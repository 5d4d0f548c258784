//! `wayhome evaluate`: how well panoramas of a set show the way to one another.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use anyhow::Result;
use strum::VariantArray;
use wayhome::homing::HomingKind;
use wayhome::panorama_set::{LayoutKind, PanoramaSet};
use wayhome::report::pairs as report;
use wayhome::study::field::{self, FieldSummary};
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
    /// Condition in which home was seen [default: the same]
    #[arg(long, value_name = "CONDITION")]
    pub home_condition: Option<String>,
    /// How many panoramas are home in turn, evenly spread over the set [default: all]
    #[arg(long, value_name = "N")]
    pub homes: Option<NonZeroUsize>,
    /// Distance between neighbouring places of a grid that does not tell, m
    #[arg(long, value_name = "M", value_parser = positive)]
    pub spacing_m: Option<f64>,
    /// Methods; several are separated by commas [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = choice::<HomingKind>())]
    pub methods: Vec<HomingKind>,
    /// Pairs of one room that are farther apart are passed over, m [default: 5; none of a grid]
    #[arg(long, value_name = "M", value_parser = positive)]
    pub farthest_m: Option<f64>,
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
    let condition = args.condition.as_ref().unwrap_or(&first);
    let homes = set.clone().only(args.home_condition.as_ref().unwrap_or(condition))?.posed(args.spacing_m);
    let set = set.only(condition)?.posed(args.spacing_m);
    let is_grid = set.grid(args.spacing_m, None).is_some();
    let farthest_m = args.farthest_m.unwrap_or(if is_grid { f64::INFINITY } else { FARTHEST_M });
    let mut methods = args.methods.clone();
    if methods.is_empty() {
        methods = HomingKind::VARIANTS.to_vec();
    }
    let name = args.set.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let (out, folder) = open_folder(args.out.as_deref(), &["evaluate", &name], "evaluate")?;
    let count = args.homes.map(NonZeroUsize::get);
    let bar = context.progress(Some((methods.len() * count.unwrap_or(homes.entries().len())) as u64))?;
    let pairs = Pairs { methods, farthest_m, homes: count, tolerance_rad: args.tolerance_deg.to_radians() };
    let rows = pairs.run(&homes, &set, &context.pool(), &|| bar.done(""))?;
    drop(bar);
    let homes = field::fields(&rows, &set, args.spacing_m);
    report::write(folder, &rows, &homes, args.tolerance_deg, &context.command_line(&["out"]))?;
    let evaluated = Evaluated { summaries: summaries(&rows), fields: field::summaries(&homes) };
    context.print_made(&evaluated, &out, || {
        let pairs = report::summary(&evaluated.summaries);
        let fields = if evaluated.fields.is_empty() { String::new() } else { report::field_summary(&evaluated.fields) + "\n" };
        format!("{pairs}\n{fields}files  {}\n", out.display())
    })?;
    Ok(Verdict::Done)
}

/// Pairs farther apart have little to say in a room, m.
const FARTHEST_M: f64 = 5.0;

/// What `--json` prints beside the folder.
#[derive(serde::Serialize)]
struct Evaluated {
    summaries: Vec<PairSummary>,
    fields: Vec<FieldSummary>,
}
