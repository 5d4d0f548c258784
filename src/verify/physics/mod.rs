//! The physics against its closed forms, as curves to look at: what `tests/physics.rs` holds down at single points.
//!
//! Each [`ClosedForm`] sweeps one quantity and measures another on the plant, beside the equation's value. All of it is the
//! library's ordinary physics with ordinary world settings.

pub mod page;

use serde::{Serialize, Serializer};

use crate::error::Result;
use crate::geometry::{Pose, Twist, Vector2};
use crate::physics::{Chassis, PlanarVelocity, Plant, RapierPlant, STANDARD_GRAVITY_M_S2 as G, WheelDrive};
use crate::random::Seed;
use crate::world::robot::GyroSpec;
use crate::world::{RobotSpec, World};

/// Substep of the physics, s.
const DT: f64 = 1e-3;

/// All that is measured.
#[derive(Debug, Clone, Serialize)]
pub struct Validation {
    /// Closed forms with what was measured.
    pub closed_forms: Vec<ClosedForm>,
    /// Energy over time: (friction, curve).
    #[serde(skip)]
    pub energy: Vec<(f64, Vec<[f64; 2]>)>,
    /// End error over substep, (s, m).
    #[serde(skip)]
    pub convergence: Vec<[f64; 2]>,
    /// Odometry drift over friction and acceleration.
    #[serde(skip)]
    pub slip_map: SlipMap,
}

/// One equation and what the plant makes of it.
#[derive(Debug, Clone, Serialize)]
pub struct ClosedForm {
    /// Short name for files, of letters and hyphens.
    pub name: &'static str,
    /// What is measured, in a few words.
    #[serde(skip)]
    pub title: &'static str,
    /// The equation.
    pub equation: &'static str,
    /// Where it comes from, and what was done.
    #[serde(skip)]
    pub story: &'static str,
    /// Names of the axes with units.
    #[serde(skip)]
    pub axes: [&'static str; 2],
    /// What the tests allow for the greatest relative difference.
    #[serde(rename = "allowed")]
    pub tolerance: f64,
    /// One curve for each setting.
    #[serde(rename = "greatest_difference", serialize_with = "serialize_difference")]
    pub curves: Vec<Curve>,
}

impl ClosedForm {
    /// Greatest relative difference between a point and the equation.
    pub fn greatest_difference(&self) -> f64 {
        greatest_difference(&self.curves)
    }
}

fn greatest_difference(curves: &[Curve]) -> f64 {
    curves.iter().map(|curve| curve.greatest_difference).fold(0.0, f64::max)
}

fn serialize_difference<S: Serializer>(curves: &[Curve], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_f64(greatest_difference(curves))
}

/// One setting of a closed form.
#[derive(Debug, Clone)]
pub struct Curve {
    /// The setting.
    pub label: String,
    /// The equation, finely.
    pub exact: Vec<[f64; 2]>,
    /// The plant, at some places.
    pub measured: Vec<[f64; 2]>,
    /// Greatest relative difference between a point and the equation.
    pub greatest_difference: f64,
}

/// Greatest distance between the paths of odometry and truth, over friction and commanded acceleration.
#[derive(Debug, Clone)]
pub struct SlipMap {
    /// Friction of the floor.
    pub friction: Vec<f64>,
    /// Greatest commanded acceleration, m/s^2.
    pub acceleration_m_s2: Vec<f64>,
    /// The distance, m: one row for each acceleration, one column for each friction.
    pub drift_m: Vec<Vec<f64>>,
}

/// Measures all of it.
///
/// # Errors
/// None that a caller could cause: worlds made here are sound.
pub fn measure() -> Result<Validation> {
    let forms =
        [sideways_stop, traction, launch, yaw_braking, rolling_resistance, load_transfer, circle_grip, worn_tyre, carton, gyro];
    let closed_forms = forms.into_iter().map(|form| form()).collect::<Result<_>>()?;
    Ok(Validation { closed_forms, energy: energy(), convergence: convergence()?, slip_map: slip_map()? })
}

/// A robot with equal wheels that roll without resistance, and its weight on them alone.
fn plain_robot() -> RobotSpec {
    RobotSpec { centre_of_gravity_m: 0.0, wheel_radius_error: [0.0; 2], rolling_resistance: 0.0, ..RobotSpec::default() }
}

/// A hall of 40 m with the given floor and robot; `more` are further lines of the file.
fn hall(friction: f64, robot: RobotSpec, more: &str) -> Result<World> {
    let text = format!(
        "name = \"hall\"\nhome = {{ x_m = 0.0, y_m = 0.0 }}\nfloor = {{ friction = {friction} }}\n\
         room = {{ outline_m = [[-20.0, -20.0], [20.0, -20.0], [20.0, 20.0], [-20.0, 20.0]] }}\n{more}"
    );
    let mut world = World::from_toml(&text, "hall")?;
    // A robot on two wheels alone has no place in a world file, which asks for a load on the caster.
    world.spec.robot = robot;
    Ok(world)
}

fn moving(x: f64, y: f64, yaw_rate: f64) -> PlanarVelocity {
    PlanarVelocity { linear: Vector2::new(x, y), yaw_rate }
}

/// A curve over `xs`: what is measured at each of them, and the exact value on a fine grid from `from` on.
fn curve(
    label: impl Into<String>,
    from: f64,
    xs: &[f64],
    exact: impl Fn(f64) -> f64,
    measure: impl Fn(f64) -> Result<f64>,
) -> Result<Curve> {
    let measured = xs.iter().map(|&x| Ok([x, measure(x)?])).collect::<Result<Vec<_>>>()?;
    let to = xs.iter().copied().fold(from, f64::max);
    let fine = (0..=120).map(|k| from + (to - from) * f64::from(k) / 120.0);
    let differences = measured.iter().map(|[x, y]| (y / exact(*x) - 1.0).abs());
    let greatest_difference = differences.fold(0.0, f64::max);
    Ok(Curve { label: label.into(), exact: fine.map(|x| [x, exact(x)]).collect(), measured, greatest_difference })
}

fn grid(from: f64, to: f64, count: u32) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * f64::from(k) / f64::from(count - 1)).collect()
}

/// Mean forward acceleration between two times, s.
fn acceleration(chassis: &mut Chassis, drives: [WheelDrive; 2], mu: f64, [from_s, to_s]: [f64; 2]) -> f64 {
    let (from, to) = ((from_s / DT).round() as u32, (to_s / DT).round() as u32);
    let mut early = 0.0;
    for k in 0..to {
        if k == from {
            early = chassis.axle_velocity().x;
        }
        chassis.advance(drives, |_| mu, DT);
    }
    (chassis.axle_velocity().x - early) / (f64::from(to - from) * DT)
}

/// The plain robot, at rest or with a velocity of its middle.
fn chassis(velocity: PlanarVelocity) -> Chassis {
    let mut chassis = Chassis::new(&plain_robot(), Pose::IDENTITY);
    chassis.set_velocity(velocity);
    chassis
}

fn sideways_stop() -> Result<ClosedForm> {
    let exact = |mu: f64, v: f64| v * v / (2.0 * mu * G);
    let measure = |mu: f64, v: f64| {
        let mut chassis = chassis(moving(0.0, v, 0.0));
        for _ in 0..2000 {
            chassis.advance([WheelDrive::Speed(0.0); 2], |_| mu, DT);
        }
        Ok(chassis.pose().y)
    };
    let speeds = grid(0.4, 2.0, 9);
    let of = |mu: f64| curve(format!("mu = {mu}"), 0.0, &speeds, |v| exact(mu, v), |v| measure(mu, v));
    Ok(ClosedForm {
        name: "sideways-stop",
        title: "Stopping distance of a sideways push",
        equation: "s = v0^2 / (2 mu g)",
        story: "Coulomb friction decelerates by mu g until the robot rests. The wheels' creep ends the slide smoothly.",
        axes: ["speed of the push v0 (m/s)", "distance s (m)"],
        tolerance: 0.005,
        curves: [0.2, 0.5, 0.8].into_iter().map(of).collect::<Result<_>>()?,
    })
}

fn traction() -> Result<ClosedForm> {
    let measure = |mu: f64| Ok(acceleration(&mut chassis(moving(0.0, 0.0, 0.0)), [WheelDrive::Torque(1.0); 2], mu, [0.1, 0.2]));
    Ok(ClosedForm {
        name: "traction-limit",
        title: "Acceleration with spinning wheels",
        equation: "a = mu g",
        story: "However strong the motors, the floor gives no more than mu N. All weight is on the driven wheels.",
        axes: ["friction mu", "acceleration a (m/s\u{b2})"],
        tolerance: 0.001,
        curves: vec![curve("1 N m on each wheel", 0.0, &grid(0.05, 0.8, 11), |mu| mu * G, measure)?],
    })
}

fn launch() -> Result<ClosedForm> {
    let robot = plain_robot();
    let (m, r, i) = (robot.mass_kg, robot.wheel_radius_m, robot.wheel_inertia_kg_m2);
    let mu = 0.4;
    let exact = |torque: f64| (2.0 * torque / (r * (m + 2.0 * i / (r * r)))).min(mu * G);
    let measure =
        |torque: f64| Ok(acceleration(&mut chassis(moving(0.0, 0.0, 0.0)), [WheelDrive::Torque(torque); 2], mu, [0.1, 0.3]));
    Ok(ClosedForm {
        name: "launch",
        title: "Launch: rolling, then spinning",
        equation: "a = 2 tau / (R (m + 2 I_w / R^2)), at most mu g",
        story: "Newton's second law for a body with two rolling wheels; beyond the friction limit the wheels spin.",
        axes: ["torque tau on each wheel (N m)", "acceleration a (m/s\u{b2})"],
        tolerance: 0.001,
        curves: vec![curve("mu = 0.4", 0.0, &grid(0.02, 0.26, 13), exact, measure)?],
    })
}

fn yaw_braking() -> Result<ClosedForm> {
    let robot = plain_robot();
    let inertia = Chassis::new(&robot, Pose::IDENTITY).yaw_inertia();
    let full = robot.mass_kg * G * 0.5 * robot.track_m / inertia;
    let measure = |mu: f64| {
        let mut chassis = chassis(moving(0.0, 0.0, 30.0));
        for _ in 0..200 {
            chassis.advance([WheelDrive::Locked; 2], |_| mu, DT);
        }
        Ok((30.0 - chassis.velocity().yaw_rate) / 0.2)
    };
    Ok(ClosedForm {
        name: "yaw-braking",
        title: "Locked wheels brake a spin",
        equation: "alpha = mu m g (b/2) / I_zz",
        story: "Both wheels drag sideways to the axle at half the track from the centre.",
        axes: ["friction mu", "yaw deceleration alpha (rad/s\u{b2})"],
        tolerance: 0.001,
        curves: vec![curve("spun, wheels locked", 0.0, &grid(0.05, 0.8, 11), |mu| mu * full, measure)?],
    })
}

fn rolling_resistance() -> Result<ClosedForm> {
    let robot = plain_robot();
    let (m, r, i) = (robot.mass_kg, robot.wheel_radius_m, robot.wheel_inertia_kg_m2);
    let exact = |c: f64| c * G / (1.0 + 2.0 * i / (m * r * r));
    let measure = |c: f64| {
        let robot = RobotSpec { rolling_resistance: c, ..plain_robot() };
        let mut chassis = Chassis::new(&robot, Pose::IDENTITY);
        chassis.set_velocity(moving(1.0, 0.0, 0.0));
        chassis.set_wheel_speeds([1.0 / robot.wheel_radius_m; 2]);
        Ok(-acceleration(&mut chassis, [WheelDrive::Torque(0.0); 2], 0.75, [0.2, 0.4]))
    };
    Ok(ClosedForm {
        name: "rolling-resistance",
        title: "Coasting against rolling resistance",
        equation: "a = c g / (1 + 2 I_w / (m R^2))",
        story: "A torque c N R on each wheel; the wheels' own inertia coasts along.",
        axes: ["rolling resistance c", "deceleration a (m/s\u{b2})"],
        tolerance: 0.001,
        curves: vec![curve("coasting", 0.0, &grid(0.005, 0.05, 10), exact, measure)?],
    })
}

fn load_transfer() -> Result<ClosedForm> {
    let robot = || RobotSpec { centre_of_gravity_m: 0.03, caster_friction: 0.0, ..plain_robot() };
    let arm = robot().caster_m;
    let exact = |mu: f64, h: f64| mu * G * (1.0 - 0.03 / arm) / (1.0 + mu * h / arm);
    let measure = |mu: f64, h: f64| {
        let robot = RobotSpec { centre_of_gravity_height_m: h, ..robot() };
        let mut chassis = Chassis::new(&robot, Pose::IDENTITY);
        chassis.set_velocity(moving(4.0, 0.0, 0.0));
        Ok(-acceleration(&mut chassis, [WheelDrive::Locked; 2], mu, [0.2, 0.4]))
    };
    let heights = grid(0.0, 0.2, 9);
    let of = |mu: f64| curve(format!("mu = {mu}"), 0.0, &heights, |h| exact(mu, h), |h| measure(mu, h));
    Ok(ClosedForm {
        name: "load-transfer",
        title: "Braking with load transfer to the caster",
        equation: "a = mu g (1 - x/L) / (1 + mu h/L)",
        story: "Moments about the axle, with a frictionless caster L ahead of it and the centre of gravity x ahead and h up \
                (Wong, Theory of Ground Vehicles: braking with one axle).",
        axes: ["height of the centre of gravity h (m)", "deceleration a (m/s\u{b2})"],
        tolerance: 0.001,
        curves: [0.3, 0.75].into_iter().map(of).collect::<Result<_>>()?,
    })
}

fn circle_grip() -> Result<ClosedForm> {
    const RADIUS: f64 = 0.5;
    let robot = RobotSpec {
        no_load_speed_rad_s: 200.0,
        stall_torque_n_m: 2.0,
        max_speed_m_s: 10.0,
        max_turn_rate_rad_s: 20.0,
        ..plain_robot()
    };
    let measure = |mu: f64| {
        let mut plant = RapierPlant::new(&hall(mu, robot.clone(), "")?, Pose::new(0.0, -RADIUS, 0.0), Seed(1));
        let mut v = 0.0;
        // Friction saturates at the creep speed; twice that is a skid.
        while plant.chassis().slip()[0].norm() < 2.0 * robot.creep_m_s && v < 5.0 {
            v += 0.001;
            plant.step(Twist { v, omega: v / RADIUS }, 0.01);
        }
        Ok(plant.chassis().velocity().linear.norm())
    };
    let exact = |mu: f64| (mu * G * RADIUS).sqrt();
    Ok(ClosedForm {
        name: "circle-grip",
        title: "Grip limit on a circle of 0.5 m",
        equation: "v = sqrt(mu g r)",
        story: "Centripetal force from friction alone. Speed grows by 0.1 m/s each second; the skid is called at twice the \
                creep speed, a little before or after the limit.",
        axes: ["friction mu", "speed at the skid v (m/s)"],
        tolerance: 0.05,
        curves: vec![curve("slowly faster until it skids", 0.0, &grid(0.1, 0.8, 8), exact, measure)?],
    })
}

fn worn_tyre() -> Result<ClosedForm> {
    let track = plain_robot().track_m;
    let measure = |factor: f64| {
        let mut plant = RapierPlant::new(&hall(0.75, plain_robot(), "")?, Pose::IDENTITY, Seed(1));
        plant.wear_tyre(0, 1.0, factor);
        plant.step(Twist { v: 0.2, omega: 0.0 }, 2.0);
        Ok(plant.chassis().velocity().yaw_rate / plant.chassis().axle_velocity().x)
    };
    let exact = |f: f64| 2.0 * (1.0 - f) / (track * (1.0 + f));
    Ok(ClosedForm {
        name: "worn-tyre",
        title: "A worn tyre bends the path",
        equation: "kappa = 2 (1 - f) / (b (1 + f))",
        story: "Equal wheel speeds on radii R and f R roll on a circle.",
        axes: ["radius of the left tyre as a share f", "curvature kappa (1/m)"],
        tolerance: 0.01,
        curves: vec![curve("commanded straight ahead", 0.8, &grid(0.8, 0.98, 10), exact, measure)?],
    })
}

fn carton() -> Result<ClosedForm> {
    const FRICTION: f64 = 0.3;
    let measure = |mass: f64| {
        let carton = format!(
            "[[obstacles]]\nname = \"carton\"\nshape = {{ box = {{ size_m = [0.4, 0.6] }} }}\nposition_m = [0.5, 0.0]\n\
             height_m = 0.5\ntexture = {{ family = \"plain\" }}\n\
             motion = {{ pushed = {{ mass_kg = {mass}, friction = {FRICTION} }} }}"
        );
        let mut plant = RapierPlant::new(&hall(0.75, plain_robot(), &carton)?, Pose::IDENTITY, Seed(1));
        plant.step(Twist { v: 0.2, omega: 0.0 }, 4.0);
        plant.step(Twist { v: 0.2, omega: 0.0 }, 1.0);
        Ok(plant.floor_contact().force_n.iter().map(|f| f.x).sum())
    };
    Ok(ClosedForm {
        name: "carton",
        title: "The floor's force on a robot that pushes a carton",
        equation: "F = mu_c m_c g",
        story: "At constant speed the wheels' traction is the carton's friction (mu_c = 0.3), through rapier's contact.",
        axes: ["mass of the carton (kg)", "traction F (N)"],
        tolerance: 0.02,
        curves: vec![curve("pushed at 0.2 m/s", 0.0, &grid(0.5, 4.0, 8), |m| FRICTION * m * G, measure)?],
    })
}

fn gyro() -> Result<ClosedForm> {
    const RUNS: u64 = 200;
    let spec = GyroSpec { bias_sd_rad_s: 1.7e-3, noise_rad_s_sqrt_hz: 3.5e-3 };
    let world = hall(0.75, RobotSpec { gyro: Some(spec), ..plain_robot() }, "")?;
    let exact = |t: f64| {
        let (bias, noise) = (spec.bias_sd_rad_s * t, spec.noise_rad_s_sqrt_hz);
        (bias * bias + noise * noise * t).sqrt()
    };
    let mut squares = [0.0; 10];
    for seed in 0..RUNS {
        let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(seed));
        let mut heading = 0.0;
        for square in &mut squares {
            for _ in 0..10 {
                heading += plant.step(Twist::default(), 0.1).odometry.twist.omega * 0.1;
            }
            *square += heading * heading;
        }
    }
    // One sum for each second.
    let measure = |t: f64| Ok((squares[t as usize - 1] / RUNS as f64).sqrt());
    Ok(ClosedForm {
        name: "gyro",
        title: "Heading from a gyro alone",
        equation: "sd = sqrt((b t)^2 + n^2 t)",
        story: "A bias drawn once a run with standard deviation b, and white noise of density n (IEEE Std 952: bias and angle \
                random walk). 200 draws scatter by 5 % themselves.",
        axes: ["time t (s)", "RMS error of the heading (rad)"],
        tolerance: 0.25,
        curves: vec![curve("200 runs at rest, RMS", 0.0, &grid(1.0, 10.0, 10), exact, measure)?],
    })
}

/// The tour of the slip map: two legs at a right angle, with full stops and a turn on the spot.
const TOUR: [(f64, f64, f64); 6] =
    [(0.3, 0.0, 3.0), (0.0, 0.0, 3.0), (0.0, 1.57, 1.0), (0.0, 0.0, 1.0), (0.3, 0.0, 3.0), (0.0, 0.0, 3.0)];

/// Drives a tour on floors of many frictions with many accelerations, by a robot with perfectly calibrated wheels and fine
/// encoders: what odometry loses, it loses to slip. What spinning wheels lose at the start skidding ones gain back when they
/// brake, so it is the greatest distance on the way that tells, and not that at the end.
fn slip_map() -> Result<SlipMap> {
    let friction = vec![0.03, 0.045, 0.07, 0.1, 0.15, 0.22, 0.33, 0.5, 0.75];
    let acceleration_m_s2 = vec![0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4];
    let mut drift_m = Vec::new();
    for &acceleration in &acceleration_m_s2 {
        let mut row = Vec::new();
        for &mu in &friction {
            let robot = RobotSpec {
                wheel_radius_error: [0.0; 2],
                max_acceleration_m_s2: acceleration,
                encoder_counts_per_turn: 1e5,
                ..RobotSpec::default()
            };
            let mut plant = RapierPlant::new(&hall(mu, robot, "")?, Pose::IDENTITY, Seed(1));
            let (mut reckoned, mut greatest) = (Pose::IDENTITY, 0.0_f64);
            for (v, omega, seconds) in TOUR {
                for _ in 0..(seconds * 20.0_f64).round() as u32 {
                    let odometry = plant.step(Twist { v, omega }, 0.05).odometry;
                    reckoned = reckoned.advanced(odometry.twist, odometry.dt_s);
                    greatest = greatest.max((plant.truth().position() - reckoned.position()).norm());
                }
            }
            row.push(greatest);
        }
        drift_m.push(row);
    }
    Ok(SlipMap { friction, acceleration_m_s2, drift_m })
}

/// Error of the end of a drive over the length of the substep: (substep, distance to the drive with the finest one), m.
fn convergence() -> Result<Vec<[f64; 2]>> {
    let world = hall(0.75, plain_robot(), "")?;
    let end = |substep: f64| {
        let mut plant = RapierPlant::new(&world, Pose::IDENTITY, Seed(1)).with_substep(substep);
        for (v, omega, seconds) in [(0.3, 0.0, 2.0), (0.2, 1.2, 2.0), (0.0, -1.9, 1.0), (-0.2, 0.4, 1.5)] {
            for _ in 0..(seconds * 10.0_f64).round() as u32 {
                plant.step(Twist { v, omega }, 0.1);
            }
        }
        plant.truth().position()
    };
    let finest = end(DT / 64.0);
    Ok([4.0, 2.0, 1.0, 0.5, 0.25, 0.125].iter().map(|f| [f * DT, (end(f * DT) - finest).norm()]).collect())
}

/// Energy over time of robots thrown across the floor with free wheels, as a share of that at the start: (friction, curve).
fn energy() -> Vec<(f64, Vec<[f64; 2]>)> {
    [0.05, 0.2, 0.75]
        .map(|mu| {
            let robot = RobotSpec { caster_friction: 0.5, centre_of_gravity_m: 0.05, ..RobotSpec::default() };
            let mut chassis = Chassis::new(&robot, Pose::IDENTITY);
            chassis.set_velocity(moving(0.5, -0.8, 6.0));
            chassis.set_wheel_speeds([30.0, -12.0]);
            let first = chassis.kinetic_energy();
            let mut curve = vec![[0.0, 1.0]];
            for k in 1..=1500 {
                chassis.advance([WheelDrive::Torque(0.0); 2], |_| mu, DT);
                curve.push([f64::from(k) * DT, chassis.kinetic_energy() / first]);
            }
            (mu, curve)
        })
        .into()
}
