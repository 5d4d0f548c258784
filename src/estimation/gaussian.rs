//! A Gaussian belief over a state of changing size, and its measurement update.
//!
//! Measurements are scalars whose Jacobian rows have few entries, so rows are sparse. A batch of them is applied at once: with
//! innovation covariance S = H P H' + R = L L', the gain form P - (P H' L'^-1)(P H' L'^-1)' keeps the covariance symmetric by
//! construction. Plain loops stand where a matrix product could: library kernels pick fused multiply-adds by processor, and
//! then the same seed would not give the same bytes everywhere.

use nalgebra::{DMatrix, DVector};

/// Most non-zero entries of one measurement's Jacobian row.
const ROW_CAPACITY: usize = 8;

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
        self.entries().iter().map(|&(c, h)| h * v[c]).sum()
    }
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

    /// Applies the linear map x -> F x to the first three components (the robot's pose) and adds noise `q` to them.
    pub fn propagate_pose(&mut self, f: &nalgebra::Matrix3<f64>, q: &nalgebra::Matrix3<f64>) {
        let n = self.len();
        for c in 0..n {
            let column = [self.covariance[(0, c)], self.covariance[(1, c)], self.covariance[(2, c)]];
            for r in 0..3 {
                self.covariance[(r, c)] = (0..3).map(|k| f[(r, k)] * column[k]).sum();
            }
        }
        for r in 0..n {
            let row = [self.covariance[(r, 0)], self.covariance[(r, 1)], self.covariance[(r, 2)]];
            for c in 0..3 {
                self.covariance[(r, c)] = (0..3).map(|k| f[(c, k)] * row[k]).sum();
            }
        }
        for r in 0..3 {
            for c in 0..3 {
                self.covariance[(r, c)] += q[(r, c)];
            }
        }
        self.symmetrise();
    }

    fn symmetrise(&mut self) {
        let n = self.len();
        for c in 0..n {
            for r in (c + 1)..n {
                let mean = 0.5 * (self.covariance[(r, c)] + self.covariance[(c, r)]);
                self.covariance[(r, c)] = mean;
                self.covariance[(c, r)] = mean;
            }
        }
    }

    /// Iterated measurement update (Gauss-Newton on the posterior): `linearise` is called with the current iterate and gives
    /// the same measurements each time, linearised there. Returns the normalised innovation squared of the whole batch at the
    /// prior mean, or `None` where the innovation covariance was not positive definite and nothing was changed.
    pub fn update_iterated(
        &mut self,
        iterations: usize,
        mut linearise: impl FnMut(&DVector<f64>) -> Vec<Linearised>,
    ) -> Option<f64> {
        let prior = self.mean.clone();
        let mut iterate = prior.clone();
        let mut nis = None;
        let mut factor = None;
        for _ in 0..iterations.max(1) {
            let batch = linearise(&iterate);
            if batch.is_empty() {
                return Some(0.0);
            }
            let gain = GainFactor::new(&self.covariance, &batch)?;
            let back = &prior - &iterate;
            let innovation: Vec<f64> = batch.iter().map(|m| m.innovation - m.row.dot(back.as_slice())).collect();
            let (step, squared) = gain.step(&innovation);
            nis.get_or_insert(squared);
            let next = &prior + step;
            if !next.iter().all(|v| v.is_finite()) {
                return None;
            }
            let change = (&next - &iterate).amax();
            iterate = next;
            factor = Some(gain);
            if change < 1e-9 {
                break;
            }
        }
        factor?.downdate(&mut self.covariance);
        self.mean = iterate;
        nis
    }
}

/// P H' and the Cholesky factor of S for one batch.
struct GainFactor {
    /// W = P H' L'^-1, column-major, n x m.
    w: Vec<Vec<f64>>,
    /// L, row by row.
    l: Vec<Vec<f64>>,
}

impl GainFactor {
    fn new(p: &DMatrix<f64>, batch: &[Linearised]) -> Option<Self> {
        let n = p.nrows();
        let p_ht: Vec<Vec<f64>> = batch
            .iter()
            .map(|m| {
                let mut column = vec![0.0; n];
                for &(c, h) in m.row.entries() {
                    for (sum, &v) in column.iter_mut().zip(&p.as_slice()[c * n..(c + 1) * n]) {
                        *sum += h * v;
                    }
                }
                column
            })
            .collect();
        let m = batch.len();
        let mut l: Vec<Vec<f64>> = Vec::with_capacity(m);
        for (i, measurement) in batch.iter().enumerate() {
            let mut row = vec![0.0; i + 1];
            for j in 0..=i {
                let mut s = measurement.row.dot(&p_ht[j]);
                if i == j {
                    s += measurement.variance;
                }
                let done: &[f64] = if i == j { &row[..j] } else { &l[j][..j] };
                for (a, b) in row[..j].iter().zip(done) {
                    s -= a * b;
                }
                if i == j {
                    if !(s > 0.0 && s.is_finite()) {
                        return None;
                    }
                    row[j] = s.sqrt();
                } else {
                    row[j] = s / l[j][j];
                }
            }
            l.push(row);
        }
        let mut w = p_ht;
        for (j, row) in l.iter().enumerate() {
            let (done, rest) = w.split_at_mut(j);
            let column = &mut rest[0];
            for (earlier, &factor) in done.iter().zip(row) {
                for (c, e) in column.iter_mut().zip(earlier) {
                    *c -= factor * e;
                }
            }
            let scale = 1.0 / row[j];
            column.iter_mut().for_each(|c| *c *= scale);
        }
        Some(Self { w, l })
    }

    /// Gain times innovation, and innovation' S^-1 innovation.
    fn step(&self, innovation: &[f64]) -> (DVector<f64>, f64) {
        let mut step = DVector::zeros(self.w[0].len());
        let mut whitened: Vec<f64> = Vec::with_capacity(innovation.len());
        for (i, row) in self.l.iter().enumerate() {
            let known: f64 = row[..i].iter().zip(&whitened).map(|(a, b)| a * b).sum();
            let e = (innovation[i] - known) / row[i];
            for (s, w) in step.iter_mut().zip(&self.w[i]) {
                *s += e * w;
            }
            whitened.push(e);
        }
        (step, whitened.iter().map(|e| e * e).sum())
    }

    /// P - W W'.
    fn downdate(&self, p: &mut DMatrix<f64>) {
        let n = p.nrows();
        for c in 0..n {
            let column = &mut p.as_mut_slice()[c * n + c..(c + 1) * n];
            for w in &self.w {
                let factor = w[c];
                for (v, e) in column.iter_mut().zip(&w[c..]) {
                    *v -= factor * e;
                }
            }
        }
        for c in 0..n {
            for r in (c + 1)..n {
                p[(c, r)] = p[(r, c)];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A batch update equals the information form, worked out with dense inverses.
    #[test]
    fn update_equals_information_form() {
        let mut belief = Gaussian::diagonal(&[1.0, -2.0, 0.5, 3.0], &[2.0, 1.0, 0.5, 4.0]);
        belief.propagate_pose(
            &nalgebra::Matrix3::new(1.0, 0.2, 0.0, -0.1, 1.0, 0.3, 0.0, 0.0, 1.0),
            &(nalgebra::Matrix3::identity() * 0.1),
        );
        let rows = [vec![(0, 1.0), (3, -0.5)], vec![(1, 2.0)], vec![(2, 1.0), (3, 1.0), (0, 0.3)]];
        let z = [0.4, -0.2, 1.1];
        let variances = [0.1, 0.2, 0.05];
        let (prior_mean, prior_cov) = (belief.mean.clone(), belief.covariance.clone());
        let mut h = DMatrix::zeros(3, 4);
        for (i, row) in rows.iter().enumerate() {
            row.iter().for_each(|&(c, v)| h[(i, c)] = v);
        }
        let z_vector = DVector::from_column_slice(&z);
        belief
            .update_iterated(3, |x| {
                let predicted = &h * x;
                (0..3)
                    .map(|i| {
                        let mut row = SparseRow::default();
                        rows[i].iter().for_each(|&(c, v)| row.push(c, v));
                        Linearised { innovation: z[i] - predicted[i], row, variance: variances[i] }
                    })
                    .collect()
            })
            .unwrap();
        let r_inverse = DMatrix::from_diagonal(&DVector::from_iterator(3, variances.iter().map(|v| 1.0 / v)));
        let p_inverse = prior_cov.clone().try_inverse().unwrap();
        let cov = (&p_inverse + h.transpose() * &r_inverse * &h).try_inverse().unwrap();
        let mean = &cov * (&p_inverse * prior_mean + h.transpose() * r_inverse * z_vector);
        assert!((belief.covariance - cov).amax() < 1e-12);
        assert!((belief.mean - mean).amax() < 1e-12);
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
