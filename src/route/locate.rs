//! Where the robot is along a route: odometry from step to step, bearings of the nearest snapshot's features in each picture.
//!
//! The pose is kept in the frame of one snapshot and handed over, with its covariance, to the next as that one comes nearer: the map is
//! true near each snapshot and nowhere else, and how odometry drifted on the way through the building does not matter. Features
//! are looked for where they are expected, so that doors which all look alike are told apart by where the robot is. Where too few are
//! found for too long the robot is lost, and looks at all snapshots of the route.

use nalgebra::Vector3;

use crate::geometry::{Matrix3, Pose, Vector2, atan2, direction, sin_cos, wrap};
use crate::observation::Odometry;
use crate::vision::view::{Agreement, Expected, ViewFeature, ViewFinder};

use super::chart::Route;
use super::ranges::{Landmark, landmarks};

/// Degrees of freedom of the residuals' t distribution: heavy tails, for wrong matches.
const TAIL: f64 = 4.0;
/// A residual of this many standard deviations belongs to a wrong match.
const GATE: f64 = 3.0;
/// Fewest matches that correct a pose.
const FEWEST: usize = 6;
/// Fewest of the expected landmarks, as a share, in a picture that bears the belief out.
const BORNE_OUT: f64 = 0.12;
/// Pictures in a row that do not bear the belief out, after which the robot is lost.
const PATIENCE: u32 = 12;
/// Noise of odometry: along and across as shares of the way, of the turn as a share of it and a metre, rad.
const NOISE: (f64, f64, f64, f64) = (0.06, 0.03, 0.06, 0.04);
/// However many bearings there are, their common errors leave so much of the pose open: m, rad.
const FLOOR: (f64, f64) = (0.004, 0.003);
/// Landmarks nearer than this share of their range at the snapshot look too different to be looked for.
const NEAREST: f64 = 0.25;
/// Fewest matches by which a robot that was lost believes to be somewhere again, ...
const FOUND: usize = 14;
/// ... and how many times as many as by any place elsewhere on the route, ...
const UNRIVALLED: f64 = 1.3;
/// ... which is farther off than this, m.
const ELSEWHERE_M: f64 = 2.5;

/// What a picture said.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Looked {
    /// Landmarks that were looked for.
    pub expected: usize,
    /// Landmarks found where the pose has them.
    pub matched: usize,
    /// Landmarks found elsewhere.
    pub rejected: usize,
}

/// The belief about the robot's pose.
pub struct Locator<'r> {
    route: &'r Route,
    landmarks: Vec<Vec<Landmark>>,
    camera: Pose,
    /// The snapshot in whose frame the pose is, and the pose of the axle in that frame.
    snapshot: usize,
    pose: Pose,
    covariance: Matrix3<f64>,
    bad: u32,
    is_lost: bool,
}

impl<'r> Locator<'r> {
    /// One that believes the robot at `pose` in the frame of a snapshot, to within standard deviations of position, m, and heading,
    /// rad.
    #[must_use]
    pub fn new(route: &'r Route, snapshot: usize, pose: Pose, sd: (f64, f64)) -> Self {
        let camera = Pose::new(route.sheet.camera_offset_m[0], route.sheet.camera_offset_m[1], 0.0);
        let covariance = spread(sd);
        Self { route, landmarks: landmarks(route), camera, snapshot, pose, covariance, bad: 0, is_lost: false }
    }

    /// Takes landmarks away.
    pub fn hide(&mut self, hidden: impl Fn(u32) -> bool) {
        for landmarks in &mut self.landmarks {
            landmarks.retain(|landmark| !hidden(landmark.track));
        }
    }

    /// Knows nothing of where it is.
    pub fn forget(&mut self) {
        self.is_lost = true;
    }

    /// The features of a snapshot that are looked for.
    #[must_use]
    pub fn features(&self, snapshot: usize) -> Vec<ViewFeature> {
        self.landmarks[snapshot].iter().map(|landmark| landmark.feature).collect()
    }

    /// How many they are.
    #[must_use]
    pub fn count(&self, snapshot: usize) -> usize {
        self.landmarks[snapshot].len()
    }

    /// Believes to stand where a snapshot was taken, with this heading in its frame.
    pub fn stand_at(&mut self, snapshot: usize, heading_rad: f64) {
        (self.snapshot, self.pose) = (snapshot, Pose::new(0.0, 0.0, heading_rad));
        self.covariance = spread((0.05, 0.03));
    }

    /// Whether it has lost its way.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.is_lost
    }

    /// Pictures in a row that did not bear the belief out.
    #[must_use]
    pub fn doubts(&self) -> u32 {
        self.bad
    }

    /// The nearest snapshot.
    #[must_use]
    pub fn snapshot(&self) -> usize {
        self.snapshot
    }

    /// Believed pose of the axle in the frame of the route.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.route.pose(self.snapshot).compose(&self.pose)
    }

    /// Standard deviation of the position along its worst direction, m.
    #[must_use]
    pub fn position_sd_m(&self) -> f64 {
        crate::observation::Estimate { pose: self.pose, covariance: self.covariance }.position_sd_m()
    }

    /// Covariance of the pose in the frame of the route.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let r = rotation(self.route.pose(self.snapshot).heading);
        r * self.covariance * r.transpose()
    }

    /// Moves on by odometry.
    pub fn advance(&mut self, odometry: &Odometry) {
        let (way, turn) = (odometry.twist.v * odometry.dt_s, odometry.twist.omega * odometry.dt_s);
        let (s, c) = sin_cos(self.pose.heading + 0.5 * turn);
        let mut f = Matrix3::identity();
        f[(0, 2)] = -way * s;
        f[(1, 2)] = way * c;
        let (along, across) = (NOISE.0 * way.abs() + 2e-4, NOISE.1 * way.abs());
        let heading = NOISE.2 * turn.abs() + NOISE.3 * way.abs();
        let r = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let noise = Matrix3::from_diagonal(&Vector3::new(along * along, across * across, heading * heading));
        self.covariance = f * self.covariance * f.transpose() + r * noise * r.transpose();
        self.pose = self.pose.advanced(odometry.twist, odometry.dt_s);
    }

    /// Changes over to the frame of another snapshot, which is where the route says that it is.
    pub fn hand_over(&mut self, snapshot: usize) {
        if snapshot == self.snapshot {
            return;
        }
        let (from, to) = (self.route.pose(self.snapshot), self.route.pose(snapshot));
        self.change_frame(snapshot, to.to_local(&from));
    }

    /// Changes over to a snapshot in whose frame the present one is at `relative`.
    pub fn change_frame(&mut self, snapshot: usize, relative: Pose) {
        let r = rotation(relative.heading);
        let way = relative.position().norm();
        self.pose = relative.compose(&self.pose);
        self.covariance = r * self.covariance * r.transpose() + spread((0.015 * way, 0.008 * way));
        self.snapshot = snapshot;
    }

    /// Corrects the belief by what is in sight.
    pub fn look(&mut self, finder: &ViewFinder) -> Looked {
        let (looked, corrected) = self.corrected(finder, self.snapshot, self.pose, self.covariance);
        let borne_out = looked.matched >= FEWEST && looked.matched as f64 >= BORNE_OUT * looked.expected as f64;
        match corrected.filter(|_| borne_out) {
            Some((pose, covariance)) => {
                (self.pose, self.covariance) = (pose, covariance);
                self.bad = 0;
            }
            None => self.bad += 1,
        }
        if self.bad > PATIENCE {
            self.is_lost = true;
        }
        looked
    }

    /// The pose that a view makes of a belief, by iterated and reweighted Gauss-Newton steps.
    fn corrected(
        &self,
        finder: &ViewFinder,
        snapshot: usize,
        before: Pose,
        covariance: Matrix3<f64>,
    ) -> (Looked, Option<(Pose, Matrix3<f64>)>) {
        let view = finder.view();
        let mut looked = Looked::default();
        let mut sightings: Vec<(usize, Seen)> = Vec::new();
        for landmark in &self.landmarks[snapshot] {
            let Some(predicted) = self.predict(landmark, &before) else { continue };
            looked.expected += 1;
            let prior = (covariance * predicted.by_pose).dot(&predicted.by_pose);
            let sd = (prior + predicted.variance).sqrt();
            let off = (before.position().norm() * landmark.variance.sqrt()).min(0.8);
            let expected = Expected {
                azimuth_rad: predicted.azimuth_rad,
                window_rad: (GATE * sd).clamp(0.025, 0.6),
                zoom: predicted.zoom,
                zoom_slack: 1.25 + off,
            };
            let Some(sighted) = finder.find(&landmark.feature, &expected) else { continue };
            let now = &view[sighted.now];
            let sd = finder.sd_rad(now, sighted.distance);
            let own = finder.sd_rad(&landmark.feature, 0.0);
            let seen = Seen {
                landmark: *landmark,
                azimuth_rad: now.azimuth_rad,
                variance: sd * sd + own * own,
                distance: sighted.distance,
            };
            sightings.push((sighted.now, seen));
        }
        // Each feature of the view is one thing.
        sightings.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.distance.total_cmp(&b.1.distance)));
        sightings.dedup_by_key(|(now, _)| *now);
        let seen: Vec<Seen> = sightings.into_iter().map(|(_, seen)| seen).collect();
        if seen.len() < FEWEST {
            looked.rejected = seen.len();
            return (looked, None);
        }
        let Some(information) = covariance.try_inverse() else { return (looked, None) };
        let mut pose = before;
        let mut normal = information;
        for step in 0..6 {
            normal = information;
            let drift = Vector3::new(pose.x - before.x, pose.y - before.y, wrap(pose.heading - before.heading));
            let mut right = -(information * drift);
            // Wide at first: wrong matches must not hold the pose where it is.
            let widening = [9.0, 4.0, 2.0, 1.0, 1.0, 1.0][step];
            for sighting in &seen {
                let Some(predicted) = self.predict(&sighting.landmark, &pose) else { continue };
                let residual = wrap(sighting.azimuth_rad - predicted.azimuth_rad);
                let variance = (sighting.variance + predicted.variance) * widening;
                let weight = (TAIL + 1.0) / (TAIL + residual * residual / variance) / variance;
                normal += weight * predicted.by_pose * predicted.by_pose.transpose();
                right += weight * residual * predicted.by_pose;
            }
            let Some(step) = normal.cholesky().map(|c| c.solve(&right)) else { return (looked, None) };
            pose = Pose::new(pose.x + step.x, pose.y + step.y, pose.heading + step.z);
        }
        for sighting in &seen {
            let Some(predicted) = self.predict(&sighting.landmark, &pose) else { continue };
            let residual = wrap(sighting.azimuth_rad - predicted.azimuth_rad);
            let fits = residual * residual <= GATE * GATE * (sighting.variance + predicted.variance);
            if fits { looked.matched += 1 } else { looked.rejected += 1 }
        }
        if !pose.is_finite() || 2 * looked.matched < seen.len() {
            return (looked, None);
        }
        let Some(after) = normal.try_inverse() else { return (looked, None) };
        (looked, Some((pose, after + spread(FLOOR))))
    }

    /// Where a landmark is seen from a pose of the axle in its snapshot's frame; `None` for one that is too near.
    fn predict(&self, landmark: &Landmark, pose: &Pose) -> Option<Predicted> {
        // The snapshot's frame is that of its axle, and its landmarks are seen from its camera.
        let camera = pose.transform(self.camera.position()) - self.camera.position();
        let u = direction(landmark.feature.azimuth_rad);
        let g: Vector2<f64> = u - camera * landmark.inverse_range;
        let n = g.norm_squared();
        if n < NEAREST * NEAREST {
            return None;
        }
        let (qx, qy) = (-g.y / n, g.x / n); // gradient of the direction by g
        let rho = landmark.inverse_range;
        let (s, c) = sin_cos(pose.heading);
        let [ox, oy] = [self.camera.x, self.camera.y];
        let turned = Vector2::new(-s * ox - c * oy, c * ox - s * oy);
        let by_rho = -(qx * camera.x + qy * camera.y);
        Some(Predicted {
            azimuth_rad: wrap(atan2(g.y, g.x) - pose.heading),
            by_pose: Vector3::new(-rho * qx, -rho * qy, -rho * (qx * turned.x + qy * turned.y) - 1.0),
            variance: by_rho * by_rho * landmark.variance,
            zoom: 1.0 / n.sqrt(),
        })
    }

    /// Pose of the last snapshot in the frame of the first, if it was taken thereabouts: a loop can be gone round again.
    #[must_use]
    pub fn closing(&self, finder: &mut ViewFinder) -> Option<Pose> {
        finder.recall(self.features(self.landmarks.len() - 1), self.route.sheet.projection.pixel_rad());
        let agreement = finder.compare(&self.features(0)).filter(|agreement| agreement.matches.len() >= FOUND)?;
        let (_, pose, _) = self.refined(finder, 0, &agreement)?;
        Some(pose)
    }

    /// The pose in a snapshot's frame that a view has by an agreement with it, with the matches that bear it out.
    fn refined(&self, finder: &ViewFinder, snapshot: usize, agreement: &Agreement) -> Option<(usize, Pose, Matrix3<f64>)> {
        let mut best: Option<(usize, Pose, Matrix3<f64>)> = None;
        for distance_m in [0.0, 0.25, 0.5, 0.8, 1.2, 1.7, 2.3] {
            let at = direction(agreement.direction_rad) * distance_m;
            let pose = Pose::new(at.x, at.y, agreement.turn_rad);
            let (looked, corrected) = self.corrected(finder, snapshot, pose, spread((0.15 + 0.15 * distance_m, 0.04)));
            if let Some((pose, covariance)) = corrected
                && best.is_none_or(|(matched, ..)| looked.matched > matched)
            {
                best = Some((looked.matched, pose, covariance));
            }
        }
        best
    }

    /// Looks for the robot all along the route. On success it is not lost any more.
    pub fn search(&mut self, finder: &ViewFinder) -> bool {
        let mut agreements: Vec<(usize, Agreement)> =
            (0..self.landmarks.len()).filter_map(|k| Some((k, finder.compare(&self.features(k))?))).collect();
        agreements.sort_by_key(|(k, agreement)| (std::cmp::Reverse(agreement.matches.len()), *k));
        let Some((best, first)) = agreements.first() else { return false };
        let here = self.route.pose(*best);
        let elsewhere = agreements
            .iter()
            .find(|(k, _)| (self.route.pose(*k).position() - here.position()).norm() > ELSEWHERE_M)
            .map_or(0, |(_, other)| other.matches.len());
        let is_sure = first.matches.len() >= FOUND
            && first.log_false_alarms < -14.0
            && first.matches.len() as f64 >= UNRIVALLED * elsewhere as f64;
        if !is_sure {
            return false;
        }
        let mut found: Option<(usize, usize, Pose, Matrix3<f64>)> = None;
        for (k, agreement) in agreements.iter().take(3) {
            if let Some((matched, pose, covariance)) = self.refined(finder, *k, agreement)
                && found.is_none_or(|(most, ..)| matched > most)
            {
                found = Some((matched, *k, pose, covariance));
            }
        }
        let Some((matched, snapshot, pose, covariance)) = found else { return false };
        if matched < FOUND {
            return false;
        }
        (self.snapshot, self.pose, self.covariance) = (snapshot, pose, covariance);
        (self.bad, self.is_lost) = (0, false);
        true
    }
}

/// A landmark that is in sight.
#[derive(Debug, Clone, Copy)]
struct Seen {
    landmark: Landmark,
    azimuth_rad: f64,
    variance: f64,
    distance: f64,
}

/// Where a landmark is expected.
struct Predicted {
    azimuth_rad: f64,
    /// Gradient of it by the pose.
    by_pose: Vector3<f64>,
    /// What the landmark's range leaves open, rad^2.
    variance: f64,
    zoom: f64,
}

/// Covariance of these standard deviations, m and rad.
fn spread((position_m, heading_rad): (f64, f64)) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(position_m * position_m, position_m * position_m, heading_rad * heading_rad))
}

/// Turns (x, y, heading) by an angle.
fn rotation(angle: f64) -> Matrix3<f64> {
    let (s, c) = sin_cos(angle);
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}
