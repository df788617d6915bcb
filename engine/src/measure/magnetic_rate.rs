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
