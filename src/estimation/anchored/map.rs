//! The map that both stages of the anchored filter use: the robot's pose and bearing-only landmarks, all anchored at one frame.
//!
//! The state is the robot's pose (x, y, heading) in the anchor frame, then for each landmark its direction from the anchor's
//! origin and its inverse range from there (inverse-depth parametrisation of Civera, Davison and Montiel, 2008): a landmark at
//! unknown, even infinite, range is then still a Gaussian. A landmark in direction d at inverse range rho is seen from a robot
//! at p with heading phi at
//!
//! atan2(g) - phi, g = (cos d, sin d) - rho p.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Vector3};

use super::FilterSettings;
use super::motion::Motion;
use crate::estimation::gaussian::{CovarianceAt, Gaussian, Linearised, Refused, SparseRow};
use crate::estimation::resection;
use crate::geometry::{Pose, atan2, direction, sin_cos, wrap};
use crate::observation::{Bearing, Estimate, LandmarkId};

/// First landmark component.
const LANDMARKS: usize = 3;
/// Steps for which a landmark is ignored after it was dropped for not fitting.
const BAN_STEPS: u64 = 25;
/// A landmark unseen for this many steps makes way when another wants its place.
const STALE_STEPS: u64 = 10;
/// Refused bearings that contradict a belief if they are also more than twice those that fit.
const LEAST_CONTRADICTION: usize = 4;
/// Strikes after which a landmark is dropped; a bearing that fits takes one back.
const STRIKES: u32 = 3;
/// Inverse ranges outside of this are no landmark's, 1/m: nearer than 5 cm, or clearly beyond infinity.
const INVERSE_RANGES: std::ops::Range<f64> = -0.3..20.0;

/// Direction (rad) and inverse range (1/m) of a landmark from the anchor, with variances: what is known before it is seen.
#[derive(Debug, Clone, Copy)]
pub struct Prior {
    /// Mean of (direction, inverse range).
    pub mean: [f64; 2],
    /// Their variances.
    pub variance: [f64; 2],
}

#[derive(Debug, Clone, Copy)]
struct Landmark {
    id: LandmarkId,
    last_seen: u64,
    strikes: u32,
}

/// Numbers of the landmarks by their ids, in order.
struct Index(Vec<(LandmarkId, usize)>);

impl Index {
    fn get(&self, id: LandmarkId) -> Option<usize> {
        self.0.binary_search_by_key(&id, |place| place.0).ok().map(|at| self.0[at].1)
    }
}

/// A bearing of a landmark, by number, linearised at the mean before the update.
#[derive(Clone, Copy)]
struct Member {
    landmark: usize,
    bearing: Bearing,
    linearised: Linearised,
}

/// What a measurement update did.
#[derive(Debug, Clone, Default)]
pub struct Update {
    /// Bearings that updated the belief.
    pub used: Vec<Bearing>,
    /// Bearings refused by the gate.
    pub rejected: usize,
    /// Bearings of landmarks that are ignored because they did not fit before.
    pub banned: usize,
    /// Bearings of landmarks that the map does not hold and has not banned.
    pub strangers: Vec<Bearing>,
    /// Normalised innovation squared of the used bearings, all together.
    pub nis: f64,
    /// Whether most bearings were refused: nothing was updated then, and no landmark is to blame.
    pub contradicted: bool,
}

/// Pose and landmarks in one anchor frame.
#[derive(Debug, Clone)]
pub struct Map {
    belief: Gaussian,
    landmarks: Vec<Landmark>,
    banned: BTreeMap<LandmarkId, u64>,
    step: u64,
}

/// Bearing of a landmark from a pose with its derivatives by (x, y, heading, direction, inverse range).
#[must_use]
pub fn predict_bearing(pose: &Pose, direction_rad: f64, inverse_range: f64) -> (f64, [f64; 5]) {
    let ([gx, gy], derivatives) = sight_line(pose, sin_cos(direction_rad), inverse_range);
    (atan2(gy, gx) - pose.heading, derivatives)
}

/// The vector g along which a landmark is seen, in the anchor frame, and the derivatives of its angle less the heading; of the
/// landmark's direction sine and cosine are given.
#[must_use]
pub(super) fn sight_line(pose: &Pose, (s, c): (f64, f64), inverse_range: f64) -> ([f64; 2], [f64; 5]) {
    let (gx, gy) = (c - inverse_range * pose.x, s - inverse_range * pose.y);
    // g vanishes where the robot stands on the landmark; the derivative is held finite there.
    let n = (gx * gx + gy * gy).max(1e-9);
    let (qx, qy) = (-gy / n, gx / n);
    let by_pose = [-inverse_range * qx, -inverse_range * qy, -1.0];
    let by_landmark = [-qx * s + qy * c, -(qx * pose.x + qy * pose.y)];
    ([gx, gy], [by_pose[0], by_pose[1], by_pose[2], by_landmark[0], by_landmark[1]])
}

impl Map {
    /// An empty map with the robot at the anchor, exactly.
    #[must_use]
    pub fn at_anchor() -> Self {
        Self { belief: Gaussian::diagonal(&[0.0; 3], &[0.0; 3]), landmarks: Vec::new(), banned: BTreeMap::new(), step: 0 }
    }

    /// A map with given landmarks: `mean` and `covariance` of (pose, landmarks in the order of `ids`).
    #[must_use]
    pub fn from_solution(ids: &[LandmarkId], mean: DVector<f64>, covariance: DMatrix<f64>) -> Self {
        let landmarks = ids.iter().map(|&id| Landmark { id, last_seen: 0, strikes: 0 }).collect();
        Self { belief: Gaussian { mean, covariance }, landmarks, banned: BTreeMap::new(), step: 0 }
    }

    /// Takes over a solution for the landmarks `ids`, a part of this map's own in the same order; the others are dropped.
    pub fn replace(&mut self, ids: &[LandmarkId], mean: DVector<f64>, covariance: DMatrix<f64>) {
        let dropped: Vec<LandmarkId> = self.ids().filter(|id| !ids.contains(id)).collect();
        for id in dropped {
            self.banned.insert(id, self.step + BAN_STEPS);
        }
        self.landmarks.retain(|l| ids.contains(&l.id));
        self.belief = Gaussian { mean, covariance };
    }

    /// The robot's pose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::new(self.belief.mean[0], self.belief.mean[1], self.belief.mean[2])
    }

    /// The robot's pose with its covariance.
    #[must_use]
    pub fn estimate(&self) -> Estimate {
        Estimate { pose: self.pose(), covariance: self.belief.covariance.fixed_view::<3, 3>(0, 0).into_owned() }
    }

    /// Ids of the landmarks, in the order of the state.
    pub fn ids(&self) -> impl Iterator<Item = LandmarkId> + '_ {
        self.landmarks.iter().map(|l| l.id)
    }

    /// (direction, inverse range) of landmark `k` and their covariance.
    #[must_use]
    pub fn landmark(&self, k: usize) -> ([f64; 2], Matrix2<f64>) {
        let c = LANDMARKS + 2 * k;
        let covariance = self.belief.covariance.fixed_view::<2, 2>(c, c).into_owned();
        ([self.belief.mean[c], self.belief.mean[c + 1]], covariance)
    }

    /// Number of landmarks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.landmarks.len()
    }

    /// Whether there is no landmark.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.landmarks.is_empty()
    }

    /// How many landmarks were seen, and fitted, in the last update.
    #[must_use]
    pub fn seen_now(&self) -> usize {
        self.landmarks.iter().filter(|l| l.last_seen == self.step).count()
    }

    /// Time update.
    pub fn predict(&mut self, motion: &Motion) {
        let before = self.pose();
        let after = before.compose(&motion.delta);
        let moved = after.position() - before.position();
        let f = Matrix3::new(1.0, 0.0, -moved.y, 0.0, 1.0, moved.x, 0.0, 0.0, 1.0);
        self.belief.propagate_pose(&f, &in_map_frame(&before, &motion.covariance));
        self.set_pose(&after);
    }

    /// Adds to the noise of the step that was just predicted; `before` is the pose before it, and `more` is in that pose's frame.
    pub fn loosen(&mut self, before: &Pose, more: &Matrix3<f64>) {
        self.belief.propagate_pose(&Matrix3::identity(), &in_map_frame(before, more));
    }

    /// Puts the robot somewhere else: what was known of its pose is forgotten, what is known of the landmarks stays.
    pub fn relocate(&mut self, pose: &Pose, sd_m: f64, sd_rad: f64) {
        self.belief.reset(0, &[pose.x, pose.y, pose.heading], &[sd_m * sd_m, sd_m * sd_m, sd_rad * sd_rad]);
    }

    fn set_pose(&mut self, pose: &Pose) {
        self.belief.mean[0] = pose.x;
        self.belief.mean[1] = pose.y;
        self.belief.mean[2] = pose.heading;
    }

    /// How many of the bearings are of landmarks that the map holds, and how many of these would pass the gate if the step
    /// just predicted had each of the given noises on top of its own (covariances in the frame of `before`).
    #[must_use]
    pub fn count_fits<const N: usize>(
        &self,
        bearings: &[Bearing],
        before: &Pose,
        more: &[Matrix3<f64>; N],
        gate: f64,
    ) -> (usize, [usize; N]) {
        let more = more.map(|m| in_map_frame(before, &m));
        let index = self.index();
        let (mut held, mut fits) = (0, [0; N]);
        for bearing in bearings {
            let Some(k) = index.get(bearing.id) else { continue };
            held += 1;
            let m = linearise(&self.belief.mean, k, bearing);
            let by_pose = Vector3::from_fn(|i, _| m.row.entries()[i].1);
            let squared = m.innovation * m.innovation;
            let variance = self.belief.variance_along(&m.row) + m.variance;
            for (fits, more) in fits.iter_mut().zip(&more) {
                *fits += usize::from(squared <= gate * (variance + (more * by_pose).dot(&by_pose)));
            }
        }
        (held, fits)
    }

    /// How many of the bearings are of landmarks that the map holds, and how many of these a robot at `pose` would see to within
    /// `about_rad`.
    #[must_use]
    pub fn agreement(&self, pose: &Pose, bearings: &[Bearing], about_rad: f64) -> (usize, usize) {
        let index = self.index();
        let off = |bearing: &Bearing| {
            let c = LANDMARKS + 2 * index.get(bearing.id)?;
            let (predicted, _) = predict_bearing(pose, self.belief.mean[c], self.belief.mean[c + 1]);
            Some(wrap(bearing.azimuth_rad - predicted).abs())
        };
        let off: Vec<f64> = bearings.iter().filter_map(off).collect();
        (off.len(), off.iter().filter(|off| **off <= about_rad).count())
    }

    /// What resection of the robot needs: the landmarks among the bearings with what the map knows of them.
    #[must_use]
    pub fn sightings(&self, bearings: &[Bearing]) -> Vec<resection::Sighting> {
        let index = self.index();
        bearings
            .iter()
            .filter_map(|bearing| {
                let (mean, covariance) = self.landmark(index.get(bearing.id)?);
                Some(resection::Sighting {
                    direction_rad: mean[0],
                    inverse_range: mean[1],
                    covariance,
                    bearing_rad: bearing.azimuth_rad,
                    variance: bearing.sd_rad * bearing.sd_rad,
                })
            })
            .collect()
    }

    fn index(&self) -> Index {
        let mut places: Vec<_> = self.landmarks.iter().enumerate().map(|(k, l)| (l.id, k)).collect();
        places.sort_unstable();
        Index(places)
    }

    /// Measurement update with the landmarks that the map holds; gates each bearing, iterates, drops landmarks that keep failing.
    /// Where the step before was loosened the gate lets much through, and is held against the updated belief once more. A
    /// `settled` map that most bearings contradict is left as it is; one that is still being built may owe it to its landmarks.
    pub fn update(
        &mut self,
        bearings: &[Bearing],
        settings: &FilterSettings,
        iterations: usize,
        loosened: bool,
        settled: bool,
    ) -> Update {
        self.step += 1;
        let mut update = Update::default();
        let index = self.index();
        let mut members = Vec::new();
        for bearing in bearings {
            if !(bearing.azimuth_rad.is_finite() && bearing.sd_rad.is_finite()) {
                update.rejected += 1;
                continue;
            }
            let Some(k) = index.get(bearing.id) else {
                if self.banned.get(&bearing.id).is_none_or(|&until| until < self.step) {
                    update.strangers.push(*bearing);
                } else {
                    update.banned += 1;
                }
                continue;
            };
            members.push(Member { landmark: k, bearing: *bearing, linearised: linearise(&self.belief.mean, k, bearing) });
        }
        let held: Vec<(usize, Bearing)> = members.iter().map(|m| (m.landmark, m.bearing)).collect();
        members.retain(|m| self.belief.fits(&m.linearised, settings.gate));
        let before = self.belief.mean.clone();
        let linearised = |x: &DVector<f64>, members: &[Member]| -> Vec<Linearised> {
            if *x == before {
                return members.iter().map(|m| m.linearised).collect();
            }
            members.iter().map(|m| linearise(x, m.landmark, &m.bearing)).collect()
        };
        if loosened && !members.is_empty() {
            let mut updated = self.clone();
            let fine = updated
                .belief
                .update_iterated(iterations, CovarianceAt::Posterior, |_| f64::INFINITY, |x| linearised(x, &members))
                .is_ok();
            members.retain(|m| fine && updated.fits(m.landmark, &m.bearing, settings.gate));
        }
        // While ranges are unknown the linearisation at the prior mean is too poor for a verdict on all bearings together.
        let joint_gate = |count: usize| match settled {
            true => settings.gate + settings.joint_gate * (count - 1) as f64,
            false => f64::INFINITY,
        };
        // While ranges are unknown, and after a slip, the prior mean is far off.
        let covariance_at = if settled && !loosened { CovarianceAt::Prior } else { CovarianceAt::Posterior };
        loop {
            let refused = held.len() - members.len() + update.banned;
            if settled && refused >= LEAST_CONTRADICTION && refused > 2 * members.len() {
                update.contradicted = true;
                update.rejected += held.len();
                return update;
            }
            match self.belief.update_iterated(iterations, covariance_at, joint_gate, |x| linearised(x, &members)) {
                Ok(nis) => {
                    update.nis = nis;
                    break;
                }
                Err(Refused::Jointly { worst }) => {
                    members.remove(worst);
                }
                Err(Refused::Singular) => members.clear(),
            }
        }
        let mut used = members.iter().peekable();
        for (k, bearing) in held {
            let landmark = &mut self.landmarks[k];
            if used.next_if(|m| m.bearing == bearing).is_some() {
                update.used.push(bearing);
                landmark.last_seen = self.step;
                landmark.strikes = landmark.strikes.saturating_sub(1);
            } else {
                update.rejected += 1;
                landmark.strikes += 1;
            }
        }
        self.belief.mean[2] = wrap(self.belief.mean[2]);
        for k in (0..self.landmarks.len()).rev() {
            let inverse_range = self.belief.mean[LANDMARKS + 2 * k + 1];
            if self.landmarks[k].strikes >= STRIKES || !INVERSE_RANGES.contains(&inverse_range) {
                self.ban(self.landmarks[k].id, BAN_STEPS);
            }
        }
        update
    }

    fn fits(&self, k: usize, bearing: &Bearing, gate: f64) -> bool {
        self.belief.fits(&linearise(&self.belief.mean, k, bearing), gate)
    }

    /// Adds a landmark with its prior and its first bearing; `false`, and no change, where the two do not fit.
    pub fn add(&mut self, prior: &Prior, bearing: &Bearing, settings: &FilterSettings) -> bool {
        let k = self.landmarks.len();
        self.belief.append(&prior.mean, &prior.variance);
        self.landmarks.push(Landmark { id: bearing.id, last_seen: self.step, strikes: 0 });
        let fits = self.fits(k, bearing, settings.gate)
            && self
                .belief
                .update_iterated(3, CovarianceAt::Posterior, |_| f64::INFINITY, |x| vec![linearise(x, k, bearing)])
                .is_ok();
        if !fits {
            self.drop_landmark(k);
            self.banned.insert(bearing.id, self.step + 3);
        }
        fits
    }

    /// Places for new landmarks, after stale ones made way for up to `wanted`.
    pub fn make_room(&mut self, wanted: usize, limit: usize) -> usize {
        for k in (0..self.landmarks.len()).rev() {
            if limit.saturating_sub(self.landmarks.len()) >= wanted {
                break;
            }
            if self.landmarks[k].last_seen + STALE_STEPS < self.step {
                self.drop_landmark(k);
            }
        }
        limit.saturating_sub(self.landmarks.len())
    }

    /// Drops a landmark and ignores it for a number of steps.
    pub fn ban(&mut self, id: LandmarkId, steps: u64) {
        self.banned.insert(id, self.step + steps);
        if let Some(k) = self.landmarks.iter().position(|l| l.id == id) {
            self.drop_landmark(k);
        }
    }

    fn drop_landmark(&mut self, k: usize) {
        self.belief.remove(LANDMARKS + 2 * k, 2);
        self.landmarks.remove(k);
    }

    /// Prior of a landmark whose direction from the anchor is known (from the snapshot) and that is now seen from the robot:
    /// its inverse range is started at the crossing of both rays, where that is well defined. `None` where the rays cannot
    /// come from one point.
    #[must_use]
    pub fn triangulated_prior(&self, from_anchor: &Bearing, now: &Bearing, settings: &FilterSettings) -> Option<Prior> {
        let estimate = self.estimate();
        let pose = estimate.pose;
        let out = direction(from_anchor.azimuth_rad);
        let ray = direction(pose.heading + now.azimuth_rad);
        // out - rho p must be parallel to the ray, and point along it.
        let across = crate::geometry::cross(ray, pose.position());
        let noise = now.sd_rad + from_anchor.sd_rad + estimate.covariance[(2, 2)].max(0.0).sqrt();
        let sd = (noise + settings.inverse_range_mean * estimate.position_sd_m()) / across.abs().max(1e-9);
        let mut inverse_range = settings.inverse_range_mean;
        if sd < 0.5 * settings.inverse_range_sd {
            let crossing = crate::geometry::cross(ray, out) / across;
            if crossing < -3.0 * sd - 0.02 || crossing > 10.0 {
                return None;
            }
            inverse_range = crossing.max(0.02);
        }
        if (out - pose.position() * inverse_range).dot(&ray) <= 0.0 {
            return None;
        }
        Some(settings.prior(from_anchor, inverse_range))
    }
}

/// A pose covariance given in the frame of `pose`, in the frame that `pose` itself is given in.
fn in_map_frame(pose: &Pose, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let (s, c) = sin_cos(pose.heading);
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    turn * covariance * turn.transpose()
}

fn linearise(x: &DVector<f64>, k: usize, bearing: &Bearing) -> Linearised {
    let c = LANDMARKS + 2 * k;
    let (predicted, d) = predict_bearing(&Pose { x: x[0], y: x[1], heading: x[2] }, x[c], x[c + 1]);
    let mut row = SparseRow::default();
    for (column, derivative) in [0, 1, 2, c, c + 1].into_iter().zip(d) {
        row.push(column, derivative);
    }
    Linearised { innovation: wrap(bearing.azimuth_rad - predicted), row, variance: bearing.sd_rad * bearing.sd_rad }
}
