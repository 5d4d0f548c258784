//! How fast panoramas come, beside the fastest that memory can be filled.
//!
//! Every figure is the median of short runs, and each of them is taken between two runs of what it is compared with, so that
//! what else the machine does weighs on both alike.

pub mod page;

use std::f64::consts::TAU;
use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::geometry::{Pose, sin_cos};
use crate::panorama::{Panorama, Projection};
use crate::render::{self, CpuRenderer, InstructionSet, Renderer, RendererChoice, RendererInfo, Scene, View};
use crate::study::statistics::quantile;
use crate::world::World;

/// Sizes that are measured: small, usual, and that of the paper.
pub const SIZES: [(u32, u32); 3] = [(561, 81), (1440, 180), (4680, 480)];
/// Numbers of bodies between which the cost of bodies shows.
pub const BODIES: [usize; 5] = [10, 30, 100, 300, 1000];
/// Bytes whose filling is the limit.
const LIMIT_BYTES: usize = 256 << 20;
/// Walls and discs of the world that is measured in.
const WALLS: usize = 40;
const DISCS: usize = 20;

/// A round hall of 40 walls, all textured, with discs in it: what panoramas are timed in.
///
/// # Errors
/// None; the world is a valid one.
pub fn hall(discs: usize) -> Result<World> {
    let mut text = String::from(
        "name = \"hall\"\nhome = { x_m = 0, y_m = 0 }\ncamera = { height_m = 0.3 }\nrobot = { height_m = 0.25 }\n[room]\nheight_m = 2.5\nfloor = { family = \"planks\" }\nceiling = { family = \"tiles\" }\n",
    );
    let corners: Vec<String> = (0..WALLS)
        .map(|k| {
            let (sin, cos) = sin_cos(TAU * k as f64 / WALLS as f64);
            let radius = 5.0 + 0.1 * ((7 * k) % 5) as f64;
            format!("[{:.4}, {:.4}]", radius * cos, radius * sin)
        })
        .collect();
    let family = |families: &[&str], k: usize| format!("{{ family = \"{}\" }}", families[k % families.len()]);
    let walls: Vec<String> = (0..WALLS).map(|k| family(&["posters", "brick", "noise", "shelves"], k)).collect();
    let _ = writeln!(text, "outline_m = [{}]\nwalls = [{}]", corners.join(", "), walls.join(", "));
    // On a spiral of even density around the middle, which stays free. Together they are always as wide.
    let radius = (0.15 * (DISCS as f64 / discs as f64).min(1.0)).max(0.005);
    for k in 0..discs {
        let (sin, cos) = sin_cos(2.399_963 * k as f64);
        let from_middle = 1.0 + 3.5 * ((k as f64 + 0.5) / discs as f64).sqrt();
        let _ = writeln!(
            text,
            "[[landmarks]]\nname = \"disc {k}\"\nshape = {{ disc = {{ radius_m = {radius:.4} }} }}\n\
             position_m = [{:.4}, {:.4}]\nheight_m = {:.1}\ntexture = {}",
            from_middle * cos,
            from_middle * sin,
            0.5 + 0.1 * (k % 10) as f64,
            family(&["bands", "brick", "posters"], k)
        );
    }
    World::from_toml(&text, "hall")
}

/// Seconds that go into the figures.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// For each figure, s.
    pub seconds: f64,
}

/// How fast something renders.
#[derive(Debug, Clone, Serialize)]
pub struct Speed {
    /// What renders.
    pub what: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Threads that render, each its own pictures.
    pub threads: usize,
    /// Panoramas a second.
    pub panoramas_per_s: f64,
    /// Bytes of their colours a second, four a pixel; range and instance come on top.
    pub colour_bytes_per_s: f64,
    /// Bytes a second that one thread can fill, measured in between.
    pub fill_bytes_per_s: f64,
    /// The former over the latter.
    pub share: f64,
}

/// What the CPU renderer takes for a picture among so many bodies.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Cost {
    /// Number of bodies.
    pub bodies: usize,
    /// Time of a panorama, s.
    pub panorama_s: f64,
}

/// All that is measured.
#[derive(Debug, Clone, Serialize)]
pub struct Findings {
    /// Name of the processor.
    pub processor: String,
    /// The CPU renderer.
    pub cpu: RendererInfo,
    /// Graphics adapter; `None` where there is none.
    pub gpu: Option<RendererInfo>,
    /// Size by size: CPU, instruction set by instruction set, one picture at a time; the widest in batches, on one thread and on
    /// two; then the GPU.
    pub speeds: Vec<Speed>,
    /// Size at which bodies are counted.
    pub bodies_size: (u32, u32),
    /// The cost of bodies on one thread.
    pub bodies: Vec<Cost>,
}

impl Findings {
    /// How many times as fast two threads are as one, in batches on the widest instruction set, size by size.
    #[must_use]
    pub fn speedups(&self) -> Vec<((u32, u32), f64)> {
        let rate = |size: (u32, u32), threads: usize| {
            let of_size = self.speeds.iter().filter(|s| (s.width, s.height) == size && s.what.ends_with("batch"));
            of_size.filter(|s| s.threads == threads).map(|s| s.panoramas_per_s).next_back()
        };
        SIZES.into_iter().filter_map(|size| Some((size, rate(size, 2)? / rate(size, 1)?))).collect()
    }
}

/// Measures all of it. `tell` hears each figure as it comes, and stops the study with an error.
///
/// # Errors
/// What rendering fails with, and what `tell` returns.
pub fn measure(effort: Effort, tell: &mut dyn FnMut(&Speed) -> Result<()>) -> Result<Findings> {
    let world = hall(DISCS)?;
    let scene = Scene::new(&world)?;
    let mut gpu = match render::create(RendererChoice::Gpu) {
        Ok(gpu) => Some(gpu),
        Err(Error::NoAdapter(_) | Error::FeatureOff { .. }) => None,
        Err(error) => return Err(error),
    };
    let mut limit = Limit::new();
    let mut speeds = Vec::new();
    for size in SIZES {
        let mut bench = Bench { scene: &scene, world: &world, size, effort, limit: &mut limit };
        let mut keep = |speed: Speed| -> Result<()> {
            tell(&speed)?;
            speeds.push(speed);
            Ok(())
        };
        for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
            let [speed] = bench.time(&format!("CPU, {set}"), &mut CpuRenderer::on(set)?, [Way::One])?;
            keep(speed)?;
        }
        let what = format!("CPU, {}, batch", InstructionSet::best());
        for speed in bench.time(&what, &mut CpuRenderer::new(), [Way::Batch(1), Way::Batch(2)])? {
            keep(speed)?;
        }
        if let Some(gpu) = &mut gpu {
            let [speed] = bench.time("GPU", gpu.as_mut(), [Way::Batch(1)])?;
            keep(speed)?;
        }
    }
    let bodies_size = SIZES[1];
    let mut bodies = Vec::new();
    for count in BODIES {
        let world = hall(count)?;
        let scene = Scene::new(&world)?;
        let mut bench = Bench { scene: &scene, world: &world, size: bodies_size, effort, limit: &mut limit };
        let [speed] = bench.time("", &mut CpuRenderer::new(), [Way::One])?;
        bodies.push(Cost { bodies: count, panorama_s: 1.0 / speed.panoramas_per_s });
    }
    let (cpu, gpu) = (CpuRenderer::new().info().clone(), gpu.map(|g| g.info().clone()));
    Ok(Findings { processor: processor(), cpu, gpu, speeds, bodies_size, bodies })
}

/// Name of the processor, where the system tells it.
pub(super) fn processor() -> String {
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = known.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
    line.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

/// Memory that is filled as fast as one thread can.
struct Limit {
    bytes: Vec<u8>,
}

impl Limit {
    fn new() -> Self {
        // Written once, so that the pages are there.
        Self { bytes: vec![1; LIMIT_BYTES] }
    }

    /// Bytes a second.
    fn time(&mut self) -> f64 {
        let began = Instant::now();
        self.bytes.fill(black_box(0));
        black_box(&mut self.bytes);
        LIMIT_BYTES as f64 / began.elapsed().as_secs_f64()
    }
}

/// How pictures are asked for.
#[derive(Clone, Copy)]
enum Way {
    /// One after the other on one thread, into the same buffers, as a closed loop does.
    One,
    /// In batches, on so many threads.
    Batch(usize),
}

/// One way of asking, and what was timed of it.
struct Lane {
    way: Way,
    threads: usize,
    pool: rayon::ThreadPool,
    /// Pictures of a run.
    length: usize,
    /// Where [`Way::One`] renders to.
    out: Panorama,
    /// Panoramas a second, run by run.
    rates: Vec<f64>,
    /// Bytes a second that can be filled, before and after each run.
    fills: Vec<f64>,
}

impl Lane {
    fn new(way: Way) -> Result<Self> {
        let threads = match way {
            Way::One => 1,
            Way::Batch(threads) => threads,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| Error::Threads(error.to_string()))?;
        Ok(Self { way, threads, pool, length: 4, out: Panorama::empty(), rates: Vec::new(), fills: Vec::new() })
    }
}

/// A place to time renderers in.
struct Bench<'a> {
    scene: &'a Scene,
    world: &'a World,
    size: (u32, u32),
    effort: Effort,
    limit: &'a mut Limit,
}

impl Bench<'_> {
    /// Times a renderer, each way in turn.
    fn time<const N: usize>(&mut self, what: &str, renderer: &mut dyn Renderer, ways: [Way; N]) -> Result<[Speed; N]> {
        let mut lanes = ways.into_iter().map(Lane::new).collect::<Result<Vec<_>>>()?;
        let began = Instant::now();
        let mut fill = self.limit.time();
        while lanes.iter().any(|lane| lane.rates.len() < 5) || began.elapsed().as_secs_f64() < N as f64 * self.effort.seconds {
            for lane in &mut lanes {
                let elapsed = self.run(renderer, lane)?;
                let before = std::mem::replace(&mut fill, self.limit.time());
                // A run is so long that its ends do not count, nor the pages that it asks the system for, nor caches that were emptied
                // by filling memory.
                if elapsed < 0.2 * self.effort.seconds {
                    lane.length *= 2;
                    lane.rates.clear();
                    lane.fills.clear();
                } else {
                    lane.rates.push(lane.length as f64 / elapsed);
                    lane.fills.extend([before, fill]);
                }
            }
        }
        let (width, height) = self.size;
        let median = |values: &[f64]| quantile(values, 0.5).unwrap_or(f64::NAN);
        Ok(std::array::from_fn(|k| {
            let lane = &lanes[k];
            let (panoramas_per_s, fill_bytes_per_s) = (median(&lane.rates), median(&lane.fills));
            let colour_bytes_per_s = 4.0 * f64::from(width) * f64::from(height) * panoramas_per_s;
            Speed {
                what: what.to_owned(),
                width,
                height,
                threads: lane.threads,
                panoramas_per_s,
                colour_bytes_per_s,
                fill_bytes_per_s,
                share: colour_bytes_per_s / fill_bytes_per_s,
            }
        }))
    }

    /// Seconds that a run takes.
    fn run(&self, renderer: &mut dyn Renderer, lane: &mut Lane) -> Result<f64> {
        let (width, height) = self.size;
        let bodies = self.world.body_poses();
        let views = views(self.world.projection_of_size(width, height), &bodies, lane.length, lane.rates.len());
        let (way, out) = (lane.way, &mut lane.out);
        let started = Instant::now();
        lane.pool.install(|| match way {
            Way::One => views.iter().try_for_each(|view| {
                renderer.render(self.scene, view, out)?;
                black_box(&*out);
                Ok(())
            }),
            Way::Batch(_) => renderer.render_batch(self.scene, &views, &mut look),
        })?;
        Ok(started.elapsed().as_secs_f64())
    }
}

/// Keeps the compiler from leaving out what nobody looks at.
fn look(_: usize, panoramas: &mut [Panorama]) -> Result<()> {
    black_box(panoramas);
    Ok(())
}

/// Views around the middle of the hall, other ones in each round.
fn views(projection: Projection, bodies: &[Pose], count: usize, round: usize) -> Vec<View<'_>> {
    let view = |k: usize| {
        let turn = 0.01 * (count * round + k) as f64;
        let (sin, cos) = sin_cos(37.0 * turn);
        View { projection, robot: Pose::new(0.3 * cos, 0.3 * sin, turn), bodies }
    };
    (0..count).map(view).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_halls_are_valid_and_the_study_runs() {
        for discs in BODIES {
            assert_eq!(hall(discs).unwrap().bodies.len(), discs);
        }
        let world = hall(10).unwrap();
        let scene = Scene::new(&world).unwrap();
        let mut limit = Limit { bytes: vec![1; 1 << 16] };
        let effort = Effort { seconds: 0.02 };
        let mut bench = Bench { scene: &scene, world: &world, size: (64, 8), effort, limit: &mut limit };
        let speeds = bench.time("CPU", &mut CpuRenderer::new(), [Way::One, Way::Batch(2)]).unwrap();
        assert_eq!(speeds.each_ref().map(|s| s.threads), [1, 2]);
        assert!(speeds.iter().all(|s| s.panoramas_per_s > 0.0 && s.share > 0.0), "{speeds:?}");
    }
}
