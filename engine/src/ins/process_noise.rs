//! What noise adds to the errors of a sensor over a transition.

use nalgebra::Vector3;

use super::error_model::Transition;

/// A model of a sensor's noise. What a data sheet says is [`ImuNoise`](super::imu_noise::ImuNoise); a system
/// that knows more of how its sensor moves has a model of its own.
pub trait ProcessNoise {
    /// What is left of the biases after `dt_s`.
    fn biases_kept(&self, dt_s: f64) -> BiasesKept;

    /// By how much the errors grow over `transition`.
    fn growth(&self, transition: &Transition) -> Growth;
}

/// What is left of a sensor's biases after some time, as factors.
#[derive(Clone, Copy, Debug)]
pub struct BiasesKept {
    /// Of the gyro's.
    pub gyro: f64,
    /// Of the accelerometer's.
    pub accelerometer: f64,
}

/// Variances that noise adds, by axis.
#[derive(Clone, Copy, Debug)]
pub struct Growth {
    /// Attitude in n, rad².
    pub attitude: Vector3<f64>,
    /// Gyro bias in b, rad²/s².
    pub gyro_bias: Vector3<f64>,
    /// Accelerometer bias in b, m²/s⁴.
    pub accelerometer_bias: Vector3<f64>,
    /// Position in n, m².
    pub position: Vector3<f64>,
    /// Velocity in n, m²/s².
    pub velocity: Vector3<f64>,
    /// The velocity's noise times this has moved the position, too, s: half of the time, as it comes in the
    /// middle of it on the mean.
    pub position_share_s: f64,
}
