//! Bearings a second: `cargo bench --bench vision`, on one core.
//!
//! The names state the panorama and how many keypoints are kept of it; the home panorama has as many.
//!
//! - `observe`: what each control step pays: pyramid, features, descriptors, matching and the check against one motion, for a
//!   panorama taken so far from home.
//! - `home`: making the landmarks from the home panorama, once a run.

#![allow(clippy::unwrap_used, missing_docs)]

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use wayhome::geometry::{Pose, direction};
use wayhome::panorama::Panorama;
use wayhome::render::{CpuRenderer, Renderer, Scene, View};
use wayhome::vision::{Extractor, ExtractorSettings};
use wayhome::world::World;

fn benches(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let world = World::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("worlds/lab.toml")).unwrap();
    let scene = Scene::new(&world).unwrap();
    let bodies = world.body_poses();
    let mut renderer = CpuRenderer::new();
    for (width, height, keypoints) in [(561, 81, 300), (1440, 180, 500), (1440, 180, 1000)] {
        let mut group = c.benchmark_group(format!("{width} x {height}, {keypoints} keypoints"));
        group.throughput(Throughput::Elements(1));
        let projection = world.projection_of_size(width, height);
        let mut take = |robot: Pose| {
            let mut panorama = Panorama::black(projection);
            renderer.render(&scene, &View { projection, robot, bodies: &bodies }, &mut panorama).unwrap();
            panorama
        };
        let settings = ExtractorSettings { features: keypoints, home_features: keypoints, ..ExtractorSettings::default() };
        let home = take(world.home);
        group.bench_function("home", |b| b.iter(|| Extractor::new(settings.clone(), &home)));
        let mut extractor = Extractor::new(settings.clone(), &home);
        for distance_m in [0.5, 2.0] {
            // The same poses in turn: four ways from home, the robot turned differently in each.
            let panoramas = [0.6, 2.4, 3.7, 5.6].map(|azimuth| {
                let place = world.home.position() + direction(azimuth) * distance_m;
                take(Pose::new(place.x, place.y, 1.0 + 2.0 * azimuth))
            });
            let mut turn = panoramas.iter().cycle();
            group.bench_function(format!("observe, {distance_m} m from home"), |b| {
                b.iter(|| extractor.observe(turn.next().unwrap()));
            });
        }
        group.finish();
    }
}

criterion_group!(vision, benches);
criterion_main!(vision);
