//! `wayhome bound`: how well R, theta and alpha can be known along a path, and how well the filter knows them.

use std::ops::RangeInclusive;

use anyhow::Result;
use wayhome::episode::Start;
use wayhome::report::bound as report;
use wayhome::study::bound::{BoundSettings, bound};
use wayhome::world::World;

use super::context::{Context, Verdict};
use super::values::{count, positive, seeds, share, start};

/// Arguments of `bound`.
#[derive(Debug, clap::Args)]
pub struct BoundArgs {
    /// World file, or the name of a built-in world
    #[arg(default_value = "lab")]
    pub world: String,
    /// Runs of the filter along the path: one a seed from A to B, both included
    #[arg(long, value_name = "A..B", default_value = "1..200", value_parser = seeds)]
    pub seeds: RangeInclusive<u64>,
    /// Seed of the run whose path is taken
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub path_seed: u64,
    /// Start of the path: `random`, the name of one of the world's starts, or a pose x,y,heading_deg
    #[arg(long, default_value = "random", allow_hyphen_values = true, value_parser = start)]
    pub start: Start,
    /// Standard deviation of bearings, degrees [default: 0.3]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = positive)]
    pub noise_deg: Option<f64>,
    /// Noise of odometry as a share of speed and yaw rate, in each step anew [default: 0.04]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = share)]
    pub noise_odometry: Option<f64>,
    /// Runs whose mean NEES and NIS are held against their 95 % bands, group by group [default: all together]
    #[arg(long, value_name = "N")]
    pub group: Option<usize>,
    /// Time between rows of the table, s; `--json` has all steps
    #[arg(long, value_name = "S", default_value = "0.5", allow_negative_numbers = true, value_parser = positive)]
    pub every_s: f64,
}

pub fn run(args: &BoundArgs, context: &Context) -> Result<Verdict> {
    let world = World::open(&args.world)?;
    let usual = BoundSettings::default();
    let settings = BoundSettings {
        path_seed: args.path_seed,
        start: args.start.clone(),
        bearing_sd_rad: args.noise_deg.map_or(usual.bearing_sd_rad, f64::to_radians),
        odometry_share: args.noise_odometry.unwrap_or(usual.odometry_share),
        group: args.group,
    };
    let bar = context.progress(Some(count(&args.seeds)))?;
    let result = bound(&world, &settings, &args.seeds, &|| {
        bar.inc(1);
        bar.flow()
    })?;
    drop(bar);
    context.print(&result, || report::table(&result, args.every_s))?;
    Ok(Verdict::Done)
}
