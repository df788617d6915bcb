//! The barometer tells how far the sensor has risen since its zero was taken. Paper 2, II-A.

use nalgebra::{RowVector3, SMatrix, SVector, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;

/// Height in the standard atmosphere at which the air has the pressure `pressure_hpa`, m.
///
/// Paper 2 prints 443300 m for the first factor, which is 44330 m. Only differences of this height
/// are used, so the weather's own pressure cancels; air that is 10 K warmer than standard makes them
/// 4 % too small.
pub fn pressure_height_m(pressure_hpa: f64) -> f64 {
    44330.0 * (1.0 - libm::pow(pressure_hpa / 1013.25, 0.190_295))
}

/// The sensor stands `height_m` above the level from which heights are counted, give or take
/// `sigma_m`.
pub fn height(sensor: usize, p_n: &Vector3<f64>, height_m: f64, sigma_m: f64) -> Observation<1> {
    Observation::new(SVector::<f64, 1>::new(p_n.z - height_m), SMatrix::<f64, 1, 1>::new(sigma_m * sigma_m))
        .with(ErrorState::Position.of(sensor), RowVector3::new(0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_atmosphere_is_met_at_sea_level_and_at_1110_m() {
        assert_eq!(pressure_height_m(1013.25), 0.0);
        // ISO 2533: 886.85 hPa at 1110 m.
        assert!((pressure_height_m(886.85) - 1110.0).abs() < 1.5, "{}", pressure_height_m(886.85));
    }

    #[test]
    fn the_innovation_grows_with_the_height_error() {
        let truth = Vector3::new(1.0, 2.0, 3.0);
        let innovation = |z: f64| height(0, &Vector3::new(1.0, 2.0, z), truth.z, 0.5).innovation[0];
        let derivative = (innovation(3.01) - innovation(2.99)) / 0.02;
        let (block, jacobian) = height(0, &truth, 3.0, 0.5).jacobians()[0];
        assert_eq!(block, ErrorState::Position.of(0));
        assert!((derivative - jacobian[2]).abs() < 1e-9 && jacobian[0] == 0.0 && jacobian[1] == 0.0);
    }
}
