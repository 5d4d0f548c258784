//! Panoramas a second: `cargo bench --bench render`. Throughput is in pictures, "elem/s". `wayhome render --bench` prints the
//! same for people, with the share of what memory allows.
//!
//! - `limit`: 256 MiB filled by one thread; throughput is in bytes.
//! - size by size, in a hall of 40 textured walls and 20 discs:
//!   - `cpu, one thread`, for each instruction set: what each worker of a study gets.
//!   - `cpu, all threads`: one picture shared out over the cores.
//!   - `batch of 16, all threads`: pictures side by side.
//!   - `gpu, alone` and `gpu, batch of 16`: the best adapter, upload and readback included; not there without an adapter.
//! - `bodies`: what 10 to 1,000 of them cost.
//! - `building`: a map of 5,100 inner walls with doors: how long it takes to load, to be packed without baking much, and a panorama in
//!   it beside one in the hall of 40 walls, without discs; and to load an outline of 5,000 corners.
//! - `scene`: packing the lab, which is mostly baking its textures.

#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use wayhome::geometry::Pose;
use wayhome::panorama::{Panorama, Projection};
use wayhome::render::{CpuRenderer, GpuRenderer, InstructionSet, Renderer, Scene, View};
use wayhome::verify::render::{BODIES, SIZES, building, hall};
use wayhome::world::World;

/// Pictures of a batch.
const BATCH: usize = 16;

/// A hall, and the views that are taken of it.
struct Hall {
    world: World,
    scene: Scene,
    bodies: Vec<Pose>,
}

impl Hall {
    fn new(discs: usize) -> Self {
        let world = hall(discs).unwrap();
        Self { scene: Scene::new(&world).unwrap(), bodies: world.body_poses(), world }
    }

    fn view(&self, projection: Projection, k: usize) -> View<'_> {
        View { projection, robot: Pose::new(0.1, -0.2, 0.01 * k as f64), bodies: &self.bodies }
    }

    fn picture(&self, renderer: &mut dyn Renderer, projection: Projection, k: &mut usize, out: &mut Panorama) {
        *k += 1;
        renderer.render(&self.scene, &self.view(projection, *k), out).unwrap();
    }

    fn batch(&self, renderer: &mut dyn Renderer, projection: Projection) {
        let views: Vec<_> = (0..BATCH).map(|k| self.view(projection, k)).collect();
        let mut look = |_: usize, panoramas: &mut [Panorama]| {
            black_box(panoramas);
            Ok(())
        };
        renderer.render_batch(&self.scene, &views, &mut look).unwrap();
    }
}

/// A round room with a wall of so many corners.
fn cave(corners: u32) -> String {
    let corner = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(corners);
        let radius = 40.0 + 0.02 * f64::from((7 * k) % 5) + 10.0 * (5.0 * angle).sin();
        format!("[{:.4}, {:.4}]", radius * angle.cos(), radius * angle.sin())
    };
    let outline: Vec<String> = (0..corners).map(corner).collect();
    let wall = "{ family = \"brick\", seed = 1 }";
    format!("name = \"cave\"\nhome = {{ x_m = 0, y_m = 0 }}\n[room]\noutline_m = [{}]\nwalls = [{wall}]\n", outline.join(", "))
}

fn benches(c: &mut Criterion) {
    let mut memory = vec![1_u8; 256 << 20];
    let mut group = c.benchmark_group("limit");
    group.throughput(Throughput::Bytes(memory.len() as u64)).sample_size(20);
    group.bench_function("fill", |b| b.iter(|| black_box(&mut memory).fill(black_box(0))));
    group.finish();

    let hall = Hall::new(20);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut gpu = GpuRenderer::new().ok();
    let (mut out, mut k) = (Panorama::empty(), 0);
    for (width, height) in SIZES {
        let mut group = c.benchmark_group(format!("{width} x {height}"));
        group.throughput(Throughput::Elements(1)).sample_size(40);
        let projection = hall.world.projection_of_size(width, height);
        for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
            let mut cpu = CpuRenderer::on(set).unwrap();
            group.bench_function(format!("cpu, one thread, {set}"), |b| {
                pool.install(|| b.iter(|| hall.picture(&mut cpu, projection, &mut k, &mut out)));
            });
        }
        let mut cpu = CpuRenderer::new();
        group.bench_function("cpu, all threads", |b| b.iter(|| hall.picture(&mut cpu, projection, &mut k, &mut out)));
        if let Some(gpu) = &mut gpu {
            group.bench_function("gpu, alone", |b| b.iter(|| hall.picture(gpu, projection, &mut k, &mut out)));
        }
        group.throughput(Throughput::Elements(BATCH as u64)).sample_size(10);
        group.bench_function("cpu, batch of 16, all threads", |b| b.iter(|| hall.batch(&mut cpu, projection)));
        if let Some(gpu) = &mut gpu {
            group.bench_function("gpu, batch of 16", |b| b.iter(|| hall.batch(gpu, projection)));
        }
        group.finish();
    }
    let mut group = c.benchmark_group("bodies");
    group.throughput(Throughput::Elements(1));
    for bodies in BODIES {
        let hall = Hall::new(bodies);
        let projection = hall.world.projection_of_size(1440, 180);
        let mut cpu = CpuRenderer::new();
        group.bench_function(format!("{bodies}"), |b| {
            pool.install(|| b.iter(|| hall.picture(&mut cpu, projection, &mut k, &mut out)));
        });
    }
    group.finish();
    let mut group = c.benchmark_group("building");
    group.sample_size(20);
    group.bench_function("load", |b| b.iter(|| building(51).unwrap()));
    let world = building(51).unwrap();
    group.bench_function("pack", |b| b.iter(|| Scene::new(&world).unwrap()));
    let building = Hall { scene: Scene::new(&world).unwrap(), bodies: world.body_poses(), world };
    let at = building.world.home;
    let hall = Hall::new(0);
    for (name, place, home) in [("5,100 walls", &building, at), ("40 walls", &hall, Pose::IDENTITY)] {
        let projection = place.world.projection_of_size(1440, 180);
        let mut cpu = CpuRenderer::new();
        group.bench_function(format!("panorama, {name}"), |b| {
            pool.install(|| {
                b.iter(|| {
                    k += 1;
                    let robot = Pose::new(home.x + 0.1, home.y - 0.2, 0.01 * k as f64);
                    cpu.render(&place.scene, &View { projection, robot, bodies: &place.bodies }, &mut out).unwrap();
                });
            });
        });
    }
    group.bench_function("load an outline of 5,000 corners", |b| b.iter(|| World::from_toml(&cave(5000), "cave").unwrap()));
    group.finish();
    let lab = World::open("lab").unwrap();
    c.bench_function("scene", |b| b.iter(|| Scene::new(&lab).unwrap()));
}

criterion_group!(render, benches);
criterion_main!(render);
