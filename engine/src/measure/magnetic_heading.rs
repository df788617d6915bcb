//! The levelled magnetic field points to magnetic north. Paper 1, §3.1.

use nalgebra::{Matrix3, RowVector3, SMatrix, SVector, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;
use crate::rotation::{azimuth, wrap};

/// The horizontal part of the field lies at the declination.
///
/// `mag_b_ut` is the mean field of a stance in b, µT; `declination_rad` is east of north. The
/// innovation is declination − azimuth of the field as the attitude turns it. The paper prints a row
/// of zeros for H; with true = (I + [φ×])·estimated it is
/// ∂α/∂φ = [B_u B_e / B_h², B_u B_n / B_h², −1]: at a dip of 40° the tilt counts almost like the
/// heading itself.
pub fn magnetic_heading(
    sensor: usize,
    c_nb: &Matrix3<f64>,
    mag_b_ut: &Vector3<f64>,
    declination_rad: f64,
    sigma_rad: f64,
) -> Observation<1> {
    let b_n = c_nb * mag_b_ut;
    let horizontal_squared = b_n.x * b_n.x + b_n.y * b_n.y;
    let row = RowVector3::new(b_n.z * b_n.x / horizontal_squared, b_n.z * b_n.y / horizontal_squared, -1.0);
    let innovation = wrap(declination_rad - azimuth(b_n.x, b_n.y));
    Observation::new(SVector::<f64, 1>::new(innovation), SMatrix::<f64, 1, 1>::new(sigma_rad * sigma_rad))
        .with(ErrorState::Attitude.of(sensor), row)
}
