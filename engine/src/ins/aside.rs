//! A linear function of the errors, kept as it was at a past moment.
//!
//! Some measurements are of a moment that is known only when it is over. What they measure is then an error
//! of the past; its covariance with the errors of now is a row that goes with them through every
//! propagation and update. Used, it corrects the present to first order as if it had been used in time,
//! and nothing is run again.

use nalgebra::{RowVector3, SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::block_covariance::BlockCovariance;
use super::linear_maps::Rows;
use super::observation::Observation;
use super::sensor_map::Five;

/// One error of the past beside the `B` vectors of now.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Aside<const B: usize> {
    /// Its covariance with all errors of now.
    pub(super) row: Rows<1, B>,
    pub(super) variance: f64,
    /// What has been taken off its nominal value since.
    pub(super) corrected: f64,
}

impl<const B: usize> Aside<B> {
    /// The error Σ jacobian · error of that block, as it is now.
    pub(super) fn of(covariance: &BlockCovariance<B>, jacobians: &[(usize, RowVector3<f64>)]) -> Self {
        let row = covariance.seen_by(jacobians);
        let variance = jacobians.iter().map(|(i, jacobian)| jacobian.dot(&row.block(*i))).sum();
        Aside { row, variance, corrected: 0.0 }
    }

    /// Five vectors of now from number `first` on go through `map`.
    #[inline]
    pub(super) fn transform(&mut self, first: usize, map: impl Fn(Five) -> Five) {
        transform_row(&mut self.row, first, map);
    }

    /// The present is updated by `observation`: its own share of the gain comes back.
    #[inline]
    pub(super) fn update<const M: usize>(
        &mut self,
        observation: &Observation<M>,
        information: &SMatrix<f64, M, M>,
        weighted: &SVector<f64, M>,
        cross_covariance: &Rows<M, B>,
    ) -> SVector<f64, M> {
        let mut seen = SVector::<f64, M>::zeros();
        for (block, jacobian) in observation.jacobians() {
            seen += jacobian * self.row.block(*block).transpose();
        }
        let gain = information * seen;
        self.corrected += seen.dot(weighted);
        self.variance = (self.variance - seen.dot(&gain)).max(0.0);
        self.row.subtract(&cross_covariance.times(&gain.transpose()));
        gain
    }
}

/// A row that sees five vectors from number `first` on sees them through `map`.
#[inline]
pub(super) fn transform_row<const M: usize, const B: usize>(
    rows: &mut Rows<M, B>,
    first: usize,
    map: impl Fn(Five) -> Five,
) {
    for row in &mut rows.0 {
        if let Some(five) = row[first..].first_chunk_mut::<5>() {
            *five = map(*five);
        }
    }
}
