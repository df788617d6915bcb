//! A covariance stored and worked on by 3×3 blocks.
//!
//! Only the blocks on and above the diagonal are kept, and the diagonal blocks are made symmetric
//! after every change: with rounding left alone there, the joint filter of two feet loses its
//! positive definiteness within minutes.

use nalgebra::{Matrix3, SMatrix};

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
    #[inline]
    pub(crate) fn upper_mut(&mut self, i: usize, j: usize) -> &mut Matrix3<f64> {
        debug_assert!(i <= j, "only the upper blocks are stored");
        &mut self.upper[i][j]
    }

    /// Sets the covariance of vector i with itself.
    pub fn set_diagonal(&mut self, i: usize, block: Matrix3<f64>) {
        self.upper[i][i] = block;
    }

    /// Adds to the covariance of vector i with itself: process noise.
    #[inline]
    pub fn add_diagonal(&mut self, i: usize, variance: f64) {
        let block = &mut self.upper[i][i];
        block[(0, 0)] += variance;
        block[(1, 1)] += variance;
        block[(2, 2)] += variance;
    }

    /// Forgets what vector i has to do with all others and gives it the covariance `block`.
    pub fn isolate(&mut self, i: usize, block: Matrix3<f64>) {
        for j in 0..B {
            let (row, column) = if i <= j { (i, j) } else { (j, i) };
            self.upper[row][column] = Matrix3::zeros();
        }
        self.upper[i][i] = block;
    }

    /// Makes the diagonal block i symmetric to the bit.
    #[inline]
    pub(crate) fn symmetrise(&mut self, i: usize) {
        let block = &mut self.upper[i][i];
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            let mean = 0.5 * (block[(row, column)] + block[(column, row)]);
            block[(row, column)] = mean;
            block[(column, row)] = mean;
        }
    }

    /// Takes `gain · cross_covariance'` off, block by block: the covariance after an update, where
    /// `cross_covariance` is P·H' and `gain` is P·H'·S⁻¹.
    #[inline]
    pub(crate) fn subtract_product<const M: usize>(
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

    /// The whole matrix, N = 3B on a side: for tests and reports.
    pub fn dense(&self) -> nalgebra::DMatrix<f64> {
        nalgebra::DMatrix::from_fn(3 * B, 3 * B, |r, c| self.block(r / 3, c / 3)[(r % 3, c % 3)])
    }

    /// Whether every number in it is finite and no variance is negative.
    pub fn is_sound(&self) -> bool {
        (0..B).all(|i| {
            (0..3).all(|k| self.upper[i][i][(k, k)] >= 0.0)
                && (i..B).all(|j| self.upper[i][j].iter().all(|x| x.is_finite()))
        })
    }
}
