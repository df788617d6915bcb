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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{Rig, assert_linearised};

    #[test]
    fn the_jacobian_is_the_derivative_of_how_far_the_tip_is_from_a_place_that_is_known_or_estimated() {
        for seed in 0..20 {
            let mut truth = Rig::random(seed, &[false, true]);
            for (sensor, arm) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                // The tip stands on the place.
                let strapdown = &mut truth.strapdowns[sensor];
                let place_n = truth.places[0].0;
                strapdown.nav.p_n = place_n - strapdown.nav.c_nb * truth.arms[arm].arm_b_m;
                let noise = Matrix3::identity() * 1e-4;
                assert_linearised(&truth, 1e-8, |rig| {
                    tip_position(&rig.strapdowns[sensor], &rig.arms[arm], &place_n, None, &noise)
                });
                assert_linearised(&truth, 1e-8, |rig| {
                    let (place_n, state) = rig.places[0];
                    tip_position(&rig.strapdowns[sensor], &rig.arms[arm], &place_n, Some(state), &noise)
                });
            }
        }
    }
}
