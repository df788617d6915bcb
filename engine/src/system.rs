//! What a system is to the rest of the house.

use serde::{Deserialize, Serialize};

use crate::sample::Foot;

/// What a session reports in the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solution {
    /// Each point as it was known at its time, but for what applies to a past moment.
    #[default]
    Filtered,
    /// The same while it goes on; and after each accepted visit the trail of the last five minutes is
    /// smoothed and reported as a revision.
    Trail,
    /// The same while it goes on; and at the end the whole session is smoothed and reported as revisions. Every
    /// input is kept until then.
    Smoothed,
}

/// What a session amounts to so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Samples taken in, of all streams.
    pub samples: u64,
    /// Epochs reported as points.
    pub epochs: u64,
    /// From the first to the last point, s.
    pub duration_s: f64,
    /// Length of the path, m.
    pub distance_m: f64,
    /// Seconds since the last accepted visit (since the start before the first).
    pub since_marker_s: f64,
    /// Metres since the last accepted visit (since the start before the first).
    pub since_marker_m: f64,
    /// Samples that came too late to be merged by time; a run over the stored log puts them right.
    pub late_samples: u64,
}

/// What the filter believes of one foot's sensor at its last sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorState {
    /// Whose.
    pub foot: Foot,
    /// Time of that sample, ns.
    pub t_ns: i64,
    /// Whether the foot is taken to stand.
    pub stands: bool,
    /// Gyro bias in b, rad/s: reading − true rate.
    pub gyro_bias_b_rad_s: [f64; 3],
    /// Its sigmas, rad/s.
    pub sigma_gyro_bias_rad_s: [f64; 3],
    /// Accelerometer bias in b, m/s²: reading − true specific force.
    pub accelerometer_bias_b_m_s2: [f64; 3],
    /// Its sigmas, m/s².
    pub sigma_accelerometer_bias_m_s2: [f64; 3],
    /// Heading by the field of the present stance, deviation not taken off, less the filter's, rad in
    /// (−π, π]; `None` while the foot swings or its sensor has no magnetometer.
    pub magnetic_minus_heading_rad: Option<f64>,
}
