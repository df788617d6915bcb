//! The navigation frame n: east, north, up in the plane that touches the ellipsoid's normal at the
//! site's origin. The conversion goes through Earth-centred coordinates and is exact at any distance.

use nalgebra::{Matrix3, Vector3};

use super::ellipsoid::Geodetic;

/// A local tangent frame, east-north-up, with its origin at a geodetic place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    origin: Geodetic,
    origin_ecef_m: Vector3<f64>,
    c_e_n: Matrix3<f64>,
}

impl LocalFrame {
    /// The frame whose origin lies here.
    pub fn new(origin: Geodetic) -> LocalFrame {
        let (sin_lat, cos_lat) = libm::sincos(origin.latitude_deg.to_radians());
        let (sin_lon, cos_lon) = libm::sincos(origin.longitude_deg.to_radians());
        #[rustfmt::skip]
        let c_e_n = Matrix3::new(
            -sin_lon,            cos_lon,           0.0,
            -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,
             cos_lat * cos_lon,  cos_lat * sin_lon, sin_lat,
        );
        LocalFrame { origin, origin_ecef_m: Vector3::from(origin.to_ecef_m()), c_e_n }
    }

    /// The origin.
    pub fn origin(&self) -> Geodetic {
        self.origin
    }

    /// East, north, up of a geodetic place, m.
    pub fn to_local_m(&self, place: Geodetic) -> [f64; 3] {
        (self.c_e_n * (Vector3::from(place.to_ecef_m()) - self.origin_ecef_m)).into()
    }

    /// The geodetic place at east, north, up, m.
    pub fn to_geodetic(&self, local_m: [f64; 3]) -> Geodetic {
        Geodetic::from_ecef_m((self.origin_ecef_m + self.c_e_n.transpose() * Vector3::from(local_m)).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FAST: Geodetic =
        Geodetic { latitude_deg: 25.652_944, longitude_deg: 106.856_667, height_m: 1110.0 };

    proptest! {
        #[test]
        fn round_trip_below_a_micrometre(
            latitude_deg in -89.0..89.0f64, longitude_deg in -179.0..179.0f64,
            e in -50_000.0..50_000.0f64, n in -50_000.0..50_000.0f64, u in -500.0..5_000.0f64,
        ) {
            let frame = LocalFrame::new(Geodetic { latitude_deg, longitude_deg, height_m: 1110.0 });
            let back = frame.to_local_m(frame.to_geodetic([e, n, u]));
            prop_assert!((back[0] - e).abs() < 1e-6 && (back[1] - n).abs() < 1e-6 && (back[2] - u).abs() < 1e-6);
        }
    }

    #[test]
    fn a_degree_at_the_site_has_the_known_length() {
        // Central differences: the lengths of a degree that a geodesist tabulates are local ones.
        let frame = LocalFrame::new(Geodetic { height_m: 0.0, ..FAST });
        let step_deg = 1e-3;
        let at = |dlat: f64, dlon: f64| {
            frame.to_local_m(Geodetic {
                latitude_deg: FAST.latitude_deg + dlat,
                longitude_deg: FAST.longitude_deg + dlon,
                height_m: 0.0,
            })
        };
        let north = (at(step_deg, 0.0)[1] - at(-step_deg, 0.0)[1]) / (2.0 * step_deg);
        let east = (at(0.0, step_deg)[0] - at(0.0, -step_deg)[0]) / (2.0 * step_deg);
        assert!((north - 110_782.7).abs() < 1.0, "{north}");
        assert!((east - 100_410.0).abs() < 1.0, "{east}");
    }

    #[test]
    fn up_is_height_above_the_origin_and_the_earth_falls_away() {
        let frame = LocalFrame::new(FAST);
        let above = frame.to_local_m(Geodetic { height_m: 1250.0, ..FAST });
        assert!(above[0].abs() < 1e-8 && above[1].abs() < 1e-8 && (above[2] - 140.0).abs() < 1e-8);
        // 250 m out the surface lies d²/2R = 4.9 mm below the plane.
        let rim = frame.to_geodetic([250.0, 0.0, 0.0]);
        assert!((rim.height_m - 1110.0 - 0.0049).abs() < 1e-4, "{}", rim.height_m);
    }
}
