//! What the devices say, row by row. A tag is when the row was written; the thing was there earlier, by the device's delay.

use serde::{Deserialize, Serialize};

/// A fix of one antenna.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AntennaRow {
    /// Tag, ns.
    pub t_ns: i64,
    /// Which antenna, by its place in the instrument's list.
    pub antenna: usize,
    /// Its position in n, m.
    pub position_n: [f64; 3],
    /// The stated sigmas, m.
    pub sigma_n: [f64; 3],
    /// 4 for fixed, 5 for float.
    pub quality: u8,
    /// Velocity by Doppler in n, m/s, where it is told.
    pub velocity_n: Option<[f64; 3]>,
}

/// A ray of a total station.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RayRow {
    /// Tag, ns.
    pub t_ns: i64,
    /// Which station, by its place in the instrument's list.
    pub station: usize,
    /// Which prism, by its place among those of the cabin and then the platform.
    pub target: usize,
    /// Clockwise from north, rad.
    pub azimuth_rad: f64,
    /// From straight up, rad.
    pub zenith_rad: f64,
    /// Distance, m.
    pub slant_m: f64,
}

/// Angles of the rotator and lengths of the legs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EncoderRow {
    /// Tag, ns.
    pub t_ns: i64,
    /// Angle a, rad.
    pub a_rad: f64,
    /// Angle b, rad.
    pub b_rad: f64,
    /// Lengths of the legs, m.
    pub legs_m: [f64; 6],
}

/// Readings of an inertial sensor in the axes of its case: means over the interval that ends at the tag.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImuRow {
    /// Tag, ns.
    pub t_ns: i64,
    /// Angular rate, rad/s.
    pub w_s: [f64; 3],
    /// Specific force, m/s².
    pub f_s: [f64; 3],
}

/// A row of any device but the inertial sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum AidRow {
    /// Encoders.
    Encoders(EncoderRow),
    /// An antenna.
    Antenna(AntennaRow),
    /// A station.
    Ray(RayRow),
}

impl AidRow {
    /// Its tag, ns.
    pub fn t_ns(&self) -> i64 {
        match self {
            AidRow::Encoders(row) => row.t_ns,
            AidRow::Antenna(row) => row.t_ns,
            AidRow::Ray(row) => row.t_ns,
        }
    }

    /// By tag; of one tag encoders come first, as rays need them, then by device.
    pub(super) fn order(&self) -> (i64, u8, usize) {
        match self {
            AidRow::Encoders(row) => (row.t_ns, 0, 0),
            AidRow::Antenna(row) => (row.t_ns, 1, row.antenna),
            AidRow::Ray(row) => (row.t_ns, 2, row.station),
        }
    }
}
