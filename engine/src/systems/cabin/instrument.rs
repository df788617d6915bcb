//! The feed cabin as it was surveyed: where every antenna, prism, station and joint is fixed, what each device delays,
//! and the sigmas that the makers state. Read from TOML; what contradicts itself is refused in a sentence.
//!
//! Frames: b cabin and p platform (x right, y front, z up), r rotator, s the case of an inertial sensor.

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use super::instrument_check;
use crate::geo::{Geodetic, LocalFrame};
use crate::ins::earth::Earth;

/// Everything that is fixed, in metres, radians and seconds.
#[derive(Clone, Debug, Deserialize)]
pub struct Instrument {
    /// The site's origin, which is that of n.
    pub site: SiteOrigin,
    /// The cabin's inertial sensor.
    pub imu: CabinImu,
    /// The platform's inertial sensor, where there is one.
    pub platform_imu: Option<PlatformImu>,
    /// The satellite antennas on the cabin's ring.
    pub antennas: Antennas,
    /// The total stations on their pillars.
    pub stations: Stations,
    /// Prisms on the cabin.
    pub targets_cabin: CabinTargets,
    /// Prisms on the platform.
    pub targets_platform: PlatformTargets,
    /// The A-B rotator: c_b_r = R_x(a) R_y(b) about its pivot.
    pub rotator: Rotator,
    /// The six legs between rotator and platform.
    pub stewart: Stewart,
}

/// Where n has its origin, and gravity there.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct SiteOrigin {
    /// Latitude, degrees.
    pub latitude_deg: f64,
    /// Longitude, degrees.
    pub longitude_deg: f64,
    /// Height above the ellipsoid, m.
    pub height_m: f64,
    /// Gravity at the origin, m/s².
    pub gravity_m_s2: f64,
}

/// The cabin's inertial sensor: place, axes, and noise as its maker states it.
#[derive(Clone, Debug, Deserialize)]
pub struct CabinImu {
    /// Where it sits, in b, m.
    pub position_b: [f64; 3],
    /// Turns the case's axes into those of the cabin, by rows.
    pub c_b_s: [[f64; 3]; 3],
    /// How well that is known about each axis, rad.
    pub mounting_sigma_rad: f64,
    /// Turn-on bias of a gyro, 1σ, rad/s.
    pub gyro_bias_sigma_rad_s: f64,
    /// Angle random walk, rad/√s.
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Turn-on bias of an accelerometer, 1σ, m/s².
    pub accelerometer_bias_sigma_m_s2: f64,
    /// Velocity random walk, m/s/√s.
    pub velocity_random_walk_m_s_sqrt_s: f64,
    /// Scale factor of a gyro, 1σ, of 1.
    #[serde(default)]
    pub gyro_scale_sigma: f64,
    /// Scale factor of an accelerometer, 1σ, of 1.
    #[serde(default)]
    pub accelerometer_scale_sigma: f64,
}

/// The platform's inertial sensor, of the same class.
#[derive(Clone, Debug, Deserialize)]
pub struct PlatformImu {
    /// Where it sits, in p, m.
    pub position_p: [f64; 3],
    /// Turns the case's axes into those of the platform, by rows.
    pub c_p_s: [[f64; 3]; 3],
    /// How well that is known about each axis, rad.
    pub mounting_sigma_rad: f64,
}

/// Antennas of several makes, each make with a base station and a delay of its own.
#[derive(Clone, Debug, Deserialize)]
pub struct Antennas {
    /// Their names.
    pub names: Vec<String>,
    /// The make of each.
    pub make: Vec<String>,
    /// Their places in b, m.
    pub position_b: Vec<[f64; 3]>,
    /// How well each place is known on each axis, m.
    pub position_sigma_m: f64,
    /// By make: a row tagged t shows the antenna at t − delay, s.
    pub delay_s: std::collections::BTreeMap<String, f64>,
    /// How well the delays are known, s.
    pub delay_sigma_s: f64,
}

/// Total stations of one kind.
#[derive(Clone, Debug, Deserialize)]
pub struct Stations {
    /// Their names.
    pub names: Vec<String>,
    /// Where their axes cross, in n, m.
    pub position_n: Vec<[f64; 3]>,
    /// How well each place is known on each axis, m.
    pub position_sigma_m: f64,
    /// A row tagged t shows the prism at t − delay, s.
    pub delay_s: f64,
    /// How well the delay is known, s.
    pub delay_sigma_s: f64,
    /// By how much it differs from row to row, s.
    #[serde(default)]
    pub delay_jitter_s: f64,
    /// Sigma of a single direction, rad.
    pub angle_sigma_rad: f64,
    /// Sigma of a single distance, m.
    pub slant_sigma_m: f64,
    /// What grows with it, millionths of the distance.
    #[serde(default)]
    pub slant_ppm: f64,
}

/// Prisms on the cabin.
#[derive(Clone, Debug, Deserialize)]
pub struct CabinTargets {
    /// Their names.
    pub names: Vec<String>,
    /// Their places in b, m.
    pub position_b: Vec<[f64; 3]>,
}

/// Prisms on the platform.
#[derive(Clone, Debug, Deserialize)]
pub struct PlatformTargets {
    /// Their names.
    pub names: Vec<String>,
    /// Their places in p, m.
    pub position_p: Vec<[f64; 3]>,
}

/// The A-B rotator.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Rotator {
    /// About which it turns, in b, m.
    pub pivot_b: [f64; 3],
    /// Sigma of an encoder's angle, rad.
    pub angle_sigma_rad: f64,
}

/// The Stewart platform: leg_i = |t_r + c_r_p joint_p_i − joint_r_i|.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Stewart {
    /// The joints on the rotator, in r, m.
    pub joint_r: [[f64; 3]; 6],
    /// The joints on the platform, in p, m.
    pub joint_p: [[f64; 3]; 6],
    /// Where the platform is with the legs at half stroke, in r, m.
    pub rest_r: [f64; 3],
    /// Sigma of a leg's length, m.
    pub leg_sigma_m: f64,
    /// A row of the encoders tagged t shows legs and rotator at t − delay, s.
    #[serde(default)]
    pub delay_s: f64,
    /// How well that is known, s.
    #[serde(default = "usual_encoder_delay_sigma_s")]
    pub delay_sigma_s: f64,
}

/// Of encoders of which nobody says it, s: they are read by the control loop itself.
fn usual_encoder_delay_sigma_s() -> f64 {
    0.002
}

/// Why an instrument cannot be used; a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct InstrumentError(pub(super) String);

impl Instrument {
    /// Reads an instrument from TOML.
    ///
    /// # Errors
    ///
    /// Where a section or a key is missing, lists are of unequal length, a mounting is no rotation, or a number cannot be
    /// that of a feed cabin.
    pub fn from_toml(text: &str) -> Result<Instrument, InstrumentError> {
        instrument_check::check_sections(text)?;
        let instrument: Instrument = toml::from_str(text).map_err(|error| {
            InstrumentError(format!(
                "expected the sections and keys of an instrument, found: {}; compare with the documented file",
                error.to_string().trim()
            ))
        })?;
        instrument_check::check(&instrument)?;
        Ok(instrument)
    }

    /// Earth at the site, with gravity as it was measured at the origin.
    pub fn earth(&self) -> Earth {
        let frame = LocalFrame::new(Geodetic {
            latitude_deg: self.site.latitude_deg,
            longitude_deg: self.site.longitude_deg,
            height_m: self.site.height_m,
        });
        Earth::turning(&frame).with_gravity_at_origin(self.site.gravity_m_s2)
    }

    /// The makes of the antennas, each once, in alphabetical order.
    pub fn makes(&self) -> Vec<&str> {
        let mut makes: Vec<&str> = self.antennas.make.iter().map(String::as_str).collect();
        makes.sort_unstable();
        makes.dedup();
        makes
    }

    /// The names of all prisms: those of the cabin, then those of the platform.
    pub fn target_names(&self) -> Vec<String> {
        self.targets_cabin.names.iter().chain(&self.targets_platform.names).cloned().collect()
    }
}

/// A matrix by its rows.
pub(super) fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

/// Vectors of places.
pub(super) fn vectors(places: &[[f64; 3]]) -> Vec<Vector3<f64>> {
    places.iter().copied().map(Vector3::from).collect()
}

#[cfg(test)]
#[path = "instrument_tests.rs"]
pub(super) mod tests;
