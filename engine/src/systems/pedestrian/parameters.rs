//! The parameters of a walk, one row each. Ranges hold what a sensor or a walk can be, not what is wise.

use super::config::Config;
use crate::detect::stance::StanceTuning;
use crate::system::Parameter;

/// A number somewhere in the configuration.
macro_rules! at {
    ($key:literal, $unit:literal, $group:literal, $least:literal..$most:literal, tuning.$($path:ident).+, $about:literal) => {
        Parameter {
            key: $key,
            unit: $unit,
            group: $group,
            about: $about,
            least: $least,
            most: $most,
            read: |session| Config::of(session).tuning.$($path).+,
            write: |session, value| Config::of_mut(session).tuning.$($path).+ = value,
        }
    };
    // Of the detector that is used unless the paper's is asked for.
    ($key:literal, $unit:literal, $group:literal, $least:literal..$most:literal, stance.$field:ident, $about:literal) => {
        Parameter {
            key: $key,
            unit: $unit,
            group: $group,
            about: $about,
            least: $least,
            most: $most,
            read: |session| match Config::of(session).tuning.stance {
                StanceTuning::LikelihoodRatio { $field, .. } => $field,
                StanceTuning::Threshold { .. } => f64::NAN,
            },
            write: |session, value| {
                if let StanceTuning::LikelihoodRatio { $field, .. } = &mut Config::of_mut(session).tuning.stance {
                    *$field = value;
                }
            },
        }
    };
    ($key:literal, $unit:literal, $group:literal, $least:literal..$most:literal, identification.$field:ident, $about:literal) => {
        Parameter {
            key: $key,
            unit: $unit,
            group: $group,
            about: $about,
            least: $least,
            most: $most,
            read: |session| session.identification.as_ref().map_or(f64::NAN, |told| told.tuning.$field),
            write: |session, value| {
                if let Some(told) = &mut session.identification {
                    told.tuning.$field = value;
                }
            },
        }
    };
}

/// The groups, in the order in which a walk meets them.
pub(crate) const GROUPS: &[&str] = &[
    "alignment",
    "stance",
    "zero_velocity",
    "heading",
    "separation",
    "markers",
    "altimeter",
    "imu_noise",
    "identification",
];

/// All parameters, by group.
pub(crate) const TABLE: &[Parameter] = &[
    at!(
        "longest_alignment_s",
        "s",
        "alignment",
        1.0..60.0,
        tuning.longest_alignment_s,
        "How long the standing start is waited for, at most."
    ),
    at!(
        "first_position_sigma_m",
        "m",
        "alignment",
        0.001..100.0,
        tuning.first_position_sigma_m,
        "How well the first position is known, on each axis."
    ),
    at!(
        "first_magnetic_heading_sigma_rad",
        "rad",
        "alignment",
        0.005..1.5,
        tuning.first_magnetic_heading_sigma_rad,
        "Sigma of a first heading that the magnetometer gave."
    ),
    at!(
        "given_heading_sigma_rad",
        "rad",
        "alignment",
        0.0005..1.0,
        tuning.given_heading_sigma_rad,
        "Sigma of a first heading that was given."
    ),
    at!(
        "second_foot_heading_sigma_rad",
        "rad",
        "alignment",
        0.005..1.5,
        tuning.second_foot_heading_sigma_rad,
        "Sigma of the heading between the two sensors where there is no magnetometer."
    ),
    at!(
        "first_tilt_sigma_rad",
        "rad",
        "alignment",
        0.0005..0.2,
        tuning.first_tilt_sigma_rad,
        "Sigma of the first tilt."
    ),
    at!(
        "accelerometer_bias_sigma_m_s2",
        "m/s²",
        "alignment",
        0.001..1.0,
        tuning.accelerometer_bias_sigma_m_s2,
        "Sigma of the accelerometer bias at the start."
    ),
    at!(
        "stance.sigma_rate_rad_s",
        "rad/s",
        "stance",
        0.02..5.0,
        stance.sigma_rate_rad_s,
        "Sigma of the angular rate of a standing foot: the larger, the sooner a foot stands."
    ),
    at!(
        "stance.sigma_specific_force_m_s2",
        "m/s²",
        "stance",
        0.02..5.0,
        stance.sigma_specific_force_m_s2,
        "Sigma of the specific force of a standing foot."
    ),
    at!(
        "stance.threshold",
        "1",
        "stance",
        0.5..200.0,
        stance.threshold,
        "A foot stands while the statistic of the likelihood ratio is below this, in walking."
    ),
    at!(
        "stance.walking_activity",
        "1",
        "stance",
        100.0..20000.0,
        stance.walking_activity,
        "Mean of the statistic up to which the threshold holds; above, as in running, it grows."
    ),
    at!(
        "stance.activity_time_s",
        "s",
        "stance",
        0.2..10.0,
        stance.activity_time_s,
        "The time over which that mean is taken."
    ),
    at!(
        "stance.least_times",
        "1",
        "stance",
        0.0..100.0,
        stance.least_times,
        "In a hurried gait the foot stands below so many times the least statistic of the last stride,"
    ),
    at!("stance.stride_s", "s", "stance", 0.1..10.0, stance.stride_s, "which takes about so long,"),
    at!(
        "stance.activity_share",
        "1",
        "stance",
        0.0..1.0,
        stance.activity_share,
        "but only below this share of the mean statistic."
    ),
    at!(
        "stance.doubtful_threshold",
        "1",
        "stance",
        0.0..5000.0,
        stance.doubtful_threshold,
        "Below this the foot may stand, if its strapdown has come to rest, too."
    ),
    at!(
        "stance.half_window_s",
        "s",
        "stance",
        0.005..0.2,
        stance.half_window_s,
        "How far the window of the statistic reaches to either side."
    ),
    at!(
        "zupt_sigma_m_s",
        "m/s",
        "zero_velocity",
        0.001..0.5,
        tuning.zupt_sigma_m_s,
        "Sigma of the velocity of a foot that stands perfectly."
    ),
    at!(
        "roll_radius_m",
        "m",
        "zero_velocity",
        0.0..0.5,
        tuning.roll_radius_m,
        "Distance from the point that a standing foot rolls about to the sensor: its rate times this is added to that sigma."
    ),
    at!(
        "shake_time_s",
        "s",
        "zero_velocity",
        0.0..0.2,
        tuning.shake_time_s,
        "How long a standing foot goes on at what its specific force is unsteady by: the product is added, too."
    ),
    at!(
        "slowest_glide_m_s",
        "m/s",
        "zero_velocity",
        0.0..5.0,
        tuning.slowest_glide_m_s,
        "A foot that looks still and is on its way all the same is at least so fast."
    ),
    at!(
        "glide_gate",
        "1",
        "zero_velocity",
        1.0..1000000.0,
        tuning.glide_gate,
        "And its velocity squared is so many times the variance that it would have."
    ),
    at!(
        "longest_glide_s",
        "s",
        "zero_velocity",
        0.0..60.0,
        tuning.longest_glide_s,
        "And it left the ground no longer ago than this."
    ),
    at!(
        "longest_swing_s",
        "s",
        "zero_velocity",
        0.1..60.0,
        tuning.longest_swing_s,
        "After a swing of so long a contact is overdue: then a doubtful one is believed, too,"
    ),
    at!(
        "landing_gate",
        "1",
        "zero_velocity",
        0.1..1000.0,
        tuning.landing_gate,
        "If its velocity squared is below so many times the variance that it would have."
    ),
    at!(
        "landing_sigma_m_s",
        "m/s",
        "zero_velocity",
        0.01..10.0,
        tuning.landing_sigma_m_s,
        "And its sigma is below this."
    ),
    at!(
        "swing_doubt_s_m",
        "s/m",
        "zero_velocity",
        0.0..1.0,
        tuning.swing_doubt_s_m,
        "Once a contact is overdue, the velocity is doubted by this times the square of the fastest in the swing."
    ),
    at!(
        "standing_s",
        "s",
        "zero_velocity",
        0.5..30.0,
        tuning.standing_s,
        "A foot that stands for longer than this does not turn but for the sway."
    ),
    at!(
        "sway_rad",
        "rad",
        "zero_velocity",
        0.0005..0.2,
        tuning.sway_rad,
        "Sway of a standing foot over the whole stand."
    ),
    at!(
        "magnetic_heading_sigma_rad",
        "rad",
        "heading",
        0.002..1.0,
        tuning.magnetic_heading_sigma_rad,
        "Sigma of the magnetic heading of one stance beside what the slow errors explain."
    ),
    at!(
        "weakest_field_ut",
        "µT",
        "heading",
        10.0..49.0,
        tuning.weakest_field_ut,
        "A field that is weaker is not the earth's."
    ),
    at!(
        "strongest_field_ut",
        "µT",
        "heading",
        50.0..100.0,
        tuning.strongest_field_ut,
        "A field that is stronger is not the earth's."
    ),
    at!(
        "magnetometer_noise_ut",
        "µT",
        "heading",
        0.01..10.0,
        tuning.magnetometer_noise_ut,
        "Noise of one reading of the magnetometer."
    ),
    at!(
        "steady_field_ut",
        "µT",
        "heading",
        0.01..20.0,
        tuning.steady_field_ut,
        "How much the field may change over a stance."
    ),
    at!(
        "slow_errors.fixed_deviation_rad",
        "rad",
        "heading",
        0.0001..0.5,
        tuning.slow_errors.fixed_deviation_rad,
        "Deviation of the compass that does not turn with the foot."
    ),
    at!(
        "slow_errors.common_deviation_rad",
        "rad",
        "heading",
        0.0..0.5,
        tuning.slow_errors.common_deviation_rad,
        "Deviation that both compasses share."
    ),
    at!(
        "slow_errors.hard_iron_deviation_rad",
        "rad",
        "heading",
        0.0001..0.5,
        tuning.slow_errors.hard_iron_deviation_rad,
        "Deviation of the compass by hard iron, either component."
    ),
    at!(
        "slow_errors.deviation_walk_rad_sqrt_s",
        "rad/√s",
        "heading",
        0.0..0.01,
        tuning.slow_errors.deviation_walk_rad_sqrt_s,
        "Random walk of these deviations."
    ),
    at!(
        "slow_errors.deflection_rad",
        "rad",
        "heading",
        0.0001..0.5,
        tuning.slow_errors.deflection_rad,
        "Deflection of the field by what stands around."
    ),
    at!(
        "slow_errors.first_deflection_rad",
        "rad",
        "heading",
        0.0001..0.5,
        tuning.slow_errors.first_deflection_rad,
        "The same while nothing has shown how quiet the field is."
    ),
    at!(
        "slow_errors.deflection_length_m",
        "m",
        "heading",
        0.2..50.0,
        tuning.slow_errors.deflection_length_m,
        "After so long a way another deflection is met."
    ),
    at!(
        "separation_m",
        "m",
        "separation",
        0.0..0.5,
        tuning.separation_m,
        "Distance of the feet, sensor to sensor, where they pass each other."
    ),
    at!(
        "separation_sigma_m",
        "m",
        "separation",
        0.005..0.5,
        tuning.separation_sigma_m,
        "Its sigma from stride to stride."
    ),
    at!(
        "separation_spread_m",
        "m",
        "separation",
        0.0005..0.5,
        tuning.separation_spread_m,
        "By how much it differs from walker to walker."
    ),
    at!(
        "symmetry_share",
        "1",
        "separation",
        0.01..2.0,
        tuning.symmetry_share,
        "How evenly a stride lies about the other foot: sigma along it as a share of its length."
    ),
    at!("symmetry_sigma_up_m", "m", "separation", 0.01..2.0, tuning.symmetry_sigma_up_m, "The same upwards."),
    at!(
        "slow_errors.stride_share",
        "1",
        "separation",
        0.0001..0.1,
        tuning.slow_errors.stride_share,
        "What a stride reads too much along and across, as a share of its length."
    ),
    at!(
        "slow_errors.stride_up_share",
        "1",
        "separation",
        0.0001..0.1,
        tuning.slow_errors.stride_up_share,
        "What a stride reads too much upwards, likewise."
    ),
    at!(
        "slow_errors.stride_walk_sqrt_s",
        "1/√s",
        "separation",
        0.0..0.001,
        tuning.slow_errors.stride_walk_sqrt_s,
        "Random walk of these shares."
    ),
    at!(
        "marker_sigma_m",
        "m",
        "markers",
        0.01..20.0,
        tuning.marker_sigma_m,
        "Where an inspector stands beside a marker, on each axis."
    ),
    at!(
        "altimeter_sigma_m",
        "m",
        "altimeter",
        0.01..20.0,
        tuning.altimeter_sigma_m,
        "Sigma of the height that the barometer gives in one stance beside its drift."
    ),
    at!(
        "slow_errors.first_pressure_sigma_m",
        "m",
        "altimeter",
        0.001..10.0,
        tuning.slow_errors.first_pressure_sigma_m,
        "Sigma of the pressure's first zero, as height."
    ),
    at!(
        "slow_errors.pressure_drift_m_sqrt_s",
        "m/√s",
        "altimeter",
        0.0001..1.0,
        tuning.slow_errors.pressure_drift_m_sqrt_s,
        "Random walk of the pressure by the weather, as height."
    ),
    at!(
        "imu_noise.angle_random_walk_rad_sqrt_s",
        "rad/√s",
        "imu_noise",
        0.000001..0.1,
        tuning.imu_noise.angle_random_walk_rad_sqrt_s,
        "Angle random walk of the gyro."
    ),
    at!(
        "imu_noise.angle_random_walk_share_sqrt_s",
        "√s",
        "imu_noise",
        0.0..0.1,
        tuning.imu_noise.angle_random_walk_share_sqrt_s,
        "What the angle random walk grows by with the rate."
    ),
    at!(
        "imu_noise.velocity_random_walk_m_s_sqrt_s",
        "m/s/√s",
        "imu_noise",
        0.0001..2.0,
        tuning.imu_noise.velocity_random_walk_m_s_sqrt_s,
        "Velocity random walk of the accelerometer."
    ),
    at!(
        "imu_noise.velocity_random_walk_share_sqrt_s",
        "√s",
        "imu_noise",
        0.0..0.5,
        tuning.imu_noise.velocity_random_walk_share_sqrt_s,
        "What the velocity random walk grows by with the acceleration."
    ),
    at!(
        "imu_noise.gyro_bias_random_walk_rad_s_sqrt_s",
        "rad/s/√s",
        "imu_noise",
        0.0..0.01,
        tuning.imu_noise.gyro_bias_random_walk_rad_s_sqrt_s,
        "Random walk of the gyro bias."
    ),
    at!(
        "imu_noise.accelerometer_bias_random_walk_m_s2_sqrt_s",
        "m/s²/√s",
        "imu_noise",
        0.0..0.1,
        tuning.imu_noise.accelerometer_bias_random_walk_m_s2_sqrt_s,
        "Random walk of the accelerometer bias."
    ),
    at!(
        "imu_noise.height_random_walk_m_sqrt_s",
        "m/√s",
        "imu_noise",
        0.0..1.0,
        tuning.imu_noise.height_random_walk_m_sqrt_s,
        "Random walk of the height, which scale and misalignment errors add up to."
    ),
    at!(
        "imu_noise.gyro_bias_correlation_time_s",
        "s",
        "imu_noise",
        10.0..1000000.0,
        tuning.imu_noise.gyro_bias_correlation_time_s,
        "Correlation time of the gyro bias."
    ),
    at!(
        "imu_noise.accelerometer_bias_correlation_time_s",
        "s",
        "imu_noise",
        10.0..1000000.0,
        tuning.imu_noise.accelerometer_bias_correlation_time_s,
        "Correlation time of the accelerometer bias."
    ),
    at!(
        "identification.inflation",
        "1",
        "identification",
        0.1..10.0,
        identification.inflation,
        "All sigmas of the track's error that identification assumes are taken times this."
    ),
    at!(
        "identification.start_sigma_m",
        "m",
        "identification",
        0.01..20.0,
        identification.start_sigma_m,
        "Where the session starts, on each axis."
    ),
    at!(
        "identification.beside_sigma_m",
        "m",
        "identification",
        0.05..10.0,
        identification.beside_sigma_m,
        "Where an inspector stands beside a marker, on each axis."
    ),
    at!(
        "identification.none_stands",
        "1",
        "identification",
        0.001..2.0,
        identification.none_stands,
        "Of the first two stands, so many are expected to be at no marker."
    ),
    at!(
        "identification.slip",
        "1",
        "identification",
        0.0..0.5,
        identification.slip,
        "A marker that was keyed in is another one so often."
    ),
    at!(
        "identification.automatic_probability",
        "1",
        "identification",
        0.5..0.999999,
        identification.automatic_probability,
        "A candidate as probable as this is taken for a visit in automatic mode."
    ),
];
