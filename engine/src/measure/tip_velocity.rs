//! The tip of a pole that stands on the ground does not move: zero velocity at a lever arm. Paper 4, (10)–(12).

use nalgebra::{Matrix3, Vector3};

use crate::ins::earth::Earth;
use crate::ins::lever_arm::LeverArm;
use crate::ins::observation::Observation;
use crate::ins::strapdown::Strapdown;

/// The tip at `arm` has the velocity zero while the gyro reads `w_ib_b` (rad/s, as read), with `sigma_m_s` of
/// motion left on each axis.
pub fn tip_velocity(
    strapdown: &Strapdown,
    arm: &LeverArm,
    w_ib_b: &Vector3<f64>,
    earth: &Earth,
    sigma_m_s: f64,
) -> Observation<3> {
    let noise = Matrix3::from_diagonal_element(sigma_m_s * sigma_m_s);
    arm.velocity(strapdown, w_ib_b, earth).observed(strapdown, arm, &Vector3::zeros(), &noise)
}
