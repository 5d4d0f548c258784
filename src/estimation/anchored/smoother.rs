//! The smoother: all bearings and odometry of a stretch of the run at once, in the home frame.
//!
//! An extended Kalman filter never revisits a linearisation. While ranges are unknown that costs it its consistency, so the
//! filter's belief is built anew from the stored stretch by Gauss-Newton on the full posterior: poses of the robot at every
//! step, and direction and inverse range from home of every landmark. Poses form a chain; eliminating them one after the other
//! leaves a dense system in the last pose and the landmarks only, whose inverse is the filter's covariance. A step costs
//! O(steps x landmarks^2).

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::map::{Prior, sight_line};
use super::motion::Motion;
use crate::estimation::dense;
use crate::geometry::{Pose, atan2, sin_cos, wrap};

/// A landmark seen in one step.
#[derive(Debug, Clone, Copy)]
pub struct Sighting {
    /// Index of the landmark among the priors.
    pub landmark: usize,
    /// Azimuth from the robot's heading, rad.
    pub azimuth_rad: f64,
    /// Its variance, rad^2.
    pub variance: f64,
}

/// One step: how the robot came here from the step before, and what it saw.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Motion since the frame before; ignored in the first frame.
    pub motion: Motion,
    /// Bearings.
    pub sightings: Vec<Sighting>,
}

/// Iterates of the solution.
#[derive(Debug, Clone)]
pub struct Iterate {
    /// Pose of the robot in the home frame, one a frame.
    pub poses: Vec<Pose>,
    /// (direction, inverse range) from home, one a landmark.
    pub landmarks: Vec<[f64; 2]>,
}

/// A converged solution.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Poses and landmarks.
    pub at: Iterate,
    /// Squared normalised residuals of the sightings, frame after frame.
    pub residuals_squared: Vec<f64>,
    /// Squared Mahalanobis distance between how the robot came to each frame and what odometry tells; 0 for the first.
    pub motions_squared: Vec<f64>,
    /// By how much the sightings scatter more than their variances say: what [`Solution::last`] enlarges its covariance by.
    pub scatter: f64,
    /// Cholesky factor of the information of (last pose, landmarks).
    factor: Vec<f64>,
}

impl Solution {
    /// Mean and covariance of (last pose, landmarks); `None` where they are not finite.
    #[must_use]
    pub fn last(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let pose = self.at.poses.last()?;
        let n = 3 + 2 * self.at.landmarks.len();
        let state = [pose.x, pose.y, pose.heading].into_iter().chain(self.at.landmarks.iter().flatten().copied());
        let mean = DVector::from_iterator(n, state);
        let covariance = self.scatter * dense::inverse(&self.factor, n);
        (mean.iter().all(|v| v.is_finite()) && covariance.iter().all(|v| v.is_finite())).then_some((mean, covariance))
    }
}

/// A stretch of the run.
pub struct Stretch<'a> {
    /// Steps.
    pub frames: &'a [Frame],
    /// Priors of the landmarks, from the snapshot.
    pub priors: &'a [Prior],
    /// Take the bearings' noise for Student's t instead of Gaussian: wrong matches then pull little, but the covariance is
    /// that of the weights and not to be used.
    pub heavy_tails: bool,
}

/// Degrees of freedom of the heavy tails.
const TAIL: f64 = 3.0;

const ITERATIONS: usize = 12;
/// A step that lowers the cost by less than this is the last: the next one would lower it by far less still.
const SETTLED: f64 = 1e-3;
/// The same under heavy tails, where steps get shorter slowly, and where it is enough to tell wrong matches from others.
const ROUGHLY_SETTLED: f64 = 0.1;

/// What stays the same from iterate to iterate.
struct Given {
    /// Inverse covariances of the motions.
    weights: Vec<Matrix3<f64>>,
    /// Cosine and sine of the sightings' azimuths, frame after frame.
    rays: Vec<[f64; 2]>,
}

/// The posterior at an iterate.
struct Posterior {
    /// Twice the negative logarithm of its density, but for a constant.
    cost: f64,
    /// Of each sighting, frame after frame.
    bearings: Vec<Residual>,
    /// Where the robot went against what odometry says, of each frame; zero for the first.
    motions: Vec<Vector3<f64>>,
    motions_squared: Vec<f64>,
}

/// A bearing's residual, rad, with the derivatives of the prediction by (x, y, heading, direction, inverse range).
struct Residual {
    rad: f64,
    squared: f64,
    derivatives: [f64; 5],
}

impl Stretch<'_> {
    /// Gauss-Newton from a start; `None` where it does not converge to a regular solution.
    #[must_use]
    pub fn solve(&self, start: Iterate) -> Option<Solution> {
        let given = self.given()?;
        let settled = if self.heavy_tails { ROUGHLY_SETTLED } else { SETTLED };
        let mut at = start;
        let mut here = self.evaluate(&at, &given);
        let mut information = None;
        for _ in 0..ITERATIONS {
            let (factor, step) = self.step(&at, &here, &given.weights)?;
            information = Some(factor);
            let mut share = 1.0;
            let mut next = step.apply(&at, share);
            let mut there = self.evaluate(&next, &given);
            while there.cost > here.cost + 1e-9 && share > 0.02 {
                share *= 0.5;
                next = step.apply(&at, share);
                there = self.evaluate(&next, &given);
            }
            if there.cost > here.cost + 1e-9 {
                break;
            }
            let gained = here.cost - there.cost;
            at = next;
            here = there;
            if gained < settled && share == 1.0 {
                break;
            }
        }
        let residuals_squared = here.bearings.iter().map(|r| r.squared).collect();
        Some(Solution { at, residuals_squared, motions_squared: here.motions_squared, scatter: 1.0, factor: information? })
    }

    /// Covariance of (last pose, landmarks) by the information at given poses and landmarks. At the true ones, and without heavy
    /// tails, it is the Cramer-Rao bound. `None` where the information is singular.
    #[must_use]
    pub fn covariance_at(&self, at: &Iterate) -> Option<DMatrix<f64>> {
        let given = self.given()?;
        let (factor, _) = self.step(at, &self.evaluate(at, &given), &given.weights)?;
        Some(dense::inverse(&factor, 3 + 2 * self.priors.len()))
    }

    /// `None` where there is nothing to solve for.
    fn given(&self) -> Option<Given> {
        if self.frames.is_empty() || self.priors.is_empty() {
            return None;
        }
        let weights = self.frames.iter().map(|frame| frame.motion.covariance.try_inverse()).collect::<Option<_>>()?;
        let ray = |s: &Sighting| {
            let (sin, cos) = sin_cos(s.azimuth_rad);
            [cos, sin]
        };
        Some(Given { weights, rays: self.frames.iter().flat_map(|frame| frame.sightings.iter().map(ray)).collect() })
    }

    /// Weight of a sighting in the normal equations by its squared normalised residual.
    fn weight(&self, squared: f64) -> f64 {
        if self.heavy_tails { (TAIL + 1.0) / (TAIL + squared) } else { 1.0 }
    }

    fn evaluate(&self, at: &Iterate, given: &Given) -> Posterior {
        let directions: Vec<(f64, f64)> = at.landmarks.iter().map(|l| sin_cos(l[0])).collect();
        let (mut cost, mut product) = (0.0, 1.0);
        let mut bearings = Vec::with_capacity(given.rays.len());
        let mut rays = given.rays.iter();
        for (pose, frame) in at.poses.iter().zip(self.frames) {
            let (sin, cos) = sin_cos(pose.heading);
            for (s, ray) in frame.sightings.iter().zip(&mut rays) {
                let ([gx, gy], derivatives) = sight_line(pose, directions[s.landmark], at.landmarks[s.landmark][1]);
                // Measured less predicted is the angle from g to the measured ray.
                let (x, y) = (cos * ray[0] - sin * ray[1], sin * ray[0] + cos * ray[1]);
                let rad = angle(gx * x + gy * y, gx * y - gy * x);
                let squared = rad * rad / s.variance;
                if self.heavy_tails {
                    // The sum of logarithms as the logarithm of products.
                    product *= 1.0 + squared / TAIL;
                    if product > 1e200 {
                        cost += (TAIL + 1.0) * libm::log(product);
                        product = 1.0;
                    }
                } else {
                    cost += squared;
                }
                bearings.push(Residual { rad, squared, derivatives });
            }
        }
        cost += (TAIL + 1.0) * libm::log(product);
        for (prior, l) in self.priors.iter().zip(&at.landmarks) {
            let d = wrap(l[0] - prior.mean[0]);
            let r = l[1] - prior.mean[1];
            cost += d * d / prior.variance[0] + r * r / prior.variance[1];
        }
        let errors = at.poses.windows(2).zip(&self.frames[1..]).map(|(p, frame)| motion_error(&p[0], &p[1], &frame.motion));
        let motions: Vec<Vector3<f64>> = std::iter::once(Vector3::zeros()).chain(errors).collect();
        let motions_squared: Vec<f64> = motions.iter().zip(&given.weights).map(|(e, w)| (w * e).dot(e)).collect();
        cost += motions_squared.iter().sum::<f64>();
        Posterior { cost: if cost.is_finite() { cost } else { f64::INFINITY }, bearings, motions, motions_squared }
    }

    /// One Gauss-Newton step: Cholesky factor of the information of (last pose, landmarks) and the step of everything.
    fn step(&self, at: &Iterate, here: &Posterior, weights: &[Matrix3<f64>]) -> Option<(Vec<f64>, Step)> {
        let n = 2 * self.priors.len();
        let last = self.frames.len() - 1;
        // Information of the landmarks among themselves (from the diagonal down), of the current pose with them, of the pose
        // itself, and the right-hand sides.
        let mut ll = vec![0.0; n * n];
        let mut l_right = vec![0.0; n];
        for (k, (prior, l)) in self.priors.iter().zip(&at.landmarks).enumerate() {
            let off = [wrap(prior.mean[0] - l[0]), prior.mean[1] - l[1]];
            for (c, (off, variance)) in (2 * k..).zip(off.into_iter().zip(prior.variance)) {
                ll[c * n + c] = 1.0 / variance;
                l_right[c] = off / variance;
            }
        }
        let mut pl = vec![0.0; 3 * n];
        let mut pp = Matrix3::zeros();
        let mut p_right = Vector3::zeros();
        let mut bearings = here.bearings.iter();
        // What elimination of each pose leaves for back-substitution: pose = g - to_next next - to_landmarks landmarks.
        let mut to_next = Vec::with_capacity(last);
        let mut gs = Vec::with_capacity(last);
        let mut to_landmarks = vec![0.0; last.next_multiple_of(TOGETHER) * 3 * n];
        let mut pls = vec![0.0; RANK * n];
        let mut rows = Vec::new();
        for (k, frame) in self.frames.iter().enumerate() {
            for (s, residual) in frame.sightings.iter().zip(&mut bearings) {
                let d = &residual.derivatives;
                let w = self.weight(residual.squared) / s.variance;
                let jp = Vector3::new(d[0], d[1], d[2]);
                pp += w * jp * jp.transpose();
                p_right += w * residual.rad * jp;
                let c = 2 * s.landmark;
                for (i, by_landmark) in (c..).zip(&d[3..]) {
                    let weighted = w * by_landmark;
                    for (row, by_pose) in pl.chunks_exact_mut(n).zip(d) {
                        row[i] += weighted * by_pose;
                    }
                    l_right[i] += weighted * residual.rad;
                }
                ll[c * n + c] += w * d[3] * d[3];
                ll[c * n + c + 1] += w * d[3] * d[4];
                ll[(c + 1) * n + c + 1] += w * d[4] * d[4];
            }
            if k == last {
                break;
            }
            let (before, after) = (&at.poses[k], &at.poses[k + 1]);
            let (e, weight) = (here.motions[k + 1], weights[k + 1]);
            let (jb, ja) = motion_jacobians(before, after);
            let inverse = (pp + jb.transpose() * weight * jb).try_inverse()?;
            let cross = jb.transpose() * weight * ja;
            let g = inverse * (p_right - jb.transpose() * weight * e);
            let group = k % TOGETHER;
            pls[3 * n * group..][..3 * n].copy_from_slice(&pl);
            pass_on(&mut pl, &mut to_landmarks[3 * n * k..][..3 * n], &mut l_right, [&inverse, &cross], &g);
            if group + 1 == TOGETHER || k + 1 == last {
                // What is left of an older group belongs to frames whose parts of `to_landmarks` are still zero.
                let those = &to_landmarks[3 * n * (k - group)..][..3 * n * TOGETHER];
                subtract_products(&mut ll, &pls, those, &mut rows);
            }
            to_next.push(inverse * cross);
            gs.push(g);
            pp = ja.transpose() * weight * ja - cross.transpose() * to_next[k];
            p_right = -(ja.transpose() * weight * e) - cross.transpose() * g;
        }
        // Lower triangle of the whole: pose first, then landmarks.
        let size = 3 + n;
        let mut factor = vec![0.0; size * size];
        for c in 0..3 {
            factor[c * size + c..c * size + 3].copy_from_slice(&pp.as_slice()[3 * c + c..3 * c + 3]);
            factor[c * size + 3..(c + 1) * size].copy_from_slice(&pl[c * n..(c + 1) * n]);
        }
        for c in 0..n {
            factor[(3 + c) * size + 3 + c..(4 + c) * size].copy_from_slice(&ll[c * n + c..(c + 1) * n]);
        }
        if !dense::factorise(&mut factor, size) {
            return None;
        }
        let mut solved: Vec<f64> = p_right.iter().copied().chain(l_right).collect();
        dense::solve_lower(&factor, 0, &mut solved);
        dense::solve_transposed(&factor, &mut solved);
        let (pose, landmarks) = solved.split_at(3);
        let mut next = Vector3::from_column_slice(pose);
        let mut poses = vec![next];
        for k in (0..last).rev() {
            let parts = &to_landmarks[3 * n * k..][..3 * n];
            next = gs[k] - to_next[k] * next - Vector3::from_fn(|i, _| dense::dot(&parts[i * n..(i + 1) * n], landmarks));
            poses.push(next);
        }
        poses.reverse();
        Some((factor, Step { poses, landmarks: landmarks.as_chunks().0.to_vec() }))
    }
}

/// Poses whose elimination is worked into the landmarks' information together: that matrix does not fit into the first cache.
const TOGETHER: usize = 4;
/// Vectors that come of it.
const RANK: usize = 3 * TOGETHER;

/// Eliminates a pose: `t` becomes inverse * pl, where `pl` has the rows of the information of the pose with the landmarks; `pl` becomes
/// those of the next pose, -cross' t; and pl' g is subtracted from the landmarks' right-hand side.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn pass_on(pl: &mut [f64], t: &mut [f64], right: &mut [f64], [inverse, cross]: [&Matrix3<f64>; 2], g: &Vector3<f64>) {
    let n = right.len();
    let (px, rest) = pl.split_at_mut(n);
    let (py, pz) = rest.split_at_mut(n);
    let (tx, rest) = t.split_at_mut(n);
    let (ty, tz) = rest.split_at_mut(n);
    let (py, pz, ty, tz) = (&mut py[..n], &mut pz[..n], &mut ty[..n], &mut tz[..n]);
    for c in 0..n {
        let p = [px[c], py[c], pz[c]];
        right[c] -= p[0] * g.x + p[1] * g.y + p[2] * g.z;
        let by = |i: usize| inverse[(i, 0)] * p[0] + inverse[(i, 1)] * p[1] + inverse[(i, 2)] * p[2];
        let t = [by(0), by(1), by(2)];
        let on = |i: usize| -(cross[(0, i)] * t[0] + cross[(1, i)] * t[1] + cross[(2, i)] * t[2]);
        [tx[c], ty[c], tz[c]] = t;
        [px[c], py[c], pz[c]] = [on(0), on(1), on(2)];
    }
}

/// `dense::subtract_block` for the vectors of some poses.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn subtract_products(ll: &mut [f64], left: &[f64], right: &[f64], rows: &mut Vec<[f64; RANK]>) {
    let n = left.len() / RANK;
    dense::subtract_block::<RANK>(ll, left, right, rows, [n, n]);
}

/// Change of all poses and landmarks.
struct Step {
    poses: Vec<Vector3<f64>>,
    landmarks: Vec<[f64; 2]>,
}

impl Step {
    fn apply(&self, at: &Iterate, share: f64) -> Iterate {
        let poses = at.poses.iter().zip(&self.poses);
        let landmarks = at.landmarks.iter().zip(&self.landmarks);
        Iterate {
            poses: poses.map(|(p, d)| Pose::new(p.x + share * d.x, p.y + share * d.y, p.heading + share * d.z)).collect(),
            landmarks: landmarks.map(|(l, d)| [wrap(l[0] + share * d[0]), l[1] + share * d[1]]).collect(),
        }
    }
}

/// Angle of the vector (x, y); most are nearly along x, where a few terms of the series are exact.
fn angle(x: f64, y: f64) -> f64 {
    if x <= 0.0 || y.abs() > 0.1 * x {
        return atan2(y, x);
    }
    let t = y / x;
    let s = t * t;
    t * (1.0 + s * (-1.0 / 3.0 + s * (1.0 / 5.0 + s * (-1.0 / 7.0 + s * (1.0 / 9.0 + s * (-1.0 / 11.0 + s * (1.0 / 13.0)))))))
}

/// Where the robot went against what odometry says, in the frame of the pose before.
fn motion_error(before: &Pose, after: &Pose, motion: &Motion) -> Vector3<f64> {
    let went = before.to_local(after);
    Vector3::new(went.x - motion.delta.x, went.y - motion.delta.y, wrap(went.heading - motion.delta.heading))
}

/// Derivatives of [`motion_error`] by the pose before and the pose after.
fn motion_jacobians(before: &Pose, after: &Pose) -> (Matrix3<f64>, Matrix3<f64>) {
    let (s, c) = sin_cos(before.heading);
    let went = before.inverse_transform(after.position());
    let by_before = Matrix3::new(-c, -s, went.y, s, -c, -went.x, 0.0, 0.0, -1.0);
    let by_after = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
    (by_before, by_after)
}

#[cfg(test)]
mod tests {
    use num_dual::{Dual64, DualNum};

    use super::*;
    use crate::estimation::anchored::map::predict_bearing;
    use crate::geometry::Twist;

    /// All residuals of a stretch, each over its standard deviation, at a state of all poses and then all landmarks.
    fn residuals(stretch: &Stretch<'_>, state: &[f64]) -> Vec<f64> {
        let (poses, landmarks) = state.split_at(3 * stretch.frames.len());
        let pose = |k: usize| Pose { x: poses[3 * k], y: poses[3 * k + 1], heading: poses[3 * k + 2] };
        let mut all = Vec::new();
        for (k, frame) in stretch.frames.iter().enumerate() {
            for s in &frame.sightings {
                let predicted = predict_bearing(&pose(k), landmarks[2 * s.landmark], landmarks[2 * s.landmark + 1]).0;
                all.push(wrap(s.azimuth_rad - predicted) / s.variance.sqrt());
            }
            if k > 0 {
                let root = frame.motion.covariance.try_inverse().unwrap().cholesky().unwrap();
                all.extend((root.l().transpose() * motion_error(&pose(k - 1), &pose(k), &frame.motion)).iter());
            }
        }
        for (prior, l) in stretch.priors.iter().zip(landmarks.as_chunks::<2>().0) {
            all.extend((0..2).map(|i| (l[i] - prior.mean[i]) / prior.variance[i].sqrt()));
        }
        all
    }

    #[test]
    fn without_landmarks_or_steps_there_is_no_solution() {
        let motion = Motion { delta: Pose::IDENTITY, covariance: Matrix3::identity() };
        let frames = vec![Frame { motion, sightings: Vec::new() }; 3];
        let prior = Prior { mean: [0.0, 0.4], variance: [1.0; 2] };
        for (frames, priors) in [(&frames[..], &[][..]), (&[][..], &[prior][..]), (&[][..], &[][..])] {
            let stretch = Stretch { frames, priors, heavy_tails: true };
            let at = Iterate { poses: vec![Pose::IDENTITY; frames.len()], landmarks: vec![[0.0, 0.4]; priors.len()] };
            assert!(stretch.covariance_at(&at).is_none() && stretch.solve(at).is_none());
        }
    }

    /// Elimination pose by pose against one dense system of all poses and landmarks, whose Jacobian comes from differences: at the
    /// solution the gradient vanishes, and the covariance is the dense inverse's part.
    #[test]
    fn elimination_equals_the_dense_solution() {
        let mut stream = crate::random::Seed(1).stream("smoother");
        let mut normal = || crate::random::standard_normal(&mut stream);
        let landmarks: Vec<[f64; 2]> = (0..7).map(|k| [0.9 * f64::from(k) - 3.0, 0.3 + 0.1 * f64::from(k)]).collect();
        // One whole group of poses and a part of the next; some landmarks come late or go.
        let (mut pose, twist) = (Pose::new(1.0, 0.5, 2.0), Twist { v: 0.8, omega: 0.5 });
        let mut poses = Vec::new();
        let mut frames = Vec::new();
        for k in 0..7 {
            let seen = (0..landmarks.len()).filter(|l| (l + k) % 3 != 0 && (*l != 6 || k > 3));
            let sightings = seen.map(|landmark| {
                let [direction, inverse_range] = landmarks[landmark];
                let azimuth_rad = predict_bearing(&pose, direction, inverse_range).0 + 0.01 * normal();
                Sighting { landmark, azimuth_rad, variance: 1e-4 }
            });
            let delta = Pose::IDENTITY.advanced(twist, 0.3);
            let covariance = Matrix3::new(4e-4, 1e-5, 0.0, 1e-5, 2e-4, 2e-5, 0.0, 2e-5, 3e-4);
            frames.push(Frame { motion: Motion { delta, covariance }, sightings: sightings.collect() });
            poses.push(pose);
            pose = pose.compose(&delta);
        }
        let prior = |l: &[f64; 2]| Prior { mean: [l[0] + 0.01, l[1] - 0.1], variance: [4e-4, 0.09] };
        let priors: Vec<Prior> = landmarks.iter().map(prior).collect();
        let stretch = Stretch { frames: &frames, priors: &priors, heavy_tails: false };
        // Until nothing changes any more.
        let mut solution = stretch.solve(Iterate { poses, landmarks }).unwrap();
        for _ in 0..3 {
            solution = stretch.solve(solution.at).unwrap();
        }
        let at = &solution.at;
        let mut state: Vec<f64> = at.poses.iter().flat_map(|p| [p.x, p.y, p.heading]).collect();
        state.extend(at.landmarks.iter().flatten());
        let here = DVector::from_vec(residuals(&stretch, &state));
        let step = 1e-6;
        let mut jacobian = DMatrix::zeros(here.len(), state.len());
        for column in 0..state.len() {
            let shifted = |by: f64| {
                let mut state = state.clone();
                state[column] += by;
                DVector::from_vec(residuals(&stretch, &state))
            };
            jacobian.set_column(column, &((shifted(step) - shifted(-step)) / (2.0 * step)));
        }
        let gradient = jacobian.transpose() * &here;
        assert!(gradient.amax() < 1e-3, "{}", gradient.amax());
        let squared: f64 = solution.residuals_squared.iter().chain(&solution.motions_squared).sum();
        let of_priors: f64 = here.as_slice()[here.len() - 2 * priors.len()..].iter().map(|r| r * r).sum();
        assert!((squared + of_priors - here.norm_squared()).abs() < 1e-9 * here.norm_squared());
        let dense = (jacobian.transpose() * &jacobian).try_inverse().unwrap();
        let first = 3 * (frames.len() - 1);
        let size = state.len() - first;
        let expected = dense.view((first, first), (size, size));
        let found = stretch.covariance_at(at).unwrap();
        assert!((&found - expected).amax() < 1e-6 * expected.amax(), "{}", (&found - expected).amax() / expected.amax());
        let (mean, covariance) = solution.last().unwrap();
        assert_eq!(mean.as_slice(), &state[first..]);
        assert!((covariance - found).amax() < 1e-6 * expected.amax());
    }

    #[test]
    fn angles_are_those_of_the_arc_tangent() {
        for k in -400..=400 {
            let expected = 0.01 * f64::from(k) * std::f64::consts::FRAC_PI_4;
            let (sin, cos) = sin_cos(expected);
            assert!((angle(3.0 * cos, 3.0 * sin) - expected).abs() < 1e-15 * (1.0 + expected.abs()), "{expected}");
        }
        assert_eq!(angle(0.0, 0.0), 0.0);
    }

    /// The analytic derivatives of the motion error against automatic differentiation of its closed form.
    #[test]
    fn motion_derivatives_equal_automatic_ones() {
        for k in 0..50 {
            let t = f64::from(k);
            let before = Pose::new(libm::sin(t), 2.0 * libm::cos(0.7 * t), 0.3 * t);
            let after = Pose::new(before.x + 0.1 * libm::cos(1.1 * t), before.y + 0.05, before.heading - 0.4);
            let x = [before.x, before.y, before.heading, after.x, after.y, after.heading];
            let (by_before, by_after) = motion_jacobians(&before, &after);
            for column in 0..6 {
                let d: [Dual64; 6] = std::array::from_fn(|i| Dual64::new(x[i], if i == column { 1.0 } else { 0.0 }));
                let (dx, dy) = (d[3] - d[0], d[4] - d[1]);
                let (s, c) = (d[2].sin(), d[2].cos());
                let error = [c * dx + s * dy, c * dy - s * dx, d[5] - d[2]];
                for (row, exact) in error.iter().enumerate() {
                    let analytic = if column < 3 { by_before[(row, column)] } else { by_after[(row, column - 3)] };
                    assert!((exact.eps - analytic).abs() < 1e-12, "{k} {row} {column}: {} {analytic}", exact.eps);
                }
            }
        }
    }
}
