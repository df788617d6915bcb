//! What a session amounts to, and what is believed of its sensors.

use serde::{Deserialize, Serialize};

use crate::stream::StreamId;

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

/// How far a system has come with a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Length of the path so far, m.
    pub distance_m: f64,
    /// When the last accepted visit was (the start before the first), ns.
    pub last_visit_ns: i64,
    /// Length of the path at that time, m.
    pub last_visit_m: f64,
    /// Samples that came too late to be used.
    pub late_samples: u64,
}

/// What the filter believes of one inertial sensor at its last sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorState {
    /// Its stream.
    pub stream: StreamId,
    /// Time of that sample, ns.
    pub t_ns: i64,
    /// Whether what it is fixed to is taken to stand.
    pub stance: bool,
    /// Gyro bias in b, rad/s: reading − true rate.
    pub gyro_bias_b_rad_s: [f64; 3],
    /// Its sigmas, rad/s.
    pub sigma_gyro_bias_rad_s: [f64; 3],
    /// Accelerometer bias in b, m/s²: reading − true specific force.
    pub accelerometer_bias_b_m_s2: [f64; 3],
    /// Its sigmas, m/s².
    pub sigma_accelerometer_bias_m_s2: [f64; 3],
    /// Heading by the magnetic field, deviation not taken off, less the filter's, rad in (−π, π]; `None` where the field
    /// is not looked at now.
    pub magnetic_minus_heading_rad: Option<f64>,
}
