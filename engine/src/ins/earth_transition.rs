//! How the errors of an instrument's strapdown grow: Earth rate, scale factors, and no approximation in the
//! length of the interval.
//!
//! With the signs of the notation page (n turns with Earth, w_in = w_ie):
//!
//! φ̇ = −\[w_ie×\] φ − C D (δb_g + W δs_g),
//! δv̇ = \[f_n×\] φ − 2 \[w_ie×\] δv + ∂g/∂p δp + C E (δb_a + F δs_a),
//! δṗ = δv,
//!
//! where W and F are the diagonals of rate and specific force, and D and E those of 1/(1 + s), as readings are
//! corrected to (reading − b)/(1 + s). Biases and scale factors are first-order Gauss–Markov processes.
//!
//! [`Transition`](super::error_model::Transition) is the short form of this for feet. Here every integral is
//! gathered sample by sample, so the covariance may wait for the next measurement.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::block_covariance::BlockCovariance;
use super::earth::Earth;
use super::earth_map::{EarthMap, rows};
use super::imu_noise::ImuNoise;
use super::layout::BLOCKS_A_SENSOR;
use super::layout::ErrorState::{AccelerometerBias, Attitude, GyroBias, Velocity};
use crate::rotation::{cayley, skew};

/// What one unit of a sensor's error has done so far to attitude, velocity and position.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Coupling {
    pub(super) attitude: Matrix3<f64>,
    pub(super) velocity: Matrix3<f64>,
    pub(super) position: Matrix3<f64>,
}

impl Coupling {
    /// Goes on by a sample in which the velocity grows by `push` × φ, and one unit of the error turns the
    /// attitude by `turn` and adds `pull` to the velocity.
    fn extend(&mut self, dt_s: f64, push: &Matrix3<f64>, turn: &Matrix3<f64>, pull: &Matrix3<f64>) {
        let (first, mean) = (self.attitude + turn / 3.0, self.attitude + turn * 0.5);
        self.position += self.velocity * dt_s + (push * first + pull) * (0.5 * dt_s);
        self.velocity += push * mean + pull;
        self.attitude += turn;
    }
}

/// The couplings of a sensor's scale factors.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct ScaleCouplings {
    pub(super) gyro: Coupling,
    pub(super) accelerometer: Coupling,
}

/// One sample, as the error model sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<'a> {
    pub(super) dt_s: f64,
    /// Mean attitude of the sample.
    pub(super) c_nb: &'a Matrix3<f64>,
    /// By how much specific force has changed the velocity, in n, m/s.
    pub(super) pushed_n: &'a Vector3<f64>,
    /// Corrected rate and specific force.
    pub(super) w_ib_b: &'a Vector3<f64>,
    pub(super) f_b: &'a Vector3<f64>,
    /// 1/(1 + s) of both.
    pub(super) gyro_gain: &'a Vector3<f64>,
    pub(super) accelerometer_gain: &'a Vector3<f64>,
}

/// The transition over the samples since it was last applied.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct EarthTransition {
    dt_s: f64,
    /// First and second integral of the specific force, m/s and m.
    velocity_by_attitude: Vector3<f64>,
    position_by_attitude: Vector3<f64>,
    gyro: Coupling,
    accelerometer: Coupling,
    scale: ScaleCouplings,
}

impl EarthTransition {
    pub(super) fn dt_s(&self) -> f64 {
        self.dt_s
    }

    pub(super) fn scale(&self) -> &ScaleCouplings {
        &self.scale
    }

    /// Goes on by a sample; `with_scale` says whether scale factors are states.
    pub(super) fn extend(&mut self, sample: &Sample<'_>, with_scale: bool) {
        let dt_s = sample.dt_s;
        let push = skew(sample.pushed_n);
        let none = Matrix3::zeros();
        let columns = |by: Vector3<f64>| {
            let mut scaled = *sample.c_nb;
            for (mut column, by) in scaled.column_iter_mut().zip(&by) {
                column *= *by;
            }
            scaled
        };
        let turn = columns(sample.gyro_gain * -dt_s);
        let pull = columns(sample.accelerometer_gain * dt_s);
        self.dt_s += dt_s;
        self.position_by_attitude += self.velocity_by_attitude * dt_s + sample.pushed_n * (0.5 * dt_s);
        self.velocity_by_attitude += sample.pushed_n;
        self.gyro.extend(dt_s, &push, &turn, &none);
        self.accelerometer.extend(dt_s, &push, &none, &pull);
        if with_scale {
            let turn = columns(sample.gyro_gain.component_mul(sample.w_ib_b) * -dt_s);
            let pull = columns(sample.accelerometer_gain.component_mul(sample.f_b) * dt_s);
            self.scale.gyro.extend(dt_s, &push, &turn, &none);
            self.scale.accelerometer.extend(dt_s, &push, &none, &pull);
        }
    }

    /// The transition of the strapdown's own five states, with its noise.
    pub(super) fn propagation(&self, earth: &Earth, noise: &ImuNoise) -> EarthPropagation {
        let dt_s = self.dt_s;
        let w_ie_n = earth.w_ie_n();
        let white = |density: f64| Vector3::repeat(0.5 * density * density * dt_s);
        EarthPropagation {
            map: EarthMap {
                dt_s,
                velocity_by_attitude: self.velocity_by_attitude.into(),
                position_by_attitude: self.position_by_attitude.into(),
                attitude_by_gyro: rows(&self.gyro.attitude),
                velocity_by_gyro: rows(&self.gyro.velocity),
                position_by_gyro: rows(&self.gyro.position),
                velocity_by_accelerometer: rows(&self.accelerometer.velocity),
                position_by_accelerometer: rows(&self.accelerometer.position),
                half_turn: rows(&cayley(&(w_ie_n * (-0.5 * dt_s)))),
                whole_turn: rows(&cayley(&(w_ie_n * -dt_s))),
                half_gradient_dt: rows(&(earth.gravity_gradient_n() * (0.5 * dt_s))),
                gyro_bias_kept: noise.gyro_bias_rad_s.kept(dt_s),
                accelerometer_bias_kept: noise.accelerometer_bias_m_s2.kept(dt_s),
            },
            half_attitude: white(noise.angle_random_walk_rad_sqrt_s),
            half_velocity: white(noise.velocity_random_walk_m_s_sqrt_s),
            gyro_bias: Vector3::repeat(noise.gyro_bias_rad_s.growth(dt_s)),
            accelerometer_bias: Vector3::repeat(noise.accelerometer_bias_m_s2.growth(dt_s)),
        }
    }
}

/// Φ and Q of such a transition. Half of the white noise comes before Φ and half after it, which gives its
/// covariances to the second order in the interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct EarthPropagation {
    pub(super) map: EarthMap,
    pub(super) half_attitude: Vector3<f64>,
    pub(super) half_velocity: Vector3<f64>,
    pub(super) gyro_bias: Vector3<f64>,
    pub(super) accelerometer_bias: Vector3<f64>,
}

impl EarthPropagation {
    /// P ← Φ P Φ' + Q for the errors of strapdown number `sensor`.
    pub(super) fn apply<const B: usize>(&self, covariance: &mut BlockCovariance<B>, sensor: usize) {
        let white = [(Attitude, &self.half_attitude), (Velocity, &self.half_velocity)];
        for (state, variance) in white {
            covariance.add_noise(state.of(sensor), variance);
        }
        covariance.transform(sensor * BLOCKS_A_SENSOR, |errors| self.map.forward(errors));
        for (state, variance) in white {
            covariance.add_noise(state.of(sensor), variance);
        }
        covariance.add_noise(GyroBias.of(sensor), &self.gyro_bias);
        covariance.add_noise(AccelerometerBias.of(sensor), &self.accelerometer_bias);
    }
}
