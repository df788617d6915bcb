//! A GNSS antenna's velocity by Doppler, at its lever arm. Paper 3, (20), with the lever arm that it leaves out.

use nalgebra::{Matrix3, Vector3};

use crate::ins::earth::Earth;
use crate::ins::lever_arm::LeverArm;
use crate::ins::observation::Observation;
use crate::ins::strapdown::Strapdown;

/// The antenna at `arm` moves with `measured_n_m_s` while the gyro reads `w_ib_b` (rad/s, as read), with the
/// covariance `noise` of the solution (m²/s²). The gyro's own noise at the lever arm is to be a part of it.
pub fn antenna_velocity(
    strapdown: &Strapdown,
    arm: &LeverArm,
    w_ib_b: &Vector3<f64>,
    earth: &Earth,
    measured_n_m_s: &Vector3<f64>,
    noise: &Matrix3<f64>,
) -> Observation<3> {
    arm.velocity(strapdown, w_ib_b, earth).observed(strapdown, arm, measured_n_m_s, noise)
}
