//! From a station to a satellite: range, direction, elevation.

use nalgebra::{Matrix3, Vector3};

use super::ephemeris::{Ephemeris, SatelliteState};
use super::signal::LIGHT_M_S;
use super::time::GpsTime;

/// Earth's rate, rad/s, as it turns while the signal is on its way.
const EARTH_RATE: f64 = 7.292_115_146_7e-5;

/// The satellite when it sent what arrived with this pseudorange at this reading of the receiver's clock.
pub fn at_transmission(ephemeris: &Ephemeris, time_tag: GpsTime, code_m: f64) -> SatelliteState {
    // Less than a nanosecond matters: the satellite moves 4 µm in it.
    let sent = time_tag - code_m / LIGHT_M_S;
    let sent = sent - ephemeris.clock_s(sent);
    ephemeris.state(sent)
}

/// The line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Length, m, Earth's turn while the signal is on its way included.
    pub range_m: f64,
    /// Unit vector from station to satellite, Earth-centred.
    pub to_satellite_e: Vector3<f64>,
}

/// The line of sight from a station to a satellite, both Earth-centred.
pub fn sight(satellite_e: &Vector3<f64>, station_e: &Vector3<f64>) -> Sight {
    let between = satellite_e - station_e;
    let distance = between.norm();
    let turn = EARTH_RATE * (satellite_e.x * station_e.y - satellite_e.y * station_e.x) / LIGHT_M_S;
    Sight { range_m: distance + turn, to_satellite_e: between / distance }
}

/// Azimuth and elevation of a direction, rad, with the rotation from Earth-centred to east, north, up.
pub fn azimuth_elevation(to_satellite_e: &Vector3<f64>, c_ne: &Matrix3<f64>) -> (f64, f64) {
    let n = c_ne * to_satellite_e;
    (libm::atan2(n.x, n.y), libm::asin(n.z.clamp(-1.0, 1.0)))
}
