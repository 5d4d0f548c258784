//! The estimators against closed forms, automatic differentiation and a simulation of their own (perfect unicycle, noisy
//! odometry and bearings, no renderer, and but for one no physics).

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a failing test shows its table, and fails by panicking")]

use std::ops::ControlFlow;

use num_dual::{Dual64, DualNum};
use rayon::prelude::*;
use wayhome::control::Law;
use wayhome::episode::{Outcome, SensorKind, Setup, Simulation};
use wayhome::estimation::anchored::map::predict_bearing;
use wayhome::estimation::anchored::motion::SlipWatch;
use wayhome::estimation::anchored::{AnchoredFilter, FilterSettings};
use wayhome::estimation::paper;
use wayhome::geometry::{Pose, Twist, Vector2, angle_of, wrap};
use wayhome::method::{MethodKind, MethodOptions, build};
use wayhome::observation::{
    Bearing, Briefing, Bumper, Estimate, HomeSnapshot, LandmarkId, Observation, Odometry, RobotSheet, Status, TaskSheet,
};
use wayhome::random::{Seed, standard_normal};
use wayhome::world::Draft;

/// (6) as the paper prints it, with R_i* by (3), in dual numbers.
fn printed_dynamics(x: &[Dual64; 6], v: f64, omega: f64, home: &[f64; 3]) -> [Dual64; 6] {
    let (r, theta, alpha) = (x[0], x[1], x[2]);
    let landmark = |i: usize| {
        let phi = x[3 + i] + alpha;
        let home_range = r * (theta - phi).sin() / (Dual64::from(home[i]) - phi).sin();
        let d = r * (theta - phi).cos() - home_range * (Dual64::from(home[i]) - phi).cos();
        -(x[3 + i].sin() * v / d) - omega
    };
    [(alpha - theta).cos() * v, (alpha - theta).sin() * v / r, Dual64::from(omega), landmark(0), landmark(1), landmark(2)]
}

#[test]
fn paper_dynamics_equal_the_printed_form_and_its_automatic_derivative() {
    let home = [0.2, 1.06, 1.25];
    let twist = Twist { v: 12.0, omega: 0.4 };
    for k in 0..50 {
        let t = f64::from(k);
        let x = paper::State::from_column_slice(&[30.0 + t, 2.0 + 0.05 * t, -1.0 + 0.11 * t, 0.3, 0.9 + 0.02 * t, -2.0]);
        let (f, j) = paper::dynamics(&x, twist, &home);
        for column in 0..6 {
            let seeded = std::array::from_fn(|i| Dual64::new(x[i], if i == column { 1.0 } else { 0.0 }));
            let printed = printed_dynamics(&seeded, twist.v, twist.omega, &home);
            let scale = j.amax().max(1.0);
            for row in 0..6 {
                assert!((f[row] - printed[row].re).abs() < 1e-9 * scale, "{row}: {} {}", f[row], printed[row].re);
                let derivative = printed[row].eps;
                assert!(
                    (j[(row, column)] - derivative).abs() < 1e-9 * scale,
                    "{row} {column}: {} {derivative}",
                    j[(row, column)]
                );
            }
        }
    }
}

struct Trial {
    final_distance_m: f64,
    time_ratio: f64,
    arrived: bool,
    nees: Vec<f64>,
}

struct Setting {
    landmarks: Vec<Vector2<f64>>,
    bearing_sd_rad: f64,
    odometry_sd_share: f64,
    false_share: f64,
    method: MethodKind,
    law: Law,
    distance_m: (f64, f64),
    /// When the robot is moved without its wheels, s, and how, in its own frame.
    carried: Option<(f64, Pose)>,
    /// Whether the wheels slip as they change speed, by as much as the filter expects.
    slips: bool,
    /// The camera from the middle of the axle, forward and left, m.
    camera_offset_m: [f64; 2],
}

fn uniform(stream: &mut wayhome::random::Stream) -> f64 {
    rand::RngExt::random::<f64>(stream)
}

fn nees(estimate: &Estimate, truth: &Pose) -> f64 {
    let e = nalgebra::Vector3::new(
        estimate.pose.x - truth.x,
        estimate.pose.y - truth.y,
        wrap(estimate.pose.heading - truth.heading),
    );
    e.dot(&estimate.covariance.cholesky().expect("a covariance is positive definite").solve(&e))
}

/// A perfect unicycle with home at the origin, noisy odometry, noisy bearings.
fn trial(setting: &Setting, seed: u64) -> Trial {
    let seed = Seed(seed);
    let mut start = seed.stream("start");
    let (near, far) = setting.distance_m;
    let place = wayhome::geometry::direction(uniform(&mut start) * 6.3) * (near + (far - near) * uniform(&mut start));
    let mut truth = Pose::new(place.x, place.y, uniform(&mut start) * 6.3);
    let distance = place.norm();
    let mut noise = seed.stream("noise");
    let sd = setting.bearing_sd_rad;
    let mount = Pose::new(setting.camera_offset_m[0], setting.camera_offset_m[1], 0.0);
    let see = |pose: &Pose, noise: &mut wayhome::random::Stream| -> Vec<Bearing> {
        let mut seen = Vec::new();
        let camera = pose.compose(&mount);
        for (k, l) in setting.landmarks.iter().enumerate() {
            let azimuth = angle_of(camera.inverse_transform(*l)) + sd * standard_normal(noise);
            let wrong = uniform(noise) < setting.false_share;
            let azimuth = if wrong { uniform(noise) * 6.3 } else { azimuth };
            seen.push(Bearing { id: LandmarkId(k as u32), azimuth_rad: wrap(azimuth), sd_rad: sd });
        }
        seen
    };
    let home = HomeSnapshot {
        bearings: setting
            .landmarks
            .iter()
            .enumerate()
            .map(|(k, l)| Bearing {
                id: LandmarkId(k as u32),
                azimuth_rad: wrap(angle_of(mount.inverse_transform(*l)) + sd * standard_normal(&mut noise)),
                sd_rad: sd,
            })
            .collect(),
    };
    let (period, speed, radius) = (0.1, 0.3, 0.05);
    let briefing = Briefing {
        home,
        robot: RobotSheet {
            track_m: 0.23,
            camera_offset_m: setting.camera_offset_m,
            max_speed_m_s: speed,
            max_turn_rate_rad_s: 1.9,
            max_acceleration_m_s2: 0.9,
        },
        task: TaskSheet { speed_m_s: speed, control_period_s: period, arrival_radius_m: radius },
        compass: false,
        camera: None,
    };
    let options = MethodOptions { law: setting.law, ..MethodOptions::default() };
    let mut method = build(setting.method.clone(), &options, briefing).unwrap();
    let filter_settings = FilterSettings { track_m: 0.23, ..FilterSettings::default() };
    let mut slip = SlipWatch::default();
    let mut odometry = Odometry::default();
    let mut errors = Vec::new();
    let mut time = 0.0;
    let mut arrived = false;
    while time < 90.0 {
        let bearings = see(&truth, &mut noise);
        let decision = method.step(&Observation {
            time_s: time,
            odometry,
            bearings: &bearings,
            alternatives: &[],
            compass_rad: None,
            bumper: Bumper::default(),
            panorama: None,
        });
        if let Some(estimate) = &decision.estimate {
            assert!(estimate.pose.is_finite());
            errors.push(nees(estimate, &truth));
        }
        if decision.status == Status::Arrived {
            arrived = true;
            break;
        }
        let command = decision.command;
        assert!(command.v.is_finite() && command.omega.is_finite());
        truth = truth.advanced(command, period);
        if let Some((_, by)) = setting.carried.filter(|(at, _)| (time..time + period).contains(at)) {
            truth = truth.compose(&by);
        }
        // Encoders that are off by a share, and wheels that slip as they change speed: the filter's own model of them.
        let share = setting.odometry_sd_share;
        let expected_m_s = slip.expect(&Odometry { twist: command, dt_s: period }, &filter_settings);
        let slip_m_s = if setting.slips { expected_m_s } else { 0.0 };
        let [left, right] = [(); 2].map(|()| slip_m_s * standard_normal(&mut noise));
        odometry = Odometry {
            twist: Twist {
                v: command.v * (1.0 + share * standard_normal(&mut noise)) + 0.5 * (left + right),
                omega: command.omega * (1.0 + share * standard_normal(&mut noise)) + (right - left) / filter_settings.track_m,
            },
            dt_s: period,
        };
        time += period;
    }
    Trial { final_distance_m: truth.position().norm(), time_ratio: time / ((distance - radius) / speed), arrived, nees: errors }
}

fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}

/// Landmarks all round at 1.5 to 3.5 m.
fn all_round(count: usize) -> Vec<Vector2<f64>> {
    (0..count)
        .map(|k| {
            let t = k as f64;
            wayhome::geometry::direction(std::f64::consts::TAU * t / count as f64 + 0.3 * libm::sin(2.0 * t))
                * (2.5 + libm::cos(3.1 * t))
        })
        .collect()
}

struct Summary {
    home: usize,
    far_claims: usize,
    median_ratio: f64,
    /// Mean over the runs of the last step's NEES.
    last_nees: f64,
}

fn run(name: &str, setting: &Setting, seeds: u64) -> Summary {
    let trials: Vec<_> = (1..=seeds).into_par_iter().map(|s| trial(setting, s)).collect();
    let last: Vec<f64> = trials.iter().filter_map(|t| t.nees.last().copied()).collect();
    let summary = Summary {
        home: trials.iter().filter(|t| t.arrived && t.final_distance_m <= 0.05).count(),
        far_claims: trials.iter().filter(|t| t.arrived && t.final_distance_m > 0.15).count(),
        median_ratio: median(trials.iter().map(|t| t.time_ratio).collect()),
        last_nees: last.iter().sum::<f64>() / last.len().max(1) as f64,
    };
    println!(
        "{name}: home {}/{seeds}, claims > 15 cm away {}, median time ratio {:.2}, median final {:.1} cm, last NEES {:.2}",
        summary.home,
        summary.far_claims,
        summary.median_ratio,
        100.0 * median(trials.iter().map(|t| t.final_distance_m).collect()),
        summary.last_nees
    );
    summary
}

fn base(count: usize, bearing_sd_deg: f64) -> Setting {
    Setting {
        landmarks: all_round(count),
        bearing_sd_rad: bearing_sd_deg.to_radians(),
        odometry_sd_share: 0.04,
        false_share: 0.0,
        method: MethodKind::AnchoredEkf,
        law: Law::Proportional,
        distance_m: (0.5, 3.0),
        carried: None,
        slips: false,
        camera_offset_m: [0.0; 2],
    }
}

/// The table of the theory notes' prototype (25/25 with 8 landmarks at 0.3 degrees, 14/25 at 1 degree, 17/25 with 3) is the
/// bar to beat; no run may claim home far from it.
#[test]
fn home_from_nothing_known() {
    let cases = [
        ("8 landmarks, 0.3 deg", base(8, 0.3), 40, 39),
        ("8 landmarks, 1 deg", base(8, 1.0), 40, 34),
        ("5 landmarks, 0.3 deg", base(5, 0.3), 40, 38),
        ("30 landmarks, 0.3 deg, 10 % false", Setting { false_share: 0.1, ..base(30, 0.3) }, 40, 39),
        // One run in a hundred claimed home wrongly when bearings were gated one by one only.
        ("30 landmarks, 0.3 deg, 30 % false", Setting { false_share: 0.3, ..base(30, 0.3) }, 400, 396),
        ("30 landmarks, 0.3 deg, Lyapunov", Setting { law: Law::Lyapunov, ..base(30, 0.3) }, 40, 39),
    ];
    for (name, setting, seeds, least) in cases {
        let summary = run(name, &setting, seeds);
        assert!(summary.home >= least, "{name}: {} of {seeds}", summary.home);
        assert_eq!(summary.far_claims, 0, "{name}");
        assert!(summary.median_ratio < 1.15, "{name}: {}", summary.median_ratio);
    }
}

/// With nothing but Gaussian noise the filter's covariance is honest: the NEES of 200 runs is chi-square with 600 degrees of
/// freedom, whose 95 % band for the mean is 2.67 to 3.35.
#[test]
fn covariance_is_honest_at_the_end() {
    let summary = run("8 landmarks, 0.3 deg, slipping", &Setting { slips: true, ..base(8, 0.3) }, 200);
    assert!((2.67..3.35).contains(&summary.last_nees), "{}", summary.last_nees);
}

/// What a camera beside the axle sees is of itself; home is where the robot stood all the same, and the covariance as honest as
/// above the axle.
#[test]
fn a_camera_beside_the_axle_brings_the_robot_home() {
    let beside = |setting: Setting| Setting { camera_offset_m: [0.09, -0.04], ..setting };
    let summary = run("camera beside the axle", &beside(Setting { slips: true, ..base(8, 0.3) }), 200);
    assert!(summary.home >= 196 && summary.far_claims == 0, "{} of 200", summary.home);
    assert!((2.67..3.35).contains(&summary.last_nees), "{}", summary.last_nees);
    let carried = Setting { carried: Some((2.5, Pose::new(0.0, 0.12, 0.35))), distance_m: (1.5, 3.0), ..base(30, 0.3) };
    let summary = run("camera beside the axle, kick", &beside(carried), 40);
    assert!(summary.home >= 39 && summary.far_claims == 0, "{} of 40", summary.home);
}

/// A compass-free average landmark vector moves homewards, if less well; it shows that the trial itself is sound.
#[test]
fn alv_comes_near() {
    let trials: Vec<_> = (1..=20).map(|s| trial(&Setting { method: MethodKind::Alv, ..base(30, 0.3) }, s)).collect();
    assert!(trials.iter().filter(|t| t.final_distance_m < 0.3).count() >= 18);
}

/// A robot that is kicked or carried off comes home all the same, and claims nothing wrong; most find themselves on the map that
/// they have.
#[test]
fn kicked_and_kidnapped_robots_recover() {
    let carried =
        |x, y, heading| Setting { carried: Some((2.5, Pose::new(x, y, heading))), distance_m: (1.5, 3.0), ..base(30, 0.3) };
    for (name, setting) in [("kick of 12 cm and 20 degrees", carried(0.0, 0.12, 0.35)), ("kidnap", carried(-0.7, 0.9, 2.5))] {
        let summary = run(name, &setting, 40);
        assert!(summary.home >= 39, "{name}: {} of 40", summary.home);
        assert_eq!(summary.far_claims, 0, "{name}");
    }
}

/// On ice a robot whose wheels stand slides on: home is claimed where it comes to rest, not where it passes. A method that claims
/// it in passing came home in none of these runs. The one test here with the plant that slips.
#[test]
fn on_ice_home_is_claimed_at_rest() {
    let mut draft = Draft::open("lab").unwrap();
    draft.set_friction(0.05).unwrap();
    let world = draft.world().unwrap();
    let setup = Setup { sensor: SensorKind::Noisy, ..Setup::default() };
    let one = |seed: u64| Simulation::new(&world, &setup).unwrap().run(seed, &mut |_| ControlFlow::Continue(())).unwrap();
    let runs: Vec<_> = (1..=20_u64).into_par_iter().map(one).collect();
    let home = runs.iter().filter(|r| r.outcome == Outcome::Home).count();
    let wrong = runs.iter().filter(|r| r.claimed_home && r.outcome != Outcome::Home).count();
    println!("{home} of 20 home, {wrong} wrong claims");
    assert!(home >= 17 && wrong <= 2, "{home} home, {wrong} wrong claims");
}

/// What a filter says while it is kidnapped: an estimate, none for a short while, and then one that is right again, without its
/// belief given up.
#[test]
fn a_kidnapped_filter_is_lost_and_finds_itself_on_its_map() {
    let landmarks = all_round(30);
    let see = |pose: &Pose, sd_rad: f64| -> Vec<Bearing> {
        let bearing = |(k, l): (usize, &Vector2<f64>)| Bearing {
            id: LandmarkId(k as u32),
            azimuth_rad: angle_of(pose.inverse_transform(*l)),
            sd_rad,
        };
        landmarks.iter().enumerate().map(bearing).collect()
    };
    let sd = 0.3_f64.to_radians();
    let mut filter = AnchoredFilter::new(FilterSettings::default(), &HomeSnapshot { bearings: see(&Pose::IDENTITY, sd) });
    let mut truth = Pose::new(1.8, -1.2, 2.0);
    let twist = Twist { v: 0.25, omega: 0.1 };
    let mut odometry = Odometry::default();
    let mut lost_steps = 0;
    for step in 0..60 {
        let bearings = see(&truth, sd);
        filter.step(&odometry, &bearings);
        if step < 40 && filter.estimate().is_none() {
            assert!(step < 20, "home is found within 2 s");
        }
        lost_steps += u32::from(step >= 40 && filter.estimate().is_none());
        truth = truth.advanced(twist, 0.1);
        odometry = Odometry { twist, dt_s: 0.1 };
        if step == 40 {
            truth = truth.compose(&Pose::new(-0.9, 0.8, -2.2));
        }
    }
    let found = filter.estimate().unwrap();
    truth = truth.advanced(Twist { v: -twist.v, omega: 0.0 }, 0.1);
    assert!(lost_steps <= 3, "{lost_steps}");
    assert_eq!(filter.restarts(), 0);
    assert!((found.pose.position() - truth.position()).norm() < 0.05, "{:?} {truth:?}", found.pose);
}

/// With few landmarks several poses of home explain what is seen at first; they stand side by side, and the right one is adopted
/// once motion has told them apart.
#[test]
fn rival_hypotheses_stand_side_by_side_until_motion_decides() {
    let landmarks = all_round(4);
    let sd = 0.1_f64.to_radians();
    let see = |pose: &Pose| -> Vec<Bearing> {
        let bearing = |(k, l): (usize, &Vector2<f64>)| Bearing {
            id: LandmarkId(k as u32),
            azimuth_rad: angle_of(pose.inverse_transform(*l)),
            sd_rad: sd,
        };
        landmarks.iter().enumerate().map(bearing).collect()
    };
    let (mut most, mut found) = (0, 0);
    for k in 0..12 {
        let mut truth = Pose::new(libm::cos(f64::from(k)), 1.4 * libm::sin(f64::from(k)), f64::from(k));
        let mut filter = AnchoredFilter::new(FilterSettings::default(), &HomeSnapshot { bearings: see(&Pose::IDENTITY) });
        let mut odometry = Odometry::default();
        for step in 0..80 {
            filter.step(&odometry, &see(&truth));
            most = most.max(filter.hypotheses().len());
            let twist = Twist { v: 0.2, omega: 0.5 * libm::sin(0.2 * f64::from(step)) };
            truth = truth.advanced(twist, 0.1);
            odometry = Odometry { twist, dt_s: 0.1 };
        }
        if let Some(estimate) = filter.estimate() {
            found += 1;
            assert!(filter.hypotheses().is_empty());
            assert!((estimate.pose.position() - truth.position()).norm() < 0.1, "{k}: {:?} {truth:?}", estimate.pose);
        }
    }
    assert!(most >= 2, "{most}");
    assert!(found >= 10, "{found} of 12 within 8 s");
}

/// At home, on the line through a landmark, on a landmark, with two landmarks, one or none: no NaN, and no claim from nothing.
#[test]
fn degenerate_geometry_gives_no_nan() {
    let sd = 0.005;
    for count in 0..4 {
        let landmarks = [Vector2::new(2.0, 0.0), Vector2::new(-1.0, 1.5), Vector2::new(0.3, -2.0)];
        let see = |pose: &Pose| -> Vec<Bearing> {
            let bearing = |(k, l): (usize, &Vector2<f64>)| Bearing {
                id: LandmarkId(k as u32),
                azimuth_rad: angle_of(pose.inverse_transform(*l)),
                sd_rad: sd,
            };
            landmarks.iter().take(count).enumerate().map(bearing).collect()
        };
        for start in [Pose::IDENTITY, Pose::new(1.0, 0.0, 0.0), Pose::new(-1.0, 0.0, 0.0), Pose::new(0.0, 0.0, 3.0)] {
            let home = HomeSnapshot { bearings: see(&Pose::IDENTITY) };
            let mut filter = AnchoredFilter::new(FilterSettings::default(), &home);
            let mut truth = start;
            let mut odometry = Odometry::default();
            for _ in 0..150 {
                filter.step(&odometry, &see(&truth));
                assert!(filter.map_pose().is_finite() && filter.best_pose().is_none_or(|p| p.is_finite()));
                if let Some(e) = filter.estimate() {
                    assert!(count >= 3, "{count} bearings do not fix a pose");
                    assert!(e.pose.is_finite() && e.covariance.iter().all(|v| v.is_finite()));
                    assert!(e.covariance.symmetric_eigenvalues().min() > 0.0, "{}", e.covariance);
                }
                let twist = Twist { v: 0.2, omega: 0.0 };
                truth = truth.advanced(twist, 0.1);
                odometry = Odometry { twist, dt_s: 0.1 };
            }
        }
    }
}

/// The analytic derivatives of a landmark's predicted bearing against automatic differentiation of its closed form.
#[test]
fn bearing_derivatives_equal_automatic_ones() {
    for k in 0..100 {
        let t = f64::from(k);
        let x = [1.5 * libm::sin(t), 1.2 * libm::cos(1.7 * t), 0.9 * t, 0.37 * t, 0.05 + 0.012 * t];
        let (bearing, analytic) = predict_bearing(&Pose { x: x[0], y: x[1], heading: x[2] }, x[3], x[4]);
        for (column, analytic) in analytic.into_iter().enumerate() {
            let [px, py, heading, direction, rho]: [Dual64; 5] =
                std::array::from_fn(|i| Dual64::new(x[i], if i == column { 1.0 } else { 0.0 }));
            let exact = (direction.sin() - rho * py).atan2(direction.cos() - rho * px) - heading;
            assert!(wrap(exact.re - bearing).abs() < 1e-12);
            assert!((exact.eps - analytic).abs() < 1e-9 * analytic.abs().max(1.0), "{k} {column}");
        }
    }
}
