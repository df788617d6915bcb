//! A foot that stands for long does not turn, so its mean reading is the gyro's bias.
//!
//! Paper 1, §3.2 leaves this out because a foot may roll in stance; over a stance it does, and the
//! caller says how much (`sigma_rad_s`) from what the stance itself shows.

use nalgebra::{Matrix3, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;

/// The mean angular rate of a stance is zero.
///
/// `w_ib_b_mean` is the mean reading over the stance, rad/s, before the bias is taken off.
/// Reading = rate + true bias, so the innovation (reading − estimated bias) is the residual bias.
pub fn zero_angular_rate(
    sensor: usize,
    w_ib_b_mean: &Vector3<f64>,
    gyro_bias_b: &Vector3<f64>,
    sigma_rad_s: f64,
) -> Observation<3> {
    Observation::new(w_ib_b_mean - gyro_bias_b, Matrix3::identity() * (sigma_rad_s * sigma_rad_s))
        .with(ErrorState::GyroBias.of(sensor), Matrix3::identity())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{assert_linearised, generic_truth, zero_truth};

    #[test]
    fn the_jacobian_is_the_derivative_of_what_a_still_gyro_reads() {
        for truth in [generic_truth(), zero_truth()] {
            for sensor in [0, 1] {
                // A still gyro reads its true bias.
                let reading = truth[sensor].gyro_bias_b;
                assert_linearised(&truth, 1e-9, |feet| {
                    zero_angular_rate(sensor, &reading, &feet[sensor].gyro_bias_b, 1e-3)
                });
            }
        }
    }
}
