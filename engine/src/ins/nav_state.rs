//! The nominal state of one sensor: where the strapdown believes it to be.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::layout::ErrorState;
use crate::rotation::cayley;

/// Attitude, velocity, position and sensor biases of one sensor.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NavState {
    /// Turns the body frame into the navigation frame.
    pub c_nb: Matrix3<f64>,
    /// Velocity, m/s.
    pub v_n: Vector3<f64>,
    /// Position, m.
    pub p_n: Vector3<f64>,
    /// Gyro bias, rad/s: reading − true rate.
    pub gyro_bias_b: Vector3<f64>,
    /// Accelerometer bias, m/s²: reading − true specific force.
    pub accelerometer_bias_b: Vector3<f64>,
}

impl NavState {
    /// Takes estimated errors off the state, after which they are zero: `correction` is the whole
    /// error vector of the filter, `sensor` says whose part is this state's.
    #[inline]
    pub fn correct<const B: usize>(&mut self, sensor: usize, correction: &[Vector3<f64>; B]) {
        self.c_nb = cayley(&correction[ErrorState::Attitude.of(sensor)]) * self.c_nb;
        self.gyro_bias_b += correction[ErrorState::GyroBias.of(sensor)];
        self.p_n -= correction[ErrorState::Position.of(sensor)];
        self.v_n -= correction[ErrorState::Velocity.of(sensor)];
        self.accelerometer_bias_b += correction[ErrorState::AccelerometerBias.of(sensor)];
    }

    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        self.c_nb.iter().chain(self.v_n.iter()).chain(self.p_n.iter()).all(|x| x.is_finite())
            && self.gyro_bias_b.iter().chain(self.accelerometer_bias_b.iter()).all(|x| x.is_finite())
    }
}
