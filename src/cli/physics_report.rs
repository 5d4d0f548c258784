//! `wayhome physics-report`: the physics against its closed forms, as a page.

use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;
use wayhome::storage::OutputFolder;
use wayhome::verify::physics;
use wayhome::verify::physics::page as physics_report;

use super::context::{Context, Verdict};

/// Arguments of `physics-report`.
#[derive(Debug, clap::Args)]
pub struct PhysicsReportArgs {
    /// Folder for the page; trajectories of another engine that lie there are shown too
    #[arg(long, value_name = "DIR", default_value = "results/physics")]
    pub out: PathBuf,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output {
    closed_forms: Vec<Form>,
    out: String,
}

/// A closed form in numbers.
#[derive(Serialize)]
struct Form {
    name: &'static str,
    equation: &'static str,
    greatest_difference: f64,
    allowed: f64,
}

pub fn run(args: &PhysicsReportArgs, context: &Context) -> Result<Verdict> {
    let folder = OutputFolder::open(&args.out, "physics-report", physics_report::FILES)?;
    // What another engine made of the same drives and what the benchmark measured is kept and shown.
    let kept = |name: &str| std::fs::read_to_string(args.out.join(name)).ok();
    let findings = physics_report::Findings {
        closed_forms: physics::closed_forms()?,
        energy: physics::energy(),
        convergence: physics::convergence()?,
        slip_map: physics::slip_map()?,
        outside: kept(physics_report::OUTSIDE),
        speed: kept(physics_report::SPEED),
    };
    physics_report::write(folder, &findings)?;
    let forms = findings.closed_forms.iter().map(|f| Form {
        name: f.name,
        equation: f.equation,
        greatest_difference: f.worst,
        allowed: f.tolerance,
    });
    let output = Output { closed_forms: forms.collect(), out: args.out.display().to_string() };
    context.print(&output, || {
        let mut text = String::new();
        for form in &output.closed_forms {
            text += &format!(
                "{:20} {:44} off by {:9.5} % at most, {} % allowed\n",
                form.name,
                form.equation,
                100.0 * form.greatest_difference,
                100.0 * form.allowed
            );
        }
        text + &format!("files in {}\n", output.out)
    })?;
    Ok(Verdict::Done)
}
