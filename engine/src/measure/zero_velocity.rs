//! A standing foot does not move. Paper 1, §2.3.

use nalgebra::{Matrix3, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;
use crate::rotation::skew;

/// The velocity of sensor number `sensor` is zero, with `sigma_m_s` of motion left.
///
/// That a foot stands says nothing of where north is: turned about the vertical, a foot at rest is at rest. But in the
/// propagated errors an error φ of the attitude has turned the velocity that the strapdown has come to, `v_n`, by
/// v × φ (notation page), which is the velocity's error and not zero. Taken for one of the velocity alone, it would tell
/// of the heading, stride by stride, a little that is not true: after a thousand strides a heading that was never
/// measured is believed to a degree. What is measured is therefore the velocity's error without that part, the one
/// of an invariant filter (Barrau, Bonnabel 2017, *The invariant extended Kalman filter as a stable observer*): at a
/// velocity of zero both are the same.
#[inline]
pub fn zero_velocity(sensor: usize, v_n: &Vector3<f64>, sigma_m_s: f64) -> Observation<3> {
    Observation::new(*v_n, Matrix3::identity() * (sigma_m_s * sigma_m_s))
        .with(ErrorState::Velocity.of(sensor), Matrix3::identity())
        .with(ErrorState::Attitude.of(sensor), -skew(v_n))
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
    fn a_turn_of_everything_about_the_vertical_is_not_seen() {
        for v_n in [Vector3::new(0.3, -0.2, 0.0), Vector3::new(-1.0, 2.0, 0.5)] {
            let observation = zero_velocity(0, &v_n, 0.03);
            // Where the attitude errs by φ about the vertical, and all else with it, the velocity errs by v × φ.
            let phi = Vector3::z() * 0.1;
            let seen: Vector3<f64> = observation
                .jacobians()
                .iter()
                .map(|(block, jacobian)| {
                    jacobian * if *block == ErrorState::Attitude.of(0) { phi } else { v_n.cross(&phi) }
                })
                .sum();
            assert!(seen.norm() < 1e-12, "{seen}");
        }
    }

    #[test]
    fn the_noise_is_the_sigma_squared_on_each_axis() {
        let observation = zero_velocity(1, &Vector3::new(0.1, 0.2, 0.3), 0.03);
        assert_eq!(observation.noise, Matrix3::identity() * (0.03 * 0.03));
    }
}
