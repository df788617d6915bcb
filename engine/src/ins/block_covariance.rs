//! A covariance stored and worked on by 3×3 blocks.
//!
//! Only the blocks on and above the diagonal are kept, and the diagonal blocks are made symmetric
//! after every change: with rounding left alone there, the joint filter of two feet loses its
//! positive definiteness within minutes.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::operations::{ErrorOperations, Factor};

/// The covariance of `B` three-vectors: a symmetric 3B × 3B matrix.
#[derive(Clone, Debug)]
pub struct BlockCovariance<const B: usize> {
    /// `upper[i][j]` for i ≤ j; what lies below the diagonal is never read.
    upper: [[Matrix3<f64>; B]; B],
}

impl<const B: usize> BlockCovariance<B> {
    /// All zero.
    pub fn zeros() -> Self {
        BlockCovariance { upper: [[Matrix3::zeros(); B]; B] }
    }

    /// The covariance of vector i with vector j.
    #[inline]
    pub fn block(&self, i: usize, j: usize) -> Matrix3<f64> {
        if i <= j { self.upper[i][j] } else { self.upper[j][i].transpose() }
    }

    /// The stored block (i, j), i ≤ j, to change in place.
    #[cfg(test)]
    pub(super) fn upper_mut(&mut self, i: usize, j: usize) -> &mut Matrix3<f64> {
        debug_assert!(i <= j, "only the upper blocks are stored");
        &mut self.upper[i][j]
    }

    /// Sets the covariance of vector i with itself.
    pub fn set_diagonal(&mut self, i: usize, block: Matrix3<f64>) {
        self.upper[i][i] = block;
    }

    /// Adds `variance`, by axis, to every covariance among `blocks`: a noise that they have in common.
    pub(super) fn add_common_noise(&mut self, blocks: &[usize], variance: &Vector3<f64>) {
        for (k, a) in blocks.iter().enumerate() {
            for b in &blocks[k..] {
                let (row, column) = (*a.min(b), *a.max(b));
                for axis in 0..3 {
                    self.upper[row][column][(axis, axis)] += variance[axis];
                }
            }
        }
    }

    /// Forgets what vector i has to do with all others and gives it the covariance `block`.
    pub(super) fn isolate(&mut self, i: usize, block: Matrix3<f64>) {
        for j in 0..B {
            let (row, column) = if i <= j { (i, j) } else { (j, i) };
            self.upper[row][column] = Matrix3::zeros();
        }
        self.upper[i][i] = block;
    }

    /// Gives vector `to` the error of vector `from`.
    pub(super) fn copy(&mut self, from: usize, to: usize) {
        let squared = self.upper[from][from];
        for j in (0..B).filter(|j| *j != to) {
            let with_j = self.block(from, j);
            let (row, column) = (j.min(to), j.max(to));
            self.upper[row][column] = if to < j { with_j } else { with_j.transpose() };
        }
        self.upper[to][to] = squared;
    }

    /// Makes the diagonal block i symmetric to the bit.
    #[inline]
    fn symmetrise(&mut self, i: usize) {
        let block = &mut self.upper[i][i];
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            let mean = 0.5 * (block[(row, column)] + block[(column, row)]);
            block[(row, column)] = mean;
            block[(column, row)] = mean;
        }
    }

    /// Takes `gain · cross_covariance'` off, block by block: the covariance after an update, where
    /// `cross_covariance` is P·H' and `gain` is P·H'·S⁻¹.
    #[expect(clippy::needless_range_loop, reason = "i and j name the block of which both arrays have a part")]
    #[inline]
    pub(super) fn subtract_product<const M: usize>(
        &mut self,
        gain: &[SMatrix<f64, 3, M>; B],
        cross_covariance: &[SMatrix<f64, 3, M>; B],
    ) {
        for i in 0..B {
            for j in i..B {
                let (k, c) = (&gain[i], &cross_covariance[j]);
                let block = &mut self.upper[i][j];
                for column in 0..3 {
                    for row in 0..3 {
                        let mut sum = 0.0;
                        for m in 0..M {
                            sum += k[(row, m)] * c[(column, m)];
                        }
                        block[(row, column)] -= sum;
                    }
                }
            }
            self.symmetrise(i);
        }
    }

    /// The matrix times a vector of `M` columns, block by block.
    #[inline]
    pub(super) fn times<const M: usize>(&self, v: &[SMatrix<f64, 3, M>; B]) -> [SMatrix<f64, 3, M>; B] {
        let mut product = [SMatrix::zeros(); B];
        for i in 0..B {
            product[i] += self.upper[i][i] * v[i];
            for j in i + 1..B {
                product[i] += self.upper[i][j] * v[j];
                product[j] += self.upper[i][j].tr_mul(&v[i]);
            }
        }
        product
    }

    /// Takes `t · d'` and its transpose off, where `t` has one block, at `at`, that is not zero.
    #[inline]
    pub(super) fn subtract_both_products<const M: usize>(
        &mut self,
        at: usize,
        t: &SMatrix<f64, 3, M>,
        d: &[SMatrix<f64, 3, M>; B],
    ) {
        for (j, d_j) in d.iter().enumerate() {
            if j < at {
                self.upper[j][at] -= d_j * t.transpose();
            } else {
                self.upper[at][j] -= t * d_j.transpose();
            }
        }
        self.upper[at][at] -= d[at] * t.transpose();
        self.symmetrise(at);
    }

    /// The whole matrix, N = 3B on a side: for tests and reports.
    pub fn dense(&self) -> nalgebra::DMatrix<f64> {
        nalgebra::DMatrix::from_fn(3 * B, 3 * B, |r, c| self.block(r / 3, c / 3)[(r % 3, c % 3)])
    }

    /// Whether every number in it is finite.
    pub(super) fn is_finite(&self) -> bool {
        (0..B).all(|i| (i..B).all(|j| self.upper[i][j].iter().all(|x| x.is_finite())))
    }

    /// Whether every number in it is finite and no variance is negative.
    pub fn is_sound(&self) -> bool {
        self.is_finite() && (0..B).all(|i| (0..3).all(|k| self.upper[i][i][(k, k)] >= 0.0))
    }
}

impl<const B: usize> ErrorOperations for BlockCovariance<B> {
    // P ← E P E' with E = I + factor in the place (a, b), done in place.
    #[inline]
    fn add_multiple(&mut self, a: usize, b: usize, factor: &impl Factor) {
        debug_assert!(a != b, "a multiple of itself is a scaling");
        let b_squared = self.upper[b][b];
        for j in 0..B {
            if j == a {
                continue;
            }
            // Row a at column j grows by factor · (row b at column j); below the diagonal the
            // transpose is what is stored.
            let b_j = if j == b { b_squared } else { self.block(b, j) };
            let growth = factor.times(&b_j);
            if a < j {
                self.upper[a][j] += growth;
            } else {
                self.upper[j][a] += growth.transpose();
            }
        }
        // The block (a, b) is new already: P_aa + f·P_ba + P_ab·f' with f·P_bb·f' shared out.
        let a_b = self.block(a, b);
        let a_b_before = a_b - factor.times(&b_squared);
        self.upper[a][a] +=
            factor.times(&a_b_before.transpose()) + factor.times(&a_b.transpose()).transpose();
        self.symmetrise(a);
    }

    #[inline]
    fn scale(&mut self, i: usize, by: &Vector3<f64>) {
        for j in 0..=i {
            for axis in 0..3 {
                let mut column = self.upper[j][i].column_mut(axis);
                column *= by[axis];
            }
        }
        for j in i..B {
            for axis in 0..3 {
                let mut row = self.upper[i][j].row_mut(axis);
                row *= by[axis];
            }
        }
        self.symmetrise(i);
    }

    #[inline]
    fn add_noise(&mut self, i: usize, variance: &Vector3<f64>) {
        let block = &mut self.upper[i][i];
        block[(0, 0)] += variance.x;
        block[(1, 1)] += variance.y;
        block[(2, 2)] += variance.z;
    }
}
