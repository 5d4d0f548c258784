//! The plants against closed forms and symmetries.
//!
//! Closed forms hold for a robot with its weight on the two wheels alone (centre of gravity above the axle) and equal
//! wheels. Where the chassis alone is driven, nothing of rapier takes part; where a plant is, all of it does.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt;
use wayhome::geometry::{Pose, Twist, Vector2, cross, wrap};
use wayhome::physics::{
    Chassis, PlanarVelocity, Plant, PlantStep, RapierPlant, STANDARD_GRAVITY_M_S2 as G, UnicyclePlant, WheelDrive,
};
use wayhome::random::Seed;
use wayhome::world::{RobotSpec, World};

const DT: f64 = 1e-3;

/// A robot with equal wheels that roll without resistance, and its weight on them alone.
fn symmetric_robot() -> RobotSpec {
    RobotSpec { centre_of_gravity_m: 0.0, wheel_radius_error: [0.0; 2], rolling_resistance: 0.0, ..RobotSpec::default() }
}

/// A world of one square room around the origin, with further lines of the file.
fn world(side_m: f64, more: &str) -> World {
    let h = 0.5 * side_m;
    let outline = format!("[[{}, {}], [{h}, {}], [{h}, {h}], [{}, {h}]]", -h, -h, -h, -h);
    world_of(&outline, more)
}

fn world_of(outline: &str, more: &str) -> World {
    let text = format!("name = \"test\"\nroom = {{ outline_m = {outline} }}\nhome = {{ x_m = 0.0, y_m = 0.0 }}\n{more}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.toml");
    std::fs::write(&path, text).unwrap();
    World::load(&path).unwrap()
}

fn with_robot(mut world: World, robot: RobotSpec) -> World {
    world.spec.robot = robot;
    world
}

fn velocity(x: f64, y: f64, yaw_rate: f64) -> PlanarVelocity {
    PlanarVelocity { linear: Vector2::new(x, y), yaw_rate }
}

/// Holds each command for its time, in control steps of 0.1 s.
fn drive(plant: &mut dyn Plant, commands: &[(f64, f64, f64)]) -> Vec<PlantStep> {
    let mut steps = Vec::new();
    for &(v, omega, seconds) in commands {
        for _ in 0..(seconds * 10.0).round() as usize {
            steps.push(plant.step(Twist { v, omega }, 0.1));
        }
    }
    steps
}

/// Where odometry alone believes to be.
fn dead_reckoned(start: Pose, steps: &[PlantStep]) -> Pose {
    steps.iter().fold(start, |p, s| p.advanced(s.odometry.twist, s.odometry.dt_s))
}

fn distance(a: Pose, b: Pose) -> f64 {
    (a.position() - b.position()).norm()
}

/// Pushed sideways at v0 the robot stops after v0^2 / (2 mu g) = 0.1019 m (work of Coulomb friction, mu m g s = m v0^2 / 2); 0.5 %.
#[test]
fn a_sideways_push_stops_after_its_friction_distance() {
    let expected = 1.0 / (2.0 * 0.5 * G);
    let mut chassis = Chassis::new(&symmetric_robot(), Pose::IDENTITY);
    chassis.set_velocity(velocity(0.0, 1.0, 0.0));
    for _ in 0..500 {
        chassis.advance([WheelDrive::Speed(0.0); 2], |_| 0.5, DT);
    }
    let y = chassis.pose().y;
    assert!((y / expected - 1.0).abs() < 0.005, "{y} against {expected}");

    let world = with_robot(world(6.0, "floor = { friction = 0.5 }"), symmetric_robot());
    let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1));
    plant.push(velocity(0.0, 1.0, 0.0));
    plant.step(Twist::default(), 0.5);
    assert!((plant.truth().y / expected - 1.0).abs() < 0.005, "{} against {expected}", plant.truth().y);
    assert!(plant.truth().x.abs() < 1e-9 && plant.truth().heading.abs() < 1e-9);
}

/// However strong the motors, the floor pulls with mu g = 4.905 m/s^2 at most (Coulomb; Wong, "Theory of Ground Vehicles",
/// maximum tractive effort); 0.1 %. On ice the wheels spin and the robot
/// hardly moves.
#[test]
fn traction_ends_at_the_friction_limit() {
    let accelerate = |mu: f64| {
        let mut chassis = Chassis::new(&symmetric_robot(), Pose::IDENTITY);
        for _ in 0..100 {
            chassis.advance([WheelDrive::Torque(1.0); 2], |_| mu, DT);
        }
        let early = chassis.axle_velocity().x;
        for _ in 0..100 {
            chassis.advance([WheelDrive::Torque(1.0); 2], |_| mu, DT);
        }
        ((chassis.axle_velocity().x - early) / 0.1, chassis)
    };
    let (a, chassis) = accelerate(0.5);
    assert!((a / (0.5 * G) - 1.0).abs() < 0.001, "{a}");
    assert!(chassis.slip().iter().all(|s| s.x < -1.0));
    let (a, chassis) = accelerate(0.01);
    assert!((a / (0.01 * G) - 1.0).abs() < 0.001, "{a}");
    assert!(chassis.wheel_speeds()[0] * chassis.wheel_radii()[0] > 10.0 * chassis.axle_velocity().x);
}

/// Within the friction limit a torque tau on each wheel gives a = 2 tau / (R (m + 2 I_w / R^2)) (Newton and Euler for body and
/// rolling wheels; Wong's mass factor for rotating parts); 0.1 %.
#[test]
fn launch_without_skid_follows_the_torque() {
    let robot = symmetric_robot();
    let torque = 0.05;
    let r = robot.wheel_radius_m;
    let expected = 2.0 * torque / (r * (robot.mass_kg + 2.0 * robot.wheel_inertia_kg_m2 / (r * r)));
    let mut chassis = Chassis::new(&robot, Pose::new(1.0, 2.0, 0.7));
    let mut early = 0.0;
    for k in 0..500 {
        if k == 100 {
            early = chassis.axle_velocity().x;
        }
        chassis.advance([WheelDrive::Torque(torque); 2], |_| 0.75, DT);
    }
    let a = (chassis.axle_velocity().x - early) / 0.4;
    assert!((a / expected - 1.0).abs() < 0.001, "{a} against {expected}");
    assert!(chassis.axle_velocity().y.abs() < 1e-12);
}

/// Locked wheels, dragged across at half the track b, brake a spin with mu m g (b/2) / I_zz (Euler, Coulomb); 0.1 %.
#[test]
fn locked_wheels_brake_a_spin() {
    let robot = symmetric_robot();
    let mut chassis = Chassis::new(&robot, Pose::IDENTITY);
    chassis.set_velocity(velocity(0.0, 0.0, 10.0));
    for _ in 0..200 {
        chassis.advance([WheelDrive::Locked; 2], |_| 0.5, DT);
    }
    let deceleration = (10.0 - chassis.velocity().yaw_rate) / 0.2;
    let expected = 0.5 * robot.mass_kg * G * 0.5 * robot.track_m / chassis.yaw_inertia();
    assert!((deceleration / expected - 1.0).abs() < 0.001, "{deceleration} against {expected}");
}

/// With wheels that roll freely, friction only takes energy, for any start, caster, centre of gravity and rolling resistance;
/// exact.
#[test]
fn energy_never_rises_without_torque() {
    for (k, mu) in [0.05, 0.2, 0.75, 1.5].into_iter().enumerate() {
        for creep_m_s in [0.001, 0.01, 0.05] {
            let robot = RobotSpec {
                caster_friction: 0.5,
                centre_of_gravity_m: 0.05,
                centre_of_gravity_height_m: 0.1,
                creep_m_s,
                rolling_resistance: 0.01 * k as f64,
                ..RobotSpec::default()
            };
            let mut chassis = Chassis::new(&robot, Pose::new(0.0, 0.0, 0.4));
            chassis.set_velocity(velocity(0.5, -0.8, 6.0 - 4.0 * k as f64));
            chassis.set_wheel_speeds([30.0, -12.0]);
            let mut energy = chassis.kinetic_energy();
            for step in 0..3000 {
                chassis.advance([WheelDrive::Torque(0.0); 2], |_| mu, DT);
                let now = chassis.kinetic_energy();
                assert!(now <= energy * (1.0 + 1e-14), "mu {mu}, creep {creep_m_s}, step {step}: {energy} to {now}");
                energy = now;
            }
        }
    }
}

/// Speed at which a robot that slowly gains speed on a circle of radius 0.5 m begins to skid: sqrt(mu g r) (Coulomb
/// friction as the only centripetal force; Gillespie, "Fundamentals of Vehicle Dynamics", cornering); 5 %.
#[test]
fn grip_on_a_circle_ends_at_the_friction_limit() {
    let radius = 0.5;
    let robot = RobotSpec {
        no_load_speed_rad_s: 200.0,
        stall_torque_n_m: 2.0,
        max_speed_m_s: 10.0,
        max_turn_rate_rad_s: 20.0,
        ..symmetric_robot()
    };
    let creep = robot.creep_m_s;
    for (mu, expected) in [(0.2, 0.990), (0.5, 1.566)] {
        let world = with_robot(world(40.0, &format!("floor = {{ friction = {mu} }}")), robot.clone());
        let mut plant = RapierPlant::new(&world, Pose::new(0.0, -radius, 0.0), Seed(1));
        let mut v = 0.0;
        // Friction saturates at the creep speed; twice that is a skid.
        while plant.chassis().slip()[0].norm() < 2.0 * creep {
            v += 0.001;
            plant.step(Twist { v, omega: v / radius }, 0.01);
            assert!(v < 3.0);
        }
        let speed = plant.chassis().velocity().linear.norm();
        assert!((speed / expected - 1.0).abs() < 0.05, "mu {mu}: {speed} against {expected}");
    }
}

/// Steered from a straight drive into a curve, the robot turns the wider the slipperier the floor.
#[test]
fn the_turning_circle_grows_as_friction_falls() {
    let radii: Vec<f64> = [0.8, 0.03, 0.02]
        .into_iter()
        .map(|mu| {
            let world = with_robot(world(40.0, &format!("floor = {{ friction = {mu} }}")), symmetric_robot());
            let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1));
            drive(&mut plant, &[(0.25, 0.0, 6.0), (0.25, 1.5, 1.0)]);
            // Path length over change of course in the next half second.
            let (mut length, mut course) = (0.0, 0.0);
            for _ in 0..50 {
                let (p, v) = (plant.truth(), plant.chassis().velocity().linear);
                plant.step(Twist { v: 0.25, omega: 1.5 }, 0.01);
                let w = plant.chassis().velocity().linear;
                length += distance(p, plant.truth());
                course += cross(v, w) / (v.norm() * w.norm());
            }
            length / course
        })
        .collect();
    assert!((radii[0] * 1.5 / 0.25 - 1.0).abs() < 0.01, "{radii:?}");
    assert!(radii.windows(2).all(|r| r[1] > r[0]) && radii[2] > 1.5 * radii[0], "{radii:?}");
}

#[test]
fn a_robot_at_rest_stays_at_rest_without_slip() {
    let start = Pose::new(0.3, -0.2, 1.0);
    let mut plant = RapierPlant::new(&world(6.0, ""), start, Seed(1));
    for _ in 0..50 {
        let step = plant.step(Twist::default(), 0.1);
        assert_eq!(step.slip_m_s, [0.0, 0.0]);
        assert_eq!(step.odometry.twist, Twist::default());
        assert_eq!(step.collisions, 0);
    }
    assert!(distance(plant.truth(), start) < 1e-12 && plant.truth().heading == start.heading);

    // After a drive it comes to true rest as well.
    drive(&mut plant, &[(0.2, 0.5, 1.0), (0.0, 0.0, 6.0)]);
    let step = plant.step(Twist::default(), 0.1);
    assert_eq!((step.slip_m_s, step.odometry.twist), ([0.0, 0.0], Twist::default()));
}

const TOUR: [(f64, f64, f64); 4] = [(0.3, 0.0, 2.0), (0.2, 1.2, 2.0), (0.0, -1.9, 1.0), (-0.2, 0.4, 1.5)];

#[test]
fn mirrored_commands_give_mirrored_paths_and_a_turned_world_a_turned_path() {
    let world = with_robot(world(12.0, ""), RobotSpec { wheel_radius_error: [0.0; 2], ..RobotSpec::default() });
    let mut stream = Seed(21).stream("tours");
    let mut draw = |low: f64, high: f64| low + (high - low) * stream.random::<f64>();
    for k in 0..20 {
        let mut world = world.clone();
        let tour = if k == 0 {
            TOUR
        } else {
            world.spec.floor.friction = draw(0.02, 0.8);
            std::array::from_fn(|_| (draw(-0.3, 0.3), draw(-1.9, 1.9), draw(0.5, 2.0)))
        };
        let run = |start: Pose, sign: f64| {
            let mut plant = RapierPlant::new(&world, start, Seed(1));
            drive(&mut plant, &tour.map(|(v, omega, t)| (v, sign * omega, t)));
            plant.truth()
        };
        let path = run(Pose::IDENTITY, 1.0);
        let mirrored = run(Pose::IDENTITY, -1.0);
        assert!((path.x - mirrored.x).abs() < 1e-9 && (path.y + mirrored.y).abs() < 1e-9, "{k}: {path:?} {mirrored:?}");
        assert!(wrap(path.heading + mirrored.heading).abs() < 1e-9);

        let frame = Pose::new(draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-PI, PI));
        let turned = run(frame, 1.0);
        assert!(distance(frame.compose(&path), turned) < 1e-9, "{k}: {path:?} {turned:?}");
    }
}

#[test]
fn runs_repeat_bit_by_bit_and_seeds_differ() {
    let run = |seed: u64| {
        let mut plant = RapierPlant::new(&crowded_room(), Pose::new(-1.0, 0.0, 0.0), Seed(seed));
        let steps = drive(&mut plant, &[(0.3, 0.3, 4.0), (0.3, -0.5, 4.0), (0.3, 0.0, 4.0)]);
        (format!("{:?} {:?}", plant.truth(), plant.body_poses()), steps)
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn halving_the_substep_converges() {
    let world = world(12.0, "");
    let run = |substep: f64| {
        let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1)).with_substep(substep);
        drive(&mut plant, &TOUR);
        plant.truth()
    };
    let finest = run(DT / 16.0);
    let errors: Vec<f64> = [2.0 * DT, DT, DT / 2.0].into_iter().map(|h| distance(run(h), finest)).collect();
    // First order: each halving should halve the error, or nearly so.
    assert!(errors.windows(2).all(|e| e[1] < 0.65 * e[0]), "{errors:?}");
    assert!(errors[1] < 1e-3, "{errors:?}");
}

/// A room that is not convex, with furniture, a passer-by and a walker.
fn crowded_room() -> World {
    world_of(
        "[[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [0.1, 2.0], [0.05, 1.2], [0.0, 2.0], [-2.0, 2.0]]",
        r#"
        [[landmarks]]
        name = "crate"
        shape = { box = { size_m = [0.4, 0.4] } }
        position_m = [-0.8, -1.6]
        heading_deg = 30.0
        height_m = 0.5
        texture = { family = "plain" }
        [[obstacles]]
        name = "passer-by"
        shape = { disc = { radius_m = 0.2 } }
        position_m = [-1.5, -1.0]
        height_m = 1.7
        texture = { family = "plain" }
        motion = { path = { corners_m = [[1.5, -1.0]], speed_m_s = 0.8 } }
        [[obstacles]]
        name = "walker"
        shape = { disc = { radius_m = 0.2 } }
        position_m = [-1.0, 1.0]
        height_m = 1.7
        texture = { family = "plain" }
        motion = { walk = { region_m = [[-1.7, 0.6], [1.7, -1.7], [1.7, 1.7], [0.0, 0.6], [-1.7, 1.7]], speed_m_s = 0.5 } }
        "#,
    )
}

/// Distance by which the robot's body reaches through the room's walls, seen from its centre, which must be inside.
fn reach_through_walls(world: &World, robot: Pose) -> f64 {
    let p = robot.position();
    let n = world.outline.len();
    let mut inside = false;
    let mut gap = f64::INFINITY;
    for k in 0..n {
        let (a, b) = (world.outline[k], world.outline[(k + 1) % n]);
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
        let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        gap = gap.min((a + (b - a) * t - p).norm());
    }
    assert!(inside, "outside the room at {robot:?}");
    world.spec.robot.radius_m - gap
}

#[test]
fn walls_hold_the_robot_and_a_collision_is_reported_once() {
    let world = world(3.0, "");
    let mut plant = RapierPlant::new(&world, Pose::new(0.0, 0.0, 0.3), Seed(1));
    let mut collisions = 0;
    for step in drive(&mut plant, &[(0.3, 0.0, 8.0)]) {
        collisions += step.collisions;
        assert!(reach_through_walls(&world, plant.truth()) < 1e-3);
    }
    assert_eq!(collisions, 1);
    assert!(plant.truth().x > 1.3, "{:?}", plant.truth());
    // Backing off and coming again is a second one.
    let steps = drive(&mut plant, &[(-0.3, 0.0, 2.0), (0.3, 0.0, 4.0)]);
    assert_eq!(steps.iter().map(|s| s.collisions).sum::<u32>(), 1);
}

/// A head-on hit takes the impulse m v (1 + e) from the robot, with the hull's restitution e = 0.1; 1 %.
#[test]
fn a_collision_tells_time_wall_and_impulse() {
    let world = with_robot(world(3.0, ""), symmetric_robot());
    let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1));
    let mut hits = Vec::new();
    for _ in 0..60 {
        plant.step(Twist { v: 0.3, omega: 0.0 }, 0.1);
        hits.extend_from_slice(plant.collisions());
    }
    let [hit] = hits[..] else { panic!("{hits:?}") };
    assert_eq!(hit.with.name(&world), "wall 1");
    let expected = world.spec.robot.mass_kg * 0.3 * 1.1;
    assert!((hit.impulse_n_s / expected - 1.0).abs() < 0.01, "{} against {expected}", hit.impulse_n_s);
    // 1.336 m to the wall at 0.3 m/s, after gaining speed at 0.9 m/s^2, which costs half of 0.3 / 0.9 s; the loop lags a little.
    let expected = (1.5 - 0.164) / 0.3 + 0.5 * 0.3 / 0.9;
    assert!((hit.time_s - expected).abs() < 0.05, "{} against {expected}", hit.time_s);
}

/// Wherever the robot is sent in a room with corners, furniture and people, it stays inside, and people do not run it over.
#[test]
fn a_crowded_room_holds_the_robot_and_its_walkers() {
    let world = crowded_room();
    let region = [[-1.7, 0.6], [1.7, -1.7], [1.7, 1.7], [0.0, 0.6], [-1.7, 1.7]];
    let mut plant = RapierPlant::new(&world, Pose::new(-1.0, 0.0, 0.0), Seed(5));
    let mut collisions = 0;
    let mut walked = 0.0;
    let mut before = plant.body_poses()[2];
    for k in 0..600 {
        let command = [(0.3, 0.4), (0.3, -0.9), (-0.3, 0.5)][(k / 25) % 3];
        collisions += plant.step(Twist { v: command.0, omega: command.1 }, 0.1).collisions;
        assert!(reach_through_walls(&world, plant.truth()) < 2e-3, "step {k}");
        let walker = plant.body_poses()[2];
        walked += distance(walker, before);
        before = walker;
        for body in &plant.body_poses()[1..] {
            assert!(distance(*body, plant.truth()) > 0.2 + 0.164 - 2e-3, "step {k}: run over");
        }
        assert!(inside_convex_pieces(&region, walker.position()), "step {k}: {walker:?}");
    }
    assert!(collisions > 3, "{collisions}");
    assert!(walked > 5.0, "{walked}");
}

/// The walker's region above, cut at its reflex corner (0, 0.6) into three triangles.
fn inside_convex_pieces(r: &[[f64; 2]; 5], p: Vector2<f64>) -> bool {
    let side = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (p.y - a[1]) - (b[1] - a[1]) * (p.x - a[0]) > -1e-9;
    [[0, 1, 3], [1, 2, 3], [0, 3, 4]].iter().any(|t| side(r[t[0]], r[t[1]]) && side(r[t[1]], r[t[2]]) && side(r[t[2]], r[t[0]]))
}

#[test]
fn what_hangs_higher_than_the_robot_is_driven_under() {
    let shelf = |elevation: f64| {
        let more = format!(
            "[[landmarks]]\nname = \"shelf\"\nshape = {{ box = {{ size_m = [0.2, 2.0] }} }}\nposition_m = [0.4, 0.0]\n\
             height_m = 0.3\nelevation_m = {elevation}\ntexture = {{ family = \"plain\" }}"
        );
        let mut plant = RapierPlant::new(&world(4.0, &more), Pose::new(-1.0, 0.0, 0.0), Seed(1));
        let hits: u32 = drive(&mut plant, &[(0.3, 0.0, 6.0)]).iter().map(|s| s.collisions).sum();
        (plant.truth().x, hits)
    };
    let (x, hits) = shelf(0.45);
    assert!(x > 0.6 && hits == 0, "{x} {hits}");
    let (x, hits) = shelf(0.3);
    assert!(x < 0.3 - 0.16 && hits == 1, "{x} {hits}");
}

/// Once round a square of 1.5 m with turns on the spot: 6 m.
const SQUARE: [(f64, f64, f64); 8] = {
    let side = (0.3, 0.0, 5.0);
    let turn = (0.0, FRAC_PI_2, 1.0);
    [side, turn, side, turn, side, turn, side, turn]
};

#[test]
fn odometry_drifts_a_little_on_a_clean_floor_and_more_on_ice() {
    let drift = |more: &str| {
        let start = Pose::new(-0.75, -0.75, 0.0);
        let mut plant = RapierPlant::new(&world(6.0, more), start, Seed(1));
        let steps = drive(&mut plant, &SQUARE);
        distance(dead_reckoned(start, &steps), plant.truth())
    };
    let path = 6.0;
    let clean = drift("");
    assert!(clean > 1e-3 && clean < 0.02 * path, "{clean}");
    let ice = drift(
        "[[floor.zones]]\nname = \"ice\"\npolygon_m = [[0.0, -3.0], [3.0, -3.0], [3.0, 3.0], [0.0, 3.0]]\nfriction = 0.02",
    );
    assert!(ice > 2.0 * clean, "{ice} against {clean}");
}

/// The speed loop at the default robot: 0.3 m/s within half a second and 5 %, a turn on the spot, braking in 0.4 s.
#[test]
fn the_speed_loop_follows_commands() {
    let robot = symmetric_robot();
    let mut plant = RapierPlant::new(&with_robot(world(12.0, ""), robot), Pose::IDENTITY, Seed(1));
    let mut fastest: f64 = 0.0;
    for k in 1..=100 {
        plant.step(Twist { v: 0.3, omega: 0.0 }, 0.02);
        let v = plant.chassis().axle_velocity().x;
        fastest = fastest.max(v);
        assert!(k < 25 || (v / 0.3 - 1.0).abs() < 0.03, "{v} after {} s", f64::from(k) * 0.02);
    }
    assert!(fastest < 0.3 * 1.05, "{fastest}");
    plant.step(Twist::default(), 0.4);
    assert!(plant.chassis().axle_velocity().x.abs() < 0.015, "{}", plant.chassis().axle_velocity().x);

    let before = plant.truth();
    plant.step(Twist { v: 0.0, omega: 1.9 }, 1.0);
    assert!((plant.chassis().velocity().yaw_rate / 1.9 - 1.0).abs() < 0.02);
    assert!(distance(before, plant.truth()) < 0.01);
}

#[test]
fn the_unicycle_does_what_it_is_told() {
    let world = crowded_room();
    let start = Pose::new(0.5, -0.5, 0.2);
    let mut plant = UnicyclePlant::new(&world, start, Seed(5));
    // Half a circle of radius 2 m, at a speed that no wheel would reach.
    let twist = Twist { v: 10.0, omega: 5.0 };
    let steps: Vec<_> = (0..7).map(|_| plant.step(twist, PI / 5.0 / 7.0)).collect();
    assert!(steps.iter().all(|s| s.odometry.twist == twist && s.collisions == 0));
    let expected = start.compose(&Pose::new(0.0, 4.0, PI));
    assert!(distance(plant.truth(), expected) < 1e-12 && wrap(plant.truth().heading - expected.heading).abs() < 1e-12);
    assert!(distance(plant.body_poses()[1], world.bodies[1].pose) > 0.1);
}
