//! What a robot keeps of a route: snapshots along a path that its odometry measured.
//!
//! A [`Route`] holds bearings and descriptors of features, where odometry had the robot when it saw them, and the path in between by
//! odometry. It holds no truth and no picture. Features that were followed from one snapshot to the next share a track: from the
//! odometry between and the change of bearing the repeat learns how far away they are.

use crate::geometry::{Pose, Vector2, angle_of, wrap};
use crate::panorama::Projection;
use crate::vision::view::ViewFeature;

use super::rule::SnapshotRule;

/// A feature of a snapshot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeptFeature {
    /// What it looks like and where it is seen.
    pub feature: ViewFeature,
    /// The track that it is part of: sightings of one track are of one thing.
    pub track: u32,
}

/// What was seen from one place of a route.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Node of the path at which it was taken.
    pub node: usize,
    /// Its features.
    pub features: Vec<KeptFeature>,
}

/// What of the world and the camera a route depends on: a repeat with others is refused.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RouteSheet {
    /// Name of the world.
    pub world: String,
    /// SHA-256 of the world file.
    pub world_sha256: String,
    /// Size and projection of the panoramas.
    pub projection: Projection,
    /// Position of the camera from the middle of the axle, forward and left, m.
    pub camera_offset_m: [f64; 2],
    /// When snapshots were taken.
    pub rule: SnapshotRule,
}

/// A taught route.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// What it depends on.
    pub sheet: RouteSheet,
    /// Poses of the middle of the axle by odometry from the start on, which is the origin.
    pub path: Vec<Pose>,
    /// Snapshots in the order of the path; the first at its first node, the last at its last.
    pub snapshots: Vec<Snapshot>,
}

impl Route {
    /// Length of the path by odometry, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.path.windows(2).map(|pair| (pair[1].position() - pair[0].position()).norm()).sum()
    }

    /// Pose at which a snapshot was taken, by odometry.
    #[must_use]
    pub fn pose(&self, snapshot: usize) -> Pose {
        self.path[self.snapshots[snapshot].node]
    }

    /// Features of all snapshots together.
    #[must_use]
    pub fn features(&self) -> usize {
        self.snapshots.iter().map(|snapshot| snapshot.features.len()).sum()
    }
}

/// A line through points, by the distance along it.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    points: Vec<Vector2<f64>>,
    along_m: Vec<f64>,
    /// Where it turns back on itself, distances along it, m.
    turns: Vec<f64>,
}

/// A place beside a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// Distance along the line of the nearest point, m.
    pub along_m: f64,
    /// Distance from it, m; positive to the left.
    pub offset_m: f64,
    /// Direction of the line there, rad.
    pub direction_rad: f64,
}

impl Line {
    /// The line through the positions of `poses`.
    #[must_use]
    pub fn new(poses: impl IntoIterator<Item = Vector2<f64>>) -> Self {
        let points: Vec<Vector2<f64>> = poses.into_iter().collect();
        let mut along_m = Vec::with_capacity(points.len());
        let mut sum = 0.0;
        for (k, point) in points.iter().enumerate() {
            if k > 0 {
                sum += (point - points[k - 1]).norm();
            }
            along_m.push(sum);
        }
        let mut line = Self { points, along_m, turns: Vec::new() };
        line.turns = line.find_turns();
        line
    }

    /// Where it turns back on itself.
    fn find_turns(&self) -> Vec<f64> {
        let sharpness = |s: f64| {
            let (before, after) = (self.at(s) - self.at(s - TIP_M), self.at(s + TIP_M) - self.at(s));
            wrap(angle_of(after) - angle_of(before)).abs()
        };
        let inner = self.along_m.iter().filter(|s| **s > TIP_M && **s < self.length_m() - TIP_M);
        let mut turns: Vec<(f64, f64)> = Vec::new();
        for (s, sharp) in inner.map(|s| (*s, sharpness(*s))).filter(|(_, sharp)| *sharp > SHARP_RAD) {
            match turns.last_mut() {
                Some(last) if s - last.0 < 3.0 * TIP_M => {
                    if sharp > last.1 {
                        *last = (s, sharp);
                    }
                }
                _ => turns.push((s, sharp)),
            }
        }
        turns.into_iter().map(|(s, _)| s).collect()
    }

    /// The stretch around a place on which the line does not turn back on itself. Two centimetres before a turn it is the next one.
    #[must_use]
    pub fn stretch(&self, along_m: f64) -> (f64, f64) {
        let k = self.turns.partition_point(|turn| *turn <= along_m + PASSED_M);
        let from = if k == 0 { 0.0 } else { self.turns[k - 1] };
        (from, self.turns.get(k).copied().unwrap_or(self.length_m()))
    }

    /// Its length, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.along_m.last().copied().unwrap_or(0.0)
    }

    /// Distance along it of its point number `k`, m.
    #[must_use]
    pub fn along_m(&self, k: usize) -> f64 {
        self.along_m[k]
    }

    /// The piece that holds the place at a distance along it, and the share of the piece.
    fn piece(&self, along_m: f64) -> (usize, f64) {
        let last = self.points.len().saturating_sub(2);
        let k = self.along_m.partition_point(|s| *s <= along_m).saturating_sub(1).min(last);
        let length = self.along_m.get(k + 1).copied().unwrap_or(0.0) - self.along_m[k];
        (k, if length > 0.0 { ((along_m - self.along_m[k]) / length).clamp(0.0, 1.0) } else { 0.0 })
    }

    /// The point at a distance along it.
    #[must_use]
    pub fn at(&self, along_m: f64) -> Vector2<f64> {
        let (k, share) = self.piece(along_m);
        match self.points.get(k + 1) {
            Some(next) => self.points[k] + (next - self.points[k]) * share,
            None => self.points[k],
        }
    }

    /// Its direction over a stretch around a place, rad.
    #[must_use]
    pub fn direction_rad(&self, along_m: f64) -> f64 {
        let (from, to) = self.stretch(along_m);
        let chord = self.at((along_m + SMOOTH_M).min(to)) - self.at((along_m - SMOOTH_M).max(from));
        angle_of(chord)
    }

    /// Its curvature around a place, 1/m.
    #[must_use]
    pub fn curvature(&self, along_m: f64) -> f64 {
        let (from, to) = self.stretch(along_m);
        let ahead = self.direction_rad((along_m + SMOOTH_M).min(to - PASSED_M - 1e-6).max(from));
        let turn = wrap(ahead - self.direction_rad((along_m - SMOOTH_M).max(from)));
        turn / (2.0 * SMOOTH_M)
    }

    /// The nearest place on the stretch from `from_m` to `to_m`.
    #[must_use]
    pub fn nearest(&self, point: Vector2<f64>, from_m: f64, to_m: f64) -> Beside {
        let (first, _) = self.piece(from_m.max(0.0));
        let (last, _) = self.piece(to_m.min(self.length_m()));
        let mut best: Option<(f64, f64)> = None;
        for k in first..=last {
            let Some(next) = self.points.get(k + 1) else { continue };
            let edge = next - self.points[k];
            let length = edge.norm();
            if length == 0.0 {
                continue;
            }
            let [low, high] = [from_m, to_m].map(|m| ((m - self.along_m[k]) / length).clamp(0.0, 1.0));
            let share = ((point - self.points[k]).dot(&edge) / (length * length)).clamp(low, high);
            let gap = (point - self.points[k] - edge * share).norm();
            if best.is_none_or(|(least, _)| gap < least) {
                best = Some((gap, self.along_m[k] + share * length));
            }
        }
        let along_m = best.map_or(from_m.clamp(0.0, self.length_m()), |(_, along)| along);
        let direction_rad = self.direction_rad(along_m);
        let to = point - self.at(along_m);
        let offset_m = crate::geometry::cross(crate::geometry::direction(direction_rad), to);
        Beside { along_m, offset_m: offset_m.signum() * to.norm(), direction_rad }
    }

    /// Distance along `other`, whose points belong to this line's, of the place that is `along_m` along this one.
    #[must_use]
    pub fn share_along(&self, along_m: f64, other: &Self) -> f64 {
        let (k, share) = self.piece(along_m);
        let (from, to) = (other.along_m[k], other.along_m.get(k + 1).copied().unwrap_or(other.along_m[k]));
        from + share * (to - from)
    }

    /// The same line the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self::new(self.points.iter().rev().copied())
    }
}

/// Directions are taken over this far to either side, m: nodes are rounded to half a millimetre.
const SMOOTH_M: f64 = 0.08;
/// A line turns back on itself where its directions over this far before and behind, m, ...
const TIP_M: f64 = 0.12;
/// ... differ by more than this, rad.
const SHARP_RAD: f64 = 2.0;
/// A turn is passed this far before it, m.
pub(super) const PASSED_M: f64 = 0.02;
