//! The inspector stands at a surveyed marker. Paper 1, §3.4.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;

/// The middle of the feet is at `marker_n_m`, give or take `sigma_m` on each axis.
///
/// `positions_n` are the positions of the sensors that take part, each with its number; what stands
/// on two feet is measured on both, half each.
pub fn marker_position(
    positions_n: &[(usize, Vector3<f64>)],
    marker_n_m: &Vector3<f64>,
    sigma_m: &Vector3<f64>,
) -> Observation<3> {
    let share = 1.0 / positions_n.len() as f64;
    let middle = positions_n.iter().map(|(_, p)| p).sum::<Vector3<f64>>() * share;
    let noise = Matrix3::from_diagonal(&sigma_m.component_mul(sigma_m));
    let mut observation = Observation::new(middle - marker_n_m, noise);
    for (sensor, _) in positions_n {
        observation = observation.with(ErrorState::Position.of(*sensor), SMatrix::identity() * share);
    }
    observation
}
