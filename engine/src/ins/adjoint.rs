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
use super::error_model::Transition;
use super::imu_noise::ImuNoise;
use super::layout::BLOCKS_A_SENSOR;
use super::operations::{Factor, Operation};
use super::rows::Rows;
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
}

impl<const B: usize> Adjoint<B> {
    /// At the end, where the future says nothing.
    pub(crate) fn at_the_end() -> Self {
        Adjoint {
            lambda: [Vector3::zeros(); B],
            information: BlockCovariance::zeros(),
            errors: [Vector3::zeros(); B],
        }
    }

    /// The smoothed errors of the nominal state.
    pub(crate) fn errors(&self) -> &[Vector3<f64>; B] {
        &self.errors
    }

    /// W Λ W': what smoothing takes off the covariance of M numbers whose covariance with the errors is W.
    pub(crate) fn taken_off<const M: usize>(&self, w: &Rows<M, B>) -> SMatrix<f64, M, M> {
        self.information.times_rows(w).times_transposed(w)
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
                        self.undo_transition(&transition, usize::from(sensor), noise);
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
                    let factor = Matrix3::from_column_slice(&pop::<9>(&mut tape.numbers));
                    let (a, b, factor) = (usize::from(a), usize::from(b), Factor::Matrix(factor));
                    self.information.add_multiple(b, a, &factor.transposed());
                    self.undo(&Operation::AddMultiple { a, b, factor });
                }
                Entry::Scale { block } => {
                    let by = Vector3::from(pop(&mut tape.numbers));
                    self.information.scale(usize::from(block), &by);
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
                    self.information.add_multiple(from, to, &Factor::Scalar(1.0));
                    self.information.isolate(to, Matrix3::zeros());
                    let lambda = std::mem::take(&mut self.lambda[to]);
                    self.lambda[from] += lambda;
                    self.errors[to] = self.by_row(&mut tape.numbers);
                }
                Entry::CommonNoise { blocks } => {
                    let variance = Vector3::from(pop(&mut tape.numbers));
                    let of = (0..B).filter(|block| blocks >> block & 1 == 1);
                    let sum: Vector3<f64> = of.clone().map(|block| self.lambda[block]).sum();
                    of.for_each(|block| self.errors[block] -= variance.component_mul(&sum));
                }
            }
        }
        false
    }

    fn undo_transition(&mut self, transition: &Transition, sensor: usize, noise: &ImuNoise) {
        for (block, variance) in transition.noise(sensor, noise) {
            self.errors[block] -= variance.component_mul(&self.lambda[block]);
        }
        let mut operations = transition.operations(sensor, noise);
        operations.reverse();
        operations.iter().for_each(|operation| self.undo(operation));
        let transposed = operations.map(|operation| operation.transposed());
        self.information.transform::<BLOCKS_A_SENSOR>(sensor * BLOCKS_A_SENSOR, &transposed);
    }

    /// Goes back over an operation with the errors and λ; Λ has done so.
    #[inline]
    fn undo(&mut self, operation: &Operation) {
        match operation {
            Operation::AddMultiple { a, b, factor } => {
                let (lambda, error) = (self.lambda[*a], self.errors[*b]);
                self.lambda[*b] += factor.transposed().times(&lambda);
                self.errors[*a] -= factor.times(&error);
            }
            Operation::Scale { i, by } => {
                self.lambda[*i].component_mul_assign(by);
                self.errors[*i].component_div_assign(by);
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
        let mut gain = Rows::<M, B>::zeros();
        gain.0.as_flattened_mut().as_flattened_mut().copy_from_slice(take(3 * M * B));
        let s_inverse = SMatrix::<f64, M, M>::from_column_slice(take(M * M));
        let mut say = SVector::<f64, M>::from_column_slice(take(M));
        let innovation = SVector::<f64, M>::from_column_slice(take(M));

        // Λ ← Λ − T D − D' T' with T = H' and D = K' Λ − (K' Λ K + S⁻¹) T' / 2.
        let mut d = self.information.times_rows(&gain);
        let inner = s_inverse + d.times_transposed(&gain);
        for (block, t) in h_transposed {
            let half = (t * inner.transpose() * 0.5).transpose();
            for m in 0..M {
                for axis in 0..3 {
                    d.0[m][*block][axis] -= half[(m, axis)];
                }
            }
        }
        for (block, t) in h_transposed {
            self.information.subtract_both_products(*block, t, &d);
        }
        say -= gain.of(&self.lambda);
        for (block, t) in h_transposed {
            self.lambda[*block] += t * say;
        }
        for (error, put_on) in self.errors.iter_mut().zip(&gain.transposed_times(&innovation)) {
            *error += put_on;
        }
        numbers.truncate(start);
    }

    /// The error of a block by its row of the covariance, which is on the tape.
    fn by_row(&self, numbers: &mut Vec<f64>) -> Vector3<f64> {
        let start = numbers.len().saturating_sub(9 * B);
        let error = numbers[start..]
            .chunks_exact(9)
            .zip(&self.lambda)
            .map(|(block, lambda)| Matrix3::from_column_slice(block) * lambda)
            .sum();
        numbers.truncate(start);
        error
    }
}

/// Takes the last numbers off the tape.
fn pop<const N: usize>(numbers: &mut Vec<f64>) -> [f64; N] {
    let mut last = [0.0; N];
    let start = numbers.len().saturating_sub(N);
    last.iter_mut().zip(&numbers[start..]).for_each(|(to, number)| *to = *number);
    numbers.truncate(start);
    last
}

#[cfg(test)]
#[path = "adjoint_tests.rs"]
mod tests;
