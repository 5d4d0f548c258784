//! Panoramas a second: `cargo bench --bench render`. Throughput is in pictures, "elem/s".
//!
//! - `cpu, one thread`: what each worker of a study gets.
//! - `cpu, all threads`: one picture shared out over the cores.
//! - `gpu`: the best adapter, upload and readback included; not there without an adapter.
//! - `scene`: packing a world, which is mostly baking its textures.

#![allow(clippy::unwrap_used, missing_docs)]

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use wayhome::geometry::Pose;
use wayhome::panorama::Panorama;
use wayhome::render::{CpuRenderer, GpuRenderer, Renderer, Scene, View};
use wayhome::world::World;

fn benches(c: &mut Criterion) {
    let world = World::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("worlds/lab.toml")).unwrap();
    let scene = Scene::new(&world).unwrap();
    let bodies = world.body_poses();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut gpu = GpuRenderer::new();
    for (width, height) in [(561, 81), (1440, 180), (4680, 480)] {
        let mut group = c.benchmark_group(format!("{width} x {height}"));
        group.throughput(Throughput::Elements(1));
        let projection = world.projection_of_size(width, height);
        let mut out = Panorama::black(projection);
        let mut turn = 0.0;
        let mut picture = |renderer: &mut dyn Renderer| {
            turn += 0.01;
            let robot = Pose::new(world.home.x, world.home.y, turn);
            renderer.render(&scene, &View { projection, robot, bodies: &bodies }, &mut out).unwrap();
        };
        let mut cpu = CpuRenderer::new();
        group.bench_function("cpu, one thread", |b| pool.install(|| b.iter(|| picture(&mut cpu))));
        group.bench_function("cpu, all threads", |b| b.iter(|| picture(&mut cpu)));
        if let Ok(gpu) = &mut gpu {
            group.bench_function("gpu", |b| b.iter(|| picture(gpu)));
        }
        group.finish();
    }
    c.bench_function("scene", |b| b.iter(|| Scene::new(&world).unwrap()));
}

criterion_group!(render, benches);
criterion_main!(render);
