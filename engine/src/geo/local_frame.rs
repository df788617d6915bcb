//! The navigation frame n: east, north and up at the site's origin, up along the ellipsoid's normal there.
//! It is fixed to Earth and does not turn with the vehicle. The conversion goes through
//! Earth-centred coordinates and is exact at any distance.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::ellipsoid::{EARTH_RATE_RAD_S, Geodetic};
use super::gravity_field::{normal_gravity_e, normal_gravity_gradient_e};

/// A local tangent frame, east-north-up, with its origin at a geodetic place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalFrame {
    origin: Geodetic,
    origin_ecef_m: Vector3<f64>,
    c_ne: Matrix3<f64>,
}

impl LocalFrame {
    /// The frame whose origin lies here.
    pub fn new(origin: Geodetic) -> LocalFrame {
        let (sin_lat, cos_lat) = libm::sincos(origin.latitude_deg.to_radians());
        let (sin_lon, cos_lon) = libm::sincos(origin.longitude_deg.to_radians());
        #[rustfmt::skip]
        let c_ne = Matrix3::new(
            -sin_lon,            cos_lon,           0.0,
            -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,
             cos_lat * cos_lon,  cos_lat * sin_lon, sin_lat,
        );
        LocalFrame { origin, origin_ecef_m: Vector3::from(origin.to_ecef_m()), c_ne }
    }

    /// The rotation that turns a vector of the Earth-centred Earth-fixed frame into this one.
    pub fn c_ne(&self) -> Matrix3<f64> {
        self.c_ne
    }

    /// Earth's rate of rotation in this frame, rad/s: the same everywhere, as the frame is fixed to Earth.
    pub fn earth_rate_n(&self) -> Vector3<f64> {
        self.c_ne * Vector3::new(0.0, 0.0, EARTH_RATE_RAD_S)
    }

    /// Normal gravity at a place of this frame, in its axes, m/s².
    pub fn gravity_n(&self, p_n: &Vector3<f64>) -> Vector3<f64> {
        self.c_ne * normal_gravity_e(&(self.origin_ecef_m + self.c_ne.tr_mul(p_n)))
    }

    /// How normal gravity changes with place at a place of this frame, ∂g/∂p in its axes, 1/s².
    pub fn gravity_gradient_n(&self, p_n: &Vector3<f64>) -> Matrix3<f64> {
        let p_e = self.origin_ecef_m + self.c_ne.tr_mul(p_n);
        self.c_ne * normal_gravity_gradient_e(&p_e) * self.c_ne.transpose()
    }

    /// The rotation that turns a vector of this frame into the east, north and up of the place `local_m` itself.
    ///
    /// Away from the origin both differ: by distance / Earth's radius in level, and about the vertical by the
    /// convergence of the meridians. Headings, pitch and roll of a body far out are those of `c_ln * c_nb`.
    pub fn c_ln(&self, local_m: [f64; 3]) -> Matrix3<f64> {
        LocalFrame::new(self.to_geodetic(local_m)).c_ne * self.c_ne.transpose()
    }

    /// The origin.
    pub fn origin(&self) -> Geodetic {
        self.origin
    }

    /// East, north, up of a geodetic place, m.
    pub fn to_local_m(&self, place: Geodetic) -> [f64; 3] {
        (self.c_ne * (Vector3::from(place.to_ecef_m()) - self.origin_ecef_m)).into()
    }

    /// The geodetic place at east, north, up, m.
    pub fn to_geodetic(&self, local_m: [f64; 3]) -> Geodetic {
        Geodetic::from_ecef_m((self.origin_ecef_m + self.c_ne.transpose() * Vector3::from(local_m)).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::ellipsoid::{FLATTENING, SEMI_MAJOR_M};
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

    /// Geodetic to Earth-centred by the reduced latitude β: another way than the one under test.
    fn ecef_by_reduced_latitude(place: Geodetic) -> Vector3<f64> {
        let (a, b) = (SEMI_MAJOR_M, SEMI_MAJOR_M * (1.0 - FLATTENING));
        let (latitude, longitude) = (place.latitude_deg.to_radians(), place.longitude_deg.to_radians());
        let beta = (b * latitude.sin()).atan2(a * latitude.cos());
        let across = a * beta.cos() + place.height_m * latitude.cos();
        let z = b * beta.sin() + place.height_m * latitude.sin();
        Vector3::new(across * longitude.cos(), across * longitude.sin(), z)
    }

    /// Earth-centred to geodetic by Heikkinen's closed form (Zeitschrift für Vermessungswesen 107, 1982).
    fn geodetic_by_heikkinen(p: Vector3<f64>) -> Geodetic {
        let (a, b) = (SEMI_MAJOR_M, SEMI_MAJOR_M * (1.0 - FLATTENING));
        let (e2, second_e2) = (1.0 - b * b / (a * a), a * a / (b * b) - 1.0);
        let (r, z) = (p.xy().norm(), p.z);
        let f = 54.0 * b * b * z * z;
        let g = r * r + (1.0 - e2) * z * z - e2 * (a * a - b * b);
        let c = e2 * e2 * f * r * r / (g * g * g);
        let s = (1.0 + c + (c * c + 2.0 * c).sqrt()).cbrt();
        let k = s + 1.0 + 1.0 / s;
        let p_ = f / (3.0 * k * k * g * g);
        let q = (1.0 + 2.0 * e2 * e2 * p_).sqrt();
        let inner =
            0.5 * a * a * (1.0 + 1.0 / q) - p_ * (1.0 - e2) * z * z / (q * (1.0 + q)) - 0.5 * p_ * r * r;
        let r0 = -p_ * e2 * r / (1.0 + q) + inner.sqrt();
        let off = (r - e2 * r0) * (r - e2 * r0);
        let (u, v) = ((off + z * z).sqrt(), (off + (1.0 - e2) * z * z).sqrt());
        let z0 = b * b * z / (a * v);
        Geodetic {
            latitude_deg: (z + second_e2 * z0).atan2(r).to_degrees(),
            longitude_deg: p.y.atan2(p.x).to_degrees(),
            height_m: u * (1.0 - b * b / (a * v)),
        }
    }

    /// East, north and up by geometry: the normal of the ellipsoid below the origin, and the pole.
    fn axes_by_geometry(origin: Geodetic) -> [Vector3<f64>; 3] {
        let (a, b) = (SEMI_MAJOR_M, SEMI_MAJOR_M * (1.0 - FLATTENING));
        let below = ecef_by_reduced_latitude(Geodetic { height_m: 0.0, ..origin });
        let up = Vector3::new(below.x / (a * a), below.y / (a * a), below.z / (b * b)).normalize();
        let east = Vector3::z().cross(&up).normalize();
        [east, up.cross(&east), up]
    }

    proptest! {
        #[test]
        fn within_50_km_both_ways_agree_with_other_formulae_to_a_tenth_of_a_millimetre(
            latitude_deg in -80.0..80.0f64, longitude_deg in -179.0..179.0f64, origin_m in -100.0..5_000.0f64,
            distance_m in 0.0..50_000.0f64, azimuth in 0.0..std::f64::consts::TAU, height_m in -100.0..5_000.0f64,
        ) {
            const TOLERANCE_M: f64 = 1e-4;
            let origin = Geodetic { latitude_deg, longitude_deg, height_m: origin_m };
            let frame = LocalFrame::new(origin);
            let beside = frame.to_geodetic([distance_m * azimuth.sin(), distance_m * azimuth.cos(), 0.0]);
            let place = Geodetic { height_m, ..beside };
            let found = Vector3::from(frame.to_local_m(place));
            let from_origin = ecef_by_reduced_latitude(place) - ecef_by_reduced_latitude(origin);
            let axes = axes_by_geometry(origin);
            let expected = Vector3::from(axes.map(|axis| axis.dot(&from_origin)));
            prop_assert!((found - expected).norm() < TOLERANCE_M, "{found} {expected}");
            // And back: the closed form leads from the local place to the geodetic one.
            let p_e = ecef_by_reduced_latitude(origin)
                + axes[0] * found.x + axes[1] * found.y + axes[2] * found.z;
            let (back, expected) = (frame.to_geodetic(found.into()), geodetic_by_heikkinen(p_e));
            let metres_a_degree = 111_000.0;
            for off_m in [
                (back.latitude_deg - expected.latitude_deg) * metres_a_degree,
                (back.longitude_deg - expected.longitude_deg) * metres_a_degree * latitude_deg.to_radians().cos(),
                back.height_m - expected.height_m,
                (back.latitude_deg - place.latitude_deg) * metres_a_degree,
                back.height_m - place.height_m,
            ] {
                prop_assert!(off_m.abs() < TOLERANCE_M, "{off_m} m: {back:?} {expected:?}");
            }
        }
    }

    #[test]
    fn earth_turns_about_north_and_up_by_latitude() {
        let rate = LocalFrame::new(FAST).earth_rate_n();
        let (sin, cos) = FAST.latitude_deg.to_radians().sin_cos();
        assert!((rate - Vector3::new(0.0, cos, sin) * EARTH_RATE_RAD_S).norm() < 1e-18, "{rate}");
    }

    #[test]
    fn far_out_the_level_frame_leans_and_turns_against_that_of_the_origin() {
        let frame = LocalFrame::new(FAST);
        assert!((frame.c_ln([0.0; 3]) - Matrix3::identity()).norm() < 1e-13);
        let east_m = 50_000.0;
        let c_ln = frame.c_ln([east_m, 0.0, 0.0]);
        // What is level at the origin rises towards the east there, by distance / radius.
        let rises = c_ln[(2, 0)];
        assert!((rises - east_m / 6_377_000.0).abs() < 2e-5, "{rises}");
        // Meridians converge by Δλ sin φ: the origin's north is east of north there.
        let north_l = c_ln * Vector3::y();
        let convergence: f64 = 50_000.0 / (100_410.0 * (6_378_137.0 + 1_110.0) / 6_378_137.0);
        let expected = convergence.to_radians() * FAST.latitude_deg.to_radians().sin();
        let turned = north_l.x.atan2(north_l.y);
        assert!((turned - expected).abs() < 1e-5, "{turned} {expected}");
        // The place's own vertical is where its gravity points.
        let g_l = c_ln * frame.gravity_n(&Vector3::new(east_m, 0.0, 0.0));
        assert!(g_l.xy().norm() < 3e-5, "{g_l}");
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
