//! The robot that is being taught: what it keeps of what it sees and of its odometry.

use std::collections::BTreeMap;

use crate::geometry::{Pose, wrap};
use crate::observation::Observation;
use crate::panorama::{Panorama, Projection};
use crate::vision::ExtractorSettings;
use crate::vision::view::{Expected, ViewFeature, ViewFinder};

use super::chart::{KeptFeature, Route, RouteSheet, Snapshot};
use super::rule::{Since, SnapshotRule};

/// Features looked for in a picture.
pub const FEATURES: usize = 300;
/// Nodes of the path are kept where the robot has turned by so much, rad, at the latest.
const NODE_RAD: f64 = 0.15;
/// Half width of the window in which a followed feature is looked for again, rad.
const WINDOW_RAD: f64 = 0.09;
/// Pictures for which a followed feature may be out of sight.
const PATIENCE: u32 = 2;
/// Noise of odometry as a share of the way, for the rule that goes by drift.
const DRIFT_SHARE: f64 = 0.05;

/// A feature that is followed.
#[derive(Debug, Clone, Copy)]
struct Followed {
    feature: ViewFeature,
    track: u32,
    /// Heading of the robot when it was last seen, by odometry, rad.
    heading_rad: f64,
    missed: u32,
    /// Pictures in which it was seen.
    age: u32,
    /// Where and in what direction it was first seen, by odometry.
    first: (Pose, f64),
}

/// Learns a route from observations with panoramas.
pub struct Learner {
    rule: SnapshotRule,
    most_features: usize,
    node_m: f64,
    finder: ViewFinder,
    pose: Pose,
    followed: Vec<Followed>,
    next_track: u32,
    path: Vec<Pose>,
    snapshots: Vec<Snapshot>,
    since: Since,
    /// Of the last snapshot: its tracks, with the direction in which each was seen.
    last: BTreeMap<u32, f64>,
    picture: Panorama,
    at_waypoint: bool,
}

impl Learner {
    /// One that keeps snapshots of at most `most_features` features by `rule`, and nodes of the path `node_m` apart.
    #[must_use]
    pub fn new(rule: SnapshotRule, most_features: usize, node_m: f64) -> Self {
        Self {
            rule,
            most_features,
            node_m,
            finder: ViewFinder::new(ExtractorSettings::default(), FEATURES),
            pose: Pose::IDENTITY,
            followed: Vec::new(),
            next_track: 0,
            path: Vec::new(),
            snapshots: Vec::new(),
            since: Since::default(),
            last: BTreeMap::new(),
            picture: Panorama::empty(),
            at_waypoint: false,
        }
    }

    /// The teacher says that here is a way-point.
    pub fn waypoint(&mut self) {
        self.at_waypoint = true;
    }

    /// Nodes of the path so far: its teacher may note what he knows of the newest.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.path.len()
    }

    /// Takes in one observation. Nothing is learned from one without a panorama but the way.
    pub fn step(&mut self, observation: &Observation<'_>) {
        let (twist, dt_s) = (observation.odometry.twist, observation.odometry.dt_s);
        self.pose = self.pose.advanced(twist, dt_s);
        self.since.distance_m += twist.v.abs() * dt_s;
        self.since.turn_rad += twist.omega * dt_s;
        self.since.drift_m += DRIFT_SHARE * twist.v.abs() * dt_s;
        let Some(picture) = observation.panorama else { return };
        self.picture.projection = picture.projection;
        self.picture.rgba.clear();
        self.picture.rgba.extend_from_slice(picture.rgba);
        self.follow();
        let is_first = self.path.is_empty();
        self.describe_change();
        let due = is_first || self.rule.is_due(&self.since);
        let node_due = self.path.last().is_none_or(|last| {
            (self.pose.position() - last.position()).norm() >= self.node_m
                || wrap(self.pose.heading - last.heading).abs() >= NODE_RAD
        });
        if due || node_due {
            self.path.push(self.pose);
        }
        if due {
            self.keep();
        }
    }

    /// Finds the followed features in the new picture, and begins to follow the others.
    fn follow(&mut self) {
        let view: Vec<ViewFeature> = self.finder.look(&self.picture).to_vec();
        let mut taken = vec![false; view.len()];
        let heading_rad = self.pose.heading;
        for followed in &mut self.followed {
            let azimuth_rad = wrap(followed.feature.azimuth_rad - wrap(heading_rad - followed.heading_rad));
            let slack = f64::from(followed.missed);
            let window_rad = WINDOW_RAD * (1.0 + 0.5 * slack);
            let expected = Expected { azimuth_rad, window_rad, zoom: 1.0, zoom_slack: 1.2 + 0.1 * slack };
            match self.finder.find(&followed.feature, &expected).filter(|sighted| !taken[sighted.now]) {
                Some(sighted) => {
                    taken[sighted.now] = true;
                    *followed =
                        Followed { feature: view[sighted.now], heading_rad, missed: 0, age: followed.age + 1, ..*followed };
                }
                None => followed.missed += 1,
            }
        }
        self.followed.retain(|followed| followed.missed <= PATIENCE);
        for (feature, _) in view.iter().zip(&taken).filter(|(_, taken)| !**taken) {
            let first = (self.pose, wrap(feature.azimuth_rad + heading_rad));
            let track = self.next_track;
            self.next_track += 1;
            self.followed.push(Followed { feature: *feature, track, heading_rad, missed: 0, age: 1, first });
        }
    }

    /// What has changed since the last snapshot, as far as the rules ask for it.
    fn describe_change(&mut self) {
        self.since.at_waypoint = std::mem::take(&mut self.at_waypoint) || self.since.at_waypoint;
        let seen = |f: &Followed| wrap(f.feature.azimuth_rad + f.heading_rad);
        let changes: Vec<f64> =
            self.followed.iter().filter_map(|f| Some(wrap(seen(f) - self.last.get(&f.track)?).abs())).collect();
        self.since.shared = changes.len() as f64 / self.last.len().max(1) as f64;
        self.since.change_rad = crate::statistics::mean(changes).unwrap_or(0.0);
        let range = |f: &Followed| {
            let (from, direction_rad) = f.first;
            let moved = self.pose.position() - from.position();
            let (now, before) = (crate::geometry::direction(seen(f)), crate::geometry::direction(direction_rad));
            let parallax = crate::geometry::cross(now, before);
            (parallax.abs() > 0.05).then(|| (crate::geometry::cross(moved, before) / parallax).abs())
        };
        let ranges: Vec<f64> = self.followed.iter().filter_map(range).collect();
        self.since.range_m = crate::statistics::quantile(&ranges, 0.5).or(self.since.range_m);
    }

    /// Keeps a snapshot of what is in sight.
    fn keep(&mut self) {
        let mut seen: Vec<&Followed> = self.followed.iter().filter(|f| f.missed == 0).collect();
        // Those that have proved to last, and of them the strongest.
        seen.sort_by(|a, b| {
            let worth = |f: &Followed| f64::from(f.age.min(8)) * libm::sqrt(f.feature.strength + 1.0);
            worth(b).total_cmp(&worth(a)).then(a.track.cmp(&b.track))
        });
        seen.truncate(self.most_features);
        seen.sort_by(|a, b| a.feature.azimuth_rad.total_cmp(&b.feature.azimuth_rad).then(a.track.cmp(&b.track)));
        self.last = seen.iter().map(|f| (f.track, wrap(f.feature.azimuth_rad + f.heading_rad))).collect();
        let features = seen.iter().map(|f| KeptFeature { feature: f.feature, track: f.track }).collect();
        self.snapshots.push(Snapshot { node: self.path.len() - 1, features });
        self.since = Since { range_m: self.since.range_m, ..Since::default() };
    }

    /// Numbers the tracks that snapshots hold from 0 on.
    fn number_tracks(&mut self) {
        let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
        for kept in self.snapshots.iter_mut().flat_map(|snapshot| &mut snapshot.features) {
            let next = numbers.len() as u32;
            kept.track = *numbers.entry(kept.track).or_insert(next);
        }
    }

    /// The route, with a snapshot of the place where it ends.
    #[must_use]
    pub fn finish(mut self, projection: Projection, world: (&str, &str), camera_offset_m: [f64; 2]) -> Route {
        if self.path.last() != Some(&self.pose) {
            self.path.push(self.pose);
        }
        if self.snapshots.last().is_none_or(|last| last.node + 1 != self.path.len()) {
            self.keep();
        }
        self.number_tracks();
        let sheet = RouteSheet {
            world: world.0.to_owned(),
            world_sha256: world.1.to_owned(),
            projection,
            camera_offset_m,
            rule: self.rule,
        };
        Route { sheet, path: self.path, snapshots: self.snapshots }
    }
}
