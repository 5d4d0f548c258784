//! An episode in numbers: the fields of `summary.json`.

use nalgebra::{Cholesky, Vector3};
use serde::Serialize;

use super::record::{Outcome, Record, Step, Timing};
use super::setup::{PlantKind, SensorKind, Setup};
use crate::control::Law;
use crate::geometry::{Pose, angle_of, wrap};
use crate::method::MethodKind;
use crate::observation::Estimate;
use crate::physics::Collision;
use crate::render::RendererInfo;
use crate::statistics::mean;
use crate::world::{CameraPreset, LightPreset, World};

/// An episode in numbers. Everything but `timing` (and the renderer's names) depends on the world, the settings and the seed
/// alone. A number that does not exist for the run is `None`, which JSON shows as `null`.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// How it ended.
    pub outcome: Outcome,
    /// Whether the method claimed to be home; with an outcome other than "home" the claim was wrong.
    pub claimed_home: bool,
    /// Why the method broke; left out where it did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// True distance from the robot at rest to home, m.
    pub final_distance_m: f64,
    /// Difference between the robot's heading at rest and home's, rad.
    pub final_heading_error_rad: f64,
    /// Time at which the run ended, s.
    pub time_s: f64,
    /// Time to the arrival radius straight ahead at cruising speed, s; `None` for a start inside the radius.
    pub straight_line_time_s: Option<f64>,
    /// `time_s` over `straight_line_time_s`; `None` for runs that did not reach home.
    pub time_ratio: Option<f64>,
    /// Length of the true path, m.
    pub path_length_m: f64,
    /// True distance from start to home, m.
    pub start_distance_m: f64,
    /// True pose at the start, in the room.
    pub start: Pose,
    /// Home pose, in the room.
    pub home: Pose,
    /// Contacts with walls and bodies.
    pub collisions: usize,
    /// Each of them.
    pub collision_list: Vec<CollisionRecord>,
    /// Distance at the end between odometry alone and the truth, m.
    pub odometry_drift_m: f64,
    /// Errors of the method's belief; `None` for a method without one.
    pub estimate: Option<EstimateErrors>,
    /// Bearings a step.
    pub landmarks: Landmarks,
    /// Control steps until the method stopped.
    pub steps: usize,
    /// What rendered; `None` for a sensor without a camera.
    pub renderer: Option<RendererInfo>,
    /// Wall-clock times.
    pub timing: Timing,
    /// The parts and settings of the run.
    pub setup: SetupRecord,
    /// Seed of the run.
    pub seed: u64,
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Version of this program.
    pub version: &'static str,
}

/// A contact with a wall or body as JSON has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CollisionRecord {
    /// When it began, s.
    pub time_s: f64,
    /// With what: `wall 2`, `desk`.
    pub with: String,
    /// Impulse of the hit on the robot, N s.
    pub impulse_n_s: f64,
}

impl CollisionRecord {
    /// Collisions by the names that `world` has for things.
    pub fn list(collisions: &[Collision], world: &World) -> Vec<Self> {
        let record = |c: &Collision| Self { time_s: c.time_s, with: c.with.name(world), impulse_n_s: c.impulse_n_s };
        collisions.iter().map(record).collect()
    }
}

/// The choices behind a run, by the names that the command line has for them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetupRecord {
    /// Plant.
    pub plant: PlantKind,
    /// Sensor of bearings.
    pub bearings: SensorKind,
    /// Homing method.
    pub method: MethodKind,
    /// Steering law.
    pub controller: Law,
    /// Standard deviation of the compass, rad; left out for a robot without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compass_sd_rad: Option<f64>,
    /// Columns and rows of the panorama; `None` for a sensor without a camera.
    pub size_px: Option<[u32; 2]>,
    /// Light at home and on the way; `None` for a sensor without a camera.
    pub light: Option<[LightPreset; 2]>,
    /// Camera at home and on the way; `None` for a sensor without a camera.
    pub camera: Option<[CameraPreset; 2]>,
    /// Cruising speed, m/s.
    pub speed_m_s: f64,
    /// Arrival radius, m.
    pub arrival_radius_m: f64,
    /// Time limit, s.
    pub time_limit_s: f64,
}

impl SetupRecord {
    /// The choices of `setup` on `world`.
    pub fn new(setup: &Setup, world: &World) -> Self {
        let task = setup.task(world);
        let projection = setup.projection(world);
        let rendered = setup.sensor == SensorKind::Rendered;
        Self {
            plant: setup.plant,
            bearings: setup.sensor,
            method: setup.method.clone(),
            controller: setup.law,
            compass_sd_rad: setup.compass_sd_rad,
            size_px: rendered.then_some([projection.width, projection.height]),
            light: rendered.then(|| setup.looks().map(|look| look.light(world))),
            camera: rendered.then(|| setup.looks().map(|look| look.camera(world))),
            speed_m_s: task.speed_m_s,
            arrival_radius_m: task.arrival_radius_m,
            time_limit_s: task.time_limit_s,
        }
    }
}

/// Errors of the method's belief against the truth, over all steps that have one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EstimateErrors {
    /// Steps with a belief.
    pub steps: usize,
    /// Time of the first belief, s.
    pub first_time_s: f64,
    /// Estimated minus true range to home at the last belief, m.
    pub range_error_m: f64,
    /// Estimated minus true bearing from home at the last belief, rad.
    pub bearing_error_rad: f64,
    /// Estimated minus true heading at the last belief, rad.
    pub heading_error_rad: f64,
    /// Root mean square of the range's error, m.
    pub range_rmse_m: f64,
    /// Root mean square of the bearing's error, rad.
    pub bearing_rmse_rad: f64,
    /// Root mean square of the heading's error, rad.
    pub heading_rmse_rad: f64,
    /// Mean normalised estimation error squared of (x, y, heading); 3 for a consistent estimator. `None` where no covariance is
    /// regular.
    pub nees: Option<f64>,
}

/// Bearings a step, on average.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Landmarks {
    /// Bearings in the home snapshot.
    pub home: usize,
    /// Bearings that the sensor gave.
    pub seen_mean: f64,
    /// Bearings that the method used.
    pub matched_mean: f64,
    /// Bearings that the method refused.
    pub rejected_mean: f64,
}

impl Summary {
    /// Compares what happened with what the method believed.
    pub fn new(record: &Record, world: &World, setup: &Setup, seed: u64) -> Self {
        let task = setup.task(world);
        let (start, rest) = (record.first().truth, record.last().truth);
        let start_distance_m = (start.position() - record.home.position()).norm();
        let straight_line_time_s = Some((start_distance_m - task.arrival_radius_m) / task.speed_m_s).filter(|t| *t > 0.0);
        let time_ratio =
            straight_line_time_s.filter(|_| record.outcome == Outcome::Home).map(|straight| record.time_s / straight);
        let observed: Vec<&Step> = record.steps.iter().filter(|s| s.seen.is_some()).collect();
        let mean_count = |of: &dyn Fn(&Step) -> usize| mean(observed.iter().map(|s| of(s) as f64)).unwrap_or(0.0);
        Self {
            outcome: record.outcome,
            claimed_home: record.claimed_home,
            failure: record.failure.clone(),
            final_distance_m: record.final_distance_m(),
            final_heading_error_rad: wrap(rest.heading - record.home.heading),
            time_s: record.time_s,
            straight_line_time_s,
            time_ratio,
            path_length_m: record.steps.windows(2).map(|w| (w[1].truth.position() - w[0].truth.position()).norm()).sum(),
            start_distance_m,
            start,
            home: record.home,
            collisions: record.collisions.len(),
            collision_list: CollisionRecord::list(&record.collisions, world),
            odometry_drift_m: record.odometry_drift_m(),
            estimate: EstimateErrors::new(record),
            landmarks: Landmarks {
                home: record.home_bearings,
                seen_mean: mean_count(&|s| s.seen.unwrap_or(0)),
                matched_mean: mean_count(&|s| s.matched),
                rejected_mean: mean_count(&|s| s.rejected),
            },
            steps: observed.len(),
            renderer: record.renderer.clone(),
            timing: record.timing,
            setup: SetupRecord::new(setup, world),
            seed,
            world: world.spec.name.clone(),
            world_sha256: world.sha256.clone(),
            version: crate::VERSION,
        }
    }

    /// Whether the method claimed to be home and the robot came to rest outside the arrival radius: the one meaning of a wrong claim, in
    /// all tables.
    pub fn is_wrong_claim(&self) -> bool {
        self.claimed_home && self.outcome != Outcome::Home
    }
}

impl EstimateErrors {
    /// `None` for a record without a single belief.
    fn new(record: &Record) -> Option<Self> {
        let believed: Vec<(f64, BeliefError)> = record
            .steps
            .iter()
            .filter_map(|s| Some((s.time_s, BeliefError::new(s.estimate.as_ref()?, &record.home.to_local(&s.truth)))))
            .collect();
        let ((first_time_s, _), (_, last)) = (believed.first()?, believed.last()?);
        let rmse = |of: &dyn Fn(&BeliefError) -> f64| mean(believed.iter().map(|(_, e)| of(e) * of(e))).map_or(0.0, f64::sqrt);
        Some(Self {
            steps: believed.len(),
            first_time_s: *first_time_s,
            range_error_m: last.range_m,
            bearing_error_rad: last.bearing_rad,
            heading_error_rad: last.heading_rad,
            range_rmse_m: rmse(&|e| e.range_m),
            bearing_rmse_rad: rmse(&|e| e.bearing_rad),
            heading_rmse_rad: rmse(&|e| e.heading_rad),
            nees: mean(believed.iter().filter_map(|(_, e)| e.nees)),
        })
    }
}

/// One belief against the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeliefError {
    /// Estimated minus true range to home, m.
    pub range_m: f64,
    /// Estimated minus true bearing from home, rad.
    pub bearing_rad: f64,
    /// Estimated minus true heading, rad.
    pub heading_rad: f64,
    /// Normalised estimation error squared of (x, y, heading); `None` where the covariance is not regular.
    pub nees: Option<f64>,
}

impl BeliefError {
    /// `truth` is the true pose in the home frame.
    pub fn new(estimate: &Estimate, truth: &Pose) -> Self {
        let heading_rad = wrap(estimate.pose.heading - truth.heading);
        let error = Vector3::new(estimate.pose.x - truth.x, estimate.pose.y - truth.y, heading_rad);
        Self {
            range_m: estimate.range_m() - truth.position().norm(),
            bearing_rad: wrap(estimate.bearing_rad() - angle_of(truth.position())),
            heading_rad,
            nees: Cholesky::new(estimate.covariance).map(|c| error.dot(&c.solve(&error))).filter(|n| n.is_finite()),
        }
    }
}
