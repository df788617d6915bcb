//! The class of an inertial sensor: its noise as a data sheet puts it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::error_model::Transition;
use super::process_noise::{BiasesKept, Growth, ProcessNoise};

/// An error that wanders about zero: a first-order Gauss–Markov process, the same on each axis.
///
/// Its autocovariance is σ² exp(−|τ|/T). A constant has an infinite correlation time; a sigma of zero is an
/// error that only fades.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaussMarkov {
    /// Stationary sigma σ, in the unit of the error.
    pub sigma: f64,
    /// Correlation time T, s.
    pub correlation_time_s: f64,
}

impl GaussMarkov {
    /// An error that never changes.
    pub const CONSTANT: GaussMarkov = GaussMarkov { sigma: 0.0, correlation_time_s: f64::INFINITY };

    /// What is left of it after `dt_s`, as a factor: exp(−dt/T).
    pub fn kept(&self, dt_s: f64) -> f64 {
        libm::exp(-dt_s / self.correlation_time_s)
    }

    /// The variance that comes anew in `dt_s`: σ² (1 − exp(−2 dt/T)).
    pub fn growth(&self, dt_s: f64) -> f64 {
        -libm::expm1(-2.0 * dt_s / self.correlation_time_s) * self.sigma * self.sigma
    }
}

/// Noise of one inertial sensor, each error the same on its three axes; densities are one-sided, as in data
/// sheets.
///
/// The bias here is the part that moves: the bias instability with its correlation time. By how much the
/// sensor is off when it is switched on is for the first covariance of the filter to say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuNoise {
    /// Angle random walk, rad/√s.
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Velocity random walk, m/s/√s.
    pub velocity_random_walk_m_s_sqrt_s: f64,
    /// Bias instability of the gyro, rad/s.
    pub gyro_bias_rad_s: GaussMarkov,
    /// Bias instability of the accelerometer, m/s².
    pub accelerometer_bias_m_s2: GaussMarkov,
    /// Scale factor of the gyro, of 1. Read where it is a state.
    pub gyro_scale_factor: GaussMarkov,
    /// Scale factor of the accelerometer, of 1. Read where it is a state.
    pub accelerometer_scale_factor: GaussMarkov,
}

impl ProcessNoise for ImuNoise {
    fn biases_kept(&self, dt_s: f64) -> BiasesKept {
        BiasesKept {
            gyro: self.gyro_bias_rad_s.kept(dt_s),
            accelerometer: self.accelerometer_bias_m_s2.kept(dt_s),
        }
    }

    fn growth(&self, transition: &Transition) -> Growth {
        let dt_s = transition.dt_s();
        let white = |density: f64| Vector3::repeat(density * density * dt_s);
        Growth {
            attitude: white(self.angle_random_walk_rad_sqrt_s),
            gyro_bias: Vector3::repeat(self.gyro_bias_rad_s.growth(dt_s)),
            accelerometer_bias: Vector3::repeat(self.accelerometer_bias_m_s2.growth(dt_s)),
            position: Vector3::zeros(),
            velocity: white(self.velocity_random_walk_m_s_sqrt_s),
            position_share_s: 0.5 * dt_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauss_markov_error_keeps_its_variance_however_the_time_is_divided() {
        let process = GaussMarkov { sigma: 3.0, correlation_time_s: 40.0 };
        for steps in [1, 7, 1000] {
            let dt_s = 100.0 / f64::from(steps);
            let (mut stationary, mut from_zero) = (9.0, 0.0);
            for _ in 0..steps {
                let kept = process.kept(dt_s);
                stationary = kept * kept * stationary + process.growth(dt_s);
                from_zero = kept * kept * from_zero + process.growth(dt_s);
            }
            assert!((stationary - 9.0_f64).abs() < 1e-12, "{stationary}");
            let expected = 9.0 * (1.0 - (-2.0 * 100.0 / 40.0_f64).exp());
            assert!((from_zero - expected).abs() < 1e-12, "{from_zero} {expected}");
        }
    }

    #[test]
    fn a_constant_stays_and_never_grows() {
        assert_eq!((GaussMarkov::CONSTANT.kept(1e6), GaussMarkov::CONSTANT.growth(1e6)), (1.0, 0.0));
    }
}
