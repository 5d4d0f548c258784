//! How many substeps of 1 ms the plant does per second on one core, and which part of that is rapier's.
//!
//! `cargo bench --bench physics`. Throughput is in substeps: "Melem/s" reads as millions of substeps a second.
//! - `plant/open floor`: one robot, 4 walls, 10 standing and 5 moving bodies, far enough from all of them
//!   for rapier to be left out.
//! - `plant/at a wall`: the same, pressed against a wall: rapier steps in every substep.
//! - `chassis`: motors, wheels and floor friction alone.
//!
//! Measured in November 2026 on one core of a shared server: 1.7 million substeps a second of the processor's time on the open
//! floor, of which the chassis takes nine tenths and moving bodies the rest; 0.13 million at a wall, where rapier takes 92 %.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use wayhome::geometry::{Pose, Twist};
use wayhome::physics::{Chassis, Plant, RapierPlant, WheelDrive};
use wayhome::random::Seed;
use wayhome::world::{RobotSpec, World};

/// Substeps a control step, at 0.1 s.
const SUBSTEPS: u64 = 100;

/// One robot, 4 walls, 10 standing bodies around the middle and 5 walkers behind them.
fn world() -> World {
    let mut text = "name = \"bench\"\nhome = { x_m = 0.0, y_m = 0.0 }\n\
        room = { outline_m = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]] }\n"
        .to_owned();
    for k in 0..10 {
        let (x, y) = (f64::from(k) - 4.5, if k % 2 == 0 { 2.0 } else { -2.0 });
        text += &format!(
            "[[landmarks]]\nname = \"body {k}\"\nshape = {{ box = {{ size_m = [0.4, 0.3] }} }}\nposition_m = [{x}, {y}]\n\
             heading_deg = {}\nheight_m = 1.0\ntexture = {{ family = \"plain\" }}\n",
            37 * k
        );
    }
    for k in 0..5 {
        let x = 1.5 * f64::from(k) - 3.0;
        text += &format!(
            "[[obstacles]]\nname = \"walker {k}\"\nshape = {{ disc = {{ radius_m = 0.2 }} }}\nposition_m = [{x}, 3.5]\n\
             height_m = 1.7\ntexture = {{ family = \"plain\" }}\nmotion = {{ walk = {{ speed_m_s = 0.8, region_m = \
             [[-4.5, 2.8], [4.5, 2.8], [4.5, 4.5], [-4.5, 4.5]] }} }}\n",
        );
    }
    World::from_toml(&text, "bench").unwrap()
}

fn benches(c: &mut Criterion) {
    let world = world();
    let mut group = c.benchmark_group("plant");
    group.throughput(Throughput::Elements(SUBSTEPS));
    let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1));
    group.bench_function("open floor", |b| b.iter(|| plant.step(Twist { v: 0.3, omega: 0.8 }, 0.1)));
    let mut plant = RapierPlant::new(&world, Pose::new(0.0, -4.7, -std::f64::consts::FRAC_PI_2), Seed(1));
    group.bench_function("at a wall", |b| b.iter(|| plant.step(Twist { v: 0.3, omega: 0.0 }, 0.1)));
    group.finish();

    let mut group = c.benchmark_group("chassis");
    group.throughput(Throughput::Elements(SUBSTEPS));
    let mut chassis = Chassis::new(&RobotSpec::default(), Pose::IDENTITY);
    group.bench_function("driving a circle", |b| {
        b.iter(|| {
            for _ in 0..SUBSTEPS {
                chassis.advance([WheelDrive::Speed(5.0), WheelDrive::Speed(8.0)], |_| 0.75, 1e-3);
            }
        });
    });
    group.finish();
}

criterion_group!(physics, benches);
criterion_main!(physics);
