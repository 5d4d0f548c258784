//! What a run says: the one row that tables are made of.

use strum::{Display, EnumString};

use crate::episode::{Outcome, Summary};

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

/// Writes [`RunRow`] from one list of its numbers: each with its name, which tables call its column, what it is, and where a summary
/// has it.
macro_rules! run_row {
    (reals { $($real:ident, $real_is:literal, $real_of:expr;)+ } ints { $($int:ident, $int_is:literal, $int_of:expr;)+ }) => {
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
            $(#[doc = $real_is] pub $real: Option<f64>,)+
            $(#[doc = $int_is] pub $int: Option<i64>,)+
            /// What rendered: `cpu` or `gpu`.
            pub renderer: Option<String>,
        }

        impl From<&Summary> for RunRow {
            fn from(s: &Summary) -> Self {
                Self {
                    seed: s.seed,
                    outcome: s.outcome.into(),
                    reason: reason(s),
                    claimed_home: Some(s.claimed_home),
                    $($real: real($real_of)(s),)+
                    $($int: Some($int_of(s) as i64),)+
                    renderer: s.renderer.as_ref().map(|r| r.kind.clone()),
                }
            }
        }

        /// The real numbers by column, and the whole ones.
        pub(super) const REALS: &[(&str, Field<f64>)] = &[$((stringify!($real), |r| &mut r.$real),)+];
        pub(super) const INTS: &[(&str, Field<i64>)] = &[$((stringify!($int), |r| &mut r.$int),)+];
    };
}

/// A number of a run, to be read or set.
pub(super) type Field<T> = fn(&mut RunRow) -> &mut Option<T>;

run_row! {
    reals {
        final_distance_m, "Distance from home at rest, m.", |s| s.final_distance_m;
        final_heading_error_rad, "Heading at rest against that of home, rad.", |s| s.final_heading_error_rad;
        time_s, "When it ended, s.", |s| s.time_s;
        straight_line_time_s, "Time straight ahead to the arrival radius, s.", |s| s.straight_line_time_s;
        time_ratio, "The one over the other, of runs that reached home.", |s| s.time_ratio;
        path_length_m, "Length of the true path, m.", |s| s.path_length_m;
        initial_distance_m, "Distance from home at the start, m.", |s| s.start_distance_m;
        start_x_m, "x of the start in the room, m.", |s| s.start.x;
        start_y_m, "y of the start in the room, m.", |s| s.start.y;
        start_heading_rad, "Heading at the start in the room, rad.", |s| s.start.heading;
        odometry_drift_m, "Distance at the end between odometry alone and the truth, m.", |s| s.odometry_drift_m;
        range_error_m, "Error of the last estimate's range, m.", |s| s.estimate.map(|e| e.range_error_m);
        bearing_error_rad, "Error of its bearing from home, rad.", |s| s.estimate.map(|e| e.bearing_error_rad);
        heading_error_rad, "Error of its heading, rad.", |s| s.estimate.map(|e| e.heading_error_rad);
        range_rmse_m, "Root mean square error of range over all estimates, m.", |s| s.estimate.map(|e| e.range_rmse_m);
        bearing_rmse_rad, "The same of bearing, rad.", |s| s.estimate.map(|e| e.bearing_rmse_rad);
        heading_rmse_rad, "The same of heading, rad.", |s| s.estimate.map(|e| e.heading_rmse_rad);
        nees, "Mean normalised estimation error squared; 3 is consistent.", |s| s.estimate.and_then(|e| e.nees);
        seen_mean, "Bearings a step that the sensor gave.", |s| s.landmarks.seen_mean;
        matched_mean, "Bearings a step that the method used.", |s| s.landmarks.matched_mean;
        rejected_mean, "Bearings a step that the method refused.", |s| s.landmarks.rejected_mean;
    }
    ints {
        collisions, "Contacts with walls and bodies.", |s: &Summary| s.collisions;
        home_landmarks, "Bearings in the home snapshot.", |s: &Summary| s.landmarks.home;
        steps, "Control steps until the method stopped.", |s: &Summary| s.steps;
    }
}

/// A number of a summary, where it is one.
fn real<N: Into<Option<f64>>>(of: fn(&Summary) -> N) -> impl Fn(&Summary) -> Option<f64> {
    move |summary| of(summary).into().filter(|value| value.is_finite())
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
