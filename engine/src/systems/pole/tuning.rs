//! What the filter takes for granted of sensors, solutions and ground.

use serde::{Deserialize, Serialize};

use crate::ins::imu_noise::{GaussMarkov, ImuNoise};

/// The figures of the filter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// The class of the inertial sensor.
    pub imu: ImuNoise,
    /// Sigmas at the start.
    pub start: StartSigmas,
    /// How far GNSS solutions can be believed.
    pub gnss: GnssTuning,
    /// What a landing is.
    pub landing: LandingTuning,
    /// Time between two looks at the errors, at most, s: while the tip stands, and otherwise.
    pub step_s: [f64; 2],
    /// Sigma of a tip that is taken to have no velocity, m/s, at every sample of a contact: paper 4's way. `None` for a
    /// place that stands still.
    pub zero_velocity_m_s: Option<f64>,
}

/// Sigmas at the start, by axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartSigmas {
    /// Velocity, m/s.
    pub velocity_m_s: f64,
    /// Bias of the gyro, rad/s.
    pub gyro_bias_rad_s: f64,
    /// Bias of the accelerometer, m/s².
    pub accelerometer_bias_m_s2: f64,
    /// Scale factors.
    pub scale: f64,
    /// Axes that are not square, rad.
    pub cross_rad: f64,
    /// What the gyro's bias has more while walking, rad/s.
    pub walking_rad_s: f64,
    /// Lever arms, m.
    pub lever_arm_m: f64,
    /// The phase centre's motion in plan and height, m per unit of lean.
    pub phase_m: [f64; 2],
    /// The tip's roundness, m.
    pub roundness_m: f64,
    /// What the receiver's clock shows more than the sensor's, s.
    pub clock_s: f64,
}

/// How far GNSS solutions can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GnssTuning {
    /// Share of the stated sigma that is new at each epoch, in plan and height.
    pub white_share: [f64; 2],
    /// At least so much of it, m.
    pub least_white_m: f64,
    /// Share of the stated sigma that stays for some time, in plan and height.
    pub slow_share: [f64; 2],
    /// Share of it that lasts for longer than a survey, in plan and height.
    pub lasting_share: [f64; 2],
    /// At least so much of it, m.
    pub least_slow_m: f64,
    /// How long it stays, s.
    pub slow_time_s: f64,
    /// A float episode is believed no better than this, m.
    pub float_m: f64,
    /// A single solution, m.
    pub single_m: f64,
    /// How long the error of a float or single solution stays, s.
    pub float_time_s: f64,
    /// Largest normalised innovation squared of a fix (3 degrees of freedom).
    pub gate: f64,
}

/// What a landing is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LandingTuning {
    /// Left out after the tip has struck the ground, s: the pole rings.
    pub after_strike_s: f64,
    /// Left out before it lifts off, s: the switch opens late.
    pub before_lift_s: f64,
    /// Sigma of where the tip stands, new at each look, in plan and height, m.
    pub sigma_m: [f64; 2],
    /// How it creeps, m/√s.
    pub creep_m_sqrt_s: [f64; 2],
    /// How it settles into the ground in the first half second, m/√s: nothing until that is seen.
    pub settling_m_sqrt_s: [f64; 2],
    /// What it moves by between two looks when it is felt to be stirred while it touches, in plan and height, m.
    pub stirred_m: [f64; 2],
    /// Largest normalised innovation squared of a tip that stands (3 degrees of freedom).
    pub gate: f64,
    /// The extra bias of walking is whole so long after a landing, s.
    pub walking_whole_s: f64,
    /// It is gone so long after a landing, s.
    pub walking_gone_s: f64,
}

impl Tuning {
    /// Paper 4, read straight: 21 states, solutions as good as they say and new at each epoch, and a tip without velocity
    /// to 0.06 m/s at every sample of a contact. A state without variance is none.
    pub fn paper() -> Tuning {
        let mut tuning = Tuning::default();
        tuning.imu.angle_random_walk_rad_sqrt_s = 7e-5;
        tuning.imu.velocity_random_walk_m_s_sqrt_s = 1e-3;
        tuning.start.scale = 1e-3;
        tuning.start.cross_rad = 0.0;
        tuning.start.walking_rad_s = 0.0;
        tuning.start.lever_arm_m = 0.0;
        tuning.start.phase_m = [0.0; 2];
        tuning.start.roundness_m = 0.0;
        tuning.start.clock_s = 0.0;
        tuning.gnss.white_share = [1.0; 2];
        tuning.gnss.slow_share = [0.0; 2];
        tuning.gnss.lasting_share = [0.0; 2];
        tuning.gnss.least_slow_m = 0.0;
        tuning.gnss.float_m = 0.0;
        tuning.gnss.single_m = 0.0;
        tuning.gnss.gate = f64::INFINITY;
        tuning.landing.after_strike_s = 0.0;
        tuning.landing.before_lift_s = 0.0;
        tuning.zero_velocity_m_s = Some(0.06);
        tuning
    }

    /// For a sensor in the hand: of its class nothing is known, it is shaken, and where its antenna is has been told roughly.
    pub fn handheld() -> Tuning {
        let mut tuning = Tuning::default();
        tuning.imu.angle_random_walk_rad_sqrt_s = 4e-4;
        tuning.imu.velocity_random_walk_m_s_sqrt_s = 1e-2;
        tuning.start.accelerometer_bias_m_s2 = 0.05;
        // Shaken, an accelerometer rectifies: its bias is another one while walking, by a thousandth of gravity and more.
        tuning.imu.accelerometer_bias_m_s2.sigma = 2.0;
        tuning.start.gyro_bias_rad_s = 0.005;
        tuning.start.lever_arm_m = 0.1;
        tuning.start.clock_s = 0.0;
        // A receiver in the hand moves between obstacles: what its solutions are off by is new each time.
        tuning.gnss.white_share = [1.0, 1.0];
        tuning.gnss.slow_share = [0.5, 0.35];
        tuning.gnss.lasting_share = [0.0; 2];
        tuning.gnss.gate = 60.0;
        tuning
    }
}

impl Default for Tuning {
    fn default() -> Self {
        Tuning {
            imu: ImuNoise {
                angle_random_walk_rad_sqrt_s: 8e-5,
                velocity_random_walk_m_s_sqrt_s: 1.2e-3,
                // What was there when the sensor was switched on stays; what it wanders by is a random walk.
                gyro_bias_rad_s: GaussMarkov { sigma: 0.012, correlation_time_s: 1e6 },
                accelerometer_bias_m_s2: GaussMarkov { sigma: 0.2, correlation_time_s: 1e6 },
                gyro_scale_factor: GaussMarkov::CONSTANT,
                accelerometer_scale_factor: GaussMarkov::CONSTANT,
            },
            start: StartSigmas {
                velocity_m_s: 0.5,
                gyro_bias_rad_s: 0.02,
                accelerometer_bias_m_s2: 0.15,
                scale: 1.5e-3,
                cross_rad: 1.5e-3,
                walking_rad_s: 4e-4,
                lever_arm_m: 2.5e-3,
                phase_m: [0.03, 0.006],
                roundness_m: 6e-3,
                clock_s: 0.03,
            },
            gnss: GnssTuning {
                white_share: [0.42, 0.42],
                least_white_m: 0.004,
                slow_share: [0.9, 0.35],
                lasting_share: [0.4, 0.2],
                least_slow_m: 0.005,
                slow_time_s: 20.0,
                float_m: 0.5,
                single_m: 2.0,
                float_time_s: 300.0,
                gate: 30.0,
            },
            landing: LandingTuning {
                after_strike_s: 0.12,
                before_lift_s: 0.06,
                sigma_m: [1.2e-3, 0.6e-3],
                creep_m_sqrt_s: [1e-3, 3.5e-4],
                settling_m_sqrt_s: [0.0; 2],
                stirred_m: [4e-3, 1e-3],
                gate: 16.0,
                walking_whole_s: 1.0,
                walking_gone_s: 2.0,
            },
            step_s: [0.1, 0.2],
            zero_velocity_m_s: None,
        }
    }
}
