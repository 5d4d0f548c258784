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
use crate::verify::speed::{Memory, median, pool_of, processor, seconds};
use crate::world::World;

/// Sizes that are measured: small, usual, and that of the paper.
pub const SIZES: [(u32, u32); 3] = [(561, 81), (1440, 180), (4680, 480)];
/// Numbers of bodies between which the cost of bodies shows.
pub const BODIES: [usize; 5] = [10, 30, 100, 300, 1000];
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

/// A building of so many by so many rooms, 3 m wide, with a door or a window in each of the 2 n (n - 1) walls between them. The walls
/// share one texture, so that packing the scene is not all baking.
///
/// # Errors
/// None; the world is a valid one.
pub fn building(rooms: u32) -> Result<World> {
    const ROOM_M: f64 = 3.0;
    let across = ROOM_M * f64::from(rooms);
    let home = ROOM_M * (f64::from(rooms / 2) + 0.5);
    let wall = "{ family = \"posters\", colour = [190, 180, 160], seed = 1, period_m = 4 }";
    let mut text = format!(
        "name = \"building\"\nhome = {{ x_m = {home}, y_m = {home} }}\ncamera = {{ height_m = 0.5 }}\n[room]\nheight_m = 2.5\n\
         outline_m = [[0, 0], [{across}, 0], [{across}, {across}], [0, {across}]]\nwalls = [{wall}]\n"
    );
    for k in 0..rooms * (rooms - 1) {
        let (along, line) = (ROOM_M * f64::from(k % rooms), ROOM_M * f64::from(k / rooms + 1));
        let opening = |number: u32| {
            let from_start_m = 0.6 + 0.15 * f64::from((7 * k + 3 * number) % 9);
            let what = if number.is_multiple_of(5) { "window" } else { "door" };
            format!("{{ kind = \"{what}\", from_start_m = {from_start_m:.2}, width_m = 0.9 }}")
        };
        let ends = [[[along, line], [along + ROOM_M, line]], [[line, along], [line, along + ROOM_M]]];
        for (number, [from, to]) in (2 * k..).zip(ends) {
            let _ = writeln!(text, "[[walls]]\nfrom_m = {from:?}\nto_m = {to:?}\nopenings = [{}]", opening(number));
        }
    }
    World::from_toml(&text, "building")
}

/// How fast something renders.
#[derive(Debug, Clone, Serialize)]
pub struct Throughput {
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
pub struct BodyCost {
    /// Number of bodies.
    pub bodies: usize,
    /// Time of a panorama, s.
    pub panorama_s: f64,
}

/// All that is measured.
#[derive(Debug, Clone, Serialize)]
pub struct RenderSpeeds {
    /// Name of the processor.
    pub processor: String,
    /// The CPU renderer.
    pub cpu: RendererInfo,
    /// Graphics adapter; `None` where there is none.
    pub gpu: Option<RendererInfo>,
    /// Size by size: CPU, instruction set by instruction set, one picture at a time; the widest in batches, on one thread and on
    /// two; then the GPU.
    pub speeds: Vec<Throughput>,
    /// Size at which bodies are counted.
    pub bodies_size: (u32, u32),
    /// The cost of bodies on one thread.
    pub bodies: Vec<BodyCost>,
}

impl RenderSpeeds {
    /// How many times as fast two threads are as one, in batches on the widest instruction set, size by size.
    pub fn speedups(&self) -> Vec<((u32, u32), f64)> {
        let rate = |size: (u32, u32), threads: usize| {
            let of_size = self.speeds.iter().filter(|s| (s.width, s.height) == size && s.what.ends_with("batch"));
            of_size.filter(|s| s.threads == threads).map(|s| s.panoramas_per_s).next_back()
        };
        SIZES.into_iter().filter_map(|size| Some((size, rate(size, 2)? / rate(size, 1)?))).collect()
    }
}

/// Measures all of it; `seconds` go into each figure. `tell` hears each as it comes, and stops the study with an error.
///
/// # Errors
/// What rendering fails with, and what `tell` returns.
pub fn measure(seconds: f64, tell: &mut dyn FnMut(&Throughput) -> Result<()>) -> Result<RenderSpeeds> {
    let mut gpu = match render::create(RendererChoice::Gpu) {
        Ok(gpu) => Some(gpu),
        Err(Error::NoAdapter(_) | Error::FeatureOff { .. }) => None,
        Err(error) => return Err(error),
    };
    let mut memory = Memory::new();
    let workload = Workload::new(DISCS, seconds)?;
    let mut speeds: Vec<Throughput> = Vec::new();
    for size in SIZES {
        let mut time = |what: &str, renderer: &mut dyn Renderer, ways: &[Way]| {
            for speed in workload.time(what, size, renderer, ways, &mut memory)? {
                tell(&speed)?;
                speeds.push(speed);
            }
            Ok(())
        };
        for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
            time(&format!("CPU, {set}"), &mut CpuRenderer::on(set)?, &[Way::One])?;
        }
        let batches = [Way::Batch(1), Way::Batch(2)];
        time(&format!("CPU, {}, batch", InstructionSet::best()), &mut CpuRenderer::new(), &batches)?;
        if let Some(gpu) = &mut gpu {
            time("GPU", gpu.as_mut(), &[Way::Batch(1)])?;
        }
    }
    let bodies_size = SIZES[1];
    let mut bodies = Vec::new();
    for count in BODIES {
        let workload = Workload::new(count, seconds)?;
        let speeds = workload.time("", bodies_size, &mut CpuRenderer::new(), &[Way::One], &mut memory)?;
        bodies.extend(speeds.iter().map(|speed| BodyCost { bodies: count, panorama_s: 1.0 / speed.panoramas_per_s }));
    }
    let (cpu, gpu) = (CpuRenderer::new().info().clone(), gpu.map(|g| g.info().clone()));
    Ok(RenderSpeeds { processor: processor(), cpu, gpu, speeds, bodies_size, bodies })
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
struct Runs {
    way: Way,
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

impl Runs {
    fn new(way: Way) -> Result<Self> {
        let threads = match way {
            Way::One => 1,
            Way::Batch(threads) => threads,
        };
        Ok(Self { way, pool: pool_of(threads)?, length: 4, out: Panorama::empty(), rates: Vec::new(), fills: Vec::new() })
    }
}

/// A hall to time renderers in.
struct Workload {
    world: World,
    scene: Scene,
    bodies: Vec<Pose>,
    /// Time that goes into a figure, s.
    seconds: f64,
}

impl Workload {
    fn new(discs: usize, seconds: f64) -> Result<Self> {
        let world = hall(discs)?;
        Ok(Self { scene: Scene::new(&world)?, bodies: world.body_poses(), world, seconds })
    }

    /// Times a renderer, each way in turn.
    fn time(
        &self,
        what: &str,
        (width, height): (u32, u32),
        renderer: &mut dyn Renderer,
        ways: &[Way],
        memory: &mut Memory,
    ) -> Result<Vec<Throughput>> {
        let projection = self.world.projection_of_size(width, height);
        let mut all = ways.iter().map(|way| Runs::new(*way)).collect::<Result<Vec<_>>>()?;
        let began = Instant::now();
        let mut fill = memory.fill_bytes_per_s();
        while all.iter().any(|runs| runs.rates.len() < 5) || began.elapsed().as_secs_f64() < ways.len() as f64 * self.seconds {
            for runs in &mut all {
                let elapsed = self.run(renderer, projection, runs)?;
                let before = std::mem::replace(&mut fill, memory.fill_bytes_per_s());
                // A run is so long that its ends do not count, nor the pages that it asks the system for, nor caches that were emptied
                // by filling memory.
                if elapsed < 0.2 * self.seconds {
                    runs.length *= 2;
                    runs.rates.clear();
                    runs.fills.clear();
                } else {
                    runs.rates.push(runs.length as f64 / elapsed);
                    runs.fills.extend([before, fill]);
                }
            }
        }
        let throughput = |runs: &Runs| {
            let (panoramas_per_s, fill_bytes_per_s) = (median(&runs.rates), median(&runs.fills));
            let colour_bytes_per_s = 4.0 * f64::from(width) * f64::from(height) * panoramas_per_s;
            Throughput {
                what: what.to_owned(),
                width,
                height,
                threads: runs.pool.current_num_threads(),
                panoramas_per_s,
                colour_bytes_per_s,
                fill_bytes_per_s,
                share: colour_bytes_per_s / fill_bytes_per_s,
            }
        };
        Ok(all.iter().map(throughput).collect())
    }

    /// Seconds that a run takes.
    fn run(&self, renderer: &mut dyn Renderer, projection: Projection, runs: &mut Runs) -> Result<f64> {
        let views = views(projection, &self.bodies, runs.length, runs.rates.len());
        let (way, out, scene) = (runs.way, &mut runs.out, &self.scene);
        let mut look = |_: usize, panoramas: &mut [Panorama]| {
            // Keeps the compiler from leaving out what nobody looks at.
            black_box(panoramas);
            Ok(())
        };
        let work = || match way {
            Way::One => views.iter().try_for_each(|view| {
                renderer.render(scene, view, out)?;
                look(0, std::slice::from_mut(out))
            }),
            Way::Batch(_) => renderer.render_batch(scene, &views, &mut look),
        };
        seconds(|| runs.pool.install(work))
    }
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
        let workload = Workload::new(10, 0.02).unwrap();
        let ways = [Way::One, Way::Batch(2)];
        let speeds = workload.time("CPU", (64, 8), &mut CpuRenderer::new(), &ways, &mut Memory::new()).unwrap();
        assert_eq!(speeds.iter().map(|s| s.threads).collect::<Vec<_>>(), [1, 2]);
        assert!(speeds.iter().all(|s| s.panoramas_per_s > 0.0 && s.share > 0.0), "{speeds:?}");
    }
}
