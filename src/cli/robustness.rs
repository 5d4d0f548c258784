//! `wayhome robustness`: success against conditions that worsen one at a time.

use anyhow::Result;
use serde::Serialize;
use wayhome::episode::Setup;
use wayhome::report::robustness as report;
use wayhome::storage::OutputFolder;
use wayhome::study::robustness::{Axis, Robustness, batches, run as run_study};
use wayhome::world::World;

use super::Verdict;
use super::args::{RobustnessArgs, bearings_name, law_name, quoted, renderer_name};
use super::context::{Context, default_folder};

/// What `--json` prints: the study and where the files are.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    study: &'a Robustness,
    out: String,
}

pub fn run(args: &RobustnessArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let setup = Setup {
        sensor: args.bearings,
        method: args.patience.method(&args.method),
        law: args.controller,
        renderer: args.renderer,
        size_px: args.size,
        time_limit_s: args.time_limit_s,
        ..Setup::default()
    };
    setup.check()?;
    let axes = axes(args);
    let range = format!("{}..{}", args.seeds.start(), args.seeds.end());
    let out = args.out.clone().unwrap_or_else(|| default_folder(&["robustness", &world.spec.name, &range]));
    let folder = OutputFolder::open(&out, "robustness", report::FILES)?;
    let runs = batches(&axes) as u64 * (args.seeds.end() - args.seeds.start() + 1);
    let bar = context.progress(Some(runs))?;
    bar.tick();
    let study = run_study(&world, &setup, &axes, &args.seeds, &context.pool(), &|axis, level| {
        bar.set_message(format!("{} {level}", axis.name()));
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    report::write(folder, &study, &command(args))?;
    let output = Output { study: &study, out: out.display().to_string() };
    context.print(&output, || format!("{}\nfiles  {}\n", report::table(&study), out.display()))?;
    Ok(Verdict::Done)
}

/// The axes asked for, each once and in the order of the report; all where none is named.
fn axes(args: &RobustnessArgs) -> Vec<Axis> {
    Axis::ALL.into_iter().filter(|axis| args.axis.is_empty() || args.axis.contains(axis)).collect()
}

/// The command that gives the same files, without what does not matter to them.
fn command(args: &RobustnessArgs) -> String {
    let mut words = vec!["wayhome robustness".to_owned(), quoted(&args.world)];
    let mut flag = |name: &str, value: String| words.push(format!("--{name} {}", quoted(&value)));
    flag("seeds", format!("{}..{}", args.seeds.start(), args.seeds.end()));
    if !args.axis.is_empty() {
        flag("axis", axes(args).iter().map(|a| a.name()).collect::<Vec<_>>().join(","));
    }
    flag("bearings", bearings_name(args.bearings).to_owned());
    flag("method", quoted(&args.method.to_string()));
    flag("controller", law_name(args.controller).to_owned());
    flag("renderer", renderer_name(args.renderer).to_owned());
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
