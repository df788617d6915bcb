//! What a run leaves: the devices' rows, and the truth.

use crate::sample::ImuSample;

/// A fix of an antenna.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntennaReading {
    /// When it was written, ns.
    pub t_ns: i64,
    /// Which antenna.
    pub antenna: usize,
    /// Position, m.
    pub position_n_m: [f64; 3],
    /// Stated sigmas, m.
    pub sigma_n_m: [f64; 3],
    /// 4 fixed, 5 float.
    pub quality: u8,
    /// Velocity by Doppler, m/s.
    pub velocity_n_m_s: [f64; 3],
}

/// A ray of a station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// When it was written, ns.
    pub t_ns: i64,
    /// Which station.
    pub station: usize,
    /// Which prism: those of the cabin come before those of the platform.
    pub target: usize,
    /// Clockwise from north, rad.
    pub azimuth_rad: f64,
    /// From straight up, rad.
    pub zenith_rad: f64,
    /// Distance, m.
    pub slant_m: f64,
}

/// Readings of the encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderReading {
    /// When, ns.
    pub t_ns: i64,
    /// Angles a and b of the rotator, rad.
    pub angles_rad: [f64; 2],
    /// Lengths of the legs, m.
    pub legs_m: [f64; 6],
}

/// Where cabin and platform were.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseTruth {
    /// When, ns.
    pub t_ns: i64,
    /// East, north, up (m), yaw, pitch and roll (rad) of the cabin.
    pub cabin: [f64; 6],
    /// The same of the platform.
    pub platform: [f64; 6],
    /// Velocity of the cabin, m/s.
    pub velocity_n_m_s: [f64; 3],
}

/// A run.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedRun {
    /// The instrument's file, TOML.
    pub instrument: String,
    /// The cabin's inertial sensor.
    pub imu: Vec<ImuSample>,
    /// The platform's.
    pub platform_imu: Vec<ImuSample>,
    /// In order of their tags.
    pub antennas: Vec<AntennaReading>,
    /// In order of their tags.
    pub stations: Vec<Ray>,
    /// The encoders.
    pub encoders: Vec<EncoderReading>,
    /// Every 50 ms.
    pub truth: Vec<PoseTruth>,
    /// Where both should have been, every 200 ms.
    pub plan: Vec<PoseTruth>,
    /// What a user would not know, in sentences.
    pub notes: Vec<String>,
}
