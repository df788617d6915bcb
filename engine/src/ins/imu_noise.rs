//! What an inertial sensor adds to the truth, as its data sheet puts it.

use serde::{Deserialize, Serialize};

/// Noise of one inertial sensor: densities are one-sided, as in data sheets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImuNoise {
    /// Angle random walk, rad/√s.
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Velocity random walk, m/s/√s.
    pub velocity_random_walk_m_s_sqrt_s: f64,
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

impl Default for ImuNoise {
    /// A foot-worn MEMS sensor: some times the white noise of the CMP10A of `navigation.md`
    /// (0.01 °/s/√Hz, 1.8 mm/s²/√Hz), because scale factors, misalignment and the sampling of heel
    /// strikes act like noise in every swing.
    fn default() -> Self {
        ImuNoise {
            angle_random_walk_rad_sqrt_s: 5e-4,
            velocity_random_walk_m_s_sqrt_s: 0.02,
            gyro_bias_random_walk_rad_s_sqrt_s: 3e-5,
            accelerometer_bias_random_walk_m_s2_sqrt_s: 3e-4,
            height_random_walk_m_sqrt_s: 0.15,
            gyro_bias_correlation_time_s: 3600.0,
            accelerometer_bias_correlation_time_s: 3600.0,
        }
    }
}
