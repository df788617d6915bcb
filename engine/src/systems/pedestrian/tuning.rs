//! Every parameter of the pedestrian system: one set of defaults for every recording.

use serde::{Deserialize, Serialize};

use super::foot_noise::FootNoise;
use crate::detect::stance::StanceTuning;

/// The parameters, each with its unit in its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tuning {
    /// Noise of the inertial sensors.
    pub imu_noise: FootNoise,
    /// When a foot stands.
    pub stance: StanceTuning,
    /// How long the standing start is waited for, at most, s.
    pub longest_alignment_s: f64,
    /// The covariance of a foot in its swing is propagated once in this time, s.
    pub swing_interval_s: f64,
    /// A foot that has just come down is held once in this time, s.
    pub hold_interval_s: f64,
    /// One that has stood for some time is held again after this share of it,
    pub hold_share: f64,
    /// but after this at the latest: until then its covariance is propagated in one step, s.
    pub longest_hold_s: f64,
    /// Sigma of the velocity of a foot that stands perfectly, m/s. Larger than the 0.017 m/s of
    /// paper 1, §2.3, because neighbouring samples of a stance err alike.
    pub zupt_sigma_m_s: f64,
    /// Distance from the point that a standing foot rolls about to the sensor, m: its rate times
    /// this is added to that sigma.
    pub roll_radius_m: f64,
    /// A foot that flies past is at least so fast, m/s (see `filter`).
    pub slowest_flight_m_s: f64,
    /// And so far from standing: its velocity squared over the variance that it would have.
    pub flight_gate: f64,
    /// A foot that looks still and is on its way all the same (slow stairs, a crawl) is at least so fast, m/s,
    pub slowest_glide_m_s: f64,
    /// and so far from standing: its velocity squared over the variance that it would have,
    pub glide_gate: f64,
    /// and has been in the air for no longer than this, s: then the strapdown is no judge any more.
    pub longest_glide_s: f64,
    /// After a swing of so long a contact is overdue, s: a swing of a walk takes 0.4 s, of a slow one 0.6 s.
    /// Then a doubtful stance is believed, too,
    pub longest_swing_s: f64,
    /// where the velocity squared over the variance that it would have is below this,
    pub landing_gate: f64,
    /// and that sigma below this, m/s.
    pub landing_sigma_m_s: f64,
    /// How much a foot's velocity is then doubted for the square of its fastest speed in the swing, s/m.
    pub swing_doubt_s_m: f64,
    /// How long a standing foot goes on at what its specific force is unsteady by, s: the product is
    /// added to that sigma, too.
    pub shake_time_s: f64,
    /// How well the first position is known, sigma on each axis, m.
    pub first_position_sigma_m: f64,
    /// Sigma of a first heading by the magnetometer, rad.
    pub first_magnetic_heading_sigma_rad: f64,
    /// Sigma of a first heading that was given, rad.
    pub given_heading_sigma_rad: f64,
    /// Sigma of the heading between two sensors without a magnetometer, rad.
    pub second_foot_heading_sigma_rad: f64,
    /// Sigma of the first tilt, rad.
    pub first_tilt_sigma_rad: f64,
    /// Sigma of the accelerometer bias at the start, m/s².
    pub accelerometer_bias_sigma_m_s2: f64,
    /// Sigma of the magnetic heading of one stance beside what the slow errors explain, rad.
    pub magnetic_heading_sigma_rad: f64,
    /// The field may be this weak, µT (paper 1, §3.1).
    pub weakest_field_ut: f64,
    /// The field may be this strong, µT (paper 1, §3.1).
    pub strongest_field_ut: f64,
    /// Noise of one magnetometer reading, µT.
    pub magnetometer_noise_ut: f64,
    /// How much the field may change over a stance, µT (paper 1, §3.2).
    pub steady_field_ut: f64,
    /// A foot that stands for longer than this does not turn but for the sway, s.
    pub standing_s: f64,
    /// Sway of a standing foot, rad, over the whole stand.
    pub sway_rad: f64,
    /// Distance of the feet, sensor to sensor, where they pass each other, m.
    pub separation_m: f64,
    /// Its sigma from stride to stride, m.
    pub separation_sigma_m: f64,
    /// By how much it differs from walker to walker, 1σ, m.
    pub separation_spread_m: f64,
    /// How evenly a stride lies about the other foot: sigma along it, as a share of its length.
    pub symmetry_share: f64,
    /// The same upwards, m.
    pub symmetry_sigma_up_m: f64,
    /// Where an inspector stands beside a marker, sigma on each axis, m.
    pub marker_sigma_m: f64,
    /// Sigma of the height that the barometer gives in one stance beside its drift, m.
    pub altimeter_sigma_m: f64,
    /// What is the same from stance to stance.
    pub slow_errors: SlowErrorsTuning,
    /// How far back a visit can still be applied, s.
    pub history_s: f64,
}

/// How large the errors are that are the same from stance to stance, and how fast they change
/// (`slow_errors` says what they are).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SlowErrorsTuning {
    /// Deviation of the compass that does not turn with the foot, 1σ, rad: soft iron, declination.
    pub fixed_deviation_rad: f64,
    /// Deviation that both compasses share, 1σ, rad: the declination's error (half a degree in a model of the world).
    pub common_deviation_rad: f64,
    /// Deviation by hard iron, 1σ of either component, rad.
    pub hard_iron_deviation_rad: f64,
    /// Random walk of all of them, rad/√s.
    pub deviation_walk_rad_sqrt_s: f64,
    /// Deflection of the field by what stands around, 1σ, rad: at least, however quiet the field of a walk shows itself.
    pub deflection_rad: f64,
    /// The same while nothing has shown how quiet the field is, 1σ, rad.
    pub first_deflection_rad: f64,
    /// After so long a way another deflection is met, m, while nothing has shown how far one reaches.
    pub deflection_length_m: f64,
    /// What a stride reads too much along and across, 1σ, as a share of its length.
    pub stride_share: f64,
    /// What it reads too much upwards, 1σ, likewise.
    pub stride_up_share: f64,
    /// Random walk of these shares, 1/√s.
    pub stride_walk_sqrt_s: f64,
    /// Sigma of the pressure's first zero, as height, m.
    pub first_pressure_sigma_m: f64,
    /// Random walk of the pressure by the weather, as height, m/√s.
    pub pressure_drift_m_sqrt_s: f64,
}

impl Default for SlowErrorsTuning {
    /// The CMP10A's hard and soft iron and the site's anomalies by `navigation.md`, as far as a walk leaves them
    /// unknown: set so that over 50 seeds the filter is as wrong as it says (`lodestep evaluate honesty`). Deflections
    /// that show in strength or dip have less weight already, so this is what is left of them.
    fn default() -> Self {
        SlowErrorsTuning {
            fixed_deviation_rad: 0.02,
            common_deviation_rad: 0.008,
            hard_iron_deviation_rad: 0.016,
            deviation_walk_rad_sqrt_s: 1e-4,
            deflection_rad: 0.023,
            first_deflection_rad: 0.09,
            deflection_length_m: 6.0,
            stride_share: 0.0025,
            stride_up_share: 0.005,
            stride_walk_sqrt_s: 2e-5,
            first_pressure_sigma_m: 0.05,
            pressure_drift_m_sqrt_s: 0.0125,
        }
    }
}

impl Default for Tuning {
    fn default() -> Self {
        Tuning {
            imu_noise: FootNoise::default(),
            stance: StanceTuning::default(),
            longest_alignment_s: 10.0,
            swing_interval_s: 0.1,
            hold_interval_s: 0.04,
            hold_share: 0.45,
            longest_hold_s: 0.18,
            zupt_sigma_m_s: 0.022,
            roll_radius_m: 0.07,
            shake_time_s: 0.014,
            slowest_flight_m_s: 4.0,
            flight_gate: 50.0,
            slowest_glide_m_s: 0.4,
            glide_gate: 25.0,
            longest_glide_s: 4.0,
            longest_swing_s: 0.8,
            landing_gate: 6.0,
            landing_sigma_m_s: 0.7,
            swing_doubt_s_m: 0.025,
            first_position_sigma_m: 0.1,
            first_magnetic_heading_sigma_rad: 0.12,
            given_heading_sigma_rad: 0.02,
            second_foot_heading_sigma_rad: 0.2,
            first_tilt_sigma_rad: 0.02,
            accelerometer_bias_sigma_m_s2: 0.08,
            magnetic_heading_sigma_rad: 0.03,
            weakest_field_ut: 40.0,
            strongest_field_ut: 60.0,
            magnetometer_noise_ut: 0.3,
            steady_field_ut: 0.3,
            standing_s: 3.0,
            sway_rad: 0.01,
            separation_m: 0.13,
            separation_sigma_m: 0.04,
            separation_spread_m: 0.03,
            symmetry_share: 0.2,
            symmetry_sigma_up_m: 2.0,
            marker_sigma_m: 1.0,
            altimeter_sigma_m: 0.2,
            slow_errors: SlowErrorsTuning::default(),
            history_s: 40.0,
        }
    }
}
