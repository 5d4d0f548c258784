//! Dense matrices by plain loops: Cholesky factors, what is solved with them, and products of a matrix with its transpose.
//!
//! Plain loops stand where a library's matrix product could: library kernels pick fused multiply-adds by processor, and then the
//! same seed would not give the same bytes everywhere. Nearly all time goes into two of them, which the compiler turns into vector
//! instructions: one adds four columns to one at a time, one works on tiles of eight rows and some columns.
//!
//! Matrices are column-major. A lower triangular one has its columns in full; what is above the diagonal means nothing.

use nalgebra::DMatrix;

/// Rows that are worked on together: a vector of the widest kind.
pub(super) const TILE: usize = 8;
/// Columns of W whose share of P - W W' is worked out together.
const BLOCK: usize = 8;

/// The Cholesky factor L of a symmetric matrix of n x n, of which only the part from the diagonal down is looked at, in its place;
/// `false` where it is not positive definite. To be inlined into functions that were compiled for a vector unit.
#[inline(always)]
pub(super) fn factorise_lower(l: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        let (done, rest) = l.split_at_mut(j * n);
        let column = &mut rest[j..n];
        add_columns(column, j, |k| -done[k * n + j], |k| &done[k * n + j..]);
        let square = column[0];
        if !(square > 0.0 && square.is_finite()) {
            return false;
        }
        let root = square.sqrt();
        let scale = 1.0 / root;
        column[0] = root;
        column[1..].iter_mut().for_each(|v| *v *= scale);
    }
    true
}

/// [`factorise_lower`] on the widest vector unit at hand.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn factorise(l: &mut [f64], n: usize) -> bool {
    factorise_lower(l, n)
}

/// L x = b in the place of b, which is zero before component `first`.
pub(super) fn solve_lower(l: &[f64], first: usize, b: &mut [f64]) {
    let n = b.len();
    for j in first..n {
        let column = &l[j * n + j..(j + 1) * n];
        let (now, later) = b[j..].split_at_mut(1);
        now[0] /= column[0];
        for (v, l) in later.iter_mut().zip(&column[1..]) {
            *v -= l * now[0];
        }
    }
}

/// L' x = b in the place of b.
pub(super) fn solve_transposed(l: &[f64], b: &mut [f64]) {
    let n = b.len();
    for j in (0..n).rev() {
        let column = &l[j * n + j..(j + 1) * n];
        b[j] = (b[j] - dot(&column[1..], &b[j + 1..])) / column[0];
    }
}

/// Product of two vectors, summed up in [`TILE`] interleaved parts.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_tiles, a_rest) = a.as_chunks::<TILE>();
    let (b_tiles, b_rest) = b.as_chunks::<TILE>();
    let mut sums = [0.0; TILE];
    for (a, b) in a_tiles.iter().zip(b_tiles) {
        for i in 0..TILE {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

/// The inverse of L L'.
pub(super) fn inverse(l: &[f64], n: usize) -> DMatrix<f64> {
    let stride = n.next_multiple_of(TILE);
    let mut w = vec![0.0; stride * n];
    for k in 0..n {
        w[k * stride + k] = 1.0;
    }
    // -W W' with W L' = I.
    let mut inverse = DMatrix::zeros(n, n);
    subtract_squared(inverse.as_mut_slice(), &mut w, l, n);
    inverse.neg_mut();
    inverse
}

/// P - W W' with W L' = V, for a symmetric P of n x n, a block of columns of V after the other. `w` holds the columns of V, each
/// with zeros up to a whole number of [tiles](TILE), and holds W in the end.
#[multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn subtract_squared(p: &mut [f64], w: &mut [f64], l: &[f64], n: usize) {
    let stride = n.next_multiple_of(TILE);
    let m = w.len() / stride;
    let (mut factors, mut rows) = (Vec::new(), Vec::<[f64; BLOCK]>::new());
    // A last block is seldom full.
    let mut few_rows = Vec::<[f64; BLOCK / 4]>::new();
    for first in (0..m).step_by(BLOCK) {
        let count = BLOCK.min(m - first);
        let (done, rest) = w.split_at_mut(first * stride);
        let block = &mut rest[..count * stride];
        factors.clear();
        factors.resize(first + count, [0.0; BLOCK]);
        for (k, factors) in factors.iter_mut().enumerate() {
            let from = first.max(k);
            factors[from - first..count].copy_from_slice(&l[k * m + from..k * m + first + count]);
        }
        solve_block(done, block, &factors, stride);
        if count <= BLOCK / 4 {
            subtract_block(p, block, block, &mut few_rows, [n, stride]);
        } else {
            subtract_block(p, block, block, &mut rows, [n, stride]);
        }
    }
    // What is above the diagonal, in squares: along a row each component is on a line of the cache of its own.
    for first_column in (0..n).step_by(TILE) {
        for first_row in (first_column..n).step_by(TILE) {
            for c in first_column..n.min(first_column + TILE) {
                for r in first_row.max(c + 1)..n.min(first_row + TILE) {
                    p[r * n + c] = p[c * n + r];
                }
            }
        }
    }
}

/// The columns of W that follow those that are `done`, from those of V: W L' = V. `factors` are the rows of L that belong to
/// them, a column of L after the other.
#[inline(always)]
fn solve_block(done: &[f64], block: &mut [f64], factors: &[[f64; BLOCK]], stride: usize) {
    // The rows of L of the block itself, its diagonal inverted; a last block that is not full is made so by ones.
    let mut triangle = [[0.0; BLOCK]; BLOCK];
    for (k, row) in triangle.iter_mut().enumerate() {
        let factors = factors.get(done.len() / stride + k).copied().unwrap_or_default();
        *row = factors;
        row[k] = if factors[k] == 0.0 { 1.0 } else { 1.0 / factors[k] };
    }
    for first in (0..stride).step_by(TILE) {
        let mut solved = [[0.0; TILE]; BLOCK];
        for (solved, column) in solved.iter_mut().zip(block.chunks_exact(stride)) {
            solved.copy_from_slice(&column[first..first + TILE]);
        }
        solved = subtract_done(solved, done, factors, first, stride);
        solved = solve_tile(solved, &triangle);
        for (solved, column) in solved.iter().zip(block.chunks_exact_mut(stride)) {
            column[first..first + TILE].copy_from_slice(solved);
        }
    }
}

/// A tile of the columns of V less the share of those that are done. All of it stays in registers.
#[inline(always)]
fn subtract_done(
    mut tile: [[f64; TILE]; BLOCK],
    done: &[f64],
    factors: &[[f64; BLOCK]],
    first: usize,
    stride: usize,
) -> [[f64; TILE]; BLOCK] {
    for (column, factors) in done.chunks_exact(stride).zip(factors) {
        let Some(known) = column[first..].first_chunk::<TILE>() else { break };
        for j in 0..BLOCK {
            for i in 0..TILE {
                tile[j][i] -= factors[j] * known[i];
            }
        }
    }
    tile
}

/// Solves for the columns of a tile, one after the other, by a column of `triangle` each.
#[inline(always)]
fn solve_tile(mut tile: [[f64; TILE]; BLOCK], triangle: &[[f64; BLOCK]; BLOCK]) -> [[f64; TILE]; BLOCK] {
    for k in 0..BLOCK {
        tile[k].iter_mut().for_each(|v| *v *= triangle[k][k]);
        let known = tile[k];
        for j in k + 1..BLOCK {
            for (v, known) in tile[j].iter_mut().zip(known) {
                *v -= triangle[k][j] * known;
            }
        }
    }
    tile
}

/// P - A B' from the diagonal down, for at most `N` columns of A and B, which are `stride` apart. What is above the diagonal means
/// nothing afterwards.
///
/// A tile of rows of A stays in registers while all columns of P that have these rows pass by. Tiles are counted from the last
/// row, so that what is left over is a small triangle at the top. `rows` is room for B by rows.
#[inline(always)]
pub(super) fn subtract_block<const N: usize>(
    p: &mut [f64],
    a: &[f64],
    b: &[f64],
    rows: &mut Vec<[f64; N]>,
    [n, stride]: [usize; 2],
) {
    rows.clear();
    rows.resize(n, [0.0; N]);
    for (k, column) in b.chunks_exact(stride).enumerate() {
        for (row, value) in rows.iter_mut().zip(column) {
            row[k] = *value;
        }
    }
    let top = n % TILE;
    for c in 0..top {
        for r in c..top {
            for (k, column) in a.chunks_exact(stride).enumerate() {
                p[c * n + r] -= column[r] * rows[c][k];
            }
        }
    }
    for first in (top..n).step_by(TILE) {
        let mut tile = [[0.0; TILE]; N];
        for (tile, column) in tile.iter_mut().zip(a.chunks_exact(stride)) {
            tile.copy_from_slice(&column[first..first + TILE]);
        }
        for (row, column) in rows[..first + TILE].iter().zip(p.chunks_exact_mut(n)) {
            let Some(column) = column[first..].first_chunk_mut::<TILE>() else { break };
            let mut sum = *column;
            for k in 0..N {
                for i in 0..TILE {
                    sum[i] -= row[k] * tile[k][i];
                }
            }
            *column = sum;
        }
    }
}

/// Adds `count` columns, the k-th times `factor(k)`, to `sum`, one after the other. A column may be longer than `sum`.
#[inline(always)]
pub(super) fn add_columns<'a>(
    sum: &mut [f64],
    count: usize,
    factor: impl Fn(usize) -> f64,
    column: impl Fn(usize) -> &'a [f64],
) {
    let fours = count - count % 4;
    for k in (0..fours).step_by(4) {
        let factors = [factor(k), factor(k + 1), factor(k + 2), factor(k + 3)];
        add_four(sum, factors, column(k), column(k + 1), column(k + 2), column(k + 3));
    }
    for k in fours..count {
        let f = factor(k);
        for (s, v) in sum.iter_mut().zip(column(k)) {
            *s += f * v;
        }
    }
}

/// Where the time goes. Slices of one length, as arguments of their own, let the compiler drop all checks and use vectors.
#[inline(always)]
fn add_four(sum: &mut [f64], f: [f64; 4], a: &[f64], b: &[f64], c: &[f64], d: &[f64]) {
    let n = sum.len();
    let (a, b, c, d) = (&a[..n], &b[..n], &c[..n], &d[..n]);
    for i in 0..n {
        sum[i] = sum[i] + f[0] * a[i] + f[1] * b[i] + f[2] * c[i] + f[3] * d[i];
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// Against nalgebra's own factor, solution and inverse, for sizes of less than a tile, of whole tiles and with a rest.
    #[test]
    fn factor_solution_and_inverse_equal_those_of_nalgebra() {
        let mut stream = crate::random::Seed(1).stream("dense");
        for n in [1, 3, 8, 21, 40] {
            let root = DMatrix::from_fn(n, n, |_, _| crate::random::standard_normal(&mut stream));
            let matrix = &root * root.transpose() + DMatrix::identity(n, n);
            let right = DVector::from_fn(n, |i, _| 1.0 + i as f64);
            let expected = matrix.clone().cholesky().unwrap();
            let mut l = matrix.as_slice().to_vec();
            assert!(factorise(&mut l, n));
            let found = DMatrix::from_vec(n, n, l.clone()).lower_triangle();
            assert!((found - expected.l()).amax() < 1e-12 * matrix.amax(), "{n}");
            let mut x = right.as_slice().to_vec();
            solve_lower(&l, 0, &mut x);
            solve_transposed(&l, &mut x);
            assert!((DVector::from_vec(x) - expected.solve(&right)).amax() < 1e-10, "{n}");
            let inverse = inverse(&l, n);
            assert!((&inverse - expected.inverse()).amax() < 1e-12, "{n}");
            assert_eq!(inverse, inverse.transpose());
        }
        assert!(!factorise(&mut [1.0, 2.0, 2.0, 1.0], 2), "indefinite");
    }
}
