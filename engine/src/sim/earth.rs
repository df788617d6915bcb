//! The Earth as an inertial sensor feels it in the navigation frame: gravity and rotation.

use nalgebra::Vector3;

use crate::geo::Site;
use crate::geo::ellipsoid::{EARTH_RATE_RAD_S, ECCENTRICITY_SQUARED, prime_vertical_radius_m};
use crate::geo::gravity::normal_gravity_m_s2;

/// Gravity and rotation around a site, in its navigation frame n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Earth {
    /// At the origin, m/s².
    gravity_n_m_s2: Vector3<f64>,
    rate_n_rad_s: Vector3<f64>,
    curvature: Option<Curvature>,
}

/// How gravity differs from place to place.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Curvature {
    /// Radii of curvature at the origin's height, eastward and northward, m.
    radii_m: [f64; 2],
    /// Change of gravity's magnitude northward and upward, as a share, 1/m.
    by_north_1_m: f64,
    by_height_1_m: f64,
}

impl Earth {
    /// One gravity everywhere, straight down, as on a walk. Where the Earth does not rotate, gyros feel none of it, and
    /// accelerometers no Coriolis acceleration.
    pub fn new(site: &Site, rotates: bool) -> Earth {
        let (sin_lat, cos_lat) = libm::sincos(site.latitude_deg.to_radians());
        let rate_rad_s = if rotates { EARTH_RATE_RAD_S } else { 0.0 };
        Earth {
            gravity_n_m_s2: Vector3::new(0.0, 0.0, -site.gravity_m_s2),
            rate_n_rad_s: rate_rad_s * Vector3::new(0.0, cos_lat, sin_lat),
            curvature: None,
        }
    }

    /// The same with gravity along the ellipsoid's normal at each place, and weaker with height. A hundred metres away it
    /// leans by 16 µg, and a hundred metres up it has lost 31 µg: a good accelerometer sees both. Linear in the distance:
    /// within 500 m it is right to 0.2 µm/s².
    pub fn curved(site: &Site, rotates: bool) -> Earth {
        let sin_lat = libm::sin(site.latitude_deg.to_radians());
        let across_m = prime_vertical_radius_m(sin_lat);
        let flat = 1.0 - ECCENTRICITY_SQUARED;
        let along_m = across_m * flat / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat);
        let radii_m = [across_m + site.height_m, along_m + site.height_m];
        let gravity = |north_m: f64, up_m: f64| {
            let latitude_deg = site.latitude_deg + (north_m / radii_m[1]).to_degrees();
            normal_gravity_m_s2(latitude_deg, site.height_m + up_m)
        };
        // The slope between two places this far to either side, m.
        const ASIDE_M: f64 = 100.0;
        let slope = |ahead: f64, behind: f64| (ahead - behind) / (2.0 * ASIDE_M * gravity(0.0, 0.0));
        let curvature = Curvature {
            radii_m,
            by_north_1_m: slope(gravity(ASIDE_M, 0.0), gravity(-ASIDE_M, 0.0)),
            by_height_1_m: slope(gravity(0.0, ASIDE_M), gravity(0.0, -ASIDE_M)),
        };
        Earth { curvature: Some(curvature), ..Earth::new(site, rotates) }
    }

    /// Gravity at a place, the centrifugal part included, in n, m/s².
    pub fn gravity_n_m_s2(&self, position_n_m: &Vector3<f64>) -> Vector3<f64> {
        let Some(curvature) = &self.curvature else { return self.gravity_n_m_s2 };
        let [e_m, n_m, u_m] = [position_n_m.x, position_n_m.y, position_n_m.z];
        let [radius_e_m, radius_n_m] = curvature.radii_m;
        let height_m = u_m + 0.5 * (e_m * e_m / radius_e_m + n_m * n_m / radius_n_m);
        let up = Vector3::new(e_m / radius_e_m, n_m / radius_n_m, 1.0).normalize();
        let share = 1.0 + curvature.by_height_1_m * height_m + curvature.by_north_1_m * n_m;
        self.gravity_n_m_s2.z * share * up
    }

    /// The rate of the Earth, and with it of n, against inertial space, in n, rad/s.
    pub fn rate_n_rad_s(&self) -> Vector3<f64> {
        self.rate_n_rad_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::Geodetic;

    #[test]
    fn curved_gravity_is_that_of_the_ellipsoid_at_the_place() {
        let site = Site::fast();
        let (earth, frame) = (Earth::curved(&site, true), site.local_frame());
        assert_eq!(earth.gravity_n_m_s2(&Vector3::zeros()), Vector3::new(0.0, 0.0, -site.gravity_m_s2));
        let at_origin = normal_gravity_m_s2(site.latitude_deg, site.height_m);
        for place in [[100.0, 0.0, 150.0], [-300.0, 400.0, -50.0], [250.0, -433.0, 300.0]] {
            let geodetic = frame.to_geodetic(place);
            // The normal there, by a point a kilometre above.
            let above = Geodetic { height_m: geodetic.height_m + 1000.0, ..geodetic };
            let up = (Vector3::from(frame.to_local_m(above)) - Vector3::from(place)) / 1000.0;
            let magnitude =
                site.gravity_m_s2 / at_origin * normal_gravity_m_s2(geodetic.latitude_deg, geodetic.height_m);
            let found = earth.gravity_n_m_s2(&Vector3::from(place));
            let off = found + magnitude * up;
            assert!(off.norm() < 2e-7, "{off:?} m/s² at {place:?}");
        }
    }

    #[test]
    fn the_earth_turns_about_its_pole() {
        let site = Site::fast();
        let rate = Earth::new(&site, true).rate_n_rad_s();
        let latitude = site.latitude_deg.to_radians();
        assert_eq!(rate.x, 0.0);
        assert!((libm::atan2(rate.z, rate.y) - latitude).abs() < 1e-12);
        assert!((rate.norm() - EARTH_RATE_RAD_S).abs() < 1e-18);
        assert_eq!(Earth::new(&site, false).rate_n_rad_s().norm(), 0.0);
    }
}
