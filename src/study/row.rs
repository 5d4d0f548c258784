//! What a run says: the one row that tables are made of.

use strum::{Display, EnumString};

use crate::episode::{EstimateErrors, Outcome, Summary};

/// How a run ended, or why it has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display, EnumString)]
#[strum(serialize_all = "lowercase")]
pub enum Ending {
    /// As [`Outcome::Home`].
    Home,
    /// As [`Outcome::Timeout`].
    Timeout,
    /// As [`Outcome::Lost`].
    Lost,
    /// As [`Outcome::Stuck`].
    Stuck,
    /// As [`Outcome::Failed`].
    Failed,
    /// The run panicked.
    Panic,
    /// The run could not be run.
    #[default]
    Error,
}

impl From<Outcome> for Ending {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Home => Self::Home,
            Outcome::Timeout => Self::Timeout,
            Outcome::Lost => Self::Lost,
            Outcome::Stuck => Self::Stuck,
            Outcome::Failed => Self::Failed,
        }
    }
}

/// One run in numbers, those of its [`Summary`]; `None` where the run has no such number.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunRow {
    /// Seed.
    pub seed: u64,
    /// How it ended.
    pub outcome: Ending,
    /// Why it did not end at home; empty where it did.
    pub reason: String,
    /// Whether the method claimed to be home, rightly or not.
    pub claimed_home: Option<bool>,
    /// Distance from home at the start, m.
    pub start_distance_m: Option<f64>,
    /// x of the start in the room, m.
    pub start_x_m: Option<f64>,
    /// y of the start in the room, m.
    pub start_y_m: Option<f64>,
    /// Heading at the start in the room, rad.
    pub start_heading_rad: Option<f64>,
    /// Distance from home at rest, m.
    pub final_distance_m: Option<f64>,
    /// Heading at rest against that of home, rad.
    pub final_heading_error_rad: Option<f64>,
    /// When it ended, s.
    pub time_s: Option<f64>,
    /// Time straight ahead to the arrival radius, s.
    pub straight_line_time_s: Option<f64>,
    /// The one over the other, of runs that reached home.
    pub time_ratio: Option<f64>,
    /// Length of the true path, m.
    pub path_length_m: Option<f64>,
    /// Distance at the end between odometry alone and the truth, m.
    pub odometry_drift_m: Option<f64>,
    /// Contacts with walls and bodies.
    pub collisions: Option<i64>,
    /// Error of the last estimate's range, m.
    pub range_error_m: Option<f64>,
    /// Error of its bearing from home, rad.
    pub bearing_error_rad: Option<f64>,
    /// Error of its heading, rad.
    pub heading_error_rad: Option<f64>,
    /// Root mean square error of range over all estimates, m.
    pub range_rmse_m: Option<f64>,
    /// The same of bearing, rad.
    pub bearing_rmse_rad: Option<f64>,
    /// The same of heading, rad.
    pub heading_rmse_rad: Option<f64>,
    /// Mean normalised estimation error squared; 3 is consistent.
    pub nees: Option<f64>,
    /// Bearings in the home snapshot.
    pub home_landmarks: Option<i64>,
    /// Bearings a step that the sensor gave.
    pub seen_mean: Option<f64>,
    /// Bearings a step that the method used.
    pub matched_mean: Option<f64>,
    /// Bearings a step that the method refused.
    pub rejected_mean: Option<f64>,
    /// Control steps until the method stopped.
    pub steps: Option<i64>,
    /// What rendered: `cpu` or `gpu`.
    pub renderer: Option<String>,
}

impl From<&Summary> for RunRow {
    fn from(s: &Summary) -> Self {
        let finite = |value: f64| Some(value).filter(|v| v.is_finite());
        let estimate = |of: fn(&EstimateErrors) -> f64| s.estimate.as_ref().and_then(|e| finite(of(e)));
        Self {
            seed: s.seed,
            outcome: s.outcome.into(),
            reason: reason(s),
            claimed_home: Some(s.claimed_home),
            start_distance_m: finite(s.start_distance_m),
            start_x_m: finite(s.start.x_m),
            start_y_m: finite(s.start.y_m),
            start_heading_rad: finite(s.start.heading_rad),
            final_distance_m: finite(s.final_distance_m),
            final_heading_error_rad: finite(s.final_heading_error_rad),
            time_s: finite(s.time_s),
            straight_line_time_s: s.straight_line_time_s.and_then(finite),
            time_ratio: s.time_ratio.and_then(finite),
            path_length_m: finite(s.path_length_m),
            odometry_drift_m: finite(s.odometry_drift_m),
            collisions: Some(s.collisions as i64),
            range_error_m: estimate(|e| e.range_error_m),
            bearing_error_rad: estimate(|e| e.bearing_error_rad),
            heading_error_rad: estimate(|e| e.heading_error_rad),
            range_rmse_m: estimate(|e| e.range_rmse_m),
            bearing_rmse_rad: estimate(|e| e.bearing_rmse_rad),
            heading_rmse_rad: estimate(|e| e.heading_rmse_rad),
            nees: s.estimate.as_ref().and_then(|e| e.nees).and_then(finite),
            home_landmarks: Some(s.landmarks.home as i64),
            seen_mean: finite(s.landmarks.seen_mean),
            matched_mean: finite(s.landmarks.matched_mean),
            rejected_mean: finite(s.landmarks.rejected_mean),
            steps: Some(s.steps as i64),
            renderer: s.renderer.as_ref().map(|r| r.kind.clone()),
        }
    }
}

/// Why a run did not end at home, in words.
fn reason(summary: &Summary) -> String {
    match summary.outcome {
        Outcome::Home => String::new(),
        Outcome::Timeout => format!("{:.1} m from home at the time limit", summary.final_distance_m),
        Outcome::Lost if summary.is_wrong_claim() => {
            format!("claimed to be home {:.1} cm from it", 100.0 * summary.final_distance_m)
        }
        Outcome::Lost => "the method gave up".to_owned(),
        Outcome::Stuck => match summary.collision_list.last() {
            Some(hit) => format!("did not move although told to; last ran into {}", hit.with),
            None => "did not move although told to".to_owned(),
        },
        Outcome::Failed => summary.failure.clone().unwrap_or_else(|| "the method failed".to_owned()),
    }
}

impl RunRow {
    /// Whether the robot came home.
    pub fn is_home(&self) -> bool {
        self.outcome == Ending::Home
    }

    /// As [`Summary::is_wrong_claim`].
    pub fn is_wrong_claim(&self) -> bool {
        self.claimed_home == Some(true) && !self.is_home()
    }
}
