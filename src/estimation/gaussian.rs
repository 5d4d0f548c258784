//! A Gaussian belief over a state of changing size, and its measurement update.
//!
//! Measurements are scalars whose Jacobian rows have few entries, so rows are sparse. A batch of them is applied at once: with
//! innovation covariance S = H P H' + R = L L', the gain form P - W W', W = P H' L'^-1, keeps the covariance symmetric by
//! construction.
//!
//! The arithmetic is that of `dense`. An update of n components by m bearings takes about n^2 m / 2 multiplications for
//! the covariance and n m^2 / 2 for W, and each iterate m^3 / 6 for L.

use nalgebra::{DMatrix, DVector};

use super::dense::{TILE, add_columns, factorise_lower, solve_lower, solve_transposed, subtract_squared};

/// Most non-zero entries of one measurement's Jacobian row: a pose and a landmark.
const ROW_CAPACITY: usize = 5;

/// One row of a measurement Jacobian.
#[derive(Debug, Clone, Copy, Default)]
pub struct SparseRow {
    entries: [(usize, f64); ROW_CAPACITY],
    len: usize,
}

impl SparseRow {
    /// Adds an entry; each column at most once.
    pub fn push(&mut self, column: usize, value: f64) {
        self.entries[self.len] = (column, value);
        self.len += 1;
    }

    /// The entries as (column, value).
    #[must_use]
    pub fn entries(&self) -> &[(usize, f64)] {
        &self.entries[..self.len]
    }

    /// Product with a dense vector.
    #[must_use]
    pub fn dot(&self, v: &[f64]) -> f64 {
        // Entries that are not used are zeros: a loop of one length is unrolled.
        self.entries.iter().map(|&(c, h)| h * v[c]).sum()
    }
}

/// An iterate that changes no component by more than this, m, rad or 1/m, is the last: linearised elsewhere by so little, a
/// bearing to something 0.3 m away would differ by 1e-5 rad.
const SETTLED: f64 = 1e-3;

/// Where the measurements of an update are linearised for the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CovarianceAt {
    /// At the prior mean, which is nearer to where earlier measurements were linearised than the iterate is. Measurements that are
    /// linearised in different places claim to tell what they cannot (Huang, Mourikis and Roumeliotis, 2010, who therefore keep the
    /// first estimates).
    Prior,
    /// At the last iterate but one: for priors so wide that their mean means little.
    Posterior,
}

/// A scalar measurement, linearised.
#[derive(Debug, Clone, Copy)]
pub struct Linearised {
    /// Measured minus predicted.
    pub innovation: f64,
    /// Jacobian of the prediction.
    pub row: SparseRow,
    /// Variance of the measurement noise.
    pub variance: f64,
}

/// Mean and covariance.
#[derive(Debug, Clone)]
pub struct Gaussian {
    /// Mean, length n.
    pub mean: DVector<f64>,
    /// Covariance, n x n, symmetric.
    pub covariance: DMatrix<f64>,
}

impl Gaussian {
    /// A belief with independent components.
    #[must_use]
    pub fn diagonal(mean: &[f64], variances: &[f64]) -> Self {
        Self {
            mean: DVector::from_column_slice(mean),
            covariance: DMatrix::from_diagonal(&DVector::from_column_slice(variances)),
        }
    }

    /// Number of components.
    #[must_use]
    pub fn len(&self) -> usize {
        self.mean.len()
    }

    /// Whether there is no component.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.mean.is_empty()
    }

    /// Appends components that are independent of the others.
    pub fn append(&mut self, mean: &[f64], variances: &[f64]) {
        let n = self.len();
        self.mean.resize_vertically_mut(n + mean.len(), 0.0);
        self.covariance.resize_mut(n + mean.len(), n + mean.len(), 0.0);
        for (k, (&m, &v)) in mean.iter().zip(variances).enumerate() {
            self.mean[n + k] = m;
            self.covariance[(n + k, n + k)] = v;
        }
    }

    /// Drops `count` components from `first` on: marginalises them out.
    pub fn remove(&mut self, first: usize, count: usize) {
        let mean = std::mem::replace(&mut self.mean, DVector::zeros(0));
        self.mean = mean.remove_rows(first, count);
        let covariance = std::mem::replace(&mut self.covariance, DMatrix::zeros(0, 0));
        self.covariance = covariance.remove_rows(first, count).remove_columns(first, count);
    }

    /// Makes components independent of all others, with a new mean and variance.
    pub fn reset(&mut self, first: usize, mean: &[f64], variances: &[f64]) {
        for (k, (&m, &v)) in mean.iter().zip(variances).enumerate() {
            self.mean[first + k] = m;
            self.covariance.row_mut(first + k).fill(0.0);
            self.covariance.column_mut(first + k).fill(0.0);
            self.covariance[(first + k, first + k)] = v;
        }
    }

    /// Variance of a linear function of the state.
    #[must_use]
    pub fn variance_along(&self, row: &SparseRow) -> f64 {
        let mut sum = 0.0;
        for &(i, a) in row.entries() {
            for &(j, b) in row.entries() {
                sum += a * b * self.covariance[(i, j)];
            }
        }
        sum
    }

    /// Whether the normalised innovation squared of a measurement that is linearised at the mean is within the gate.
    #[must_use]
    pub fn fits(&self, m: &Linearised, gate: f64) -> bool {
        m.innovation * m.innovation <= gate * (self.variance_along(&m.row) + m.variance)
    }

    /// Applies the linear map x -> F x to the first three components (the robot's pose) and adds noise `q` to them.
    pub fn propagate_pose(&mut self, f: &nalgebra::Matrix3<f64>, q: &nalgebra::Matrix3<f64>) {
        let n = self.len();
        let p = self.covariance.as_mut_slice();
        let mapped =
            |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|r| f[(r, 0)] * v[0] + f[(r, 1)] * v[1] + f[(r, 2)] * v[2]) };
        for c in 3..n {
            let column = mapped([p[c * n], p[c * n + 1], p[c * n + 2]]);
            for (r, &v) in column.iter().enumerate() {
                p[c * n + r] = v;
                p[r * n + c] = v;
            }
        }
        // F P F' of the pose itself: first its columns, then the rows of what they became.
        let columns: [[f64; 3]; 3] = std::array::from_fn(|c| mapped([p[c * n], p[c * n + 1], p[c * n + 2]]));
        let block: [[f64; 3]; 3] = std::array::from_fn(|r| mapped([columns[0][r], columns[1][r], columns[2][r]]));
        for r in 0..3 {
            for c in 0..3 {
                p[c * n + r] = 0.5 * (block[r][c] + block[c][r] + q[(r, c)] + q[(c, r)]);
            }
        }
    }

    /// Iterated measurement update (Gauss-Newton on the posterior): `linearise` is called with the current iterate and gives
    /// the same measurements each time, linearised there; `covariance_at` says which linearisation shrinks the covariance. Returns
    /// the normalised innovation squared of the whole batch at the prior mean.
    ///
    /// # Errors
    ///
    /// [`Refused`] where the innovation covariance is not positive definite, or the normalised innovation squared of the batch is
    /// more than `joint_gate` of the number of measurements; nothing is changed then.
    pub fn update_iterated(
        &mut self,
        iterations: usize,
        covariance_at: CovarianceAt,
        joint_gate: impl Fn(usize) -> f64,
        mut linearise: impl FnMut(&DVector<f64>) -> Vec<Linearised>,
    ) -> Result<f64, Refused> {
        let prior = self.mean.clone();
        let mut iterate = prior.clone();
        let mut nis = None;
        let (mut factor, mut at_prior) = (Factor::default(), None);
        for iteration in 0..iterations.max(1) {
            let batch = linearise(&iterate);
            if batch.is_empty() {
                return Ok(0.0);
            }
            if iteration == 1 && covariance_at == CovarianceAt::Prior {
                at_prior = Some(std::mem::take(&mut factor));
            }
            factor.compute(&self.covariance, &batch).ok_or(Refused::Singular)?;
            let back = &prior - &iterate;
            let innovation: Vec<f64> = batch.iter().map(|m| m.innovation - m.row.dot(back.as_slice())).collect();
            let (step, squared) = factor.step(&innovation);
            if nis.is_none() && squared > joint_gate(batch.len()) {
                return Err(Refused::Jointly { worst: factor.worst(&innovation) });
            }
            nis.get_or_insert(squared);
            let next = &prior + step;
            if !next.iter().all(|v| v.is_finite()) {
                return Err(Refused::Singular);
            }
            let change = (&next - &iterate).amax();
            iterate = next;
            if change < SETTLED {
                break;
            }
        }
        at_prior.unwrap_or(factor).downdate(&mut self.covariance);
        self.mean = iterate;
        Ok(nis.unwrap_or(0.0))
    }
}

/// Why a measurement update was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// The innovation covariance is not positive definite, or the update not finite.
    Singular,
    /// The measurements contradict the belief, or each other, as a whole, though each may fit alone.
    Jointly {
        /// Index of the one that the belief and all others together contradict most.
        worst: usize,
    },
}

/// P H' and the Cholesky factor of S for one batch. The buffers are used again for the next one.
#[derive(Default)]
struct Factor {
    /// Number of components.
    n: usize,
    /// Number of measurements.
    m: usize,
    /// P H', column-major, n x m, each column with zeros up to a whole number of tiles.
    p_ht: Vec<f64>,
    /// L, column-major, m x m; what is above the diagonal means nothing.
    l: Vec<f64>,
}

impl Factor {
    /// `None` where S is not positive definite.
    fn compute(&mut self, p: &DMatrix<f64>, batch: &[Linearised]) -> Option<()> {
        let (n, m) = (p.nrows(), batch.len());
        (self.n, self.m) = (n, m);
        self.p_ht.resize(n.next_multiple_of(TILE) * m, 0.0);
        self.l.resize(m * m, 0.0);
        factorise(&mut self.p_ht, &mut self.l, p.as_slice(), batch).then_some(())
    }

    /// Gain times innovation, and innovation' S^-1 innovation.
    fn step(&self, innovation: &[f64]) -> (DVector<f64>, f64) {
        let (n, m) = (self.n, self.m);
        let mut innovation = innovation.to_vec();
        solve_lower(&self.l, 0, &mut innovation);
        let squared = innovation.iter().map(|v| v * v).sum();
        solve_transposed(&self.l, &mut innovation);
        let mut step = DVector::zeros(n);
        add_columns(step.as_mut_slice(), m, |k| innovation[k], |k| &self.p_ht[k * n.next_multiple_of(TILE)..]);
        (step, squared)
    }

    /// The measurement whose innovation is farthest, by its standard deviation, from what the belief and all other measurements
    /// make of it: (S^-1 v)_i / sqrt((S^-1)_ii) is greatest.
    fn worst(&self, innovation: &[f64]) -> usize {
        let m = self.m;
        let mut whitened = innovation.to_vec();
        solve_lower(&self.l, 0, &mut whitened);
        let mut unit = vec![0.0; m];
        let squared = |i: usize| {
            unit.fill(0.0);
            unit[i] = 1.0;
            solve_lower(&self.l, i, &mut unit);
            let (dot, square) = unit[i..].iter().zip(&whitened[i..]).fold((0.0, 0.0), |(d, s), (u, w)| (d + u * w, s + u * u));
            dot * dot / square
        };
        let squares: Vec<f64> = (0..m).map(squared).collect();
        (0..m).max_by(|&a, &b| squares[a].total_cmp(&squares[b])).unwrap_or(0)
    }

    /// P - W W'. P H' becomes W.
    fn downdate(&mut self, p: &mut DMatrix<f64>) {
        subtract_squared(p.as_mut_slice(), &mut self.p_ht, &self.l, self.n);
    }
}

/// P H' and L of a batch; `false` where S is not positive definite.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn factorise(p_ht: &mut [f64], l: &mut [f64], p: &[f64], batch: &[Linearised]) -> bool {
    let m = batch.len();
    let stride = p_ht.len() / m;
    let n = p.len().isqrt();
    for (j, measurement) in batch.iter().enumerate() {
        let column = &mut p_ht[j * stride..][..stride];
        column.fill(0.0);
        let column = &mut column[..n];
        let entries = measurement.row.entries();
        add_columns(column, entries.len(), |k| entries[k].1, |k| &p[entries[k].0 * n..]);
        for (i, other) in batch.iter().enumerate().skip(j) {
            l[j * m + i] = other.row.dot(column);
        }
        l[j * m + j] += measurement.variance;
    }
    factorise_lower(l, m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pose and landmarks that hang together after a motion, and `m` bearings of every other landmark.
    fn dense_belief(landmarks: usize, m: usize) -> (Gaussian, Vec<SparseRow>) {
        let mut stream = crate::random::Seed(1).stream("gaussian");
        let mut normal = || crate::random::standard_normal(&mut stream);
        let n = 3 + 2 * landmarks;
        let mean: Vec<f64> = (0..n).map(|_| normal()).collect();
        let root = DMatrix::from_fn(n, n, |_, _| normal());
        let belief = Gaussian { mean: DVector::from_vec(mean), covariance: &root * root.transpose() };
        let row = |k: usize, normal: &mut dyn FnMut() -> f64| {
            let mut row = SparseRow::default();
            let c = 3 + 4 * (k % landmarks.div_ceil(2));
            [0, 1, 2, c, c + 1].iter().for_each(|&c| row.push(c, normal()));
            row
        };
        (belief, (0..m).map(|k| row(k, &mut normal)).collect())
    }

    fn dense(rows: &[SparseRow], n: usize) -> DMatrix<f64> {
        let mut h = DMatrix::zeros(rows.len(), n);
        for (i, row) in rows.iter().enumerate() {
            row.entries().iter().for_each(|&(c, v)| h[(i, c)] = v);
        }
        h
    }

    /// Of a measurement that is not linear, the mean is the iterated one and the covariance that of a single iteration.
    #[test]
    fn the_covariance_may_be_that_of_the_prior_place() {
        let (prior, rows) = dense_belief(3, 2);
        let update = |iterations, at| {
            let mut belief = prior.clone();
            let linearise = |x: &DVector<f64>| {
                let stretched = |row: &SparseRow| {
                    let along = row.dot(x.as_slice());
                    let mut stretched = SparseRow::default();
                    row.entries().iter().for_each(|&(c, v)| stretched.push(c, v * (1.0 + 0.02 * along)));
                    Linearised { innovation: 1.0 - along - 0.01 * along * along, row: stretched, variance: 0.5 }
                };
                rows.iter().map(stretched).collect()
            };
            belief.update_iterated(iterations, at, |_| f64::INFINITY, linearise).unwrap();
            belief
        };
        let (once, last) = (update(1, CovarianceAt::Prior), update(3, CovarianceAt::Posterior));
        let both = update(3, CovarianceAt::Prior);
        assert_eq!((&both.mean, &both.covariance), (&last.mean, &once.covariance));
        assert!((&once.mean - &last.mean).amax() > SETTLED && once.covariance != last.covariance);
    }

    /// A batch update equals the information form, worked out with dense inverses; for batches within one block, of several
    /// and with a rest.
    #[test]
    fn update_equals_information_form() {
        for (landmarks, m) in [(2, 1), (5, 3), (9, 8), (12, 21)] {
            let (mut belief, rows) = dense_belief(landmarks, m);
            let n = belief.len();
            let (prior_mean, prior_cov) = (belief.mean.clone(), belief.covariance.clone());
            let h = dense(&rows, n);
            let z = DVector::from_fn(m, |i, _| 0.3 * i as f64 - 1.0);
            let variance = |i: usize| 0.1 + 0.05 * i as f64;
            let nis = belief
                .update_iterated(
                    3,
                    CovarianceAt::Posterior,
                    |_| f64::INFINITY,
                    |x| {
                        let predicted = &h * x;
                        let linearised = |(i, row): (usize, &SparseRow)| Linearised {
                            innovation: z[i] - predicted[i],
                            row: *row,
                            variance: variance(i),
                        };
                        rows.iter().enumerate().map(linearised).collect()
                    },
                )
                .unwrap();
            let noise = DMatrix::from_diagonal(&DVector::from_fn(m, |i, _| variance(i)));
            let noise_inverse = noise.clone().try_inverse().unwrap();
            let p_inverse = prior_cov.clone().try_inverse().unwrap();
            let cov = (&p_inverse + h.transpose() * &noise_inverse * &h).try_inverse().unwrap();
            let mean = &cov * (&p_inverse * &prior_mean + h.transpose() * noise_inverse * &z);
            let scale = prior_cov.amax();
            assert!((&belief.covariance - cov).amax() < 1e-10 * scale, "{landmarks} {m}");
            assert!((&belief.mean - mean).amax() < 1e-9 * scale, "{landmarks} {m}");
            assert_eq!(belief.covariance, belief.covariance.transpose());
            let innovation = &z - &h * prior_mean;
            let s_inverse = (&h * prior_cov * h.transpose() + noise).try_inverse().unwrap();
            let expected = innovation.dot(&(s_inverse * &innovation));
            assert!((nis - expected).abs() < 1e-9 * (1.0 + expected), "{nis} {expected}");
        }
    }

    /// A batch that is refused as a whole leaves the belief alone and names the measurement without which the rest fits best,
    /// by the NIS of every batch without one of them.
    #[test]
    fn a_joint_refusal_names_the_measurement_that_fits_least() {
        let (belief, rows) = dense_belief(9, 12);
        for planted in 0..rows.len() {
            let update = |without: Option<usize>, gate: f64| {
                let mut trial = belief.clone();
                let measured = |(i, row): (usize, &SparseRow)| Linearised {
                    innovation: if i == planted { 40.0 } else { libm::sin(i as f64) },
                    row: *row,
                    variance: 0.2,
                };
                let batch: Vec<_> = rows.iter().enumerate().filter(|(i, _)| Some(*i) != without).map(measured).collect();
                (trial.update_iterated(1, CovarianceAt::Prior, |_| gate, |_| batch.clone()), trial)
            };
            let (all, after) = update(None, 10.0);
            assert_eq!(after.mean, belief.mean);
            assert_eq!(after.covariance, belief.covariance);
            let nis = |i: usize| update(Some(i), f64::INFINITY).0.unwrap();
            let worst = (0..rows.len()).min_by(|&a, &b| nis(a).total_cmp(&nis(b))).unwrap();
            assert_eq!(all, Err(Refused::Jointly { worst }), "{planted}");
        }
    }

    #[test]
    fn a_motion_maps_the_whole_covariance() {
        let (mut belief, _) = dense_belief(4, 0);
        let n = belief.len();
        let f = nalgebra::Matrix3::new(1.0, 0.2, 0.0, -0.1, 1.0, 0.3, 0.0, 0.4, 1.0);
        let q = nalgebra::Matrix3::new(0.3, 0.1, 0.0, 0.1, 0.2, 0.0, 0.0, 0.0, 0.1);
        let mut whole = DMatrix::identity(n, n);
        whole.fixed_view_mut::<3, 3>(0, 0).copy_from(&f);
        let mut expected = &whole * &belief.covariance * whole.transpose();
        for r in 0..3 {
            for c in 0..3 {
                expected[(r, c)] += q[(r, c)];
            }
        }
        belief.propagate_pose(&f, &q);
        assert!((&belief.covariance - expected).amax() < 1e-12 * belief.covariance.amax());
        assert_eq!(belief.covariance, belief.covariance.transpose());
    }

    #[test]
    fn append_and_remove_keep_the_rest() {
        let mut belief = Gaussian::diagonal(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]);
        belief.append(&[4.0, 5.0], &[4.0, 5.0]);
        belief.remove(1, 2);
        assert_eq!(belief.mean.as_slice(), &[1.0, 4.0, 5.0]);
        assert_eq!(belief.covariance.diagonal().as_slice(), &[1.0, 4.0, 5.0]);
    }
}
