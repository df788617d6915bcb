//! The way back over a tape: what the measurements of the future say of the errors of the past.
//!
//! The modified Bryson–Frazier smoother (G. J. Bierman, *Fixed interval smoothing with discrete
//! measurements*, International Journal of Control 18, 1973): beside the errors run their adjoints λ and
//! the information Λ of what comes later. Where the filter has the covariance P, the smoothed errors are
//! P λ and their covariance is P − P Λ P. Nothing is inverted, and every operation of the filter is gone
//! back over by itself. With the signs of the notation page an update with innovation m goes back as
//!
//! λ ← H' S⁻¹ m + (I − K H)' λ,  Λ ← H' S⁻¹ H + (I − K H)' Λ (I − K H),
//!
//! and a transition e ← Φ e + noise as λ ← Φ' λ, Λ ← Φ' Λ Φ. As the filter takes its corrections off the
//! nominal state at once, errors are those against the nominal state of their moment.
//!
//! The errors themselves go back, too, so that P is needed at the ends only: after an update K m is put
//! on again, after a transition the noise's part Q λ is taken off and Φ undone. The disturbance smoother
//! of S. J. Koopman (Biometrika 80, 1993) is the same run forward.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::block_covariance::BlockCovariance;
use super::imu_noise::ImuNoise;
use super::operations::{Cross, ErrorOperations, KeptFactor, Operation};
use super::tape::{Entry, Tape};

/// What the future says at one moment of the way back.
#[derive(Clone, Debug)]
pub(crate) struct Adjoint<const B: usize> {
    /// λ, in inverse units of the errors.
    lambda: [Vector3<f64>; B],
    /// Λ.
    information: BlockCovariance<B>,
    /// The smoothed errors of the nominal state, P λ.
    errors: [Vector3<f64>; B],
    transition: Vec<Operation>,
}

impl<const B: usize> Adjoint<B> {
    /// At the end, where the future says nothing.
    pub(crate) fn at_the_end() -> Self {
        Adjoint {
            lambda: [Vector3::zeros(); B],
            information: BlockCovariance::zeros(),
            errors: [Vector3::zeros(); B],
            transition: Vec::new(),
        }
    }

    /// The smoothed errors of the nominal state.
    pub(crate) fn errors(&self) -> &[Vector3<f64>; B] {
        &self.errors
    }

    /// W Λ W': what smoothing takes off the covariance of M numbers whose covariance with the errors is
    /// W, block by block.
    pub(crate) fn taken_off<const M: usize>(&self, w: &[SMatrix<f64, M, 3>; B]) -> SMatrix<f64, M, M> {
        let columns = w.each_ref().map(SMatrix::transpose);
        let products = self.information.times(&columns);
        let mut sum = SMatrix::zeros();
        for (row, product) in w.iter().zip(&products) {
            sum += row * product;
        }
        sum
    }

    /// Whether every number in it is finite.
    pub(crate) fn is_finite(&self) -> bool {
        let vectors = self.lambda.iter().chain(&self.errors);
        vectors.flat_map(|v| v.iter()).all(|x| x.is_finite()) && self.information.is_finite()
    }

    /// Works the errors out anew from the covariance of this moment: on the way back rounding grows as
    /// the errors of an inertial sensor do, so once in a minute it is taken out.
    pub(crate) fn anchor(&mut self, covariance: &BlockCovariance<B>) {
        self.errors = covariance.times(&self.lambda);
    }

    /// Goes back over `tape`, to the last moment marked in it, or to its start. Says whether it is at a
    /// moment.
    pub(crate) fn go_back(&mut self, tape: &mut Tape, noise: &ImuNoise) -> bool {
        while let Some(entry) = tape.entries.pop() {
            match entry {
                Entry::Moment => return true,
                Entry::Transition { sensor } => {
                    if let Some(transition) = tape.transitions.pop() {
                        let mut operations = std::mem::take(&mut self.transition);
                        transition.apply(&mut operations, usize::from(sensor), noise);
                        operations.drain(..).rev().for_each(|operation| self.undo(&operation));
                        self.transition = operations;
                    }
                }
                Entry::Update { rows, used, blocks } => {
                    let blocks = &blocks[..usize::from(used)];
                    match rows {
                        1 => self.undo_update::<1>(blocks, &mut tape.numbers),
                        2 => self.undo_update::<2>(blocks, &mut tape.numbers),
                        _ => self.undo_update::<3>(blocks, &mut tape.numbers),
                    }
                }
                Entry::AddMultiple { a, b } => {
                    let factor = Matrix3::from_column_slice(&pop(&mut tape.numbers, 9));
                    let factor = KeptFactor::Matrix(factor);
                    self.undo(&Operation::AddMultiple { a: usize::from(a), b: usize::from(b), factor });
                }
                Entry::Scale { block } => {
                    let by = Vector3::from_column_slice(&pop(&mut tape.numbers, 3));
                    self.undo(&Operation::Scale { i: usize::from(block), by });
                }
                Entry::Isolate { block } => {
                    let block = usize::from(block);
                    self.information.isolate(block, Matrix3::zeros());
                    self.lambda[block] = Vector3::zeros();
                    self.errors[block] = self.by_row(&mut tape.numbers);
                }
                Entry::Copy { from, to } => {
                    let (from, to) = (usize::from(from), usize::from(to));
                    self.information.add_multiple(from, to, &1.0);
                    self.information.isolate(to, Matrix3::zeros());
                    let lambda = std::mem::take(&mut self.lambda[to]);
                    self.lambda[from] += lambda;
                    self.errors[to] = self.by_row(&mut tape.numbers);
                }
                Entry::CommonNoise { blocks } => {
                    let variance = Vector3::from_column_slice(&pop(&mut tape.numbers, 3));
                    let of = (0..B).filter(|block| blocks >> block & 1 == 1);
                    let sum: Vector3<f64> = of.clone().map(|block| self.lambda[block]).sum();
                    of.for_each(|block| self.errors[block] -= variance.component_mul(&sum));
                }
            }
        }
        false
    }

    #[inline]
    fn undo(&mut self, operation: &Operation) {
        match operation {
            Operation::AddMultiple { a, b, factor } => {
                let (lambda, error) = (self.lambda[*a], self.errors[*b]);
                match factor {
                    KeptFactor::Scalar(by) => {
                        self.information.add_multiple(*b, *a, by);
                        self.lambda[*b] += lambda * *by;
                        self.errors[*a] -= error * *by;
                    }
                    KeptFactor::Cross(v) => {
                        self.information.add_multiple(*b, *a, &Cross(-v));
                        self.lambda[*b] -= v.cross(&lambda);
                        self.errors[*a] -= v.cross(&error);
                    }
                    KeptFactor::Matrix(by) => {
                        self.information.add_multiple(*b, *a, &by.transpose());
                        self.lambda[*b] += by.tr_mul(&lambda);
                        self.errors[*a] -= by * error;
                    }
                }
            }
            Operation::Scale { i, by } => {
                self.information.scale(*i, by);
                self.lambda[*i].component_mul_assign(by);
                self.errors[*i].component_div_assign(by);
            }
            Operation::AddNoise { i, variance } => {
                self.errors[*i] -= variance.component_mul(&self.lambda[*i]);
            }
        }
    }

    fn undo_update<const M: usize>(&mut self, blocks: &[u8], numbers: &mut Vec<f64>) {
        let start = numbers.len().saturating_sub(3 * M * (blocks.len() + B) + M * M + 2 * M);
        let mut rest = &numbers[start..];
        let mut take = |count: usize| {
            let (taken, left) = rest.split_at(count);
            rest = left;
            taken
        };
        let mut h_transposed = [(0, SMatrix::<f64, 3, M>::zeros()); super::observation::MOST_BLOCKS];
        for (place, block) in h_transposed.iter_mut().zip(blocks) {
            let jacobian = SMatrix::<f64, M, 3>::from_column_slice(take(3 * M));
            *place = (usize::from(*block), jacobian.transpose());
        }
        let h_transposed = &h_transposed[..blocks.len()];
        let mut gain = [SMatrix::<f64, 3, M>::zeros(); B];
        for block in &mut gain {
            block.copy_from_slice(take(3 * M));
        }
        let s_inverse = SMatrix::<f64, M, M>::from_column_slice(take(M * M));
        let mut say = SVector::<f64, M>::from_column_slice(take(M));
        let innovation = SVector::<f64, M>::from_column_slice(take(M));

        // Λ ← Λ − T D' − D T' with T = H' and D = Λ K − T (K' Λ K + S⁻¹) / 2.
        let mut d = self.information.times(&gain);
        let mut inner = s_inverse;
        for (gain, product) in gain.iter().zip(&d) {
            inner += gain.tr_mul(product);
        }
        for (block, t) in h_transposed {
            d[*block] -= t * inner * 0.5;
        }
        for (block, t) in h_transposed {
            self.information.subtract_both_products(*block, t, &d);
        }
        for (gain, lambda) in gain.iter().zip(&self.lambda) {
            say -= gain.tr_mul(lambda);
        }
        for (block, t) in h_transposed {
            self.lambda[*block] += t * say;
        }
        for (gain, error) in gain.iter().zip(&mut self.errors) {
            *error += gain * innovation;
        }
        numbers.truncate(start);
    }

    /// The error of a block by its row of the covariance, which is on the tape.
    fn by_row(&self, numbers: &mut Vec<f64>) -> Vector3<f64> {
        let row = pop(numbers, 9 * B);
        row.chunks_exact(9)
            .zip(&self.lambda)
            .map(|(block, lambda)| Matrix3::from_column_slice(block) * lambda)
            .sum()
    }
}

fn pop(numbers: &mut Vec<f64>, count: usize) -> Vec<f64> {
    numbers.split_off(numbers.len() - count)
}

#[cfg(test)]
#[path = "adjoint_tests.rs"]
mod tests;
