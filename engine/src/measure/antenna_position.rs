//! A GNSS antenna's position, at its lever arm. Paper 4, (14), and paper 3, (20) for each antenna by itself.
//!
//! Paper 4 prints the tip's lever arm in (14); it is the antenna's. Paper 3 has none.

use nalgebra::{Matrix3, Vector3};

use crate::ins::lever_arm::LeverArm;
use crate::ins::observation::Observation;
use crate::ins::strapdown::Strapdown;

/// The antenna at `arm` is at `measured_n_m`, with the covariance `noise` of the solution (m², in n: a receiver
/// gives it by east, north and up, and within 50 km these are the axes of n to half a degree).
pub fn antenna_position(
    strapdown: &Strapdown,
    arm: &LeverArm,
    measured_n_m: &Vector3<f64>,
    noise: &Matrix3<f64>,
) -> Observation<3> {
    arm.position(strapdown).observed(strapdown, arm, measured_n_m, noise)
}
