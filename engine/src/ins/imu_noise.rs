//! What an inertial sensor adds to the truth, as its data sheet puts it.

use serde::{Deserialize, Serialize};

/// Noise of one inertial sensor: densities are one-sided, as in data sheets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImuNoise {
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

impl Default for ImuNoise {
    /// A foot-worn MEMS sensor. The gyro's white noise is that of the CMP10A of `navigation.md`
    /// (0.01 °/s/√Hz), the accelerometer's some times its 1.8 mm/s²/√Hz. Scale factors, misalignment
    /// and the sampling of heel strikes act in proportion to the motion: 0.1 % of the rate and 1.3 %
    /// of the acceleration that go one way for 0.1 s. Without them a runner's tilt, which fast
    /// swings spoil, is believed and the biases take the blame.
    /// The biases walk as the CMP10A's do.
    fn default() -> Self {
        ImuNoise {
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
