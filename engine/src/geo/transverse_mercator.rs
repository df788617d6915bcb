//! Plane coordinates of national grids: the transverse Mercator projection of the ellipsoid, Gauss–Krüger and UTM.
//!
//! By Krüger's series in the third flattening n to its fourth power (L. Krüger, Konforme Abbildung des Erdellipsoids in
//! der Ebene, 1912, as C. F. F. Karney gives it in Transverse Mercator with an accuracy of a few nanometers, Journal of
//! Geodesy 85, 2011, equations 7 to 36): better than a tenth of a millimetre within 4° of the central meridian.

use libm::{asin, atan2, atanh, cos, cosh, sin, sinh, sqrt};

use super::ellipsoid::{FLATTENING, SEMI_MAJOR_M};

/// One zone of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverseMercator {
    /// Longitude at which east is `false_easting_m`, degrees.
    pub central_meridian_deg: f64,
    /// Scale on the central meridian: 1 of Gauss–Krüger, 0.9996 of UTM.
    pub scale: f64,
    /// Added to every easting, m.
    pub false_easting_m: f64,
}

fn n() -> f64 {
    FLATTENING / (2.0 - FLATTENING)
}

/// Radius of the sphere on which the meridian keeps its length, m.
fn radius_m() -> f64 {
    let n = n();
    SEMI_MAJOR_M / (1.0 + n) * (1.0 + n * n / 4.0 + n * n * n * n / 64.0)
}

/// A series in n for each multiple of an angle.
fn series(coefficients: [[f64; 4]; 4]) -> [f64; 4] {
    let n = n();
    coefficients.map(|c| n * (c[0] + n * (c[1] + n * (c[2] + n * c[3]))))
}

impl TransverseMercator {
    /// Latitude and longitude of a point of the plane, degrees.
    pub fn to_geodetic_deg(&self, easting_m: f64, northing_m: f64) -> [f64; 2] {
        let beta = series([
            [1.0 / 2.0, -2.0 / 3.0, 37.0 / 96.0, -1.0 / 360.0],
            [0.0, 1.0 / 48.0, 1.0 / 15.0, -437.0 / 1440.0],
            [0.0, 0.0, 17.0 / 480.0, -37.0 / 840.0],
            [0.0, 0.0, 0.0, 4397.0 / 161_280.0],
        ]);
        let delta = series([
            [2.0, -2.0 / 3.0, -2.0, 116.0 / 45.0],
            [0.0, 7.0 / 3.0, -8.0 / 5.0, -227.0 / 45.0],
            [0.0, 0.0, 56.0 / 15.0, -136.0 / 35.0],
            [0.0, 0.0, 0.0, 4279.0 / 630.0],
        ]);
        let xi = northing_m / (self.scale * radius_m());
        let eta = (easting_m - self.false_easting_m) / (self.scale * radius_m());
        let (mut xi_s, mut eta_s) = (xi, eta);
        for (j, beta) in beta.into_iter().enumerate() {
            let k = 2.0 * (j + 1) as f64;
            xi_s -= beta * sin(k * xi) * cosh(k * eta);
            eta_s -= beta * cos(k * xi) * sinh(k * eta);
        }
        let chi = asin(sin(xi_s) / cosh(eta_s));
        let mut latitude = chi;
        for (j, delta) in delta.into_iter().enumerate() {
            latitude += delta * sin(2.0 * (j + 1) as f64 * chi);
        }
        let longitude = atan2(sinh(eta_s), cos(xi_s));
        [latitude.to_degrees(), self.central_meridian_deg + longitude.to_degrees()]
    }

    /// Easting and northing of a place, m.
    pub fn to_plane_m(&self, latitude_deg: f64, longitude_deg: f64) -> [f64; 2] {
        let alpha = series([
            [1.0 / 2.0, -2.0 / 3.0, 5.0 / 16.0, 41.0 / 180.0],
            [0.0, 13.0 / 48.0, -3.0 / 5.0, 557.0 / 1440.0],
            [0.0, 0.0, 61.0 / 240.0, -103.0 / 140.0],
            [0.0, 0.0, 0.0, 49_561.0 / 161_280.0],
        ]);
        let from_meridian = (longitude_deg - self.central_meridian_deg).to_radians();
        let eccentricity = 2.0 * sqrt(n()) / (1.0 + n());
        let sine = sin(latitude_deg.to_radians());
        let t = sinh(atanh(sine) - eccentricity * atanh(eccentricity * sine));
        let xi_s = atan2(t, cos(from_meridian));
        let eta_s = atanh(sin(from_meridian) / sqrt(1.0 + t * t));
        let (mut xi, mut eta) = (xi_s, eta_s);
        for (j, alpha) in alpha.into_iter().enumerate() {
            let k = 2.0 * (j + 1) as f64;
            xi += alpha * sin(k * xi_s) * cosh(k * eta_s);
            eta += alpha * cos(k * xi_s) * sinh(k * eta_s);
        }
        [self.false_easting_m + self.scale * radius_m() * eta, self.scale * radius_m() * xi]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const UTM_48: TransverseMercator =
        TransverseMercator { central_meridian_deg: 105.0, scale: 0.9996, false_easting_m: 500_000.0 };

    #[test]
    fn the_equator_and_the_meridian_are_where_they_have_to_be() {
        assert_eq!(UTM_48.to_plane_m(0.0, 105.0), [500_000.0, 0.0]);
        // The quarter of the meridian of WGS84 is 10,001,965.729 m long.
        let quarter = TransverseMercator { scale: 1.0, ..UTM_48 }.to_plane_m(90.0, 105.0)[1];
        assert!((quarter - 10_001_965.729).abs() < 1e-3, "{quarter}");
    }

    proptest! {
        #[test]
        fn there_and_back(latitude in -80.0..80.0_f64, off in -4.0..4.0_f64) {
            let [e, n] = UTM_48.to_plane_m(latitude, 105.0 + off);
            let [back, longitude] = UTM_48.to_geodetic_deg(e, n);
            // 1e-9 degrees are 0.1 mm.
            prop_assert!((back - latitude).abs() < 1e-9 && (longitude - 105.0 - off).abs() < 1e-9);
        }
    }
}
