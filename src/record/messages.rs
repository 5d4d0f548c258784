//! The project's poses and colours as Foxglove's messages have them, and the messages that Foxglove has no schema for.

use foxglove::messages::{Color, Odometry, Point3, Pose as FoxglovePose, Quaternion, Timestamp, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use crate::draw::map::paint;
use crate::episode::{Belief, Step};
use crate::geometry::{Pose, Twist, Vector2, sin_cos};
use crate::observation::Estimate;

/// Nanoseconds of a simulated time, from 0 on.
pub(super) fn nanoseconds(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}

pub(super) fn timestamp(time_ns: u64) -> Timestamp {
    let seconds = u32::try_from(time_ns / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (time_ns % 1_000_000_000) as u32)
}

pub(super) fn vector(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

pub(super) fn point(p: Vector2<f64>, z: f64) -> Point3 {
    Point3 { x: p.x, y: p.y, z }
}

/// A turn around the vertical.
pub(super) fn turn(heading_rad: f64) -> Quaternion {
    let (z, w) = sin_cos(0.5 * heading_rad);
    Quaternion { x: 0.0, y: 0.0, z, w }
}

pub(super) fn pose(pose: &Pose, z: f64) -> FoxglovePose {
    FoxglovePose { position: Some(vector(pose.x, pose.y, z)), orientation: Some(turn(pose.heading)) }
}

/// A colour from the `#rrggbb` that drawings have.
pub(super) fn colour(hex: &str, opacity: f64) -> Color {
    let [r, g, b] = paint::rgb(hex).map(|c| f64::from(c) / 255.0);
    Color { r, g, b, a: opacity }
}

/// Where a body is by wheel odometry, with the speeds that it measured.
pub(super) fn odometry(time_ns: u64, frame: &str, place: &Pose, twist: Twist) -> Odometry {
    Odometry {
        timestamp: Some(timestamp(time_ns)),
        frame_id: frame.to_owned(),
        body_frame_id: "base_link".to_owned(),
        pose: Some(pose(place, 0.0)),
        linear_velocity: Some(vector(twist.v, 0.0, 0.0)),
        angular_velocity: Some(vector(0.0, 0.0, twist.omega)),
        ..Odometry::default()
    }
}

/// A belief with its covariance.
pub(super) fn estimate(time_ns: u64, estimate: &Estimate) -> Odometry {
    let mut pose_covariance = vec![0.0; 36];
    // Rows and columns are x, y, z and the turns around x, y, z.
    let places = [0, 1, 5];
    for (row, &to_row) in places.iter().enumerate() {
        for (column, &to_column) in places.iter().enumerate() {
            pose_covariance[6 * to_row + to_column] = estimate.covariance[(row, column)];
        }
    }
    Odometry { pose_covariance, ..odometry(time_ns, "home", &estimate.pose, Twist::default()) }
}

/// Command for the interval that follows.
#[derive(Serialize, JsonSchema)]
pub(super) struct Command {
    pub v_m_s: f64,
    pub omega_rad_s: f64,
}

/// What `trajectory.csv` has beside poses.
#[derive(Serialize, JsonSchema)]
pub(super) struct Diagnostics {
    /// Bearings that the sensor gave; `null` while the robot comes to rest.
    seen: Option<usize>,
    /// Bearings that the method used.
    matched: usize,
    /// Bearings that the method refused.
    rejected: usize,
    /// Normalised innovation squared per bearing.
    nis: Option<f64>,
    slip_left_m_s: f64,
    slip_right_m_s: f64,
    /// Distance between odometry alone and the truth.
    odometry_drift_m: f64,
    /// True distance to home.
    distance_m: f64,
    range_est_m: Option<f64>,
    range_sd_m: Option<f64>,
    heading_sd_rad: Option<f64>,
    /// "searching", "homing" or "lost".
    belief: Option<&'static str>,
}

impl Diagnostics {
    pub(super) fn new(step: &Step, home: &Pose, belief: Option<Belief>) -> Self {
        let finite = |value: f64| Some(value).filter(|v| v.is_finite());
        let estimate = step.estimate.as_ref();
        Self {
            seen: step.seen,
            matched: step.matched,
            rejected: step.rejected,
            nis: finite(step.nis),
            slip_left_m_s: step.slip_m_s[0],
            slip_right_m_s: step.slip_m_s[1],
            odometry_drift_m: (step.dead_reckoned.position() - step.truth.position()).norm(),
            distance_m: (step.truth.position() - home.position()).norm(),
            range_est_m: estimate.and_then(|e| finite(e.range_m())),
            range_sd_m: estimate.and_then(|e| finite(e.range_sd_m())),
            heading_sd_rad: estimate.and_then(|e| finite(e.heading_sd_rad())),
            belief: belief.map(Belief::name),
        }
    }
}
