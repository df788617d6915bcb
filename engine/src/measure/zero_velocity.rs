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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{assert_linearised, generic_truth, zero_truth};

    #[test]
    fn the_jacobian_is_the_derivative_of_the_velocity_of_that_foot_alone() {
        // A standing foot: its true velocity is zero, whatever the rest of the state.
        for mut truth in [generic_truth(), zero_truth()] {
            for sensor in [0, 1] {
                truth[sensor].v_n = Vector3::zeros();
                assert_linearised(&truth, 1e-9, |feet| zero_velocity(sensor, &feet[sensor].v_n, 0.03));
            }
        }
    }

    #[test]
    fn the_noise_is_the_sigma_squared_on_each_axis() {
        let observation = zero_velocity(1, &Vector3::new(0.1, 0.2, 0.3), 0.03);
        assert_eq!(observation.noise, Matrix3::identity() * (0.03 * 0.03));
    }
}
