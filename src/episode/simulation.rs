//! A simulation that a caller steps: reset it, look, command, look again.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use super::parts::{Parts, PlantMaker, Shared};
use super::record::{Outcome, Pictures, Record, Step, Timing};
use super::recorder::Recorder;
use super::running::{Episode, Phase};
use super::setup::{Setup, StopRule};
use super::summary::Summary;
use crate::error::{Error, Result, go_on};
use crate::geometry::{Pose, Twist, wrap};
use crate::method;
use crate::observation::{Briefing, Decision, Estimate, Method, Observation, Odometry, Status};
use crate::panorama::Panorama;
use crate::physics::{Collision, Plant};
use crate::random::Seed;
use crate::render::Scene;
use crate::sensor::Sensor;
use crate::world::{TaskSpec, World};

/// Longest time given to the robot to coast to rest after the end, s.
const REST_LIMIT_S: f64 = 1.0;
/// Speeds below which the robot is at rest, m/s and rad/s.
const REST_TWIST: Twist = Twist { v: 1e-3, omega: 5e-3 };

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

/// Is shown the state once a control step, and says whether to go on.
pub type Watch<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// A robot in a world, one control step at a time.
///
/// [`reset`](Self::reset) puts it at the start of a seed's run and tells the first observation; [`step`](Self::step) holds a command for a
/// control period and tells the next one. An [`Observation`] holds nothing of the truth; a caller who is no method finds that in
/// [`truth`](Self::truth), [`bodies`](Self::bodies) and [`steps`](Self::steps). [`run`](Self::run) closes the loop with the method that the
/// setup names, [`run_method`](Self::run_method) with any other.
///
/// ```
/// use wayhome::episode::{Phase, PlantKind, SensorKind, Setup, Simulation};
/// use wayhome::geometry::Twist;
/// use wayhome::world::World;
///
/// let world = World::open("lab")?;
/// let setup = Setup { plant: PlantKind::Unicycle, sensor: SensorKind::Ideal, ..Setup::default() };
/// let mut simulation = Simulation::new(&world, &setup)?;
/// let first = simulation.reset(7)?;
/// assert!(first.time_s == 0.0 && !first.bearings.is_empty());
/// let before = simulation.truth();
/// let (seen, phase) = simulation.step(Twist { v: 0.2, omega: 0.0 })?;
/// assert!(seen.time_s == 0.1 && seen.odometry.twist.v == 0.2 && phase == Phase::Running);
/// assert!(((simulation.truth().position() - before.position()).norm() - 0.02).abs() < 1e-12);
/// # Ok::<(), wayhome::Error>(())
/// ```
pub struct Simulation<'a> {
    world: &'a World,
    setup: Setup,
    task: TaskSpec,
    /// `None` where the parts are a caller's own.
    shared: Option<Shared>,
    plant: PlantMaker<'a>,
    sensor: Box<dyn Sensor + 'a>,
    recorder: Option<Box<dyn Recorder + 'a>>,
    episode: Option<Episode<'a>>,
}

impl<'a> Simulation<'a> {
    /// Builds what `setup` names: packs the world and opens the renderer where it needs them.
    ///
    /// # Errors
    /// When [`Setup::check`] finds a fault, the world cannot be packed, the renderer cannot be had, or the set cannot be opened.
    pub fn new(world: &'a World, setup: &Setup) -> Result<Self> {
        setup.check()?;
        Self::shared(world, setup, Shared::new(world, setup)?)
    }

    /// As [`Simulation::new`], with the scenes of another simulation of an equal world with the same [`Setup::looks`]: packing a world,
    /// its textures above all, takes longer than a short run.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn with_scenes(world: &'a World, setup: &Setup, scenes: [Arc<Scene>; 2]) -> Result<Self> {
        setup.check()?;
        Self::shared(world, setup, Shared::with_scenes(world, setup, Some(scenes))?)
    }

    /// With parts of a caller's own. Of `setup` hold the method, the start, the task and the names in summaries.
    pub fn from_parts(world: &'a World, setup: &Setup, parts: Parts<'a>) -> Self {
        let Parts { plant, sensor } = parts;
        let task = setup.task(world);
        Self { world, setup: setup.clone(), task, shared: None, plant, sensor, recorder: None, episode: None }
    }

    fn shared(world: &'a World, setup: &Setup, shared: Shared) -> Result<Self> {
        let parts = Parts::shared(world, setup, &shared)?;
        Ok(Self { shared: Some(shared), ..Self::from_parts(world, setup, parts) })
    }

    /// A second one for another thread; it shares the packed world and has a renderer of its own.
    ///
    /// # Errors
    /// When a second renderer cannot be had, or the parts are a caller's own.
    pub fn another(&self) -> Result<Self> {
        let shared = self.shared.clone().ok_or_else(|| Error::Invalid {
            what: "second simulation".into(),
            found: "parts of a caller's own".into(),
            allowed: "parts that the setup names".into(),
        })?;
        Self::shared(self.world, &self.setup, shared)
    }

    /// The packed world as it was at home and as it is on the way; `None` for a sensor without a camera.
    pub fn scenes(&self) -> Option<[Arc<Scene>; 2]> {
        self.shared.as_ref()?.scenes.clone()
    }

    /// The world.
    pub fn world(&self) -> &'a World {
        self.world
    }

    /// The setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The sensor, for looks from other places than the robot's. It should be reset first.
    pub fn sensor(&mut self) -> &mut (dyn Sensor + 'a) {
        self.sensor.as_mut()
    }

    /// Tells `recorder` of all that happens from the next reset on, in place of the recorder before.
    pub fn record_to(&mut self, recorder: impl Recorder + 'a) {
        self.recorder = Some(Box::new(recorder));
    }

    /// Puts the robot where the run of `seed` starts, and tells what is observed there. The same seed gives the same run.
    ///
    /// # Errors
    /// When there is no such start, or a part fails.
    pub fn reset(&mut self, seed: u64) -> Result<Observation<'_>> {
        let start = self.setup.start_pose(self.world, Seed(seed))?;
        self.reset_at(seed, start)
    }

    /// The same from a pose in the room, whatever start the setup names.
    ///
    /// # Errors
    /// When a part fails.
    pub fn reset_at(&mut self, seed: u64, start: Pose) -> Result<Observation<'_>> {
        let plant = (self.plant)(start, Seed(seed));
        self.sensor.reset(Seed(seed))?;
        if let Some(recorder) = &mut self.recorder {
            recorder.begin(self.sensor.home(), self.sensor.home_panorama())?;
        }
        self.episode = Some(Episode {
            seed,
            start,
            ticks: 0,
            other_s: 0.0,
            phase: Phase::Running,
            odometry: Odometry::default(),
            bearings: Vec::new(),
            compass_rad: None,
            slip_m_s: [0.0; 2],
            dead_reckoned: plant.truth(),
            plant,
            steps: Vec::new(),
            collisions: Vec::new(),
            known_collisions: 0,
            start_picture: None,
            began: Instant::now(),
            timing: Timing::default(),
        });
        self.look()?;
        let seen = self.sensor.panorama().cloned();
        self.running_mut()?.start_picture = seen;
        self.observation()
    }

    /// What a method is told before the run that was last reset.
    pub fn briefing(&self) -> Briefing {
        self.setup.briefing(self.world, self.sensor.as_ref())
    }

    /// What is observed now.
    ///
    /// # Errors
    /// Before the first reset, and after the end of a run.
    pub fn observation(&self) -> Result<Observation<'_>> {
        let episode = self.running()?;
        Ok(Observation {
            time_s: episode.time_s(self.task.control_period_s),
            odometry: episode.odometry,
            bearings: &episode.bearings,
            alternatives: self.sensor.alternatives(),
            compass_rad: episode.compass_rad,
            bumper: episode.plant.bumper(),
            panorama: self.sensor.panorama().map(Panorama::picture),
        })
    }

    /// Holds a command for one control period, and tells what is observed then and how the episode stands. A command that no number
    /// describes counts as a stop.
    ///
    /// # Errors
    /// Before the first reset, and when a part or the recorder fails.
    pub fn step(&mut self, command: Twist) -> Result<(Observation<'_>, Phase)> {
        self.step_for(command, None)
    }

    /// The same for another interval, s; `None` is the control period.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn step_for(&mut self, command: Twist, interval_s: Option<f64>) -> Result<(Observation<'_>, Phase)> {
        self.note(&Decision::command(command))?;
        self.advance(command, interval_s)?;
        Ok((self.observation()?, self.running()?.phase))
    }

    /// How the episode stands; running before the first reset.
    pub fn phase(&self) -> Phase {
        self.episode.as_ref().map_or(Phase::Running, |episode| episode.phase)
    }

    /// True pose of the robot in the room; home before the first reset.
    pub fn truth(&self) -> Pose {
        self.episode.as_ref().map_or(self.world.home, |episode| episode.plant.truth())
    }

    /// What moves, with what its wheels do; `None` before the first reset.
    pub fn plant(&self) -> Option<&dyn Plant> {
        Some(self.episode.as_ref()?.plant.as_ref())
    }

    /// True poses of the bodies, in the order of `World::bodies`.
    pub fn bodies(&self) -> &[Pose] {
        self.episode.as_ref().map_or(&[], |episode| episode.plant.body_poses())
    }

    /// The record so far: truth, odometry, command and belief of all steps that were left.
    pub fn steps(&self) -> &[Step] {
        self.episode.as_ref().map_or(&[], |episode| &episode.steps)
    }

    /// Contacts of the run so far.
    pub fn collisions(&self) -> &[Collision] {
        self.episode.as_ref().map_or(&[], |episode| &episode.collisions)
    }

    /// Forgets the steps and contacts so far, so that a run of any length needs no more memory than a short one.
    pub fn forget(&mut self) {
        if let Some(episode) = &mut self.episode {
            episode.steps.clear();
            episode.collisions.clear();
            episode.known_collisions = 0;
        }
    }

    /// Runs the episode of one seed with the setup's method. `watch` stops the run with `Break`.
    ///
    /// # Errors
    /// When there is no such start, the method cannot be built from what it is told, a part fails, or `watch` breaks.
    pub fn run(&mut self, seed: u64, watch: &mut Watch<'_>) -> Result<Record> {
        self.reset(seed)?;
        self.run_own(watch)
    }

    /// The same from a pose in the room, whatever start the setup names.
    ///
    /// # Errors
    /// As [`Simulation::run`].
    pub fn run_from(&mut self, seed: u64, start: Pose, watch: &mut Watch<'_>) -> Result<Record> {
        self.reset_at(seed, start)?;
        self.run_own(watch)
    }

    /// The same with a method of a caller's own, which is built from what methods are told.
    ///
    /// # Errors
    /// As [`Simulation::run`], and what `build` fails with.
    pub fn run_method(
        &mut self,
        seed: u64,
        build: impl FnOnce(Briefing) -> Result<Box<dyn Method>>,
        watch: &mut Watch<'_>,
    ) -> Result<Record> {
        self.reset(seed)?;
        let mut method = build(self.briefing())?;
        self.close_loop(method.as_mut(), watch)
    }

    fn run_own(&mut self, watch: &mut Watch<'_>) -> Result<Record> {
        let options = self.setup.method_options(self.world, &self.running()?.start);
        let mut method = method::build(self.setup.method.clone(), &options, self.briefing())?;
        self.close_loop(method.as_mut(), watch)
    }

    /// The loop: observe, decide, move, until the method says that it is over, the time limit, or a robot that is stuck. Then the
    /// robot comes to rest, and the distance from there to home decides whether a claim to be home is right.
    fn close_loop(&mut self, method: &mut dyn Method, watch: &mut Watch<'_>) -> Result<Record> {
        let status = loop {
            let deciding = Instant::now();
            let decision = method.step(&self.observation()?);
            self.running_mut()?.timing.estimation_s += deciding.elapsed().as_secs_f64();
            self.note(&decision)?;
            let time_s = self.running()?.time_s(self.task.control_period_s);
            let progress = Progress { time_s, distance_m: self.distance_m(), estimate: decision.estimate };
            go_on(watch(&progress))?;
            if self.phase() != Phase::Running || decision.status != Status::Running {
                break decision.status;
            }
            // A method that commands what no number describes has lost its way; the plant must not inherit it.
            if !(decision.command.v.is_finite() && decision.command.omega.is_finite()) {
                break Status::Lost;
            }
            self.advance(decision.command, None)?;
        };
        self.finish(status, method.failure().map(str::to_owned))
    }

    /// Ends the run, of which its method thinks `status`: stops the robot, waits until it rests, tells the recorder, and hands the record
    /// over. A run that is stepped by hand needs no end but for its record.
    ///
    /// # Errors
    /// Before the first reset, and when the recorder fails.
    pub fn finish(&mut self, status: Status, failure: Option<String>) -> Result<Record> {
        self.running()?;
        let end = self.sensor.panorama().cloned();
        self.come_to_rest()?;
        let Some(episode) = self.episode.take() else { return Err(not_reset()) };
        let Episode { seed, phase, steps, collisions, start_picture, timing, began, .. } = episode;
        let ended = steps.iter().rev().find(|step| step.seen.is_some()).map_or(0.0, |step| step.time_s);
        let mut record = Record {
            outcome: Outcome::Lost,
            claimed_home: status == Status::Arrived && phase != Phase::Reached,
            failure,
            time_s: ended,
            collisions,
            home: self.world.home,
            home_bearings: self.sensor.home().bearings.len(),
            pictures: Pictures { home: self.sensor.home_panorama().cloned(), start: start_picture, end },
            renderer: self.sensor.renderer().cloned(),
            steps,
            timing,
        };
        let is_home = record.final_distance_m() <= self.task.arrival_radius_m;
        record.outcome = match (phase, status) {
            (Phase::Reached, _) => Outcome::Home,
            (_, Status::Arrived) if is_home => Outcome::Home,
            (_, Status::Arrived | Status::Lost) | (Phase::Running, Status::Running) => Outcome::Lost,
            (_, Status::Failed) => Outcome::Failed,
            (Phase::OutOfTime, Status::Running) => Outcome::Timeout,
            (Phase::Stuck, Status::Running) => Outcome::Stuck,
        };
        let sensing = self.sensor.timing();
        let wall_s = began.elapsed().as_secs_f64();
        record.timing = Timing {
            render_s: sensing.render_s,
            vision_s: sensing.vision_s,
            wall_s,
            real_time_factor: record.last().time_s / wall_s.max(1e-9),
            ..record.timing
        };
        if let Some(recorder) = &mut self.recorder {
            recorder.finish(&record, &Summary::new(&record, self.world, &self.setup, seed))?;
        }
        Ok(record)
    }

    fn running(&self) -> Result<&Episode<'a>> {
        self.episode.as_ref().ok_or_else(not_reset)
    }

    fn running_mut(&mut self) -> Result<&mut Episode<'a>> {
        self.episode.as_mut().ok_or_else(not_reset)
    }

    fn distance_m(&self) -> f64 {
        (self.truth().position() - self.world.home.position()).norm()
    }

    /// Senses from where the robot is now.
    fn look(&mut self) -> Result<()> {
        let Some(episode) = &mut self.episode else { return Err(not_reset()) };
        let truth = episode.plant.truth();
        episode.bearings = self.sensor.observe(truth, episode.plant.body_poses())?;
        episode.compass_rad = self.sensor.compass_rad(truth);
        let reached = self.setup.stop == StopRule::Reached && self.distance_m() <= self.task.arrival_radius_m;
        let task = self.task;
        let episode = self.running_mut()?;
        episode.phase = if reached {
            Phase::Reached
        } else if episode.time_s(task.control_period_s) >= task.time_limit_s {
            Phase::OutOfTime
        } else if episode.is_stuck(task.control_period_s) {
            Phase::Stuck
        } else {
            Phase::Running
        };
        Ok(())
    }

    /// Writes down what was observed and what was decided on it.
    fn note(&mut self, decision: &Decision) -> Result<()> {
        let Some(episode) = &mut self.episode else { return Err(not_reset()) };
        let row = Step {
            command: decision.command,
            estimate: decision.estimate,
            seen: Some(episode.bearings.len()),
            matched: decision.matched,
            rejected: decision.rejected,
            nis: decision.nis,
            ..episode.row(self.task.control_period_s)
        };
        episode.steps.push(row);
        if let Some(recorder) = &mut self.recorder {
            recorder.record(&episode.moment(&row, &episode.bearings, self.sensor.panorama()))?;
        }
        Ok(())
    }

    /// Moves, and senses.
    fn advance(&mut self, command: Twist, interval_s: Option<f64>) -> Result<()> {
        let period_s = self.task.control_period_s;
        self.running_mut()?.step(command, interval_s, period_s);
        self.look()
    }

    /// Commands zero until the robot rests, one row a period.
    fn come_to_rest(&mut self) -> Result<()> {
        let period_s = self.task.control_period_s;
        let Some(episode) = &mut self.episode else { return Err(not_reset()) };
        for _ in 0..(REST_LIMIT_S / period_s).ceil() as usize {
            let before = episode.plant.truth();
            episode.step(Twist::default(), None, period_s);
            let row = episode.row(period_s);
            if let Some(recorder) = &mut self.recorder {
                recorder.record(&episode.moment(&row, &[], None))?;
            }
            episode.steps.push(row);
            let moved = (row.truth.position() - before.position()).norm();
            let turned = wrap(row.truth.heading - before.heading).abs();
            if moved < REST_TWIST.v * period_s && turned < REST_TWIST.omega * period_s {
                break;
            }
        }
        Ok(())
    }
}

fn not_reset() -> Error {
    Error::Invalid { what: "simulation".into(), found: "no run under way".into(), allowed: "one that was reset".into() }
}

#[cfg(test)]
mod tests {
    #[cfg(feature = "rapier")]
    use super::super::setup::SensorKind;
    use super::super::setup::Start;
    use super::*;
    use crate::physics::PlantStep;
    use crate::sensor::Blind;

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

    /// Drives at 0.2 m/s until a time and then says something.
    struct Script {
        until_s: f64,
        then: Status,
        v: f64,
    }

    impl Method for Script {
        fn step(&mut self, observation: &Observation<'_>) -> Decision {
            let ended = observation.time_s >= self.until_s;
            let command = Twist { v: self.v, omega: 0.0 };
            Decision { status: if ended { self.then } else { Status::Running }, ..Decision::command(command) }
        }
    }

    /// A world with home at the origin.
    fn world() -> World {
        let text = "name = \"track\"\nroom.outline_m = [[-9, -9], [9, -9], [9, 9], [-9, 9]]\nhome = { x_m = 1, y_m = 0 }\n\
                    task = { time_limit_s = 20 }";
        World::from_toml(text, "track.toml").unwrap()
    }

    fn parts<'a>(wall_x: f64) -> Parts<'a> {
        let plant = move |pose, _| -> Box<dyn Plant> { Box::new(Track { pose, wall_x, last_v: 0.0 }) };
        Parts { plant: Box::new(plant), sensor: Box::new(Blind::default()) }
    }

    fn run(wall_x: f64, script: Script, watch: &mut Watch<'_>) -> Result<Record> {
        let (world, setup) = (world(), Setup { start: Start::At(Pose::IDENTITY), ..Setup::default() });
        let mut simulation = Simulation::from_parts(&world, &setup, parts(wall_x));
        simulation.run_method(1, |_| Ok(Box::new(script)), watch)
    }

    /// Home lies 1 m ahead of the start.
    fn episode(wall_x: f64, script: Script) -> Record {
        run(wall_x, script, &mut |_| ControlFlow::Continue(())).unwrap()
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
        let stop_after_a_second =
            &mut |p: &Progress| if p.time_s < 1.0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
        let result = run(9.0, script(99.0, Status::Arrived), stop_after_a_second);
        assert!(matches!(result, Err(Error::Interrupted)));
    }

    /// Whoever steps by hand sees what a method would have seen, and gets the same record.
    #[cfg(feature = "rapier")]
    #[test]
    fn a_run_can_be_stepped_by_hand() {
        let world = World::open("lab").unwrap();
        let setup = Setup { sensor: SensorKind::Noisy, ..Setup::default() };
        let mut simulation = Simulation::new(&world, &setup).unwrap();
        assert!(simulation.step(Twist::default()).is_err(), "there is nothing to step before a reset");
        let closed = simulation.run(3, &mut |_| ControlFlow::Continue(())).unwrap();
        for _ in 0..2 {
            let start = setup.start_pose(&world, Seed(3)).unwrap();
            simulation.reset(3).unwrap();
            let mut method =
                method::build(setup.method.clone(), &setup.method_options(&world, &start), simulation.briefing()).unwrap();
            let mut decision = method.step(&simulation.observation().unwrap());
            while decision.status == Status::Running {
                let (seen, _) = simulation.step(decision.command).unwrap();
                decision = method.step(&seen);
            }
            let truths: Vec<Pose> = simulation.steps().iter().map(|step| step.truth).collect();
            let held: Vec<Pose> = closed.steps.iter().take(truths.len()).map(|step| step.truth).collect();
            assert!(truths.len() > 20 && truths == held);
        }
    }
}
