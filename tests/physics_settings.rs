//! What a world can ask of the robot's physics beyond the default: load transfer, rolling resistance, gyro, faults, kicks,
//! kidnaps, bodies to push. Each against its closed form.

#![allow(clippy::unwrap_used)]

use rand::RngExt;
use wayhome::geometry::{Pose, Twist, Vector2, wrap};
use wayhome::physics::{Chassis, PlanarVelocity, Plant, RapierPlant, STANDARD_GRAVITY_M_S2 as G, UnicyclePlant, WheelDrive};
use wayhome::random::Seed;
use wayhome::world::{RobotSpec, World};

const DT: f64 = 1e-3;

/// A square room of 8 m around the origin, with further lines of the file. `robot` are lines of its robot, which has equal
/// wheels, no rolling resistance and its weight (almost) on the wheels alone.
fn world(robot: &str, more: &str) -> World {
    load(&format!(
        "name = \"test\"\nhome = {{ x_m = 0.0, y_m = 0.0 }}\n\
         room = {{ outline_m = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]] }}\n{more}\n\
         [robot]\nwheel_radius_error = [0.0, 0.0]\ncentre_of_gravity_m = 1e-9\nrolling_resistance = 0.0\n{robot}\n"
    ))
    .unwrap()
}

fn load(text: &str) -> Result<World, wayhome::Error> {
    World::from_toml(text, "test.toml")
}

fn symmetric_robot() -> RobotSpec {
    RobotSpec { centre_of_gravity_m: 0.0, wheel_radius_error: [0.0; 2], rolling_resistance: 0.0, ..RobotSpec::default() }
}

fn moving(x: f64, y: f64) -> PlanarVelocity {
    PlanarVelocity { linear: Vector2::new(x, y), yaw_rate: 0.0 }
}

/// Forward deceleration between 0.2 and 0.4 s.
fn deceleration(chassis: &mut Chassis, drives: [WheelDrive; 2], mu: f64) -> f64 {
    let mut early = 0.0;
    for k in 0..400 {
        if k == 200 {
            early = chassis.axle_velocity().x;
        }
        chassis.advance(drives, |_| mu, DT);
    }
    (early - chassis.axle_velocity().x) / 0.2
}

/// A robot that coasts on two wheels of rolling resistance c slows down by c g / (1 + 2 I_w / (m R^2)); 0.1 %.
#[test]
fn rolling_resistance_slows_a_coasting_robot() {
    let robot = RobotSpec { rolling_resistance: 0.02, ..symmetric_robot() };
    let mut chassis = Chassis::new(&robot, Pose::IDENTITY);
    chassis.set_velocity(moving(0.5, 0.0));
    chassis.set_wheel_speeds([0.5 / robot.wheel_radius_m; 2]);
    let r = robot.wheel_radius_m;
    let expected = 0.02 * G / (1.0 + 2.0 * robot.wheel_inertia_kg_m2 / (robot.mass_kg * r * r));
    let found = deceleration(&mut chassis, [WheelDrive::Torque(0.0); 2], 0.75);
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} against {expected}");
    // It ends at rest, and stays.
    for _ in 0..5000 {
        chassis.advance([WheelDrive::Torque(0.0); 2], |_| 0.75, DT);
    }
    assert_eq!((chassis.axle_velocity().x, chassis.wheel_speeds()), (0.0, [0.0; 2]));
}

/// Locked wheels and a caster without friction, ahead of the axle by L, with the centre of gravity ahead by x and up by h:
/// braking takes load off the wheels, so a = mu g (1 - x/L) / (1 + mu h/L) (moments about the axle; Wong, "Theory of Ground
/// Vehicles", braking with one axle); 0.1 %. Without h it is mu g (1 - x/L).
#[test]
fn braking_shifts_load_to_the_caster() {
    for height in [0.0, 0.06] {
        let robot = RobotSpec {
            centre_of_gravity_m: 0.03,
            centre_of_gravity_height_m: height,
            caster_friction: 0.0,
            ..symmetric_robot()
        };
        let mut chassis = Chassis::new(&robot, Pose::IDENTITY);
        chassis.set_velocity(moving(3.0, 0.0));
        let (mu, caster) = (0.5, robot.caster_m);
        let expected = mu * G * (1.0 - 0.03 / caster) / (1.0 + mu * height / caster);
        let found = deceleration(&mut chassis, [WheelDrive::Locked; 2], mu);
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} against {expected}");
        let weight: f64 = chassis.loads().iter().sum();
        assert!((weight / (robot.mass_kg * G) - 1.0).abs() < 1e-12);
    }
}

/// In a sideways skid the wheel in front carries m a h / (b/2) more than the other one; 0.1 %.
#[test]
fn a_sideways_skid_loads_the_leading_wheel() {
    let robot = RobotSpec { centre_of_gravity_height_m: 0.05, ..symmetric_robot() };
    let mut chassis = Chassis::new(&robot, Pose::IDENTITY);
    chassis.set_velocity(moving(0.0, 2.0));
    for _ in 0..200 {
        chassis.advance([WheelDrive::Locked; 2], |_| 0.5, DT);
    }
    let [left, right, _] = chassis.loads();
    let expected = 2.0 * robot.mass_kg * 0.5 * G * 0.05 / robot.track_m;
    assert!(((left - right) / expected - 1.0).abs() < 1e-3, "{left} - {right} against {expected}");
}

/// Whatever state the robot is in, no contact gives more than mu N, and none pushes along its slip.
#[test]
fn no_contact_gives_more_than_its_friction() {
    let mut stream = Seed(7).stream("random states");
    let mut draw = |low: f64, high: f64| low + (high - low) * stream.random::<f64>();
    for _ in 0..300 {
        let robot = RobotSpec {
            mass_kg: draw(0.5, 30.0),
            centre_of_gravity_m: draw(-0.02, 0.12),
            centre_of_gravity_height_m: draw(0.0, 0.2),
            rolling_resistance: draw(0.0, 0.05),
            creep_m_s: draw(0.001, 0.05),
            caster_friction: draw(0.0, 1.0),
            ..RobotSpec::default()
        };
        let mu = draw(0.0, 1.5);
        let mut chassis = Chassis::new(&robot, Pose::new(0.0, 0.0, draw(-3.0, 3.0)));
        chassis
            .set_velocity(PlanarVelocity { linear: Vector2::new(draw(-2.0, 2.0), draw(-2.0, 2.0)), yaw_rate: draw(-9.0, 9.0) });
        chassis.set_wheel_speeds([draw(-60.0, 60.0), draw(-60.0, 60.0)]);
        let drives = [WheelDrive::Speed(draw(-20.0, 20.0)), WheelDrive::Torque(draw(-1.0, 1.0))];
        for _ in 0..50 {
            chassis.kick(drives, |_| mu, DT);
            let limits = chassis.loads().map(|load| mu * load);
            for (k, (force, limit)) in chassis.forces().iter().zip(limits).enumerate() {
                let share = if k == 2 { robot.caster_friction } else { 1.0 };
                assert!(force.norm() <= limit * share * (1.0 + 1e-9), "{k}: {} N of {}", force.norm(), limit * share);
                assert!(k == 2 || force.dot(&chassis.slip()[k]) <= 1e-9, "{k}: {force} along {}", chassis.slip()[k]);
            }
            chassis.drift(DT);
        }
    }
}

/// Kicked sideways at rest with impulse J, the robot slides (J/m)^2 / (2 mu g); 0.5 %. Before, nothing happens.
#[test]
fn a_kick_comes_on_time_and_moves_by_its_impulse() {
    let kick = "disturbances = [{ at_s = 0.35, what = { kick = { impulse_n_s = [0.0, 2.3] } } }]\nfloor = { friction = 0.5 }";
    let mut plant = RapierPlant::new(&world("", kick), Pose::IDENTITY, Seed(1));
    plant.step(Twist::default(), 0.1);
    plant.step(Twist::default(), 0.25);
    assert_eq!(plant.chassis().velocity(), PlanarVelocity::default());
    plant.step(Twist::default(), 1.0);
    let expected = 1.0 / (2.0 * 0.5 * G);
    assert!((plant.truth().y / expected - 1.0).abs() < 0.005, "{} against {expected}", plant.truth().y);
}

/// A kidnapped robot stands elsewhere, and neither its encoders nor its gyro know.
#[test]
fn a_kidnapped_robot_does_not_notice() {
    let kidnap = "disturbances = [{ at_s = 0.5, what = { kidnap = { x_m = 2.0, y_m = -1.0, heading_deg = 90.0 } } }]";
    let gyro = "gyro = { bias_sd_rad_s = 0.0, noise_rad_s_sqrt_hz = 0.0 }";
    let world = world(gyro, kidnap);
    let mut plants: [Box<dyn Plant>; 2] = [
        Box::new(RapierPlant::new(&world, Pose::IDENTITY, Seed(1))),
        Box::new(UnicyclePlant::new(&world, Pose::IDENTITY, Seed(1))),
    ];
    for plant in &mut plants {
        for _ in 0..10 {
            assert_eq!(plant.step(Twist::default(), 0.1).odometry.twist, Twist::default());
        }
        let (there, to) = (plant.truth(), Pose::new(2.0, -1.0, std::f64::consts::FRAC_PI_2));
        assert!((there.position() - to.position()).norm() < 1e-9 && wrap(there.heading - to.heading).abs() < 1e-9, "{there:?}");
    }
}

/// Without bias and noise the gyro gives the true mean yaw rate, whatever the wheels do on ice.
#[test]
fn a_gyro_measures_what_wheels_on_ice_do_not() {
    let run = |robot: &str| {
        let mut plant = RapierPlant::new(&world(robot, "floor = { friction = 0.02 }"), Pose::IDENTITY, Seed(1));
        let turned: f64 = (0..5).map(|_| plant.step(Twist { v: 0.0, omega: 1.9 }, 0.1).odometry.twist.omega * 0.1).sum();
        turned - plant.truth().heading
    };
    assert!(run("gyro = { bias_sd_rad_s = 0.0, noise_rad_s_sqrt_hz = 0.0 }").abs() < 1e-12);
    assert!(run("").abs() > 0.05, "encoders on ice: {}", run(""));
    let noisy = run("gyro = { bias_sd_rad_s = 0.01, noise_rad_s_sqrt_hz = 0.001 }");
    assert!(noisy.abs() > 1e-6 && noisy.abs() < 0.05, "{noisy}");
}

/// A wheel that is smaller by a factor f bends the path of equal wheel speeds to the curvature 2 (1 - f) / (b (1 + f)); 1 %.
#[test]
fn a_worn_tyre_bends_the_path() {
    let worn = "faults = [{ wheel = \"left\", what = { worn-tyre = { radius_factor = 0.9 } } }]";
    let mut plant = RapierPlant::new(&world(worn, ""), Pose::new(-2.0, 0.0, 0.0), Seed(1));
    plant.step(Twist { v: 0.2, omega: 0.0 }, 1.0);
    let velocity = plant.chassis().velocity();
    let expected = 2.0 * (1.0 - 0.9) / (0.233 * (1.0 + 0.9));
    let found = velocity.yaw_rate / plant.chassis().axle_velocity().x;
    assert!((found / expected - 1.0).abs() < 0.01, "{found} against {expected}");
}

#[test]
fn broken_wheels_break_when_they_are_to() {
    let seized = "faults = [{ wheel = \"right\", what = \"seized-motor\", from_s = 1.0 }]";
    let mut plant = RapierPlant::new(&world(seized, ""), Pose::new(-2.0, 0.0, 0.0), Seed(1));
    plant.step(Twist { v: 0.2, omega: 0.0 }, 1.0);
    assert!(plant.truth().heading.abs() < 1e-6 && plant.chassis().wheel_speeds()[1] > 5.0);
    plant.step(Twist { v: 0.2, omega: 0.0 }, 0.5);
    assert!(plant.chassis().wheel_speeds()[1] == 0.0 && plant.truth().heading < -0.2, "{:?}", plant.truth());

    // With one dead encoder a straight drive reads as a curve at half the speed.
    let dead = "faults = [{ wheel = \"left\", what = \"dead-encoder\" }]";
    let mut plant = RapierPlant::new(&world(dead, ""), Pose::new(-2.0, 0.0, 0.0), Seed(1));
    plant.step(Twist { v: 0.2, omega: 0.0 }, 1.0);
    let twist = plant.step(Twist { v: 0.2, omega: 0.0 }, 1.0).odometry.twist;
    assert!((twist.v / 0.1 - 1.0).abs() < 0.01 && (twist.omega / (0.2 / 0.233) - 1.0).abs() < 0.01, "{twist:?}");
    assert!(plant.truth().heading.abs() < 1e-6);
}

/// A room with a carton before the robot.
fn carton(mass_kg: f64) -> World {
    world(
        "",
        &format!(
            "[[obstacles]]\nname = \"carton\"\nshape = {{ box = {{ size_m = [0.4, 0.6] }} }}\nposition_m = [1.0, 0.0]\n\
             height_m = 0.5\ntexture = {{ family = \"plain\" }}\nmotion = {{ pushed = {{ mass_kg = {mass_kg}, friction = 0.3 }} }}"
        ),
    )
}

/// A robot that pushes a carton at constant speed needs the carton's friction, mu m g; 2 %. Let go, the carton comes to rest.
#[test]
fn a_pushed_carton_costs_its_friction() {
    let world = carton(2.0);
    let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1));
    let mut hits = 0;
    for _ in 0..100 {
        hits += plant.step(Twist { v: 0.2, omega: 0.0 }, 0.1).collisions;
    }
    let before = plant.body_poses()[0];
    assert!(hits >= 1 && before.x > 1.5, "{hits} hits, carton at {before:?}");
    assert!(before.y.abs() < 0.02 && before.heading.abs() < 0.02, "{before:?}");
    plant.step(Twist { v: 0.2, omega: 0.0 }, 0.5);
    let force: f64 = plant.floor_contact().force_n.iter().map(|f| f.x).sum();
    let expected = 0.3 * 2.0 * G;
    assert!((force / expected - 1.0).abs() < 0.02, "{force} N against {expected}");

    plant.step(Twist { v: -0.2, omega: 0.0 }, 1.0);
    let rest = plant.body_poses()[0];
    plant.step(Twist { v: -0.2, omega: 0.0 }, 1.0);
    assert_eq!(plant.body_poses()[0], rest);

    // One with more grip than the robot stays where it is.
    let mut plant = RapierPlant::new(&carton(20.0), Pose::IDENTITY, Seed(1));
    for _ in 0..60 {
        plant.step(Twist { v: 0.2, omega: 0.0 }, 0.1);
    }
    assert!((plant.body_poses()[0].x - 1.0).abs() < 0.005 && plant.truth().x < 0.64, "{:?}", plant.body_poses()[0]);
}

/// Rapier at work in every substep, needed or not: far from everything, the path is the same bit by bit. So it is with a carton
/// in a corner.
#[test]
fn leaving_rapier_out_in_free_motion_changes_no_bit() {
    let far = "[[obstacles]]\nname = \"carton\"\nshape = { disc = { radius_m = 0.2 } }\nposition_m = [-3.5, -3.5]\n\
               height_m = 0.5\ntexture = { family = \"plain\" }\nmotion = { pushed = { mass_kg = 1.0 } }";
    let plant = |more: &str| RapierPlant::new(&world("", more), Pose::new(0.3, -0.2, 0.4), Seed(1));
    let run = |mut plant: RapierPlant| {
        let steps: Vec<_> = [(0.3, 0.5), (0.1, -1.0), (0.3, 0.0), (-0.2, 0.8)]
            .into_iter()
            .map(|(v, omega)| plant.step(Twist { v, omega }, 2.0))
            .collect();
        (plant.truth(), steps)
    };
    let alone = run(plant(""));
    assert_eq!(alone, run(plant("").always_asking_rapier()));
    assert_eq!(alone, run(plant(far)));
    assert_eq!(alone, run(plant(far).always_asking_rapier()));
}

#[test]
fn presets_fill_what_is_left_out() {
    let with = |robot: &str| {
        load(&format!(
            "name = \"t\"\nhome = {{ x_m = 1.0, y_m = 1.0 }}\ntask = {{ speed_m_s = 0.1 }}\n\
             room = {{ outline_m = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]] }}\n[robot]\n{robot}\n"
        ))
        .unwrap()
        .spec
        .robot
    };
    let burger = with("preset = \"turtlebot3\"\nmass_kg = 1.5");
    assert_eq!((burger.mass_kg, burger.track_m, burger.caster_m), (1.5, 0.16, -0.081));
    assert_eq!(with("preset = \"create3\""), RobotSpec::default());
    assert_eq!(with("preset = \"generic\"").encoder_counts_per_turn, 3200.0);
}

#[test]
fn bad_settings_are_refused_by_name() {
    let refused = |robot: &str, more: &str| {
        let text = format!(
            "name = \"test\"\nhome = {{ x_m = 0.0, y_m = 0.0 }}\n\
             room = {{ outline_m = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]] }}\n{more}\n[robot]\n{robot}\n"
        );
        load(&text).unwrap_err().to_string()
    };
    for (robot, more, words) in [
        ("wheel_radius_m = 0.0", "", ["line", "robot.wheel_radius_m", "found 0"]),
        ("preset = \"r2d2\"", "", ["line", "robot.preset", "create3"]),
        ("rolling_resistance = -0.1", "", ["line", "robot.rolling_resistance", "-0.1"]),
        ("centre_of_gravity_height_m = 0.6", "", ["line", "robot.centre_of_gravity_height_m", "0.35"]),
        ("gyro = { bias_sd_rad_s = nan, noise_rad_s_sqrt_hz = 0.0 }", "", ["line", "robot.gyro.bias_sd_rad_s", "NaN"]),
        ("faults = [{ wheel = \"middle\", what = \"seized-motor\" }]", "", ["line", "robot.faults[0].wheel", "left"]),
        (
            "faults = [{ wheel = \"left\", what = { worn-tyre = { radius_factor = 0.0 } } }]",
            "",
            ["line", "robot.faults[0].what.worn-tyre.radius_factor", "0.5 to 1.5"],
        ),
        ("", "floor = { friction = -1.0 }", ["line", "floor.friction", "-1"]),
        (
            "",
            "floor = { zones = [{ friction = 0.1, polygon_m = [[0.0, 0.0], [9.0, 0.0], [0.0, 1.0]] }] }",
            ["line", "floor.zones[0].polygon_m", "leaves the room"],
        ),
        (
            "",
            "disturbances = [{ at_s = -1.0, what = { kick = { impulse_n_s = [1.0, 0.0] } } }]",
            ["line", "disturbances[0].at_s", "-1"],
        ),
        (
            "",
            "disturbances = [{ at_s = 1.0, what = { kidnap = { x_m = 3.95, y_m = 0.0 } } }]",
            ["line", "disturbances[0].what.kidnap", "wall 1"],
        ),
        (
            "",
            "[[obstacles]]\nname = \"box\"\nshape = { disc = { radius_m = 0.2 } }\nposition_m = [1.0, 0.0]\nheight_m = 0.5\n\
             texture = { family = \"plain\" }\nmotion = { pushed = { mass_kg = 0.0 } }",
            ["line", "obstacles[0].motion.pushed.mass_kg", "found 0"],
        ),
    ] {
        let message = refused(robot, more);
        assert!(words.iter().all(|word| message.contains(word)), "{words:?} in: {message}");
    }
}
