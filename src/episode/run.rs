//! The loop: sense, decide, move, until the episode ends.

use std::ops::ControlFlow;
use std::time::Instant;

use super::record::{Outcome, Pictures, Record, Step, Timing};
use super::recorder::{Moment, Recorder};
use crate::error::{Error, Result};
use crate::geometry::{Pose, Twist, wrap};
use crate::observation::{Bearing, Estimate, Method, Observation, Odometry, Status};
use crate::panorama::Panorama;
use crate::physics::{Collision, Plant};
use crate::sensor::Sensor;
use crate::world::TaskSpec;

/// Longest time given to the robot to coast to rest after the end, s.
const REST_LIMIT_S: f64 = 1.0;
/// Speeds below which the robot is at rest, m/s and rad/s.
const REST_TWIST: Twist = Twist { v: 1e-3, omega: 5e-3 };

/// A robot is stuck when it was told to move all through this time, s ...
const STUCK_WINDOW_S: f64 = 5.0;
/// ... and stayed within this distance, m, ...
const STUCK_DISTANCE_M: f64 = 0.02;
/// ... and this angle of where it is, rad.
const STUCK_TURN_RAD: f64 = 0.1;
/// Commands below these count as not told to move, m/s and rad/s.
const IDLE_TWIST: Twist = Twist { v: 0.005, omega: 0.02 };

/// The three parts of an episode.
pub struct Parts<'a> {
    /// What moves.
    pub plant: &'a mut dyn Plant,
    /// What senses; it sees the truth, as the world does.
    pub sensor: &'a mut dyn Sensor,
    /// What decides; it sees observations only.
    pub method: &'a mut dyn Method,
}

/// State of a running episode, for a watcher.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// Simulated time, s.
    pub time_s: f64,
    /// True distance to home, m.
    pub distance_m: f64,
    /// The method's belief.
    pub estimate: Option<Estimate>,
}

/// Runs an episode to its end. `watch` is called once a control step and stops the run with `Break`.
///
/// The episode ends when the method says so, at the time limit, or when the robot is stuck. Then the command is zero until the
/// robot rests, and the distance from there to home decides whether a claim to be home is right.
///
/// # Errors
/// [`Error::Interrupted`] when `watch` breaks, and what the sensor fails with.
pub fn run(
    parts: Parts<'_>,
    home: Pose,
    task: &TaskSpec,
    watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Record> {
    run_recorded(parts, home, task, watch, &mut ())
}

/// [`run`], with a recorder that is told of every control step. The record is the same with any recorder, but for its timing.
///
/// # Errors
/// As [`run`], and what the recorder fails with.
pub fn run_recorded(
    parts: Parts<'_>,
    home: Pose,
    task: &TaskSpec,
    watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    recorder: &mut dyn Recorder,
) -> Result<Record> {
    recorder.begin(parts.sensor.home(), parts.sensor.home_panorama())?;
    let mut timing = Timing::default();
    let began = Instant::now();
    let mut drive = Drive::new(parts.plant, task.control_period_s);
    let mut steps: Vec<Step> = Vec::new();
    let mut pictures = Pictures { home: parts.sensor.home_panorama().cloned(), ..Pictures::default() };

    let (ending, time_s) = loop {
        let time_s = steps.len() as f64 * task.control_period_s;
        let truth = drive.plant.truth();
        let bearings = parts.sensor.observe(truth, drive.plant.body_poses())?;
        let deciding = Instant::now();
        let compass_rad = parts.sensor.compass_rad(truth);
        let panorama = parts.sensor.panorama().map(Panorama::picture);
        let seen = Observation { time_s, odometry: drive.odometry, bearings: &bearings, compass_rad, panorama };
        let decision = parts.method.step(&seen);
        timing.estimation_s += deciding.elapsed().as_secs_f64();
        if steps.is_empty() {
            pictures.start = parts.sensor.panorama().cloned();
        }
        steps.push(Step {
            command: decision.command,
            estimate: decision.estimate,
            seen: Some(bearings.len()),
            matched: decision.matched,
            rejected: decision.rejected,
            nis: decision.nis,
            ..drive.row(time_s)
        });
        if let Some(step) = steps.last() {
            let panorama = parts.sensor.panorama();
            recorder.record(&drive.moment(step, &bearings, panorama))?;
        }
        let distance_m = (truth.position() - home.position()).norm();
        if watch(&Progress { time_s, distance_m, estimate: decision.estimate }).is_break() {
            return Err(Error::Interrupted);
        }
        match decision.status {
            Status::Arrived => break (Ending::Claimed, time_s),
            Status::Lost => break (Ending::GaveUp, time_s),
            Status::Failed => break (Ending::Broke, time_s),
            Status::Running if time_s >= task.time_limit_s => break (Ending::Timeout, time_s),
            Status::Running if is_stuck(&steps, task.control_period_s) => break (Ending::Stuck, time_s),
            Status::Running => {}
        }
        // A method that commands what no number describes has lost its way; the plant must not inherit it.
        if !(decision.command.v.is_finite() && decision.command.omega.is_finite()) {
            break (Ending::GaveUp, time_s);
        }
        drive.step(decision.command);
    };
    pictures.end = parts.sensor.panorama().cloned();

    drive.come_to_rest(&mut steps, recorder)?;
    let mut record = Record {
        outcome: Outcome::Lost,
        claimed_home: ending == Ending::Claimed,
        failure: parts.method.failure().map(str::to_owned),
        time_s,
        collisions: drive.collisions,
        home,
        home_bearings: parts.sensor.home().bearings.len(),
        pictures,
        renderer: parts.sensor.renderer().cloned(),
        steps,
        timing,
    };
    record.outcome = match ending {
        Ending::Claimed if record.final_distance_m() <= task.arrival_radius_m => Outcome::Home,
        Ending::Claimed | Ending::GaveUp => Outcome::Lost,
        Ending::Timeout => Outcome::Timeout,
        Ending::Stuck => Outcome::Stuck,
        Ending::Broke => Outcome::Failed,
    };
    let sensing = parts.sensor.timing();
    let wall_s = began.elapsed().as_secs_f64();
    record.timing = Timing {
        physics_s: drive.physics_s,
        render_s: sensing.render_s,
        vision_s: sensing.vision_s,
        wall_s,
        real_time_factor: record.last().time_s / wall_s.max(1e-9),
        ..timing
    };
    Ok(record)
}

/// Why the loop ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ending {
    Claimed,
    GaveUp,
    Timeout,
    Stuck,
    Broke,
}

/// The plant with what it reported since the last step.
struct Drive<'a> {
    plant: &'a mut dyn Plant,
    period_s: f64,
    odometry: Odometry,
    slip_m_s: [f64; 2],
    dead_reckoned: Pose,
    collisions: Vec<Collision>,
    /// How many of these there were before the last step.
    known_collisions: usize,
    physics_s: f64,
}

impl<'a> Drive<'a> {
    fn new(plant: &'a mut dyn Plant, period_s: f64) -> Self {
        let dead_reckoned = plant.truth();
        Self {
            plant,
            period_s,
            odometry: Odometry::default(),
            slip_m_s: [0.0; 2],
            dead_reckoned,
            collisions: Vec::new(),
            known_collisions: 0,
            physics_s: 0.0,
        }
    }

    /// Moves for one period.
    fn step(&mut self, command: Twist) {
        let moving = Instant::now();
        let moved = self.plant.step(command, self.period_s);
        self.physics_s += moving.elapsed().as_secs_f64();
        self.odometry = moved.odometry;
        self.slip_m_s = moved.slip_m_s;
        self.known_collisions = self.collisions.len();
        self.collisions.extend_from_slice(self.plant.collisions());
        self.dead_reckoned = self.dead_reckoned.advanced(moved.odometry.twist, moved.odometry.dt_s);
    }

    /// A row that says where the plant is, without an observation or a command.
    fn row(&self, time_s: f64) -> Step {
        Step {
            time_s,
            truth: self.plant.truth(),
            dead_reckoned: self.dead_reckoned,
            odometry: self.odometry.twist,
            slip_m_s: self.slip_m_s,
            command: Twist::default(),
            estimate: None,
            seen: None,
            matched: 0,
            rejected: 0,
            nis: f64::NAN,
        }
    }

    /// What a recorder is told of a step.
    fn moment<'m>(&'m self, step: &'m Step, bearings: &'m [Bearing], panorama: Option<&'m Panorama>) -> Moment<'m> {
        let collisions = &self.collisions[self.known_collisions..];
        Moment { step, bearings, panorama, bodies: self.plant.body_poses(), collisions }
    }

    /// Commands zero until the robot rests, one row a period.
    fn come_to_rest(&mut self, steps: &mut Vec<Step>, recorder: &mut dyn Recorder) -> Result<()> {
        let limit = (REST_LIMIT_S / self.period_s).ceil() as usize;
        for _ in 0..limit {
            let before = self.plant.truth();
            self.step(Twist::default());
            let row = self.row(steps.len() as f64 * self.period_s);
            recorder.record(&self.moment(&row, &[], None))?;
            steps.push(row);
            let moved = (row.truth.position() - before.position()).norm();
            let turned = wrap(row.truth.heading - before.heading).abs();
            if moved < REST_TWIST.v * self.period_s && turned < REST_TWIST.omega * self.period_s {
                break;
            }
        }
        Ok(())
    }
}

/// Whether the robot was told to move during the whole window before the last step and did not.
fn is_stuck(steps: &[Step], period_s: f64) -> bool {
    let window = (STUCK_WINDOW_S / period_s).ceil() as usize;
    let Some(first) = steps.len().checked_sub(window + 1) else { return false };
    let (now, before) = (&steps[steps.len() - 1], &steps[first..steps.len() - 1]);
    before.iter().all(|s| {
        (s.command.v.abs() >= IDLE_TWIST.v || s.command.omega.abs() >= IDLE_TWIST.omega)
            && (s.truth.position() - now.truth.position()).norm() < STUCK_DISTANCE_M
            && wrap(s.truth.heading - now.truth.heading).abs() < STUCK_TURN_RAD
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observation::{Decision, HomeSnapshot};
    use crate::physics::PlantStep;

    /// Moves as told along a line, short of a wall; coasts for one period after the command ends.
    struct Track {
        pose: Pose,
        wall_x: f64,
        last_v: f64,
    }

    impl Plant for Track {
        fn step(&mut self, command: Twist, dt_s: f64) -> PlantStep {
            let v = 0.5 * (command.v + self.last_v);
            self.last_v = command.v;
            self.pose.x = (self.pose.x + v * dt_s).min(self.wall_x);
            PlantStep { odometry: Odometry { twist: Twist { v, omega: 0.0 }, dt_s }, ..PlantStep::default() }
        }
        fn truth(&self) -> Pose {
            self.pose
        }
        fn body_poses(&self) -> &[Pose] {
            &[]
        }
    }

    struct Blind(HomeSnapshot);

    impl Sensor for Blind {
        fn home(&self) -> &HomeSnapshot {
            &self.0
        }
        fn observe(&mut self, _: Pose, _: &[Pose]) -> Result<Vec<Bearing>> {
            Ok(Vec::new())
        }
    }

    /// Drives at 0.2 m/s until a time and then says something.
    struct Script {
        until_s: f64,
        then: Status,
        v: f64,
    }

    impl Method for Script {
        fn step(&mut self, observation: &Observation<'_>) -> Decision {
            let ended = observation.time_s >= self.until_s;
            Decision {
                command: Twist { v: self.v, omega: 0.0 },
                estimate: None,
                status: if ended { self.then } else { Status::Running },
                matched: 0,
                rejected: 0,
                nis: f64::NAN,
            }
        }
    }

    /// Home lies 1 m ahead of the start.
    fn episode(wall_x: f64, script: Script) -> Record {
        let task = TaskSpec { time_limit_s: 20.0, ..TaskSpec::default() };
        let mut plant = Track { pose: Pose::IDENTITY, wall_x, last_v: 0.0 };
        let (mut sensor, mut method) = (Blind(HomeSnapshot::default()), script);
        let parts = Parts { plant: &mut plant, sensor: &mut sensor, method: &mut method };
        run(parts, Pose::new(1.0, 0.0, 0.0), &task, &mut |_| ControlFlow::Continue(())).unwrap()
    }

    fn script(until_s: f64, then: Status) -> Script {
        Script { until_s, then, v: 0.2 }
    }

    #[test]
    fn a_claim_counts_where_the_robot_rests() {
        let right = episode(9.0, script(5.0, Status::Arrived));
        assert_eq!((right.outcome, right.claimed_home, right.time_s), (Outcome::Home, true, 5.0));
        // 0.2 m/s for 5 s, half of that in the first period, and half of that again in the period after the stop.
        assert!(right.final_distance_m() < 1e-12, "{}", right.final_distance_m());
        assert!(right.last().time_s > 5.0 && right.last().seen.is_none() && right.odometry_drift_m() < 1e-12);
        let wrong = episode(9.0, script(4.0, Status::Arrived));
        assert_eq!((wrong.outcome, wrong.claimed_home), (Outcome::Lost, true));
        assert!((wrong.final_distance_m() - 0.2).abs() < 1e-12);
    }

    #[test]
    fn other_ends_are_told_apart() {
        let lost = episode(9.0, script(1.0, Status::Lost));
        assert_eq!((lost.outcome, lost.claimed_home, lost.time_s), (Outcome::Lost, false, 1.0));
        let late = episode(9.0, script(99.0, Status::Arrived));
        assert_eq!((late.outcome, late.time_s), (Outcome::Timeout, 20.0));
        let broken = episode(9.0, Script { until_s: 99.0, then: Status::Arrived, v: f64::NAN });
        assert_eq!((broken.outcome, broken.time_s), (Outcome::Lost, 0.0));
        assert!(broken.last().truth.is_finite());
    }

    #[test]
    fn only_a_robot_that_is_told_to_move_gets_stuck() {
        let stuck = episode(0.5, script(99.0, Status::Arrived));
        assert_eq!(stuck.outcome, Outcome::Stuck);
        // At the wall after 2.55 s; 5 s later, but for the last 2 cm, it has not moved.
        assert!((stuck.time_s - 7.5).abs() < 0.2, "{}", stuck.time_s);
        let waiting = episode(0.5, Script { until_s: 99.0, then: Status::Arrived, v: 0.0 });
        assert_eq!(waiting.outcome, Outcome::Timeout);
    }

    #[test]
    fn a_watcher_can_stop_it() {
        let mut plant = Track { pose: Pose::IDENTITY, wall_x: 9.0, last_v: 0.0 };
        let (mut sensor, mut method) = (Blind(HomeSnapshot::default()), script(99.0, Status::Arrived));
        let parts = Parts { plant: &mut plant, sensor: &mut sensor, method: &mut method };
        let stop_after_a_second =
            &mut |p: &Progress| if p.time_s < 1.0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
        let result = run(parts, Pose::new(1.0, 0.0, 0.0), &TaskSpec::default(), stop_after_a_second);
        assert!(matches!(result, Err(Error::Interrupted)));
    }
}
