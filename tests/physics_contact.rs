//! The robot's hull against walls and bodies: closed forms of a hit, what must never happen, and rapier as the second opinion.
//!
//! Closed forms hold on a floor without friction, so that nothing but the hit acts, for a robot that is a uniform disc with its
//! centre of gravity in the middle. A hit gives back e = 0.1 of the speed of approach (Newton) and rubs with mu = 0.3 (Coulomb);
//! see R. M. Brach, "Mechanical Impact Dynamics", on the oblique impact of a disc.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt;
use wayhome::geometry::{Pose, Twist, Vector2, cross, direction};
use wayhome::observation::BumperSector;
use wayhome::physics::{Collision, PlanarVelocity, Plant, RapierPlant};
use wayhome::random::{Seed, Stream};
use wayhome::world::{Footprint, RobotSpec, World};

const RESTITUTION: f64 = 0.1;
const FRICTION: f64 = 0.3;

/// A room of 6 m around the origin with `more` in it, and a disc of a robot.
fn world(floor_friction: f64, more: &str) -> World {
    let text = format!(
        "name = \"test\"\nhome = {{ x_m = 0.0, y_m = 0.0 }}\nfloor = {{ friction = {floor_friction} }}\n\
         room = {{ outline_m = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]] }}\n{more}"
    );
    let mut world = World::from_toml(&text, "test.toml").unwrap();
    world.spec.robot =
        RobotSpec { centre_of_gravity_m: 0.0, wheel_radius_error: [0.0; 2], rolling_resistance: 0.0, ..RobotSpec::default() };
    world
}

fn body(kind: &str, name: &str, shape: &str, position: [f64; 2], more: &str) -> String {
    format!(
        "[[{kind}]]\nname = \"{name}\"\nshape = {{ {shape} }}\nposition_m = {position:?}\nheight_m = 1.0\n\
         texture = {{ family = \"plain\" }}\n{more}\n"
    )
}

/// A crate, a pillar and a sharp wedge.
fn furniture() -> String {
    body("landmarks", "crate", "box = { size_m = [0.8, 0.5] }", [-1.2, 1.1], "heading_deg = 25.0")
        + &body("landmarks", "pillar", "disc = { radius_m = 0.3 }", [1.0, 1.5], "")
        + &body("landmarks", "wedge", "polygon = { corners_m = [[-0.5, -0.1], [0.6, 0.0], [-0.5, 0.1]] }", [0.5, -1.2], "")
}

/// Steps a plant that nobody drives for `seconds`, one substep at a time; each collision with the velocities before and after.
fn coast(plant: &mut RapierPlant, seconds: f64) -> Vec<(Collision, PlanarVelocity, PlanarVelocity)> {
    let mut hits = Vec::new();
    for _ in 0..(seconds * 1e3) as u32 {
        let before = plant.chassis().velocity();
        plant.step(Twist::default(), 1e-3);
        hits.extend(plant.collisions().iter().map(|hit| (*hit, before, plant.chassis().velocity())));
    }
    hits
}

fn velocity(x: f64, y: f64, yaw_rate: f64) -> PlanarVelocity {
    PlanarVelocity { linear: Vector2::new(x, y), yaw_rate }
}

/// Free space between the robot's hull and the nearest wall or body, m, computed anew.
fn gap(world: &World, robot: Pose, poses: &[Pose]) -> f64 {
    let p = robot.position();
    let n = world.outline.len();
    let distance = |a: Vector2<f64>, b: Vector2<f64>, p: Vector2<f64>| {
        let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (a + (b - a) * t - p).norm()
    };
    let polygon = |corners: &[Vector2<f64>], p: Vector2<f64>| {
        let n = corners.len();
        (0..n).map(|k| distance(corners[k], corners[(k + 1) % n], p)).fold(f64::INFINITY, f64::min)
    };
    let bodies = world.bodies.iter().zip(poses).map(|(body, pose)| match &body.footprint {
        Footprint::Disc(radius) => (pose.position() - p).norm() - radius,
        Footprint::Polygon(corners) => polygon(corners, pose.inverse_transform(p)),
    });
    assert!(
        (0..n).all(|k| cross(world.outline[(k + 1) % n] - world.outline[k], p - world.outline[k]) > 0.0),
        "outside: {robot:?}"
    );
    bodies.fold(polygon(&world.outline, p), f64::min) - world.spec.robot.radius_m
}

/// Whatever is hit under whatever angle, with c = 3 for a disc (1 + m R^2 / I):
/// - along the normal v_n' = -e v_n,
/// - along the surface the hull's slip u = v_t + omega R ends if u < c mu (1 + e) v_n, by the impulse m u / c; else friction
///   takes mu (1 + e) m v_n;
/// - the impulse reported is that of both together. To rounding.
#[test]
fn hits_follow_newton_and_coulomb() {
    let world = world(0.0, &furniture());
    let (m, r) = (world.spec.robot.mass_kg, world.spec.robot.radius_m);
    // Start, velocity, where on what the nearest point lies once it touches.
    let pillar = Vector2::new(1.0, 1.5);
    let tip = Vector2::new(1.1, -1.2);
    type Nearest = Box<dyn Fn(Vector2<f64>) -> Vector2<f64>>;
    let cases: Vec<(&str, Pose, PlanarVelocity, Nearest)> = vec![
        ("wall 1", Pose::new(2.0, 0.0, 0.4), velocity(0.5, 0.0, 0.0), Box::new(|p| Vector2::new(3.0, p.y))),
        ("wall 1", Pose::new(2.0, 0.0, 0.4), velocity(0.5, 0.3, 0.0), Box::new(|p| Vector2::new(3.0, p.y))),
        ("wall 1", Pose::new(2.0, 0.0, 0.4), velocity(0.5, 0.9, 0.0), Box::new(|p| Vector2::new(3.0, p.y))),
        ("wall 0", Pose::new(0.0, -2.0, 0.4), velocity(-0.4, -1.1, 7.0), Box::new(|p| Vector2::new(p.x, -3.0))),
        (
            "pillar",
            Pose::new(0.1, 1.3, 0.0),
            velocity(0.8, 0.1, -2.0),
            Box::new(move |p| pillar + (p - pillar).normalize() * 0.3),
        ),
        ("wedge", Pose::new(1.9, -1.1, 0.0), velocity(-0.7, 0.0, 0.0), Box::new(move |_| tip)),
    ];
    for (name, start, push, nearest) in cases {
        let mut plant = RapierPlant::new(&world, start, Seed(1));
        plant.push(push);
        let hits = coast(&mut plant, 1.8);
        let (hit, before, after) = hits[0];
        assert_eq!(hit.with.name(&world), name);
        // The normal is that at the start of the substep of the hit.
        let mut twin = RapierPlant::new(&world, start, Seed(1));
        twin.push(push);
        coast(&mut twin, hit.time_s - 0.0005);
        let centre = twin.truth().position();
        let normal = (centre - nearest(centre)).normalize();
        let tangent = Vector2::new(-normal.y, normal.x);
        let (approach, along) = (-before.linear.dot(&normal), before.linear.dot(&tangent));
        let slip = along - before.yaw_rate * r;
        let most = FRICTION * (1.0 + RESTITUTION) * approach * m;
        let rubbed = (m * slip / 3.0).clamp(-most, most);
        let expected = (RESTITUTION * approach, along - rubbed / m, before.yaw_rate + rubbed * r / (0.5 * m * r * r));
        let found = (after.linear.dot(&normal), after.linear.dot(&tangent), after.yaw_rate);
        let impulse = m * Vector2::new((1.0 + RESTITUTION) * approach, rubbed / m).norm();
        for (found, expected) in
            [(found.0, expected.0), (found.1, expected.1), (found.2, expected.2), (hit.impulse_n_s, impulse)]
        {
            assert!((found - expected).abs() < 1e-9, "{name}: {found} against {expected}");
        }
    }
}

fn draw(stream: &mut Stream, low: f64, high: f64) -> f64 {
    low + (high - low) * stream.random::<f64>()
}

/// Thrown about among furniture without friction on the floor, from random states: the robot never sinks into anything, hits
/// never give energy, and there are many of them.
#[test]
fn random_throws_never_penetrate_and_never_gain_energy() {
    let world = world(0.0, &furniture());
    let mut stream = Seed(11).stream("throws");
    let (mut hits, mut deepest) = (0, 0.0_f64);
    for _ in 0..60 {
        let mut draw = |low: f64, high: f64| draw(&mut stream, low, high);
        let mut plant = RapierPlant::new(&world, Pose::new(draw(-0.6, 0.6), draw(-0.6, 0.6), draw(-PI, PI)), Seed(1));
        plant.push(velocity(draw(-4.0, 4.0), draw(-4.0, 4.0), draw(-9.0, 9.0)));
        let mut energy = plant.chassis().kinetic_energy();
        for _ in 0..3000 {
            hits += plant.step(Twist::default(), 1e-3).collisions;
            let now = plant.chassis().kinetic_energy();
            assert!(now <= energy * (1.0 + 1e-12), "{energy} J to {now} J at {:?}", plant.truth());
            energy = now;
            deepest = deepest.max(-gap(&world, plant.truth(), plant.body_poses()));
        }
    }
    assert!(hits > 60, "{hits}");
    assert!(deepest < 1e-5, "{deepest}");
}

/// On a real floor, driven against walls, into corners and along furniture: motors press for minutes, and nothing gives.
#[test]
fn pressing_motors_do_not_push_the_robot_into_anything() {
    let world = world(0.75, &furniture());
    let mut stream = Seed(12).stream("presses");
    for _ in 0..12 {
        let mut draw = |low: f64, high: f64| draw(&mut stream, low, high);
        let mut plant = RapierPlant::new(&world, Pose::new(draw(-0.5, 0.5), draw(-0.5, 0.5), draw(-PI, PI)), Seed(1));
        let command = Twist { v: draw(0.1, 0.306), omega: draw(-0.2, 0.2) };
        for _ in 0..300 {
            plant.step(command, 0.1);
            assert!(gap(&world, plant.truth(), plant.body_poses()) > -1e-6, "{:?}", plant.truth());
        }
    }
}

/// The same drives with rapier's contacts in the place of the hull's own: along a wall, into a corner, past a pillar, into a
/// crate's corner. They end within 5 mm and 0.05 rad of one another and report the same first collision.
#[test]
fn rapier_as_a_second_opinion_agrees() {
    let world = world(0.75, &furniture());
    for (start, command, seconds) in [
        (Pose::new(0.0, -2.5, -0.5), Twist { v: 0.3, omega: 0.0 }, 8.0),
        (Pose::new(2.2, -2.3, -0.6), Twist { v: 0.2, omega: 0.0 }, 10.0),
        (Pose::new(0.0, 1.2, 0.0), Twist { v: 0.3, omega: 0.0 }, 6.0),
        (Pose::new(-1.4, -0.2, FRAC_PI_2), Twist { v: 0.3, omega: 0.05 }, 6.0),
        (Pose::new(2.0, 0.0, 0.0), Twist { v: 0.3, omega: 0.0 }, 5.0),
    ] {
        let run = |mut plant: RapierPlant| {
            let mut first = None;
            for _ in 0..(seconds * 10.0) as u32 {
                plant.step(command, 0.1);
                let hit = plant.collisions().first().copied();
                first = first.or(hit.map(|hit| (hit, plant.bumper())));
            }
            (plant.truth(), first.unwrap())
        };
        let (ours, (our_hit, our_bumper)) = run(RapierPlant::new(&world, start, Seed(1)));
        let (theirs, (their_hit, their_bumper)) = run(RapierPlant::new(&world, start, Seed(1)).always_asking_rapier());
        let apart = (ours.position() - theirs.position()).norm();
        assert!(apart < 5e-3 && (direction(ours.heading) - direction(theirs.heading)).norm() < 0.05, "{ours:?} {theirs:?}");
        assert_eq!(our_hit.with, their_hit.with);
        assert_eq!(our_bumper, their_bumper);
        assert!(our_bumper.sectors().next().is_some(), "it drove forwards into something");
        assert!((our_hit.time_s - their_hit.time_s).abs() < 0.02, "{our_hit:?} {their_hit:?}");
        assert!((our_hit.impulse_n_s / their_hit.impulse_n_s - 1.0).abs() < 0.05, "{our_hit:?} {their_hit:?}");
    }
}

/// A robot that is pushed into a wall feels it in the sector that faces the wall, and behind it nothing.
#[test]
fn the_bumper_feels_where_the_wall_is() {
    use BumperSector::{FrontCentre, FrontLeft, FrontRight, Left, Right};
    let world = world(0.0, "");
    for (heading_deg, felt) in [
        (0.0, Some(FrontCentre)),
        (-30.0, Some(FrontLeft)),
        (30.0, Some(FrontRight)),
        (-70.0, Some(Left)),
        (70.0, Some(Right)),
        (110.0, None),
        (180.0, None),
    ] {
        let heading = f64::to_radians(heading_deg);
        let mut plant = RapierPlant::new(&world, Pose::new(2.0, 0.0, heading), Seed(1));
        plant.push(velocity(1.0, 0.0, 0.0));
        plant.step(Twist::default(), 1.5);
        assert_eq!(plant.collisions().len(), 1, "{heading_deg}");
        assert!(plant.bumper().sectors().eq(felt), "{heading_deg}: {:?}", plant.bumper());
        plant.step(Twist::default(), 0.1);
        assert!(plant.bumper().sectors().next().is_none(), "it has bounced off");
    }
}

/// Head-on against a free carton of mass M: v1' = (m - e M) v / (m + M) and v2' = (1 + e) m v / (m + M) (Newton, momentum kept);
/// through rapier, 2 %.
#[test]
fn a_hit_carton_takes_its_share_of_the_momentum() {
    for carton_kg in [0.5, 2.3, 9.0] {
        let motion = format!("motion = {{ pushed = {{ mass_kg = {carton_kg}, friction = 0.0 }} }}");
        let world = world(0.0, &body("obstacles", "carton", "box = { size_m = [0.4, 0.6] }", [0.8, 0.0], &motion));
        let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1));
        plant.push(velocity(0.5, 0.0, 0.0));
        plant.step(Twist::default(), 1.2);
        let [hit] = *plant.collisions() else { panic!("{:?}", plant.collisions()) };
        let (m, robot, carton) = (world.spec.robot.mass_kg, plant.chassis().velocity().linear.x, plant.body_poses()[0].x);
        plant.step(Twist::default(), 0.1);
        let carton = (plant.body_poses()[0].x - carton) / 0.1;
        let total = m + carton_kg;
        let expected = ((m - RESTITUTION * carton_kg) * 0.5 / total, (1.0 + RESTITUTION) * m * 0.5 / total);
        assert!(
            (robot - expected.0).abs() < 0.02 * 0.5 && (carton - expected.1).abs() < 0.02 * 0.5,
            "{robot} {carton} {expected:?}"
        );
        assert!((m * robot + carton_kg * carton - m * 0.5).abs() < 0.02 * m * 0.5);
        let impulse = carton_kg * expected.1;
        assert!((hit.impulse_n_s / impulse - 1.0).abs() < 0.02, "{hit:?} {impulse}");
    }
}

/// A cart on a path that moves across the robot's nose while the robot presses against it drags the robot along by friction and
/// never runs it over; a carton in a cart's way is pushed by it though the robot is far away.
#[test]
fn moving_bodies_drag_the_robot_and_push_cartons() {
    let cart = "motion = { path = { corners_m = [[1.0, 1.5]], speed_m_s = 0.2 } }";
    let room = world(0.1, &body("obstacles", "cart", "box = { size_m = [0.4, 2.0] }", [1.0, -0.5], cart));
    let mut plant = RapierPlant::new(&room, Pose::new(0.5, 0.0, 0.0), Seed(1));
    let mut dragged = 0.0_f64;
    for _ in 0..60 {
        plant.step(Twist { v: 0.2, omega: 0.0 }, 0.1);
        dragged = dragged.max(plant.chassis().velocity().linear.y);
        assert!(gap(&room, plant.truth(), plant.body_poses()) > -1e-4, "{:?}", plant.truth());
    }
    assert!(dragged > 0.01, "{dragged}");

    let across = "motion = { path = { corners_m = [[2.0, 2.0]], speed_m_s = 0.3 } }";
    let carton = "motion = { pushed = { mass_kg = 1.0, friction = 0.3 } }";
    let mut room = world(
        0.75,
        &(body("obstacles", "cart", "disc = { radius_m = 0.3 }", [-2.0, 2.0], across)
            + &body("obstacles", "carton", "box = { size_m = [0.3, 0.3] }", [0.0, 1.0], carton)),
    );
    room.bodies[1].pose.y = 2.0; // where a world file may not have it
    let mut plant = RapierPlant::new(&room, Pose::new(0.0, -2.0, 0.0), Seed(1));
    for _ in 0..120 {
        plant.step(Twist::default(), 0.1);
    }
    let carton = plant.body_poses()[1];
    assert!((carton.position() - Vector2::new(0.0, 2.0)).norm() > 0.3, "{carton:?}");
    assert_eq!(plant.truth().position(), Vector2::new(0.0, -2.0));
}

/// A wall from y = -3 to y = 3 at x = 1 with an opening around y = 0, 0.6 m wide.
fn wall_with(opening: &str) -> World {
    world(0.75, &format!("[[walls]]\nname = \"partition\"\nfrom_m = [1.0, -3.0]\nto_m = [1.0, 3.0]\nopenings = [{opening}]\n"))
}

#[test]
fn a_robot_passes_a_door_that_is_high_enough_and_nothing_else_of_a_wall() {
    let at = "from_start_m = 2.7, width_m = 0.6";
    let doors = [
        (format!("{{ kind = \"door\", {at} }}"), true),
        (format!("{{ {at}, top_m = 2.5 }}"), true),
        (format!("{{ {at}, sill_m = 0.02 }}"), false),
        (format!("{{ kind = \"window\", {at} }}"), false),
        (format!("{{ {at}, top_m = 0.2 }}"), false),
    ];
    for (opening, passes) in doors {
        let world = wall_with(&opening);
        for always_rapier in [false, true] {
            let start = Pose::new(0.0, 0.0, 0.0);
            let mut plant = RapierPlant::new(&world, start, Seed(1));
            if always_rapier {
                plant = plant.always_asking_rapier();
            }
            let mut hits = Vec::new();
            for _ in 0..80 {
                plant.step(Twist { v: 0.3, omega: 0.0 }, 0.1);
                hits.extend(plant.collisions().iter().map(|hit| hit.with.name(&world)));
            }
            let radius = world.spec.robot.radius_m;
            if passes {
                assert!(plant.truth().x > 1.9 && hits.is_empty(), "{opening}: {:?}, {hits:?}", plant.truth());
            } else {
                assert_eq!(hits, ["partition"], "{opening}");
                assert!((plant.truth().x - (0.95 - radius)).abs() < 2e-3, "{opening}: {:?}", plant.truth());
            }
        }
        let free = |y: f64| world.is_free(&Pose::new(1.0, y, 0.0), 0.0, &[]);
        assert_eq!(free(0.0).is_ok(), passes, "{opening}");
        assert_eq!(free(0.2), Err("partition".to_owned()), "{opening}: a jamb is in the way");
        let corridor = world.is_corridor_free(Vector2::new(0.0, 0.0), Vector2::new(2.0, 0.0));
        assert_eq!(corridor.is_ok(), passes, "{opening}");
    }
}
