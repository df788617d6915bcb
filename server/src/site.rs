//! The site that this server serves: one, given by its configuration.

use serde::{Deserialize, Serialize};

/// Where the site's origin lies and which fields act there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Site {
    /// Its name, as pages show it.
    pub name: String,
    /// Geodetic latitude (WGS 84) of the origin, degrees.
    pub latitude_deg: f64,
    /// Longitude (WGS 84) of the origin, degrees.
    pub longitude_deg: f64,
    /// Height of the origin over the ellipsoid, m.
    pub height_m: f64,
    /// Local gravity, m/s².
    pub gravity_m_s2: f64,
    /// Magnetic declination, east of north positive, degrees.
    pub declination_deg: f64,
}

impl Default for Site {
    /// FAST: the centre as observatories publish it, normal gravity between 840 m and 1,110 m, and the
    /// declination of the IGRF for the middle of 2026.
    fn default() -> Self {
        Site {
            name: "FAST".to_owned(),
            latitude_deg: 25.652_944,
            longitude_deg: 106.856_667,
            height_m: 1_110.028_8,
            gravity_m_s2: 9.787,
            declination_deg: -2.45,
        }
    }
}
