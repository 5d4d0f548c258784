//! The command line: one file a subcommand, each a `run(args, context)`.
//!
//! Results go to stdout, diagnostics and progress to stderr. A subcommand returns a [`Verdict`] or an error; `main` turns that
//! into an exit code.

pub mod args;
mod bound;
mod compare;
mod context;
mod dataset;
mod drive;
mod home;
mod method_args;
mod observability;
mod physics_report;
mod record_args;
mod render;
mod render_report;
mod reproduce;
mod robustness;
mod sweep;
mod threads;
mod vision_report;
mod world;

use anyhow::Result;

use args::{Args, Command};
use context::Context;

/// What a command that ran to its end came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Done; where the task was to come home, home was reached.
    Done,
    /// The run ended without reaching home.
    NotHome,
}

/// Runs the command.
pub fn run(args: Args) -> Result<Verdict> {
    let context = Context::new(&args.common)?;
    match args.command {
        Command::Dataset(args) => dataset::run(&args, &context),
        Command::Drive(args) => drive::run(&args, &context),
        Command::Home(args) => home::run(&args, &context),
        Command::PhysicsReport(args) => physics_report::run(&args, &context),
        Command::Robustness(args) => robustness::run(&args, &context),
        Command::Sweep(args) => sweep::run(&args, &context),
        Command::Bound(args) => bound::run(&args, &context),
        Command::Compare(args) => compare::run(&args, &context),
        Command::Observability(args) => observability::run(&args, &context),
        Command::Reproduce(args) => reproduce::run(&args, &context),
        Command::Render(args) => render::run(&args, &context),
        Command::VisionReport(args) => vision_report::run(&args, &context),
        Command::RenderReport(args) => render_report::run(&args, &context),
        Command::World(args) => world::run(&args, &context),
    }
}
