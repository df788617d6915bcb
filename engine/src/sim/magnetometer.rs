//! A magnetometer: hard and soft iron of what it sits on, noise, and the steps of its converter.

use nalgebra::{Matrix3, Vector3};

use super::random::Random;
use super::triad::digitise;

/// A magnetometer's errors, each given so that zero means none.
#[derive(Clone, Debug, PartialEq)]
pub struct MagnetometerModel {
    /// Noise of each reading and axis, µT.
    pub noise_ut: f64,
    /// Hard iron on each axis, 1σ, µT.
    pub hard_iron_ut: f64,
    /// Soft iron: 1σ of each element by which the matrix differs from the identity.
    pub soft_iron: f64,
    /// Whether readings are rounded to 16 bits of the range.
    pub sixteen_bits: bool,
}

/// Range of the magnetometer, µT.
const RANGE_UT: f64 = 800.0;

impl MagnetometerModel {
    /// Without errors.
    pub fn perfect() -> MagnetometerModel {
        MagnetometerModel { noise_ut: 0.0, hard_iron_ut: 0.0, soft_iron: 0.0, sixteen_bits: false }
    }
}

/// One magnetometer: its errors have been drawn.
#[derive(Clone, Debug)]
pub(crate) struct Magnetometer {
    soft_iron: Matrix3<f64>,
    hard_iron_ut: Vector3<f64>,
    noise: Random,
    model: MagnetometerModel,
}

impl Magnetometer {
    /// Draws what is constant from `calibration`: always as many numbers, in one order.
    pub(crate) fn new(model: &MagnetometerModel, calibration: &mut Random, noise: Random) -> Magnetometer {
        let hard_iron_ut = model.hard_iron_ut * Vector3::from(calibration.normal_3());
        let soft_iron = Matrix3::identity() + Matrix3::from_fn(|_, _| model.soft_iron * calibration.normal());
        Magnetometer { soft_iron, hard_iron_ut, noise, model: model.clone() }
    }

    /// The next reading of a true field, both in the sensor's axes, µT.
    pub(crate) fn read(&mut self, field_s_ut: &Vector3<f64>) -> [f64; 3] {
        let field = self.soft_iron * field_s_ut + self.hard_iron_ut;
        let noise = self.noise.normal_3();
        let step = self.model.sixteen_bits.then_some(RANGE_UT / 32768.0);
        let range = if self.model.sixteen_bits { RANGE_UT } else { f64::INFINITY };
        std::array::from_fn(|axis| digitise(field[axis] + self.model.noise_ut * noise[axis], range, step))
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Purpose;
    use super::*;

    #[test]
    fn iron_and_noise_have_their_sigmas_over_the_seeds() {
        let model =
            MagnetometerModel { noise_ut: 0.5, hard_iron_ut: 2.0, soft_iron: 0.02, sixteen_bits: true };
        let field = Vector3::new(0.0, 40.0, 0.0);
        let (mut constant, mut noise) = (0.0, 0.0);
        for seed in 0..300 {
            let mut calibration = Random::new(seed, 0, Purpose::Calibration);
            let stream = Random::new(seed, 0, Purpose::MagneticNoise);
            let mut sensor = Magnetometer::new(&model, &mut calibration, stream);
            let readings: Vec<Vector3<f64>> = (0..50).map(|_| Vector3::from(sensor.read(&field))).collect();
            let mean = readings.iter().sum::<Vector3<f64>>() / 50.0;
            constant += (mean - field).norm_squared() / 900.0;
            noise += readings.iter().map(|r| (r - mean).norm_squared()).sum::<f64>() / (900.0 * 49.0);
            assert!(readings.iter().flatten().all(|ut| (ut * 32768.0 / RANGE_UT).fract() == 0.0));
        }
        // Hard iron, soft iron on 40 µT, and what is left of the noise in a mean of 50.
        let expected = libm::sqrt(4.0 + 0.64 + 0.25 / 50.0);
        assert!((libm::sqrt(constant) / expected - 1.0).abs() < 0.08, "{} µT", libm::sqrt(constant));
        assert!((libm::sqrt(noise) / 0.5 - 1.0).abs() < 0.02, "{} µT", libm::sqrt(noise));
    }
}
