//! When a snapshot is kept: the rules of the field.

use serde::{Deserialize, Serialize};

/// When the robot keeps a snapshot on its way. All rules but `waypoints` keep one at the latest after [`MOST_M`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum SnapshotRule {
    /// After a distance, m, or a turn, rad.
    Every {
        /// Distance, m.
        distance_m: f64,
        /// Turn, rad.
        turn_rad: f64,
    },
    /// When odometry may have strayed by this share of the catchment, which is taken to reach as far as a quarter of the median range
    /// of what is seen (van Dijk, De Wagter and de Croon 2024).
    Drift {
        /// Share of the catchment.
        share: f64,
    },
    /// When less than this share of the last snapshot's features is still followed (Argyros and others 2005).
    Shared {
        /// Share of the features.
        share: f64,
    },
    /// When bearings have changed by so much since the last snapshot, in the mean and apart from the turn: the edge of the locale, where
    /// the homing vector is another one (Vardy; Smith and others 2007).
    Locale {
        /// Mean change of bearing, rad.
        change_rad: f64,
    },
    /// At the way-points that the teacher names and nowhere else.
    Waypoints,
}

/// Turn after which `every` keeps a snapshot, for each metre of its distance, rad.
const TURN_RAD_M: f64 = 0.7;
/// Farthest between two snapshots for all rules that go by what is seen, m.
pub const MOST_M: f64 = 4.0;

impl SnapshotRule {
    /// The usual numbers of each rule, by name.
    ///
    /// # Errors
    /// When there is no rule of this name.
    pub fn named(name: &str) -> crate::Result<Self> {
        let all = [
            Self::Every { distance_m: 0.5, turn_rad: 0.35 },
            Self::Drift { share: 0.2 },
            Self::Shared { share: 0.5 },
            Self::Locale { change_rad: 0.12 },
            Self::Waypoints,
        ];
        all.into_iter().find(|rule| rule.name() == name).ok_or_else(|| crate::Error::Invalid {
            what: "rule for snapshots".into(),
            found: format!("`{name}`"),
            allowed: "every, drift, shared, locale, waypoints".into(),
        })
    }

    /// The same rule with another number: the distance, the share or the change that it goes by.
    ///
    /// # Errors
    /// For a rule without one.
    pub fn with(self, number: f64) -> crate::Result<Self> {
        Ok(match self {
            Self::Every { .. } => Self::Every { distance_m: number, turn_rad: TURN_RAD_M * number },
            Self::Drift { .. } => Self::Drift { share: number },
            Self::Shared { .. } => Self::Shared { share: number },
            Self::Locale { .. } => Self::Locale { change_rad: number },
            Self::Waypoints => {
                return Err(crate::Error::Invalid {
                    what: "number of the rule `waypoints`".into(),
                    found: number.to_string(),
                    allowed: "none: it goes by the way-points".into(),
                });
            }
        })
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Every { .. } => "every",
            Self::Drift { .. } => "drift",
            Self::Shared { .. } => "shared",
            Self::Locale { .. } => "locale",
            Self::Waypoints => "waypoints",
        }
    }

    /// Whether a snapshot is due.
    #[must_use]
    pub fn is_due(&self, since: &Since) -> bool {
        match *self {
            Self::Every { distance_m, turn_rad } => since.distance_m >= distance_m || since.turn_rad.abs() >= turn_rad,
            Self::Waypoints => since.at_waypoint,
            _ if since.distance_m >= MOST_M => true,
            Self::Drift { share } => since.drift_m >= share * 0.25 * since.range_m.unwrap_or(2.0),
            Self::Shared { share } => since.shared < share,
            Self::Locale { change_rad } => since.change_rad >= change_rad,
        }
    }
}

/// What has happened since the last snapshot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Since {
    /// Way by odometry, m.
    pub distance_m: f64,
    /// Turn by odometry, rad.
    pub turn_rad: f64,
    /// Standard deviation of odometry on the way, m.
    pub drift_m: f64,
    /// Median range of the features in sight, as far as their bearings tell it, m.
    pub range_m: Option<f64>,
    /// Share of the last snapshot's features that are still followed.
    pub shared: f64,
    /// Mean change of bearing of those, apart from the turn, rad.
    pub change_rad: f64,
    /// Whether the teacher says that here is a way-point.
    pub at_waypoint: bool,
}
