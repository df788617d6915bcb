//! In a field that does not change, the magnetometer sees how the sensor has turned: magnetic
//! angular rate update. Paper 1, §3.2.
//!
//! The paper compares neighbouring samples, where 0.25 µT of noise hides what the bias does to the
//! field in 0.01 s. Here the ends of a whole stance are compared, with the gyro's turn in between.

use nalgebra::{Matrix3, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;
use crate::rotation::skew;

/// The field at the end of a stance is that at its start, turned as the gyro says.
///
/// `mag_start_b_ut`, `mag_end_b_ut`: mean fields near both ends, each in the body frame of its own
/// moment; `turn` turns the end's body frame into the start's, from the gyro less the estimated
/// bias; `duration_s` lies between the two moments. With true rate = estimated − δb,
/// B_end − turn'·B_start = −[turn'·B_start ×] δb · duration.
pub fn magnetic_rate(
    sensor: usize,
    mag_start_b_ut: &Vector3<f64>,
    mag_end_b_ut: &Vector3<f64>,
    turn: &Matrix3<f64>,
    duration_s: f64,
    sigma_ut: f64,
) -> Observation<3> {
    let expected_b_ut = turn.transpose() * mag_start_b_ut;
    Observation::new(mag_end_b_ut - expected_b_ut, Matrix3::identity() * (sigma_ut * sigma_ut))
        .with(ErrorState::GyroBias.of(sensor), skew(&expected_b_ut) * -duration_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{assert_linearised, generic_truth, zero_truth};
    use crate::ins::nav_state::NavState;
    use crate::rotation::cayley;

    const INTERVAL_S: f64 = 0.01;
    const SAMPLES: usize = 50;

    /// A foot that turns at a steady rate in a steady field, as its sensors see it.
    struct Turning {
        start_b_ut: Vector3<f64>,
        end_b_ut: Vector3<f64>,
        reading: Vector3<f64>,
    }

    fn turning(truth: &NavState, w_nb_b: Vector3<f64>) -> Turning {
        let field_n_ut = Vector3::new(-1.5, 36.7, -31.0);
        let mut c_nb = truth.c_nb;
        let start_b_ut = c_nb.transpose() * field_n_ut;
        for _ in 0..SAMPLES {
            c_nb *= cayley(&(w_nb_b * INTERVAL_S));
        }
        Turning { start_b_ut, end_b_ut: c_nb.transpose() * field_n_ut, reading: w_nb_b + truth.gyro_bias_b }
    }

    fn model(sensor: usize, seen: &Turning, feet: &[NavState; 2]) -> Observation<3> {
        let mut turn = Matrix3::identity();
        for _ in 0..SAMPLES {
            turn *= cayley(&((seen.reading - feet[sensor].gyro_bias_b) * INTERVAL_S));
        }
        let duration_s = SAMPLES as f64 * INTERVAL_S;
        magnetic_rate(sensor, &seen.start_b_ut, &seen.end_b_ut, &turn, duration_s, 0.2)
    }

    #[test]
    fn on_a_foot_that_does_not_turn_the_jacobian_is_the_derivative() {
        for truth in [generic_truth(), zero_truth()] {
            for sensor in [0, 1] {
                let seen = turning(&truth[sensor], Vector3::zeros());
                assert_linearised(&truth, 1e-4, |feet| model(sensor, &seen, feet));
            }
        }
    }

    #[test]
    fn over_a_turn_the_jacobian_leaves_out_half_of_that_turn() {
        // Where in the stance the bias acted turns its effect: by half the turn on the mean.
        let truth = generic_truth();
        let w_nb_b = Vector3::new(0.3, -0.2, 0.35);
        let seen = turning(&truth[0], w_nb_b);
        let duration_s = SAMPLES as f64 * INTERVAL_S;
        let tolerance = 0.5 * w_nb_b.norm() * duration_s * seen.start_b_ut.norm() * duration_s;
        let largest = seen.start_b_ut.amax() * duration_s;
        assert!(tolerance < 0.2 * largest, "{tolerance} of {largest}");
        assert_linearised(&truth, tolerance, |feet| model(0, &seen, feet));
    }
}
