//! What a measurement model hands to the filter.

use nalgebra::{SMatrix, SVector};

use super::layout::StateVariable;

/// At most this many three-vectors of the state take part in one measurement.
pub const MOST_BLOCKS: usize = 8;

/// A measurement of M numbers, linearised: innovation = Σ jacobian · error of that block + noise.
///
/// The sign follows the errors of the notation page, so for a position or velocity the innovation
/// is estimated − measured.
#[derive(Clone, Debug)]
pub struct Observation<const M: usize> {
    /// The innovation.
    pub innovation: SVector<f64, M>,
    /// Covariance of the measurement noise, in the innovation's units squared.
    pub noise: SMatrix<f64, M, M>,
    blocks: [(usize, SMatrix<f64, M, 3>); MOST_BLOCKS],
    used: usize,
}

impl<const M: usize> Observation<M> {
    /// A measurement that does not depend on any state yet.
    pub fn new(innovation: SVector<f64, M>, noise: SMatrix<f64, M, M>) -> Self {
        Observation { innovation, noise, blocks: [(0, SMatrix::zeros()); MOST_BLOCKS], used: 0 }
    }

    /// Adds how the innovation changes with the error of block `block`.
    ///
    /// # Panics
    /// When more than [`MOST_BLOCKS`] blocks are added: a model that needs more is a mistake.
    #[must_use]
    pub fn with(mut self, block: usize, jacobian: SMatrix<f64, M, 3>) -> Self {
        self.blocks[self.used] = (block, jacobian);
        self.used += 1;
        self
    }

    /// The same for a variable of up to three numbers, where it is a state; otherwise nothing is added.
    #[must_use]
    pub fn with_variable(self, variable: Option<StateVariable>, jacobian: SMatrix<f64, M, 3>) -> Self {
        match variable {
            Some(variable) => self.with(variable.block(), jacobian),
            None => self,
        }
    }

    /// The blocks that take part, with their Jacobians.
    #[inline]
    pub fn jacobians(&self) -> &[(usize, SMatrix<f64, M, 3>)] {
        &self.blocks[..self.used]
    }
}
