//! The WGS84 ellipsoid: geodetic and Earth-centred coordinates.

use serde::{Deserialize, Serialize};

/// Semi-major axis a, m.
pub const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening f.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared, e² = f(2 − f).
pub const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);
/// Rate of the Earth's rotation, rad/s.
pub const EARTH_RATE_RAD_S: f64 = 7.292_115e-5;

/// A place by latitude, longitude and height above the WGS84 ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geodetic {
    /// Geodetic latitude, north positive, degrees.
    pub latitude_deg: f64,
    /// Longitude, east positive, degrees in (−180, 180].
    pub longitude_deg: f64,
    /// Height above the ellipsoid, m.
    pub height_m: f64,
}

/// Radius of curvature in the prime vertical, m, at a latitude whose sine is given.
pub fn prime_vertical_radius_m(sin_latitude: f64) -> f64 {
    SEMI_MAJOR_M / libm::sqrt(1.0 - ECCENTRICITY_SQUARED * sin_latitude * sin_latitude)
}

impl Geodetic {
    /// Earth-centred Earth-fixed coordinates, m.
    pub fn to_ecef_m(self) -> [f64; 3] {
        let (sin_lat, cos_lat) = libm::sincos(self.latitude_deg.to_radians());
        let (sin_lon, cos_lon) = libm::sincos(self.longitude_deg.to_radians());
        let n = prime_vertical_radius_m(sin_lat);
        let across = (n + self.height_m) * cos_lat;
        [across * cos_lon, across * sin_lon, (n * (1.0 - ECCENTRICITY_SQUARED) + self.height_m) * sin_lat]
    }

    /// The place with these Earth-centred Earth-fixed coordinates, m.
    pub fn from_ecef_m([x, y, z]: [f64; 3]) -> Geodetic {
        let across = libm::hypot(x, y);
        let longitude_deg = libm::atan2(y, x).to_degrees();
        // tan φ = (z + e² N sin φ) / p is a contraction by about e² = 0.0067 a round near the
        // surface: eight rounds take the first guess to the last bit.
        let mut latitude = libm::atan2(z, across * (1.0 - ECCENTRICITY_SQUARED));
        for _ in 0..8 {
            let sin = libm::sin(latitude);
            latitude = libm::atan2(z + ECCENTRICITY_SQUARED * prime_vertical_radius_m(sin) * sin, across);
        }
        let (sin, cos) = libm::sincos(latitude);
        // Height along the normal: well-behaved at the poles and at the equator alike.
        let height_m = across * cos + z * sin - SEMI_MAJOR_M * SEMI_MAJOR_M / prime_vertical_radius_m(sin);
        Geodetic { latitude_deg: latitude.to_degrees(), longitude_deg, height_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulsar_timing_coordinates_of_fast_are_the_site() {
        let place = Geodetic::from_ecef_m([-1_668_557.0, 5_506_838.0, 2_744_934.0]);
        assert!((place.latitude_deg - 25.652_946).abs() < 1e-6, "{place:?}");
        assert!((place.longitude_deg - 106.856_666).abs() < 1e-6, "{place:?}");
        assert!((place.height_m - 1109.1).abs() < 0.1, "{place:?}");
    }

    #[test]
    fn round_trip_everywhere() {
        for latitude_deg in [-90.0, -89.999, -45.0, -0.001, 0.0, 25.65, 60.0, 89.9999, 90.0] {
            for longitude_deg in [-179.9, -90.0, 0.0, 106.86, 180.0] {
                for height_m in [-400.0, 0.0, 1110.0, 9000.0] {
                    let place = Geodetic { latitude_deg, longitude_deg, height_m };
                    let ecef = place.to_ecef_m();
                    let again = Geodetic::from_ecef_m(ecef);
                    let back = again.to_ecef_m();
                    for axis in 0..3 {
                        assert!((back[axis] - ecef[axis]).abs() < 1e-8, "{place:?} gives {again:?}");
                    }
                    assert!((again.height_m - height_m).abs() < 1e-8, "{place:?} gives {again:?}");
                }
            }
        }
    }

    #[test]
    fn the_axes_have_the_ellipsoids_lengths() {
        let [x, _, _] = Geodetic { latitude_deg: 0.0, longitude_deg: 0.0, height_m: 0.0 }.to_ecef_m();
        let [_, _, z] = Geodetic { latitude_deg: 90.0, longitude_deg: 0.0, height_m: 0.0 }.to_ecef_m();
        assert_eq!(x, SEMI_MAJOR_M);
        assert!((z - 6_356_752.314_245).abs() < 1e-6);
    }
}
