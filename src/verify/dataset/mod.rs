//! How fast sets are made, beside what rendering and encoding take by themselves, and which coding of pictures is worth its time.

pub mod page;

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use crate::dataset::conditions::Condition;
use crate::dataset::pipeline::Job;
use crate::dataset::plan::{Headings, Places, Plan, Request};
use crate::error::{Result, go_on};
use crate::panorama::{Panorama, Projection};
use crate::panorama_set::{
    LayoutKind, encode_instance, encode_range, encode_rgb, modes, packed_instance, packed_range, packed_rgb,
};
use crate::render::{CpuRenderer, Renderer, Scene, View};
use crate::verify::speed::{median, pool_of, processor, seconds};
use crate::world::World;

/// Sizes that are measured: Vardy's and the usual one.
pub const SIZES: [(u32, u32); 2] = [(561, 81), (1440, 180)];
/// Rounds whose median is taken.
const ROUNDS: usize = 5;
/// Different panoramas that are encoded again and again.
const SAMPLES: usize = 16;

/// Layouts that are measured: a file for each picture, and many pictures in an archive.
pub const LAYOUTS: [LayoutKind; 2] = [LayoutKind::Folder, LayoutKind::Webdataset];

/// Panoramas a second by themselves and all together.
#[derive(Debug, Clone, Serialize)]
pub struct SetRates {
    /// Layout of the set.
    pub layout: LayoutKind,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Threads of the pool.
    pub threads: usize,
    /// Panoramas of a round.
    pub frames: usize,
    /// Rendering alone, on all threads.
    pub render_per_s: f64,
    /// Encoding colours, range and instances alone, on all threads.
    pub encode_per_s: f64,
    /// The same two on one thread each: what a pipeline can do with a thread for each.
    pub render_one_per_s: f64,
    /// See there.
    pub encode_one_per_s: f64,
    /// The whole way to disk, truth and sums included, on all threads.
    pub pipeline_per_s: f64,
}

impl SetRates {
    /// Greatest share of the slower stage that is possible where both share all threads: the inverse of the sum of their times.
    pub fn bound_of_slower(&self) -> f64 {
        1.0 / (1.0 / self.render_per_s + 1.0 / self.encode_per_s) / self.render_per_s.min(self.encode_per_s)
    }

    /// Share of the slower stage alone with all threads to itself.
    pub fn share_of_slower(&self) -> f64 {
        self.pipeline_per_s / self.render_per_s.min(self.encode_per_s)
    }

    /// Share of the slower stage on one thread.
    pub fn share_of_slower_one(&self) -> f64 {
        self.pipeline_per_s / self.render_one_per_s.min(self.encode_one_per_s)
    }
}

/// A channel in a coding, on one thread.
#[derive(Debug, Clone, Serialize)]
pub struct CodingCost {
    /// Channel: "rgb", "range" or "instance".
    pub channel: &'static str,
    /// Compression and filter.
    pub coding: String,
    /// Time, ms.
    pub ms: f64,
    /// Length over that of the packed pixels.
    pub share: f64,
}

/// What was measured.
#[derive(Debug, Clone, Serialize)]
pub struct DatasetSpeeds {
    /// Processor.
    pub processor: String,
    /// World.
    pub world: String,
    /// Rates by size.
    pub rates: Vec<SetRates>,
    /// Codings of pictures of the larger size.
    pub codings: Vec<CodingCost>,
    /// Size of those.
    pub codings_px: [u32; 2],
}

/// Measures. `frames` panoramas make a round; sets are written to `scratch` and removed again. `watch` is told what is being
/// measured, every few seconds.
///
/// # Errors
/// When the world cannot be rendered, or a set cannot be written; [`Error::Interrupted`](crate::Error::Interrupted) when `watch` breaks.
pub fn measure(world: &World, frames: usize, scratch: &Path, watch: &dyn Fn(&str) -> ControlFlow<()>) -> Result<DatasetSpeeds> {
    let go_on = |what: &str| go_on(watch(what));
    let mut rates = Vec::new();
    for (width, height) in SIZES {
        rates.extend(measure_size(world, (width, height), frames, scratch, &|| go_on(&format!("{width}x{height}")))?);
    }
    go_on("codings")?;
    let size = SIZES[SIZES.len() - 1];
    let codings = codings(&samples(world, world.projection_of_size(size.0, size.1))?);
    Ok(DatasetSpeeds { processor: processor(), world: world.spec.name.clone(), rates, codings, codings_px: [size.0, size.1] })
}

/// Panoramas from around home.
fn samples(world: &World, projection: Projection) -> Result<Vec<Panorama>> {
    let (scene, bodies) = (Scene::new(world)?, world.body_poses());
    let turned = |k: usize| crate::geometry::Pose { heading: 0.4 * k as f64, ..world.home };
    let views: Vec<_> = (0..SAMPLES).map(|k| View { projection, robot: turned(k), bodies: &bodies }).collect();
    let mut seen = vec![Panorama::empty(); SAMPLES];
    CpuRenderer::new().render_group(&scene, &views, &mut seen)?;
    Ok(seen)
}

fn request(frames: usize, size_px: (u32, u32), layout: LayoutKind) -> Request {
    Request {
        places: Places::Random(frames),
        headings: Headings::Random(1),
        conditions: vec![Condition::original()],
        size_px: Some(size_px),
        layout,
        seed: 1,
        licence: "Apache-2.0".into(),
        command: "benchmark".into(),
    }
}

fn measure_size(
    world: &World,
    size: (u32, u32),
    frames: usize,
    scratch: &Path,
    go_on: &dyn Fn() -> Result<()>,
) -> Result<Vec<SetRates>> {
    go_on()?;
    let plan = Plan::new(world, request(frames, size, LAYOUTS[0]))?;
    let projection = plan.projection;
    let (scene, bodies) = (Scene::new(world)?, world.body_poses());
    let views: Vec<_> = plan.stage_frames(0).map(|f| View { projection, robot: f.robot, bodies: &bodies }).collect();
    let pictures = samples(world, projection)?;
    let per_s = |seconds: f64| frames as f64 / seconds;
    let render = || seconds(|| CpuRenderer::new().render_batch(&scene, &views, &mut |_, _| Ok(()))).map(per_s);
    let encode = || {
        let pictures = (0..frames).into_par_iter().map(|k| &pictures[k % SAMPLES]);
        seconds(|| pictures.try_for_each(|picture| encode_all(picture).map(|_| ()))).map(per_s)
    };
    let scratch = tempfile::Builder::new()
        .prefix("wayhome-dataset-bench-")
        .tempdir_in(scratch)
        .map_err(crate::storage::io_error("make a folder in", scratch))?;
    let pipeline = |layout: LayoutKind, round: usize| -> Result<f64> {
        let plan = Plan::new(world, request(frames, size, layout))?;
        // A folder of its own, which stays until all is measured: some file systems are slow to create files after many were
        // removed.
        let out = scratch.path().join(format!("{}-{round}", layout.name()));
        let job = Job { plan: &plan, out: &out, shard: (1, 1), extras: &|_, _, _| Ok(Vec::new()) };
        // From when the scene is packed, as in the measure of rendering alone.
        let mut start = None;
        let made = job.run(&mut CpuRenderer::new(), &mut |_| {
            start.get_or_insert_with(Instant::now);
            ControlFlow::Continue(())
        });
        made.map(|_| per_s(start.unwrap_or_else(Instant::now).elapsed().as_secs_f64()))
    };
    let one = pool_of(1)?;
    // In turns, so that what else the machine does weighs on all alike.
    let mut rounds: [Vec<f64>; 4] = Default::default();
    let mut pipelines = LAYOUTS.map(|layout| (layout, Vec::new()));
    for round in 0..ROUNDS {
        go_on()?;
        rounds[0].push(render()?);
        go_on()?;
        rounds[1].push(encode()?);
        for (layout, rates) in &mut pipelines {
            go_on()?;
            rates.push(pipeline(*layout, round)?);
        }
        rounds[2].push(one.install(render)?);
        go_on()?;
        rounds[3].push(one.install(encode)?);
    }
    let [render_per_s, encode_per_s, render_one_per_s, encode_one_per_s] = rounds.map(|rates| median(&rates));
    let threads = rayon::current_num_threads();
    let (width, height) = size;
    let rates = pipelines.map(|(layout, rates)| SetRates {
        layout,
        width,
        height,
        threads,
        frames,
        render_per_s,
        encode_per_s,
        render_one_per_s,
        encode_one_per_s,
        pipeline_per_s: median(&rates),
    });
    Ok(rates.into())
}

fn encode_all(panorama: &Panorama) -> Result<usize> {
    let lengths = [encode_rgb(panorama, "rgb")?, encode_range(panorama, "range")?, encode_instance(panorama, "instance")?];
    Ok(lengths.iter().map(Vec::len).sum())
}

fn codings(pictures: &[Panorama]) -> Vec<CodingCost> {
    type Pack = fn(&Panorama) -> Vec<u8>;
    let channels: [(&'static str, Pack); 3] = [("rgb", packed_rgb), ("range", packed_range), ("instance", packed_instance)];
    let mut costs = Vec::new();
    for (channel, pack) in channels {
        let packed: Vec<Vec<u8>> = pictures.iter().take(4).map(pack).collect();
        for (coding, mode) in modes() {
            let (mut times, mut bytes, mut all) = (Vec::new(), 0, 0);
            for _ in 0..ROUNDS {
                for (picture, packed) in pictures.iter().zip(&packed) {
                    let start = Instant::now();
                    let coded = mode.encode(packed, picture.projection.width, picture.projection.height);
                    times.push(1e3 * start.elapsed().as_secs_f64());
                    bytes += coded.map_or(0, |c| c.len());
                    all += packed.len();
                }
            }
            costs.push(CodingCost { channel, coding, ms: median(&times), share: bytes as f64 / all as f64 });
        }
    }
    costs
}
