//! The tip of a pole stands on a place: one that was surveyed (paper 4's coordinate update), or one that is
//! estimated itself and does not move while the tip stands on it.

use nalgebra::{Matrix3, Vector3};

use crate::ins::layout::StateVariable;
use crate::ins::lever_arm::LeverArm;
use crate::ins::observation::Observation;
use crate::ins::strapdown::Strapdown;

/// The tip at `arm` stands at `place_n_m`, with the covariance `noise` (m²).
///
/// `place` says where the error of the place stands, where it is a state: in n, m, estimated − true.
pub fn tip_position(
    strapdown: &Strapdown,
    arm: &LeverArm,
    place_n_m: &Vector3<f64>,
    place: Option<StateVariable>,
    noise: &Matrix3<f64>,
) -> Observation<3> {
    arm.position(strapdown)
        .observed(strapdown, arm, place_n_m, noise)
        .with_variable(place, -Matrix3::identity())
}
