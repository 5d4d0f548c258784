//! Teaching: somebody who sees the room drives the robot along, and the robot learns what it can of it by itself.
//!
//! The driver is no part of the robot: he steers by where it truly is, as a person with a joystick does. What is learned comes of
//! observations alone ([`Learner`]); where the driver truly was is noted beside it ([`Lesson::truth`]), for measures and for nothing else.

use std::ops::ControlFlow;

use crate::control::escape::Escape;
use crate::episode::{Look, Simulation};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, angle_of};
use crate::observation::Status;
use crate::world::World;

use super::chart::{Line, Route};
use super::learn::Learner;
use super::rule::SnapshotRule;
use super::scene::Stage;
use super::steer::{progress, steer};

/// How a route is taught.
#[derive(Debug, Clone, PartialEq)]
pub struct Teaching {
    /// When snapshots are kept.
    pub rule: SnapshotRule,
    /// Most features of a snapshot.
    pub features: usize,
    /// Nodes of the path by odometry lie so far apart, m.
    pub node_m: f64,
    /// Light and camera.
    pub look: Look,
    /// Seed of slip, encoders and camera noise.
    pub seed: u64,
}

impl Default for Teaching {
    fn default() -> Self {
        Self {
            rule: SnapshotRule::Every { distance_m: 0.5, turn_rad: 0.35 },
            features: 120,
            node_m: 0.1,
            look: Look::default(),
            seed: 0,
        }
    }
}

/// What a lesson leaves behind.
#[derive(Debug, Clone, PartialEq)]
pub struct Lesson {
    /// What the robot has learned.
    pub route: Route,
    /// Where it truly was at each node of the route's path, in the room.
    pub truth: Vec<Pose>,
    /// How long it took, s.
    pub time_s: f64,
    /// Contacts on the way.
    pub collisions: usize,
}

/// Corners of a way are rounded from so far before them, m.
const ROUNDED_M: f64 = 0.45;
/// Two way-points nearer than this are one, m.
const APART_M: f64 = 0.05;
/// The driver goes on until so near to the end, m.
const END_M: f64 = 0.01;
/// Time for the robot to come to rest, s.
const REST_S: f64 = 0.6;

/// A way through `points`, whose corners are rounded, checked to be free for the robot; and how far along it each point lies, m.
///
/// # Errors
/// When there are fewer than two points, two in a row on one spot, or something stands in the way; the message says where.
pub fn way(world: &World, points: &[Vector2<f64>]) -> Result<(Line, Vec<f64>)> {
    let fault = |found: String, allowed: &str| Error::Invalid { what: "way-points".into(), found, allowed: allowed.into() };
    if points.len() < 2 {
        return Err(fault(format!("{}", points.len()), "at least 2"));
    }
    if let Some(k) = points.windows(2).position(|pair| (pair[1] - pair[0]).norm() < APART_M) {
        let found = format!("numbers {} and {} both at ({}, {}) m", k + 1, k + 2, points[k].x, points[k].y);
        return Err(fault(found, "at least 5 cm from each to the next"));
    }
    let mut corners: Vec<Vector2<f64>> = vec![points[0]];
    for k in 1..points.len() - 1 {
        let (before, at, after) = (points[k - 1], points[k], points[k + 1]);
        // The corner is cut as widely as there is room.
        let rounded = [1.0, 0.6, 0.35, 0.15].into_iter().map(|share| bend(before, at, after, share * ROUNDED_M));
        let sharp = vec![at];
        let free = |bend: &Vec<Vector2<f64>>| bend.windows(2).all(|pair| world.is_corridor_free(pair[0], pair[1]).is_ok());
        corners.extend(rounded.into_iter().find(free).unwrap_or(sharp));
    }
    corners.push(points[points.len() - 1]);
    corners.dedup_by(|b, a| (*b - *a).norm() < 1e-6);
    for pair in corners.windows(2) {
        world.is_corridor_free(pair[0], pair[1]).map_err(|reason| {
            let found = format!(
                "{reason} in the way from ({:.2}, {:.2}) to ({:.2}, {:.2}) m",
                pair[0].x, pair[0].y, pair[1].x, pair[1].y
            );
            fault(found, "a way that is wide enough for the robot")
        })?;
    }
    let line = Line::new(corners);
    let mut from = 0.0;
    let along = points
        .iter()
        .map(|point| {
            from = line.nearest(*point, from, line.length_m().min(from + 1e3)).along_m;
            from
        })
        .collect();
    Ok((line, along))
}

/// An arc in place of a corner, from at most `cut_m` before it to as far behind.
fn bend(before: Vector2<f64>, at: Vector2<f64>, after: Vector2<f64>, cut_m: f64) -> Vec<Vector2<f64>> {
    let cut = |to: Vector2<f64>| at + (to - at) * (cut_m.min(0.45 * (to - at).norm()) / (to - at).norm());
    let (from, to) = (cut(before), cut(after));
    let share = |j: i32| f64::from(j) / 8.0;
    (0..=8).map(share).map(|t| from * (1.0 - t) * (1.0 - t) + at * 2.0 * t * (1.0 - t) + to * t * t).collect()
}

/// Drives the robot of `stage` through `points` of the room and has it learn the route.
///
/// # Errors
/// As [`way`]; when the robot is stuck, a part fails, or `watch`, which is told the share of the way, breaks.
pub fn teach(
    stage: &Stage<'_>,
    points: &[Vector2<f64>],
    teaching: &Teaching,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Lesson> {
    let world = stage.world();
    let (line, waypoints) = way(world, points)?;
    let mut simulation = stage.simulation(world, teaching.look)?;
    let start = Pose::new(points[0].x, points[0].y, angle_of(line.at(0.3) - points[0]));
    simulation.reset_at(teaching.seed, start)?;
    let (robot, task) = {
        let briefing = simulation.briefing();
        (briefing.robot, briefing.task)
    };
    let mut learner = Learner::new(teaching.rule, teaching.features, teaching.node_m);
    let mut truth: Vec<Pose> = Vec::new();
    let (mut along, mut next, mut collisions) = (0.0, 0, 0);
    learner.step(&simulation.observation()?);
    note(&mut truth, &learner, &simulation);
    let limit_s = 60.0 + 4.0 * line.length_m() / task.speed_m_s;
    let mut rested_s = 0.0;
    let mut escape = Escape::new(robot, task);
    let mut bumper = Default::default();
    let mut time_s = 0.0;
    while rested_s < REST_S || simulation.observation()?.panorama.is_none() {
        let pose = simulation.truth();
        let beside = progress(&line, along, &pose);
        along = beside.along_m;
        if waypoints.get(next).is_some_and(|at| *at <= along) {
            learner.waypoint();
            next += 1;
        }
        let is_there = line.length_m() - along <= END_M || rested_s > 0.0;
        let command = if is_there {
            Default::default()
        } else {
            // People who stand in the way are driven round, as by anybody with a joystick.
            escape.guard(time_s, &pose, bumper, steer(&line, &beside, &pose, &robot, &task))
        };
        rested_s += if is_there { task.control_period_s } else { 0.0 };
        let (seen, _) = simulation.step(command)?;
        (time_s, bumper) = (seen.time_s, seen.bumper);
        learner.step(&seen);
        note(&mut truth, &learner, &simulation);
        collisions += simulation.collisions().len();
        simulation.forget();
        if watch(along / line.length_m()).is_break() {
            return Err(Error::Interrupted);
        }
        if time_s > limit_s {
            let found = format!("the robot at ({:.2}, {:.2}) m after {time_s:.0} s", pose.x, pose.y);
            return Err(Error::Unfit {
                what: "lesson".into(),
                found,
                needed: "a robot that comes to the end of the way".into(),
            });
        }
    }
    let projection = stage.projection();
    let route = learner.finish(projection, (&world.spec.name, &world.sha256), robot.camera_offset_m);
    if truth.len() < route.path.len() {
        truth.push(simulation.truth());
    }
    simulation.finish(Status::Arrived, None)?;
    Ok(Lesson { route, truth, time_s, collisions })
}

/// Notes where the robot truly is if it has made a node.
fn note(truth: &mut Vec<Pose>, learner: &Learner, simulation: &Simulation<'_>) {
    if truth.len() < learner.nodes() {
        truth.push(simulation.truth());
    }
}
