//! One repeat, held against the truth: a follower in a simulation, and what came of it.

use std::ops::ControlFlow;
use std::time::Instant;

use crate::episode::{Look, Simulation};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Vector2, direction, wrap};
use crate::observation::Status;
use crate::physics::Struck;
use crate::random::Seed;
use crate::world::spec::{DisturbanceKind, DisturbanceSpec, PoseSpec};

use super::chart::{Line, Route};
use super::follow::{Begin, Engine, Follower, Way};
use super::scene::Stage;

/// Conditions of a repeat.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeating {
    /// What drives the legs.
    pub engine: Engine,
    /// Which way.
    pub way: Way,
    /// Rounds, of a loop.
    pub laps: u32,
    /// Where it starts: at the beginning, or anywhere along the route without being told where.
    pub begin: Begin,
    /// Whether the robot is lifted on the way and set down elsewhere along the route.
    pub kidnap: bool,
    /// Light and camera.
    pub look: Look,
    /// Friction of the floor, where it is not the world's.
    pub friction: Option<f64>,
    /// Share of the taught features that are hidden.
    pub hidden: f64,
}

impl Default for Repeating {
    fn default() -> Self {
        Self {
            engine: Engine::LocalMap,
            way: Way::Forwards,
            laps: 1,
            begin: Begin::AtStart,
            kidnap: false,
            look: Look::default(),
            friction: None,
            hidden: 0.0,
        }
    }
}

/// The robot is set down at its start within this of where it stood at the teach, m ...
const PLACED_M: f64 = 0.05;
/// ... and rad.
const PLACED_RAD: f64 = 0.09;
/// One that starts anywhere, or is kidnapped, is set down so far beside the path at most, m, facing anywhere.
const BESIDE_M: f64 = 0.4;
/// A claim to be at a place of the route is wrong if the robot truly is farther than this from there, m.
pub const WRONG_M: f64 = 0.5;
/// A route is completed by a robot that claims its end and rests within this of it, m.
pub const COMPLETED_M: f64 = 0.15;
/// Time after the start or a kidnap that does not count for cross-track errors: the robot comes from beside, s.
const JOINING_S: f64 = 8.0;

/// State of a repeat in a control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Time, s.
    pub time_s: f64,
    /// True pose in the room.
    pub truth: Pose,
    /// Believed distance along the route, m, from the end that the robot comes from.
    pub along_m: f64,
    /// True distance from the taught path, m, positive to its left.
    pub cross_track_m: f64,
    /// Heading off that of the path, rad.
    pub heading_error_rad: f64,
    /// True distance between where the robot is and where it believes to be.
    pub belief_error_m: f64,
    /// Believed pose, by way of the true path, in the room.
    pub believed: Pose,
    /// Nearest snapshot.
    pub snapshot: usize,
    /// Landmarks looked for, found, and refused in the last picture.
    pub looked: [usize; 3],
    /// Whether it does not know where it is.
    pub is_lost: bool,
    /// Whether the step counts for cross-track errors.
    pub counts: bool,
}

/// What came of a repeat.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeat {
    /// Seed.
    pub seed: u64,
    /// How it ended in the robot's own view.
    pub status: Status,
    /// Control steps.
    pub rows: Vec<Row>,
    /// True distance at rest from the end of the route, m.
    pub final_error_m: f64,
    /// Contacts with walls and with what stands, ...
    pub wall_hits: usize,
    /// ... and with what moves by itself.
    pub walker_hits: usize,
    /// Snapshots that it believes to have passed, ...
    pub legs: usize,
    /// ... and how many of those truly were elsewhere.
    pub wrong_legs: usize,
    /// When it was kidnapped, s.
    pub kidnapped_s: Option<f64>,
    /// Wall-clock time, s.
    pub wall_s: f64,
}

impl Repeat {
    /// Whether it claims the end of the route and rests there.
    #[must_use]
    pub fn is_completed(&self) -> bool {
        self.status == Status::Arrived && self.final_error_m <= COMPLETED_M
    }

    /// Time that it took, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.time_s)
    }

    /// Distances from the taught path that count, m.
    pub fn cross_track_m(&self) -> impl Iterator<Item = f64> + '_ {
        self.rows.iter().filter(|row| row.counts).map(|row| row.cross_track_m.abs())
    }
}

/// Repeats `route`, which was taught along `truth`, on `stage`.
///
/// # Errors
/// When the route does not fit the stage, a part fails, or `watch` breaks.
pub fn repeat(
    stage: &Stage<'_>,
    route: &Route,
    truth: &[Pose],
    repeating: &Repeating,
    seed: u64,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Repeat> {
    check(stage, route, truth)?;
    let line = Line::new(truth.iter().map(Pose::position));
    let mut draw = {
        use rand::RngExt;
        let mut stream = Seed(seed).stream("route");
        move || stream.random::<f64>()
    };
    let backwards = repeating.way == Way::Backwards;
    let line = if backwards { line.reversed() } else { line };
    let place = |along_m: f64, beside_m: f64, heading: f64| {
        let at = line.at(along_m);
        let ahead = line.direction_rad(along_m.max(0.1));
        let left = Vector2::new(-libm::sin(ahead), libm::cos(ahead));
        let at = at + left * beside_m;
        Pose::new(at.x, at.y, ahead + heading)
    };
    let world = stage.world();
    let free = |pose: &Pose| world.is_free(pose, 0.03, &world.body_poses()).is_ok();
    let anywhere = |draw: &mut dyn FnMut() -> f64, from: f64, to: f64| {
        let tries = (0..200).map(|_| {
            let along = (from + (to - from) * draw()) * line.length_m();
            place(along, BESIDE_M * (2.0 * draw() - 1.0), std::f64::consts::TAU * draw())
        });
        tries.into_iter().find(|pose| free(pose)).unwrap_or_else(|| place(0.5 * (from + to) * line.length_m(), 0.0, 0.0))
    };
    let start = match repeating.begin {
        Begin::AtStart => {
            let off = [PLACED_M, PLACED_M, PLACED_RAD].map(|most| most * (2.0 * draw() - 1.0));
            let pose = place(0.0, off[0], off[2]);
            let at = pose.position() + direction(pose.heading) * off[1];
            let first = if backwards { 0.0 } else { wrap(truth[0].heading - line.direction_rad(0.1)) };
            let placed = Pose::new(at.x, at.y, pose.heading + first);
            if free(&placed) { placed } else { Pose { x: line.at(0.0).x, y: line.at(0.0).y, ..placed } }
        }
        Begin::Anywhere => anywhere(&mut draw, 0.05, 0.8),
    };
    let (mut changed, mut kidnapped_s) = (world.clone(), None);
    if let Some(friction) = repeating.friction {
        changed.spec.floor.friction = friction;
        changed.zones.clear();
    }
    let speed = world.spec.task.speed_m_s;
    if repeating.kidnap {
        let at_s = (0.25 + 0.3 * draw()) * line.length_m() / speed;
        let to = anywhere(&mut draw, 0.1, 0.85);
        let what = DisturbanceKind::Kidnap(PoseSpec { x_m: to.x, y_m: to.y, heading_deg: to.heading.to_degrees() });
        changed.spec.disturbances.push(DisturbanceSpec { at_s, what });
        kidnapped_s = Some(at_s);
    }
    let mut simulation = stage.simulation(&changed, repeating.look)?;
    simulation.reset_at(seed, start)?;
    let briefing = simulation.briefing();
    let mut follower = Follower::new(
        route,
        repeating.engine.clone(),
        repeating.way,
        repeating.begin,
        repeating.laps,
        (briefing.robot, briefing.task),
    );
    if repeating.hidden > 0.0 {
        let hidden = Seed(seed).derive("hidden");
        follower.locator_mut().hide(|track| {
            use rand::RngExt;
            hidden.stream(&track.to_string()).random::<f64>() < repeating.hidden
        });
    }
    let began = Instant::now();
    let mut judge = Judge::new(&line, route, repeating);
    judge.kidnapped_s = kidnapped_s;
    let limit_s = 120.0 + 3.0 * f64::from(repeating.laps) * line.length_m() / speed;
    let (mut wall_hits, mut walker_hits) = (0, 0);
    let status = loop {
        let (step, time_s) = {
            let seen = simulation.observation()?;
            (follower.step(&seen), seen.time_s)
        };
        judge.note(time_s, simulation.truth(), &follower, step.looked.map(|l| [l.expected, l.matched, l.rejected]));
        if step.status != Status::Running {
            break step.status;
        }
        if time_s > limit_s {
            break Status::Running;
        }
        if watch(follower.along_m() / line.length_m()).is_break() {
            return Err(Error::Interrupted);
        }
        simulation.step(step.command)?;
        for collision in simulation.collisions() {
            match collision.with {
                Struck::Body(k) if !world.bodies[k].stands() => walker_hits += 1,
                _ => wall_hits += 1,
            }
        }
        simulation.forget();
    };
    let wall_s = began.elapsed().as_secs_f64();
    let end = line.at(line.length_m());
    let final_error_m = (rest(&mut simulation, status)?.position() - end).norm();
    let Judge { rows, legs, wrong_legs, .. } = judge;
    Ok(Repeat { seed, status, rows, final_error_m, wall_hits, walker_hits, legs, wrong_legs, kidnapped_s, wall_s })
}

/// Where the robot comes to rest.
fn rest(simulation: &mut Simulation<'_>, status: Status) -> Result<Pose> {
    let record = simulation.finish(status, None)?;
    Ok(record.last().truth)
}

/// Refuses a route that was taught elsewhere, or with another camera.
///
/// # Errors
/// What differs, with both values.
pub fn check(stage: &Stage<'_>, route: &Route, truth: &[Pose]) -> Result<()> {
    let unfit = |what: &str, found: String, needed: String| Err(Error::Unfit { what: what.into(), found, needed });
    let (sheet, world) = (&route.sheet, stage.world());
    if sheet.world_sha256 != world.sha256 {
        return unfit(
            "world of the repeat",
            format!("`{}` ({:.8})", world.spec.name, world.sha256),
            format!("that of the teach: `{}` ({:.8})", sheet.world, sheet.world_sha256),
        );
    }
    if sheet.projection != stage.projection() {
        let size =
            |p: &crate::panorama::Projection| format!("{} x {} pixels, horizon in row {}", p.width, p.height, p.horizon_row);
        return unfit(
            "camera of the repeat",
            size(&stage.projection()),
            format!("that of the teach: {}", size(&sheet.projection)),
        );
    }
    if truth.len() != route.path.len() {
        return unfit(
            "true path of the teach",
            format!("{} poses", truth.len()),
            format!("one for each of the route's {} nodes", route.path.len()),
        );
    }
    Ok(())
}

/// Holds a follower against the truth.
struct Judge<'a> {
    line: &'a Line,
    last_snapshot: Option<usize>,
    rows: Vec<Row>,
    legs: usize,
    wrong_legs: usize,
    kidnapped_s: Option<f64>,
    found_s: f64,
    was_lost: bool,
    taught: Line,
    looked: [usize; 3],
    anywhere: bool,
}

impl<'a> Judge<'a> {
    fn new(line: &'a Line, route: &Route, repeating: &Repeating) -> Self {
        let taught = Line::new(route.path.iter().map(Pose::position));
        let taught = if repeating.way == Way::Backwards { taught.reversed() } else { taught };
        Self {
            line,
            last_snapshot: None,
            rows: Vec::new(),
            legs: 0,
            wrong_legs: 0,
            kidnapped_s: None,
            found_s: 0.0,
            was_lost: false,
            taught,
            looked: [0; 3],
            anywhere: repeating.begin == Begin::Anywhere,
        }
    }

    fn note(&mut self, time_s: f64, truth: Pose, follower: &Follower<'_>, looked: Option<[usize; 3]>) {
        let along_m = follower.along_m();
        let at = follower.true_along(self.line);
        let is_lost = follower.locator().is_lost();
        let beside = if is_lost || self.was_lost {
            self.line.nearest(truth.position(), 0.0, self.line.length_m())
        } else {
            self.line.nearest(truth.position(), at - 1.5, at + 1.5)
        };
        self.looked = looked.unwrap_or(self.looked);
        // Beside the believed path as far as beside the true one.
        let own = self.taught.nearest(follower.locator().pose().position(), along_m - 0.5, along_m + 0.5);
        let ahead = self.line.direction_rad(at);
        let left = Vector2::new(-libm::sin(ahead), libm::cos(ahead));
        let believed_at = self.line.at(at) + left * own.offset_m;
        let believed =
            Pose::new(believed_at.x, believed_at.y, ahead + wrap(follower.locator().pose().heading - own.direction_rad));
        let belief_error_m = (truth.position() - believed.position()).norm();
        if is_lost || self.was_lost || self.kidnapped_s.is_some_and(|at_s| time_s >= at_s && self.found_s < at_s) {
            self.found_s = time_s;
        }
        let joining =
            (self.anywhere || self.kidnapped_s.is_some_and(|at_s| time_s >= at_s)) && time_s - self.found_s < JOINING_S;
        self.was_lost = is_lost;
        let snapshot = follower.locator().snapshot();
        if !is_lost && self.last_snapshot != Some(snapshot) {
            self.last_snapshot = Some(snapshot);
            self.legs += 1;
            let just_kidnapped = self.kidnapped_s.is_some_and(|at_s| (at_s..at_s + 4.0).contains(&time_s));
            if belief_error_m > WRONG_M && !just_kidnapped {
                self.wrong_legs += 1;
            }
        }
        self.rows.push(Row {
            time_s,
            truth,
            along_m,
            cross_track_m: beside.offset_m,
            heading_error_rad: wrap(truth.heading - beside.direction_rad),
            belief_error_m,
            believed,
            snapshot,
            looked: self.looked,
            is_lost,
            counts: !is_lost && !joining,
        });
    }
}
