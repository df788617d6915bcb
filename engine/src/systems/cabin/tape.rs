//! Smoothing: what an epoch leaves behind, and the way back over it (G. J. Bierman's modification of Bryson and Frazier's
//! smoother, *Fixed interval smoothing with discrete measurements*, International Journal of Control 18, 1973).
//!
//! μ and Λ are what the future says: the smoothed error of a pose with P Jᵀ = W is Wᵀ μ, its covariance J P Jᵀ − Wᵀ Λ W.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::covariance::Update;
use super::output::Row;
use super::states::{DRIVING, MOVING};

/// P Jᵀ of a pose: three columns for the place, three for the attitude, three for the velocity.
pub(super) type Columns = Vec<Vec<f64>>;

/// One epoch.
#[derive(Clone, Debug, Default)]
pub(super) struct Leaf {
    /// Transitions before the epoch's rows, each with the states that were forgotten after it.
    steps: Vec<Step>,
    pub(super) updates: Vec<Update>,
    /// The cabin's pose after them, and the platform's.
    pub(super) poses: Vec<Posed>,
}

#[derive(Clone, Debug)]
struct Step {
    moving: Box<[[f64; DRIVING]; MOVING]>,
    kept: Vec<f64>,
    forgotten: Vec<usize>,
}

/// A row of the result with how it hangs on the errors at the epoch.
#[derive(Clone, Debug)]
pub(super) struct Posed {
    pub(super) row: Row,
    pub(super) columns: Columns,
    pub(super) is_platform: bool,
}

impl Leaf {
    pub(super) fn propagated(&mut self, moving: &[[f64; DRIVING]; MOVING], kept: &[f64]) {
        self.steps.push(Step { moving: Box::new(*moving), kept: kept.to_vec(), forgotten: Vec::new() });
    }

    pub(super) fn forget_after(&mut self, state: usize) {
        if let Some(step) = self.steps.last_mut() {
            step.forgotten.push(state);
        }
    }
}

/// What the future says of the errors.
#[derive(Clone, Debug)]
pub(super) struct Future {
    n: usize,
    mu: Vec<f64>,
    lambda: Vec<f64>,
}

impl Future {
    /// Nothing yet.
    pub(super) fn new(n: usize) -> Future {
        Future { n, mu: vec![0.0; n], lambda: vec![0.0; n * n] }
    }

    /// The row smoothed.
    pub(super) fn smooth(&self, posed: &Posed) -> Row {
        let count = posed.columns.len();
        let moved: Vec<f64> = posed.columns.iter().map(|column| dot(column, &self.mu)).collect();
        let pulled: Vec<Vec<f64>> = posed.columns.iter().map(|column| self.times(column)).collect();
        let less = |row: usize, column: usize| dot(&posed.columns[row], &pulled[column]);
        let mut pose_less = Matrix6::zeros();
        for row in 0..6 {
            for column in 0..6 {
                pose_less[(row, column)] = less(row, column);
            }
        }
        let mut velocity_less = Vector3::zeros();
        let mut velocity = Vector3::zeros();
        if count >= 9 {
            velocity_less = Vector3::from_fn(|axis, _| less(6 + axis, 6 + axis));
            velocity = Vector3::new(moved[6], moved[7], moved[8]);
        }
        posed.row.smoothed(&Vector6::from_column_slice(&moved[..6]), &pose_less, &velocity, &velocity_less)
    }

    /// Λ times a column, as a sum of its rows: Λ is symmetric.
    fn times(&self, column: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.n];
        for (row, factor) in
            self.lambda.chunks_exact(self.n).zip(column).filter(|(_, factor)| **factor != 0.0)
        {
            for (sum, x) in product.iter_mut().zip(row) {
                *sum += factor * x;
            }
        }
        product
    }

    /// Back over an epoch, once its poses have been smoothed.
    pub(super) fn back(&mut self, leaf: &Leaf) {
        for update in leaf.updates.iter().rev() {
            self.back_over_update(update);
        }
        for step in leaf.steps.iter().rev() {
            for state in &step.forgotten {
                self.mu[*state] = 0.0;
                for other in 0..self.n {
                    self.lambda[state * self.n + other] = 0.0;
                    self.lambda[other * self.n + state] = 0.0;
                }
            }
            self.back_over_step(step);
        }
    }

    /// μ ← μ + Hᵀ (S⁻¹ r − Kᵀ μ), Λ ← (I − K H)ᵀ Λ (I − K H) + Hᵀ S⁻¹ H.
    fn back_over_update(&mut self, update: &Update) {
        let Update { jacobian, innovation, information, gain } = update;
        let told = information * innovation - Vector3::from_fn(|axis, _| dot(&gain[axis], &self.mu));
        let weighed: [Vec<f64>; 3] = std::array::from_fn(|axis| self.times(&gain[axis]));
        let mut middle = *information;
        for row in 0..3 {
            for column in 0..3 {
                middle[(row, column)] += dot(&gain[row], &weighed[column]);
            }
        }
        let n = self.n;
        for (state, h) in jacobian {
            self.mu[*state] += h[0] * told.x + h[1] * told.y + h[2] * told.z;
            let [x, y, z] = &weighed;
            for (k, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
                let less = h[0] * x + h[1] * y + h[2] * z;
                self.lambda[state * n + k] -= less;
                self.lambda[k * n + state] -= less;
            }
        }
        add_between(&mut self.lambda, n, jacobian, &middle);
    }

    /// μ ← Φᵀ μ, Λ ← Φᵀ Λ Φ.
    fn back_over_step(&mut self, step: &Step) {
        let n = self.n;
        let transposed = |v: &mut [f64]| {
            let mut driven = [0.0; DRIVING];
            for (value, factors) in v[..MOVING].iter().zip(step.moving.iter()) {
                for (driven, factor) in driven.iter_mut().zip(factors) {
                    *driven += factor * value;
                }
            }
            for (v, kept) in v.iter_mut().zip(&step.kept).skip(MOVING) {
                *v *= kept;
            }
            v[..MOVING].copy_from_slice(&driven[..MOVING]);
            for (v, driven) in v[MOVING..DRIVING].iter_mut().zip(&driven[MOVING..]) {
                *v += driven;
            }
        };
        transposed(&mut self.mu);
        for row in self.lambda.chunks_exact_mut(n) {
            transposed(row);
        }
        // The columns, as rows: Λ is symmetric, Λ Φ is not.
        let mut driven = vec![0.0; DRIVING * n];
        for (row, factors) in step.moving.iter().enumerate() {
            for (to, factor) in driven.chunks_exact_mut(n).zip(factors).filter(|(_, factor)| **factor != 0.0)
            {
                for (to, from) in to.iter_mut().zip(&self.lambda[row * n..(row + 1) * n]) {
                    *to += factor * from;
                }
            }
        }
        for (row, kept) in self.lambda.chunks_exact_mut(n).zip(&step.kept).skip(MOVING) {
            if *kept != 1.0 {
                row.iter_mut().for_each(|x| *x *= kept);
            }
        }
        self.lambda[..MOVING * n].copy_from_slice(&driven[..MOVING * n]);
        for (to, from) in self.lambda[MOVING * n..DRIVING * n].iter_mut().zip(&driven[MOVING * n..]) {
            *to += from;
        }
        for row in 1..n {
            for column in 0..row {
                let mean = 0.5 * (self.lambda[row * n + column] + self.lambda[column * n + row]);
                self.lambda[row * n + column] = mean;
                self.lambda[column * n + row] = mean;
            }
        }
    }
}

fn add_between(lambda: &mut [f64], n: usize, jacobian: &[(usize, [f64; 3])], middle: &Matrix3<f64>) {
    for (row, a) in jacobian {
        let left = middle.tr_mul(&Vector3::from(*a));
        for (column, b) in jacobian {
            lambda[row * n + column] += left.x * b[0] + left.y * b[1] + left.z * b[2];
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
