//! A standing foot does not move. Paper 1, §2.3.

use nalgebra::{Matrix3, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;

/// The velocity of sensor number `sensor` is zero, with `sigma_m_s` of motion left.
#[inline]
pub fn zero_velocity(sensor: usize, v_n: &Vector3<f64>, sigma_m_s: f64) -> Observation<3> {
    Observation::new(*v_n, Matrix3::identity() * (sigma_m_s * sigma_m_s))
        .with(ErrorState::Velocity.of(sensor), Matrix3::identity())
}
