//! How many substeps of 1 ms the plant does per second on one core, and which part of that is rapier's.
//!
//! `cargo bench --bench physics`. Throughput is in substeps: "Melem/s" reads as millions of substeps a second. The robot has 4
//! walls, 10 standing and 5 moving bodies around it.
//! - `plant/open floor`: it drives circles far from all of them. Nothing of rapier runs.
//! - `plant/at a wall`: it presses against a wall; the hull's own contacts. Nothing of rapier runs.
//! - `plant/pushing a carton`: one of the moving bodies is a carton that it pushes; rapier runs in every substep.
//! - `chassis/driving a circle`: motors, wheels and floor friction alone.
//! - `rapier/pushing a carton`: rapier alone, the same scene: what of `plant/pushing a carton` is rapier's.
//! - `rapier/in every substep`: the open floor again, but rapier is asked each time, which is what it would cost not to look
//!   first whether anything is near.
//!
//! Time is that of the processor where the system tells (on Unix): substeps per second *and core*, whatever else the machine
//! does. `results/physics/README.md` says what was measured.

#![allow(clippy::unwrap_used, missing_docs)]

use std::time::Duration;

use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use rapier2d::prelude::{
    ColliderBuilder, MassProperties, PhysicsWorld, Pose as RapierPose, RigidBodyBuilder, RigidBodyHandle, Vector,
};
use wayhome::geometry::{Pose, Twist};
use wayhome::physics::{Chassis, Plant, RapierPlant, WheelDrive};
use wayhome::random::Seed;
use wayhome::world::{RobotSpec, World};

/// Substeps a control step, at 0.1 s.
const SUBSTEPS: u64 = 100;
/// Substeps of a push.
const PUSH: u64 = 1000;
const PUSHING: Twist = Twist { v: 0.3, omega: 0.0 };

/// Time that this thread has run on a processor.
struct CoreTime;

impl CoreTime {
    #[cfg(unix)]
    fn now() -> Duration {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
    }

    #[cfg(not(unix))]
    fn now() -> Duration {
        static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
        START.elapsed()
    }
}

impl Measurement for CoreTime {
    type Intermediate = Duration;
    type Value = Duration;

    fn start(&self) -> Duration {
        Self::now()
    }

    fn end(&self, start: Duration) -> Duration {
        Self::now() - start
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        WallTime.to_f64(value)
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

/// One robot, 4 walls, 10 standing bodies around the middle and 5 moving ones: walkers behind them, and perhaps a carton.
fn world(carton: bool) -> World {
    let mut text = "name = \"bench\"\nhome = { x_m = 0.0, y_m = 0.0 }\n\
        room = { outline_m = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]] }\n"
        .to_owned();
    let mut add = |kind: &str, name: &str, shape: &str, [x, y]: [f64; 2], more: &str| {
        text += &format!(
            "[[{kind}]]\nname = \"{name}\"\nshape = {{ {shape} }}\nposition_m = [{x}, {y}]\nheight_m = 1.0\n\
             texture = {{ family = \"plain\" }}\n{more}\n"
        );
    };
    for k in 0..10 {
        let place = [f64::from(k) - 4.5, if k % 2 == 0 { 2.0 } else { -2.0 }];
        add("landmarks", &format!("body {k}"), "box = { size_m = [0.4, 0.3] }", place, &format!("heading_deg = {}", 37 * k));
    }
    for k in 0..if carton { 4 } else { 5 } {
        let region = "[[-4.5, 2.8], [4.5, 2.8], [4.5, 4.5], [-4.5, 4.5]]";
        let walk = format!("motion = {{ walk = {{ speed_m_s = 0.8, region_m = {region} }} }}");
        add("obstacles", &format!("walker {k}"), "disc = { radius_m = 0.2 }", [1.5 * f64::from(k) - 3.0, 3.5], &walk);
    }
    if carton {
        let pushed = "motion = { pushed = { mass_kg = 2.0, friction = 0.3 } }";
        add("obstacles", "carton", "box = { size_m = [0.4, 0.6] }", [-1.6, 0.0], pushed);
    }
    World::from_toml(&text, "bench").unwrap()
}

/// The scene of the push in rapier alone, and the robot in it.
fn rapier_world() -> (PhysicsWorld, RigidBodyHandle) {
    let mut physics = PhysicsWorld { gravity: Vector::ZERO, ..PhysicsWorld::default() };
    let settings = &mut physics.integration_parameters;
    (settings.length_unit, settings.contact_recycling, settings.num_solver_iterations, settings.dt) = (0.1, false, 1, 1e-3);
    let corners = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]].map(|[x, y]| Vector::new(x, y));
    for k in 0..4 {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        physics.insert_collider(ColliderBuilder::triangle(a, b, 0.55 * (a + b)), None);
    }
    for k in 0..10 {
        let place = Vector::new(k as f32 - 4.5, if k % 2 == 0 { 2.0 } else { -2.0 });
        let turned = RapierPose::new(place, (37.0 * k as f32).to_radians());
        physics.insert_collider(ColliderBuilder::cuboid(0.2, 0.15).position(turned), None);
    }
    let carton = RigidBodyBuilder::dynamic().translation(Vector::new(-1.6, 0.0)).can_sleep(false).linear_damping(10.0);
    physics.insert(carton, ColliderBuilder::cuboid(0.2, 0.3).mass(2.0));
    let mass = MassProperties::new(Vector::new(0.03, 0.0), 2.3, 0.031);
    let robot =
        RigidBodyBuilder::dynamic().translation(Vector::new(-2.0, 0.0)).additional_mass_properties(mass).can_sleep(false);
    let robot = physics.insert(robot, ColliderBuilder::ball(0.164).density(0.0)).0;
    (physics, robot)
}

/// Pushes for so many substeps as the plant does: pose and velocity are set anew before each.
fn push(physics: &mut PhysicsWorld, robot: RigidBodyHandle, substeps: u64) {
    for _ in 0..substeps {
        let body = physics.bodies.get_mut(robot).unwrap();
        let pose = *body.position();
        body.set_position(pose, false);
        body.set_linvel(Vector::new(0.3, 0.0), false);
        body.set_angvel(0.0, false);
        physics.step();
    }
}

fn benches(c: &mut Criterion<CoreTime>) {
    let open = world(false);
    let mut group = c.benchmark_group("plant");
    group.throughput(Throughput::Elements(SUBSTEPS));
    let mut plant = RapierPlant::new(&open, Pose::IDENTITY, Seed(1));
    group.bench_function("open floor", |b| b.iter(|| plant.step(Twist { v: 0.3, omega: 0.8 }, 0.1)));
    let mut plant = RapierPlant::new(&open, Pose::new(0.0, -4.7, -std::f64::consts::FRAC_PI_2), Seed(1));
    group.bench_function("at a wall", |b| b.iter(|| plant.step(PUSHING, 0.1)));
    group.throughput(Throughput::Elements(PUSH));
    let with_carton = world(true);
    group.bench_function("pushing a carton", |b| {
        let at_the_carton = || {
            let mut plant = RapierPlant::new(&with_carton, Pose::new(-2.0, 0.0, 0.0), Seed(1));
            plant.step(PUSHING, 1.0);
            plant
        };
        b.iter_batched_ref(at_the_carton, |plant| plant.step(PUSHING, 1e-3 * PUSH as f64), BatchSize::LargeInput);
    });
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

    let mut group = c.benchmark_group("rapier");
    group.throughput(Throughput::Elements(PUSH));
    group.bench_function("pushing a carton", |b| {
        let at_the_carton = || {
            let (mut physics, robot) = rapier_world();
            push(&mut physics, robot, 1000);
            (physics, robot)
        };
        b.iter_batched_ref(at_the_carton, |(physics, robot)| push(physics, *robot, PUSH), BatchSize::LargeInput);
    });
    group.throughput(Throughput::Elements(SUBSTEPS));
    let mut plant = RapierPlant::new(&open, Pose::IDENTITY, Seed(1)).always_asking_rapier();
    group.bench_function("in every substep", |b| b.iter(|| plant.step(Twist { v: 0.3, omega: 0.8 }, 0.1)));
    group.finish();
}

criterion_group! {
    name = physics;
    config = Criterion::default().with_measurement(CoreTime);
    targets = benches
}
criterion_main!(physics);
