//! The command line: one file a subcommand, each with its arguments and a `run(args, context)`.
//!
//! Results go to stdout, diagnostics and progress to stderr. A subcommand returns a [`Verdict`] or an error; `main` turns that
//! into an exit code. Subcommands import [`values`], [`setup`] and [`context`], and none of them another one or this file;
//! but `render --bench` and `dataset bench` are old names of parts of [`verify`].
//!
//! Knows of: everything below; nothing imports it.

mod bearings;
mod bound;
mod changes;
mod compare;
mod context;
mod dataset;
mod drive;
mod evaluate;
mod generate;
mod home;
mod lens;
mod map;
mod observability;
mod render;
mod reproduce;
mod robustness;
mod route;
mod setup;
mod sweep;
mod threads;
mod values;
mod verify;
mod world;

use anyhow::Result;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use context::{CommonArgs, Context};

pub use context::{INTERRUPTED, Verdict};

/// Shown under `--help` of all subcommands.
const EXIT_CODES: &str = "Exit codes:
  0    done; for a single run of `home`: home was reached
  1    failed: what a file or a folder holds does not serve, or the machine lacks something
  2    usage: an argument or one of its values is not allowed
  3    a single run of `home` ended without reaching home
  130  interrupted by Ctrl-C; what is finished is kept, nothing half written is left behind";

/// Headless, physics-simulated robot testbed for bearing-only visual homing
#[derive(Debug, Parser)]
#[command(version = wayhome::VERSION)]
struct Args {
    #[command(flatten)]
    common: CommonArgs,
    #[command(subcommand)]
    command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
enum Command {
    /// Drive home: one closed-loop run, or one a seed
    Home(Box<home::HomeArgs>),
    /// Drive a table of commands open loop and record truth, odometry, wheels, slip and forces
    Drive(drive::DriveArgs),
    /// Hold the project against closed forms, other programs and its own speed, each as a page
    Verify(verify::VerifyArgs),
    /// The same as `verify physics`
    #[command(hide = true)]
    PhysicsReport(verify::PhysicsArgs),
    /// The same as `verify vision`
    #[command(hide = true)]
    VisionReport(verify::VisionArgs),
    /// The same as `verify render`
    #[command(hide = true)]
    RenderReport(verify::RenderArgs),
    /// Every method from the same starts: success, time, path, final error, AAE, catchment area
    Compare(Box<compare::CompareArgs>),
    /// Rebuild the paper's tables and figures beside the printed numbers, and audit its claims
    Reproduce(reproduce::ReproduceArgs),
    /// Where the paper's state can be told from bearings and motion: rank and condition over a room
    Observability(observability::ObservabilityArgs),
    /// Success against conditions that worsen one at a time, as a table and a picture
    Robustness(Box<robustness::RobustnessArgs>),
    /// Stress studies: Monte-Carlo sweeps over any settings, on one machine or many, and their report
    Sweep(Box<sweep::SweepArgs>),
    /// Cramer-Rao bound of range, bearing and heading along a path, and the filter's errors beside it
    Bound(bound::BoundArgs),
    /// Teach a chain of snapshots along a way, and follow it by visual homing
    Route(route::RouteArgs),
    /// Render panoramas with range and instance ids: of a pose, along a trajectory, or several on a sheet
    Render(Box<render::RenderArgs>),
    /// Panorama sets with ground truth in the field's layouts, and their check
    Dataset(Box<dataset::DatasetArgs>),
    /// What your own pictures say of the way home: bearings, visual compass, direction of home, and how sure they are
    Bearings(Box<bearings::BearingsArgs>),
    /// How well the panoramas of a set, or your own pictures with poses, show the way to one another
    Evaluate(Box<evaluate::EvaluateArgs>),
    /// Check, draw and describe world files
    World(world::WorldArgs),
}

/// The whole command line. What a subcommand says under its help stands above the exit codes, which are the same for all.
fn command() -> clap::Command {
    Args::command().after_help(EXIT_CODES).mut_subcommands(|subcommand| {
        let own = subcommand.get_after_help().map_or_else(String::new, |help| format!("{help}\n\n"));
        subcommand.after_help(own + EXIT_CODES)
    })
}

/// Does what the process' arguments say. On a fault in them clap explains and leaves with 2, after `--help` and `--version` with 0.
pub fn run() -> Result<Verdict> {
    let mut command = command();
    let matches = command.get_matches_mut();
    let args = Args::from_arg_matches(&matches).unwrap_or_else(|fault| fault.format(&mut command).exit());
    let context = &Context::new(&args.common, command, matches)?;
    match args.command {
        Command::Bearings(args) => bearings::run(&args, context),
        Command::Bound(args) => bound::run(&args, context),
        Command::Compare(args) => compare::run(&args, context),
        Command::Dataset(args) => dataset::run(&args, context),
        Command::Drive(args) => drive::run(&args, context),
        Command::Evaluate(args) => evaluate::run(&args, context),
        Command::Home(args) => home::run(&args, context),
        Command::Observability(args) => observability::run(&args, context),
        Command::PhysicsReport(args) => verify::physics(&args, context),
        Command::Render(args) => render::run(&args, context),
        Command::RenderReport(args) => verify::render(&args, context),
        Command::Reproduce(args) => reproduce::run(&args, context),
        Command::Robustness(args) => robustness::run(&args, context),
        Command::Route(args) => route::run(&args, context),
        Command::Sweep(args) => sweep::run(&args, context),
        Command::Verify(args) => verify::run(&args, context),
        Command::VisionReport(args) => verify::vision(&args, context),
        Command::World(args) => world::run(&args, context),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_command_line_is_consistent() {
        super::command().debug_assert();
    }
}
