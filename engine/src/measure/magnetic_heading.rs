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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{assert_linearised, generic_truth, zero_truth};
    use crate::ins::eskf::Eskf;
    use crate::rotation::{cayley, heading};

    const DECLINATION_RAD: f64 = -0.04;

    /// A field of 48 µT at a dip of 40°, as at the site.
    fn field_n_ut() -> Vector3<f64> {
        let (sin_dip, cos_dip) = 40f64.to_radians().sin_cos();
        let (sin, cos) = DECLINATION_RAD.sin_cos();
        Vector3::new(sin * cos_dip, cos * cos_dip, -sin_dip) * 48.0
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_azimuth_on_a_tilted_foot() {
        for truth in [generic_truth(), zero_truth()] {
            for sensor in [0, 1] {
                let mag_b_ut = truth[sensor].c_nb.transpose() * field_n_ut();
                assert_linearised(&truth, 1e-7, |feet| {
                    magnetic_heading(sensor, &feet[sensor].c_nb, &mag_b_ut, DECLINATION_RAD, 0.1)
                });
            }
        }
    }

    #[test]
    fn at_a_dip_of_forty_degrees_tilt_counts_almost_like_the_heading() {
        let observation = magnetic_heading(0, &Matrix3::identity(), &field_n_ut(), DECLINATION_RAD, 0.1);
        let (_, row) = observation.jacobians()[0];
        let tilt = row[0].hypot(row[1]);
        assert!((tilt - 40f64.to_radians().tan()).abs() < 1e-12, "{tilt}");
        assert_eq!(row[2], -1.0);
    }

    #[test]
    fn an_innovation_across_south_takes_the_short_way_round() {
        let declination_rad = std::f64::consts::PI - 0.01;
        let field_n =
            Vector3::new((declination_rad + 0.03).sin(), (declination_rad + 0.03).cos(), -0.8) * 30.0;
        let observation = magnetic_heading(0, &Matrix3::identity(), &field_n, declination_rad, 0.1);
        assert!((observation.innovation[0] + 0.03).abs() < 1e-12, "{}", observation.innovation[0]);
    }

    #[test]
    fn an_update_turns_a_wrong_heading_towards_the_true_one() {
        let truth = &generic_truth()[0];
        let mag_b_ut = truth.c_nb.transpose() * field_n_ut();
        for wrong_rad in [-0.2, 0.2] {
            // Turned about the vertical only, and known to be so.
            let mut state = truth.clone();
            state.c_nb = cayley(&Vector3::new(0.0, 0.0, wrong_rad)) * state.c_nb;
            let mut filter = Eskf::<5>::new();
            filter.covariance.set_diagonal(0, Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0)));
            let observation = magnetic_heading(0, &state.c_nb, &mag_b_ut, DECLINATION_RAD, 1e-3);
            let correction = filter.update(&observation, f64::INFINITY).correction.unwrap();
            state.correct(0, &correction);
            let off_rad = wrap(heading(&state.c_nb) - heading(&truth.c_nb));
            assert!(off_rad.abs() < 1e-3, "{wrong_rad} rad wrong, {off_rad} rad after the update");
        }
    }
}
