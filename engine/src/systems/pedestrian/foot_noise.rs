//! What a foot-worn inertial sensor adds to the truth: its data sheet, and what the motion of a foot makes of
//! scale, misalignment and sampling, which are no states here.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::ins::error_model::Transition;
use crate::ins::process_noise::{BiasesKept, Growth, ProcessNoise};

/// Noise of one foot's sensor: densities are one-sided, as in data sheets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FootNoise {
    /// Angle random walk, rad/√s.
    pub angle_random_walk_rad_sqrt_s: f64,
    /// What the angle random walk grows by with the rate, on the axis of the motion, √s: a relative
    /// error of the rate (scale, misalignment, sampling) times the square root of the time over which
    /// it goes one way, a tenth of a second in a swing.
    pub angle_random_walk_share_sqrt_s: f64,
    /// Velocity random walk, m/s/√s.
    pub velocity_random_walk_m_s_sqrt_s: f64,
    /// What the velocity random walk grows by with the acceleration, likewise, √s.
    pub velocity_random_walk_share_sqrt_s: f64,
    /// Random walk of the gyro bias, rad/s/√s.
    pub gyro_bias_random_walk_rad_s_sqrt_s: f64,
    /// Random walk of the accelerometer bias, m/s²/√s.
    pub accelerometer_bias_random_walk_m_s2_sqrt_s: f64,
    /// Random walk of the height, m/√s: what scale and misalignment errors, which are no states, add
    /// up to over the strides of a walk.
    pub height_random_walk_m_sqrt_s: f64,
    /// Correlation time of the gyro bias, s (paper 1's T_gb).
    pub gyro_bias_correlation_time_s: f64,
    /// Correlation time of the accelerometer bias, s (paper 1's T_ab).
    pub accelerometer_bias_correlation_time_s: f64,
}

impl Default for FootNoise {
    /// A foot-worn MEMS sensor. The gyro's white noise is that of the CMP10A of `navigation.md`
    /// (0.01 °/s/√Hz), the accelerometer's some times its 1.8 mm/s²/√Hz. Scale factors, misalignment
    /// and the sampling of heel strikes act in proportion to the motion: 0.1 % of the rate and 1.3 %
    /// of the acceleration that go one way for 0.1 s. Without them a runner's tilt, which fast
    /// swings spoil, is believed and the biases take the blame.
    /// The biases walk as the CMP10A's do.
    fn default() -> Self {
        FootNoise {
            angle_random_walk_rad_sqrt_s: 2e-4,
            angle_random_walk_share_sqrt_s: 3e-4,
            velocity_random_walk_m_s_sqrt_s: 0.02,
            velocity_random_walk_share_sqrt_s: 4e-3,
            gyro_bias_random_walk_rad_s_sqrt_s: 2.6e-5,
            accelerometer_bias_random_walk_m_s2_sqrt_s: 3e-4,
            height_random_walk_m_sqrt_s: 0.04,
            gyro_bias_correlation_time_s: 3600.0,
            accelerometer_bias_correlation_time_s: 3600.0,
        }
    }
}

impl ProcessNoise for FootNoise {
    #[inline]
    fn biases_kept(&self, dt_s: f64) -> BiasesKept {
        BiasesKept {
            gyro: 1.0 - dt_s / self.gyro_bias_correlation_time_s,
            accelerometer: 1.0 - dt_s / self.accelerometer_bias_correlation_time_s,
        }
    }

    #[inline]
    fn growth(&self, transition: &Transition) -> Growth {
        let dt_s = transition.dt_s();
        let white = |density: f64| Vector3::repeat(density * density * dt_s);
        // A scale error of the gyro turns about the axis of the motion itself, and one of the
        // accelerometer lies along the acceleration: each axis of n by its own motion.
        let turning = transition.rate_squared_dt() * self.angle_random_walk_share_sqrt_s.powi(2);
        let pushing = transition.acceleration_squared_dt() * self.velocity_random_walk_share_sqrt_s.powi(2);
        let height = self.height_random_walk_m_sqrt_s;
        Growth {
            attitude: white(self.angle_random_walk_rad_sqrt_s) + turning,
            gyro_bias: white(self.gyro_bias_random_walk_rad_s_sqrt_s),
            accelerometer_bias: white(self.accelerometer_bias_random_walk_m_s2_sqrt_s),
            position: Vector3::new(0.0, 0.0, height * height * dt_s),
            velocity: white(self.velocity_random_walk_m_s_sqrt_s) + pushing,
            position_share_s: 0.5 * dt_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::block_covariance::BlockCovariance;
    use crate::ins::layout::ErrorState;
    use crate::ins::mechanization::advance;
    use crate::ins::nav_state::NavState;
    use nalgebra::Matrix3;

    const GRAVITY: f64 = 9.787;

    #[test]
    fn the_noise_of_a_motion_is_on_its_own_axis_and_that_of_rest_does_not_grow() {
        let noise = FootNoise {
            gyro_bias_correlation_time_s: 1e12,
            height_random_walk_m_sqrt_s: 0.0,
            ..FootNoise::default()
        };
        let variances = |w_ib_b: Vector3<f64>, f_b: Vector3<f64>| {
            let mut state = NavState {
                c_nb: Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
                v_n: Vector3::zeros(),
                p_n: Vector3::zeros(),
                gyro_bias_b: Vector3::zeros(),
                accelerometer_bias_b: Vector3::zeros(),
            };
            let mut transition = Transition::none();
            let step = advance(&mut state, &w_ib_b, &w_ib_b, &f_b, 0.001, GRAVITY);
            transition.extend(&step, &state.c_nb);
            let mut covariance = BlockCovariance::<5>::zeros();
            transition.apply(&mut covariance, 0, &noise);
            [ErrorState::Attitude, ErrorState::Velocity]
                .map(|state| covariance.block(state.of(0), state.of(0)).diagonal() / 0.001)
        };
        let gravity_b = Vector3::new(0.0, 0.0, GRAVITY);
        let white =
            [noise.angle_random_walk_rad_sqrt_s, noise.velocity_random_walk_m_s_sqrt_s].map(|w| w * w);
        let [attitude, velocity] = variances(Vector3::zeros(), gravity_b);
        assert!((attitude - Vector3::repeat(white[0])).norm() < 1e-12);
        assert!((velocity - Vector3::repeat(white[1])).norm() < 1e-12);
        // The body's x axis points along n's y: so do a rate and an acceleration along it.
        let [attitude, velocity] =
            variances(Vector3::new(8.0, 0.0, 0.0), gravity_b + Vector3::new(20.0, 0.0, 0.0));
        let turning = (noise.angle_random_walk_share_sqrt_s * 8.0).powi(2);
        let pushing = (noise.velocity_random_walk_share_sqrt_s * 20.0).powi(2);
        assert!((attitude - Vector3::new(0.0, turning, 0.0) - Vector3::repeat(white[0])).norm() < 1e-9);
        assert!(velocity.x < white[1] * 1.01 && (velocity.y - pushing - white[1]).abs() < pushing * 1e-6);
        // Along z the specific force keeps a part of the acceleration while the body turns about x.
        assert!(velocity.z < white[1] + pushing * 1e-3);
    }
}
