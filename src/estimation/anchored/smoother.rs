//! The smoother: all bearings and odometry of a stretch of the run at once, in the home frame.
//!
//! An extended Kalman filter never revisits a linearisation. While ranges are unknown that costs it its consistency, so the
//! filter's belief is built anew from the stored stretch by Gauss-Newton on the full posterior: poses of the robot at every
//! step, and direction and inverse range from home of every landmark. Poses form a chain; eliminating them one after the other
//! leaves a dense system in the last pose and the landmarks only, whose inverse is the filter's covariance. A step costs
//! O(steps x landmarks^2).

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::map::{Prior, predict_bearing};
use super::motion::Motion;
use crate::geometry::{Pose, sin_cos, wrap};

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
    /// Mean of (last pose, landmarks).
    pub mean: DVector<f64>,
    /// Covariance of (last pose, landmarks).
    pub covariance: DMatrix<f64>,
    /// Sum of squared normalised residuals of the bearings, and their number.
    pub chi_square: (f64, usize),
}

/// What elimination of one pose leaves for back-substitution: pose = g - to_next next - to_landmarks landmarks.
struct Eliminated {
    to_next: Matrix3<f64>,
    to_landmarks: Vec<Vector3<f64>>,
    g: Vector3<f64>,
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

impl Stretch<'_> {
    /// Gauss-Newton from a start; `None` where it does not converge to a regular solution.
    #[must_use]
    pub fn solve(&self, start: Iterate) -> Option<Solution> {
        let mut at = start;
        let mut cost = self.cost(&at);
        let mut information = None;
        for _ in 0..ITERATIONS {
            let (lambda, step) = self.step(&at)?;
            information = Some(lambda);
            let mut share = 1.0;
            let mut next = step.apply(&at, share);
            let mut next_cost = self.cost(&next);
            while next_cost > cost + 1e-9 && share > 0.02 {
                share *= 0.5;
                next = step.apply(&at, share);
                next_cost = self.cost(&next);
            }
            if next_cost > cost + 1e-9 {
                break;
            }
            let gained = cost - next_cost;
            at = next;
            cost = next_cost;
            if gained < 1e-4 && share == 1.0 {
                break;
            }
        }
        let covariance = information?.cholesky()?.inverse();
        let last = at.poses.last()?;
        let mean = DVector::from_iterator(
            3 + 2 * at.landmarks.len(),
            [last.x, last.y, last.heading].into_iter().chain(at.landmarks.iter().flatten().copied()),
        );
        let chi_square = self.bearing_chi_square(&at);
        (mean.iter().all(|v| v.is_finite()) && covariance.iter().all(|v| v.is_finite())).then_some(Solution {
            at,
            mean,
            covariance,
            chi_square,
        })
    }

    /// Covariance of (last pose, landmarks) by the information at given poses and landmarks. At the true ones, and without heavy
    /// tails, it is the Cramer-Rao bound. `None` where the information is singular.
    #[must_use]
    pub fn covariance_at(&self, at: &Iterate) -> Option<DMatrix<f64>> {
        Some(self.step(at)?.0.cholesky()?.inverse())
    }

    /// Squared normalised residual of one sighting.
    #[must_use]
    pub fn residual_squared(at: &Iterate, frame: usize, s: &Sighting) -> f64 {
        let l = at.landmarks[s.landmark];
        let r = wrap(s.azimuth_rad - predict_bearing(&at.poses[frame], l[0], l[1]).0);
        r * r / s.variance
    }

    /// Squared Mahalanobis distance between how the robot came to a frame, the first excepted, and what odometry tells.
    #[must_use]
    pub fn motion_squared(&self, at: &Iterate, frame: usize) -> f64 {
        let motion = &self.frames[frame].motion;
        let e = motion_error(&at.poses[frame - 1], &at.poses[frame], motion);
        motion.covariance.try_inverse().map_or(f64::INFINITY, |w| (w * e).dot(&e))
    }

    /// Contribution of a squared normalised residual to the cost, and its weight in the normal equations.
    fn loss(&self, squared: f64) -> (f64, f64) {
        if self.heavy_tails {
            ((TAIL + 1.0) * libm::log(1.0 + squared / TAIL), (TAIL + 1.0) / (TAIL + squared))
        } else {
            (squared, 1.0)
        }
    }

    fn bearing_chi_square(&self, at: &Iterate) -> (f64, usize) {
        let mut sum = 0.0;
        let mut count = 0;
        for (k, frame) in self.frames.iter().enumerate() {
            for s in &frame.sightings {
                sum += Self::residual_squared(at, k, s);
                count += 1;
            }
        }
        (sum, count)
    }

    fn cost(&self, at: &Iterate) -> f64 {
        let mut sum = 0.0;
        for (k, frame) in self.frames.iter().enumerate() {
            sum += frame.sightings.iter().map(|s| self.loss(Self::residual_squared(at, k, s)).0).sum::<f64>();
        }
        for (prior, l) in self.priors.iter().zip(&at.landmarks) {
            let d = wrap(l[0] - prior.mean[0]);
            let r = l[1] - prior.mean[1];
            sum += d * d / prior.variance[0] + r * r / prior.variance[1];
        }
        for k in 1..self.frames.len() {
            sum += self.motion_squared(at, k);
        }
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// One Gauss-Newton step: information matrix of (last pose, landmarks) and the step of everything.
    fn step(&self, at: &Iterate) -> Option<(DMatrix<f64>, Step)> {
        let n = 2 * self.priors.len();
        // Information of the landmarks among themselves (column-major), of the current pose with them, of the pose itself.
        let mut ll = vec![0.0; n * n];
        let mut l_right = vec![0.0; n];
        for (k, (prior, l)) in self.priors.iter().zip(&at.landmarks).enumerate() {
            let off = [wrap(prior.mean[0] - l[0]), prior.mean[1] - l[1]];
            for (c, (off, variance)) in (2 * k..).zip(off.into_iter().zip(prior.variance)) {
                ll[c * n + c] = 1.0 / variance;
                l_right[c] = off / variance;
            }
        }
        let mut pl = vec![Vector3::zeros(); n];
        let mut pp = Matrix3::zeros();
        let mut p_right = Vector3::zeros();
        let mut eliminated = Vec::with_capacity(self.frames.len());
        let mut parts: [(Vec<f64>, Vec<f64>); 3] = Default::default();
        for (k, frame) in self.frames.iter().enumerate() {
            for s in &frame.sightings {
                let l = at.landmarks[s.landmark];
                let (predicted, d) = predict_bearing(&at.poses[k], l[0], l[1]);
                let r = wrap(s.azimuth_rad - predicted);
                let w = self.loss(r * r / s.variance).1 / s.variance;
                let jp = Vector3::new(d[0], d[1], d[2]);
                pp += w * jp * jp.transpose();
                p_right += w * r * jp;
                for i in 0..2 {
                    let ci = 2 * s.landmark + i;
                    pl[ci] += w * d[3 + i] * jp;
                    l_right[ci] += w * r * d[3 + i];
                    for j in 0..2 {
                        ll[(2 * s.landmark + j) * n + ci] += w * d[3 + i] * d[3 + j];
                    }
                }
            }
            let Some(next) = self.frames.get(k + 1) else { break };
            let (before, after) = (&at.poses[k], &at.poses[k + 1]);
            let e = motion_error(before, after, &next.motion);
            let weight = next.motion.covariance.try_inverse()?;
            let (jb, ja) = motion_jacobians(before, after);
            let inverse = (pp + jb.transpose() * weight * jb).try_inverse()?;
            let right = p_right - jb.transpose() * weight * e;
            let cross = jb.transpose() * weight * ja;
            let to_next = inverse * cross;
            let g = inverse * right;
            let to_landmarks: Vec<Vector3<f64>> = pl.iter().map(|c| inverse * c).collect();
            for (component, (pl_part, t_part)) in parts.iter_mut().enumerate() {
                pl_part.clear();
                pl_part.extend(pl.iter().map(|p| p[component]));
                t_part.clear();
                t_part.extend(to_landmarks.iter().map(|t| t[component]));
            }
            subtract_products(&mut ll, &parts);
            for (right, p) in l_right.iter_mut().zip(&pl) {
                *right -= p.dot(&g);
            }
            pp = ja.transpose() * weight * ja - cross.transpose() * to_next;
            p_right = -(ja.transpose() * weight * e) - cross.transpose() * g;
            for (p, t) in pl.iter_mut().zip(&to_landmarks) {
                *p = -(cross.transpose() * t);
            }
            eliminated.push(Eliminated { to_next, to_landmarks, g });
        }
        let mut lambda = DMatrix::zeros(3 + n, 3 + n);
        lambda.fixed_view_mut::<3, 3>(0, 0).copy_from(&pp);
        for c in 0..n {
            for i in 0..3 {
                lambda[(i, 3 + c)] = pl[c][i];
                lambda[(3 + c, i)] = pl[c][i];
            }
            // Only rows from the diagonal down were kept up to date.
            for r in c..n {
                lambda[(3 + r, 3 + c)] = ll[c * n + r];
                lambda[(3 + c, 3 + r)] = ll[c * n + r];
            }
        }
        let right = DVector::from_iterator(3 + n, p_right.iter().copied().chain(l_right));
        let solved = lambda.clone().cholesky()?.solve(&right);
        let landmarks: Vec<[f64; 2]> = (0..self.priors.len()).map(|k| [solved[3 + 2 * k], solved[4 + 2 * k]]).collect();
        let mut next = Vector3::new(solved[0], solved[1], solved[2]);
        let mut poses = vec![next];
        for e in eliminated.iter().rev() {
            let mut pose = e.g - e.to_next * next;
            for (c, t) in e.to_landmarks.iter().enumerate() {
                pose -= t * solved[3 + c];
            }
            poses.push(pose);
            next = pose;
        }
        poses.reverse();
        Some((lambda, Step { poses, landmarks }))
    }
}

/// Subtracts from `ll` (column-major, n x n, from the diagonal down) the outer product of two lists of n vectors, given by components.
/// Plain loops over components vectorise, which vectors of three do not; the result is the same.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn subtract_products(ll: &mut [f64], [(px, tx), (py, ty), (pz, tz)]: &[(Vec<f64>, Vec<f64>); 3]) {
    let n = px.len();
    for c in 0..n {
        let (x, y, z) = (tx[c], ty[c], tz[c]);
        if x == 0.0 && y == 0.0 && z == 0.0 {
            continue; // not seen yet
        }
        let rows = ll[c * n + c..(c + 1) * n].iter_mut().zip(&px[c..]).zip(&py[c..]).zip(&pz[c..]);
        for (((v, px), py), pz) in rows {
            *v -= px * x + py * y + pz * z;
        }
    }
}

/// Change of all poses and landmarks.
struct Step {
    poses: Vec<Vector3<f64>>,
    landmarks: Vec<[f64; 2]>,
}

impl Step {
    fn apply(&self, at: &Iterate, share: f64) -> Iterate {
        Iterate {
            poses: at
                .poses
                .iter()
                .zip(&self.poses)
                .map(|(p, d)| Pose::new(p.x + share * d.x, p.y + share * d.y, p.heading + share * d.z))
                .collect(),
            landmarks: at
                .landmarks
                .iter()
                .zip(&self.landmarks)
                .map(|(l, d)| [wrap(l[0] + share * d[0]), l[1] + share * d[1]])
                .collect(),
        }
    }
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
