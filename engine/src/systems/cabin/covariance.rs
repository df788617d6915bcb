//! A dense covariance whose updates know which columns of a Jacobian are not zero.
//!
//! Errors are true − estimated, the attitude's as true = (I + \[φ×\]) · estimated.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Rows of three numbers that depend on few states: by state, the column of the Jacobian.
pub(super) type Sparse = Vec<(usize, [f64; 3])>;

/// P of n states, row by row.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Covariance {
    n: usize,
    p: Vec<f64>,
}

/// What a measurement of three numbers has done, with what a smoother needs of it.
#[derive(Clone, Debug)]
pub(super) struct Update {
    pub(super) jacobian: Sparse,
    /// Measured − predicted, by the estimate before.
    pub(super) innovation: Vector3<f64>,
    /// Inverse of the innovation's covariance.
    pub(super) information: Matrix3<f64>,
    /// The gain's three columns.
    pub(super) gain: [Vec<f64>; 3],
}

impl Covariance {
    pub(super) fn new(n: usize) -> Covariance {
        Covariance { n, p: vec![0.0; n * n] }
    }

    pub(super) fn row(&self, k: usize) -> &[f64] {
        &self.p[k * self.n..(k + 1) * self.n]
    }

    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.p[row * self.n + column] += value;
    }

    /// Forgets what is known of a state: no correlation, and this variance.
    pub(super) fn reset(&mut self, k: usize, variance: f64) {
        for other in 0..self.n {
            self.p[k * self.n + other] = 0.0;
            self.p[other * self.n + k] = 0.0;
        }
        self.p[k * self.n + k] = variance;
    }

    /// P H' of a sparse Jacobian, by its three rows.
    pub(super) fn times_transposed(&self, jacobian: &Sparse) -> [Vec<f64>; 3] {
        let mut product: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; self.n]);
        let [x, y, z] = &mut product;
        for (state, [hx, hy, hz]) in jacobian {
            let row = self.row(*state);
            for (k, p) in row.iter().enumerate() {
                x[k] += p * hx;
                y[k] += p * hy;
                z[k] += p * hz;
            }
        }
        product
    }

    /// H P H' for a Jacobian and its P H'.
    pub(super) fn projected(jacobian: &Sparse, product: &[Vec<f64>; 3]) -> Matrix3<f64> {
        let mut projected = Matrix3::zeros();
        for (state, h) in jacobian {
            for row in 0..3 {
                for column in 0..3 {
                    projected[(row, column)] += h[row] * product[column][*state];
                }
            }
        }
        (projected + projected.transpose()) * 0.5
    }

    /// P ← P − K H P.
    pub(super) fn subtract(&mut self, gain: &[Vec<f64>; 3], product: &[Vec<f64>; 3]) {
        let [gx, gy, gz] = gain;
        let [px, py, pz] = product;
        for (k, row) in self.p.chunks_exact_mut(self.n).enumerate() {
            let (a, b, c) = (gx[k], gy[k], gz[k]);
            for (((p, x), y), z) in row.iter_mut().zip(px).zip(py).zip(pz) {
                *p -= a * x + b * y + c * z;
            }
        }
    }

    /// P ← Φ P Φ', where Φ turns the first states by `moving` (rows of the first `moving.len()` states over its columns) and
    /// lets each of the others fade by its factor in `kept`.
    pub(super) fn propagate<const R: usize, const C: usize>(&mut self, moving: &[[f64; C]; R], kept: &[f64]) {
        let n = self.n;
        let mut rows = vec![0.0; R * n];
        for (row, factors) in rows.chunks_exact_mut(n).zip(moving) {
            for (column, factor) in factors.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
                for (new, old) in row.iter_mut().zip(&self.p[column * n..(column + 1) * n]) {
                    *new += factor * old;
                }
            }
        }
        self.p[..R * n].copy_from_slice(&rows);
        for (k, row) in self.p.chunks_exact_mut(n).enumerate() {
            let mut turned = [0.0; R];
            for (new, factors) in turned.iter_mut().zip(moving) {
                *new = factors.iter().zip(&row[..C]).map(|(factor, old)| factor * old).sum();
            }
            row[..R].copy_from_slice(&turned);
            let own = if k < R { 1.0 } else { kept[k] };
            for (p, kept) in row.iter_mut().zip(kept) {
                *p *= kept * own;
            }
        }
        self.symmetrise();
    }

    /// Rounding leaves the halves apart; the upper one is taken.
    fn symmetrise(&mut self) {
        let n = self.n;
        for row in 1..n {
            for column in 0..row {
                self.p[row * n + column] = self.p[column * n + row];
            }
        }
    }
}
