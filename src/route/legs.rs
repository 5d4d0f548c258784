//! Legs by a homing method of any kind: each snapshot is home for a while, and the next one takes its place before it is reached.
//!
//! The method gets what it gets in a single run: the bearings of the snapshot, and bearings of the same features now, which are looked
//! for where the last leg and odometry have them. Whether a snapshot is passed is told by the average landmark vector, which then points back.

use crate::error::Result;
use crate::geometry::{Pose, Vector2, angle_of, direction, wrap};
use crate::method::{self, MethodKind, MethodOptions};
use crate::observation::{
    Bearing, Briefing, Decision, HomeSnapshot, LandmarkId, Method, Observation, RobotSheet, Status, TaskSheet,
};
use crate::vision::view::{Expected, ViewFeature, ViewFinder};

/// Fewest matches that tell anything of a snapshot.
const FEWEST: usize = 8;
/// Standard deviation of bearings as they are stated to methods, rad.
const SD_RAD: f64 = 0.006;
/// Half width of the window in which a feature is looked for, rad: at the snapshot, a metre off, and at most.
const WINDOW: (f64, f64, f64) = (0.08, 0.4, 0.5);
/// Factor by which a feature's size may have changed, at the snapshot, and more a metre off.
const ZOOM: (f64, f64) = (1.25, 0.4);
/// Pictures in a row that tell nothing, after which the robot is lost.
const PATIENCE: u32 = 60;

/// A leg: a method on its way to a snapshot.
pub(super) struct Leg {
    features: Vec<ViewFeature>,
    method: Box<dyn Method>,
    /// Direction of travel at the snapshot, in its frame.
    travel: Vector2<f64>,
    /// Methods that filter are shown each picture once, those that do not remember see its bearings turned until the next.
    remembers: bool,
    bearings: Vec<Bearing>,
}

/// What is known of a leg's snapshot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    /// Features found again.
    pub matched: usize,
    /// Heading of the robot in the snapshot's frame, rad.
    pub heading_rad: f64,
    /// Whether the snapshot lies behind.
    pub is_passed: bool,
}

impl Leg {
    pub fn new(
        kind: &MethodKind,
        features: Vec<ViewFeature>,
        travel_rad: f64,
        (robot, task): (RobotSheet, TaskSheet),
    ) -> Result<Self> {
        let bearing =
            |(k, f): (usize, &ViewFeature)| Bearing { id: LandmarkId(k as u32), azimuth_rad: f.azimuth_rad, sd_rad: SD_RAD };
        let home = HomeSnapshot { bearings: features.iter().enumerate().map(bearing).collect() };
        let briefing = Briefing { home, robot, task, compass: false, camera: None };
        Ok(Self {
            features,
            method: method::build(kind.clone(), &MethodOptions::default(), briefing)?,
            travel: direction(travel_rad),
            remembers: !matches!(kind, MethodKind::Alv | MethodKind::TronDaniilidis | MethodKind::Weber | MethodKind::Ibvs),
            bearings: Vec::new(),
        })
    }

    /// Looks for the snapshot's features in a new picture, where the last leg and odometry have them: `pose` is the robot's in the
    /// snapshot's frame, by these.
    pub fn look(&mut self, finder: &ViewFinder, pose: &Pose) -> Option<Seen> {
        self.bearings.clear();
        let distance_m = pose.position().norm();
        let view = finder.view();
        let mut taken = vec![false; view.len()];
        let mut sum = Vector2::zeros();
        for (k, feature) in self.features.iter().enumerate() {
            let expected = Expected {
                azimuth_rad: wrap(feature.azimuth_rad - pose.heading),
                window_rad: (WINDOW.0 + WINDOW.1 * distance_m).min(WINDOW.2),
                zoom: 1.0,
                zoom_slack: ZOOM.0 + ZOOM.1 * distance_m.min(1.0),
            };
            let Some(found) = finder.find(feature, &expected).filter(|found| !taken[found.now]) else { continue };
            taken[found.now] = true;
            let azimuth_rad = view[found.now].azimuth_rad;
            sum += direction(feature.azimuth_rad - azimuth_rad);
            self.bearings.push(Bearing { id: LandmarkId(k as u32), azimuth_rad, sd_rad: SD_RAD });
        }
        if self.bearings.len() < FEWEST {
            self.bearings.clear();
            return None;
        }
        let heading_rad = angle_of(sum);
        let difference =
            |b: &Bearing| direction(b.azimuth_rad + heading_rad) - direction(self.features[b.id.0 as usize].azimuth_rad);
        let vector: Vector2<f64> = self.bearings.iter().map(difference).sum();
        Some(Seen { matched: self.bearings.len(), heading_rad, is_passed: vector.dot(&self.travel) <= 0.0 })
    }

    /// What the method decides.
    pub fn decide(&mut self, observation: &Observation<'_>, is_new: bool) -> Decision {
        if !is_new {
            let turned = observation.odometry.twist.omega * observation.odometry.dt_s;
            self.bearings.iter_mut().for_each(|bearing| bearing.azimuth_rad = wrap(bearing.azimuth_rad - turned));
        }
        let bearings = if is_new || !self.remembers { self.bearings.as_slice() } else { &[] };
        self.method.step(&Observation { bearings, alternatives: &[], ..*observation })
    }
}

/// Pictures that told nothing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Doubts(u32);

impl Doubts {
    /// Counts a picture, and says whether the robot is lost.
    pub fn count(&mut self, seen: Option<&Seen>) -> bool {
        self.0 = if seen.is_some() { 0 } else { self.0 + 1 };
        self.0 > PATIENCE
    }
}

/// What a decision of a method means for the leg to the last snapshot.
pub(super) fn is_over(decision: &Decision, seen: Option<&Seen>) -> bool {
    decision.status == Status::Arrived || seen.is_some_and(|seen| seen.is_passed)
}
