//! Whole-image homing: `cargo bench --bench homing`, on one core.
//!
//! - `ridf`: the rotational image difference of two views at all turns, the home view transformed before; `with transform` pays for that of
//!   the current view, too.
//! - `minwarping`: 384 x 48 pixels, 128 x 128 directions and turns, 9 scale planes.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use wayhome::geometry::Pose;
use wayhome::homing::grey::Grey;
use wayhome::homing::ridf::Ridf;
use wayhome::homing::warping::{MinWarping, WarpingSettings};
use wayhome::panorama::Panorama;
use wayhome::render::{CpuRenderer, Renderer, Scene, View};
use wayhome::world::World;

fn benches(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let world = World::open("lab").unwrap();
    let scene = Scene::new(&world).unwrap();
    let bodies = world.body_poses();
    let mut renderer = CpuRenderer::new();
    let mut take = |robot: Pose, width: u32, height: u32| {
        let projection = world.projection_of_size(width, height);
        let mut panorama = Panorama::black(projection);
        renderer.render(&scene, &View { projection, robot, bodies: &bodies }, &mut panorama).unwrap();
        panorama
    };
    let away = world.home.compose(&Pose::new(0.4, 0.3, 1.0));
    for (width, height) in [(90, 13), (561, 81)] {
        let [home, now] = [world.home, away].map(|pose| Grey::of(&take(pose, width, height)));
        let mut ridf = Ridf::new(home.width(), home.height());
        let (at_home, seen) = (ridf.spectrum(&home), ridf.spectrum(&now));
        let mut squares = Vec::new();
        let mut group = c.benchmark_group(format!("ridf {width} x {height}"));
        group.bench_function("transformed", |b| b.iter(|| ridf.squares(&seen, &at_home, &mut squares)));
        group.bench_function("with transform", |b| {
            b.iter(|| {
                let seen = ridf.spectrum(&now);
                ridf.squares(&seen, &at_home, &mut squares);
            });
        });
        group.finish();
    }
    let (home, now) = (take(world.home, 384, 48), take(away, 384, 48));
    let warping = MinWarping::new(WarpingSettings::default(), &home);
    c.bench_function("minwarping 384 x 48, 128 x 128", |b| b.iter(|| warping.scores(&now).unwrap()));
}

criterion_group!(homing, benches);
criterion_main!(homing);
