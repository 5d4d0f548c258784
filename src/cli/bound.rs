//! `wayhome bound`: how well R, theta and alpha can be known along a path, and how well the filter knows them.

use std::ops::ControlFlow;

use anyhow::Result;
use wayhome::report::bound as report;
use wayhome::study::bound::{BoundSettings, bound};
use wayhome::world::World;

use super::Verdict;
use super::args::BoundArgs;
use super::context::Context;

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
    let bar = context.progress(Some(args.seeds.end() - args.seeds.start() + 1))?;
    bar.tick();
    let result = bound(&world, &settings, &args.seeds, &|| {
        bar.inc(1);
        if context.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    bar.finish_and_clear();
    context.print(&result, || report::table(&result, args.every_s))?;
    Ok(Verdict::Done)
}
