//! Normal gravity as a vector: where it points, not only how strong it is.
//!
//! In a frame that is fixed to Earth gravity changes with place: 100 m from the origin it leans by 3″
//! (16 µg), 50 km from it by half a degree. The field is that of the WGS84 ellipsoid, by its zonal harmonics,
//! which need no latitude: GM/r², the harmonics J₂, J₄ and J₆, and the centrifugal part.

use nalgebra::{Matrix3, Vector3};

use super::ellipsoid::{EARTH_RATE_RAD_S, SEMI_MAJOR_M};

/// Gravitational constant times the mass of Earth, m³/s² (NIMA TR8350.2, table 3.1).
const GM_M3_S2: f64 = 3.986_004_418e14;
/// Zonal harmonics of the ellipsoid, from its flattening, GM, a and ω (TR8350.2, equation 3-62).
const J2: f64 = 1.082_629_821_313_306e-3;
const J4: f64 = -2.370_911_200_534e-6;
const J6: f64 = 6.083_464_988_8e-9;
/// Step of the differences that the gradient is taken from, m.
const GRADIENT_STEP_M: f64 = 100.0;

/// Normal gravity at an Earth-centred Earth-fixed place, in e, m/s²: attraction and centrifugal
/// acceleration together. Good to 1e-8 m/s² from the surface up.
///
/// Heiskanen and Moritz, *Physical Geodesy* (1967), equation 2-92: the gradient of the term Jₙ is
/// GM/r² Jₙ (a/r)ⁿ (P′ₙ₊₁(s) r̂ − P′ₙ(s) ẑ) with s = z/r.
pub fn normal_gravity_e(p_e: &Vector3<f64>) -> Vector3<f64> {
    let r = p_e.norm();
    let up = p_e / r;
    let s = up.z;
    let s2 = s * s;
    let ratio2 = (SEMI_MAJOR_M / r) * (SEMI_MAJOR_M / r);
    let (c2, c4, c6) = (J2 * ratio2, J4 * ratio2 * ratio2, J6 * ratio2 * ratio2 * ratio2);
    // Derivatives of the Legendre polynomials 2 to 7.
    let p2 = 3.0 * s;
    let p3 = 1.5 * (5.0 * s2 - 1.0);
    let p4 = 2.5 * s * (7.0 * s2 - 3.0);
    let p5 = 1.875 * (1.0 + s2 * (21.0 * s2 - 14.0));
    let p6 = 2.625 * s * (5.0 + s2 * (33.0 * s2 - 30.0));
    let p7 = (s2 * (945.0 + s2 * (3003.0 * s2 - 3465.0)) - 35.0) / 16.0;
    let along_up = c2 * p3 + c4 * p5 + c6 * p7 - 1.0;
    let along_axis = c2 * p2 + c4 * p4 + c6 * p6;
    let attraction = (up * along_up - Vector3::z() * along_axis) * (GM_M3_S2 / (r * r));
    attraction + Vector3::new(p_e.x, p_e.y, 0.0) * (EARTH_RATE_RAD_S * EARTH_RATE_RAD_S)
}

/// How normal gravity changes with place, ∂g/∂p in e, 1/s².
pub fn normal_gravity_gradient_e(p_e: &Vector3<f64>) -> Matrix3<f64> {
    let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
        let step = axis * GRADIENT_STEP_M;
        (normal_gravity_e(&(p_e + step)) - normal_gravity_e(&(p_e - step))) / (2.0 * GRADIENT_STEP_M)
    });
    Matrix3::from_columns(&columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::gravity::normal_gravity_m_s2;
    use crate::geo::{Geodetic, LocalFrame};

    const PLACES: [(f64, f64); 7] = [
        (-90.0, 0.0),
        (-45.0, 100.0),
        (-10.0, -60.0),
        (0.0, 0.0),
        (25.652_944, 106.856_667),
        (48.0, 11.0),
        (89.0, -170.0),
    ];

    /// In the east-north-up axes of the place itself, so that the ellipsoid's normal is z.
    fn at(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Vector3<f64> {
        let place = Geodetic { latitude_deg, longitude_deg, height_m };
        LocalFrame::new(place).gravity_n(&Vector3::zeros())
    }

    #[test]
    fn on_the_ellipsoid_it_is_somigliana_s_along_the_normal() {
        for (latitude_deg, longitude_deg) in PLACES {
            let g_n = at(latitude_deg, longitude_deg, 0.0);
            let expected = normal_gravity_m_s2(latitude_deg, 0.0);
            // The normal of an equipotential surface has no component along the surface.
            assert!((g_n + Vector3::z() * expected).norm() < 1e-8, "{latitude_deg}: {g_n:?} {expected}");
        }
    }

    #[test]
    fn above_the_ellipsoid_its_strength_is_that_of_the_series_in_height() {
        for (latitude_deg, longitude_deg) in PLACES {
            for height_m in [-100.0, 500.0, 1110.0, 5000.0] {
                let (found, series) = (
                    at(latitude_deg, longitude_deg, height_m).norm(),
                    normal_gravity_m_s2(latitude_deg, height_m),
                );
                assert!((found - series).abs() < 1e-6, "{latitude_deg} {height_m}: {found} {series}");
            }
        }
    }

    #[test]
    fn with_height_it_leans_towards_the_equator_as_the_plumb_line_bends() {
        // 0.17″ for each kilometre at 45° of latitude (Torge, Geodesy: the curvature of the normal plumb line).
        let g_n = at(45.0, 0.0, 3000.0);
        let lean_arcsec = (g_n.y / g_n.z).to_degrees() * 3600.0;
        assert!((lean_arcsec - 3.0 * 0.17).abs() < 0.03, "{lean_arcsec}″");
        assert!(at(-45.0, 0.0, 3000.0).y > 0.0 && g_n.y < 0.0 && g_n.x.abs() < 1e-12);
    }

    #[test]
    fn in_the_plane_of_a_site_it_leans_back_to_the_origin_by_distance_over_radius() {
        let frame = LocalFrame::new(Geodetic {
            latitude_deg: 25.652_944,
            longitude_deg: 106.856_667,
            height_m: 1110.0,
        });
        let vertical = frame.gravity_n(&Vector3::zeros());
        for distance_m in [100.0, 50_000.0] {
            let g_n = frame.gravity_n(&Vector3::new(distance_m, 0.0, 0.0));
            let lean_rad = -g_n.x / -g_n.z;
            assert!(
                (lean_rad / (distance_m / 6_374_800.0) - 1.0).abs() < 2e-3,
                "{lean_rad} at {distance_m} m"
            );
        }
        assert!(vertical.x.abs() < 1e-12 && vertical.y.abs() < 1e-5);
    }

    #[test]
    fn the_gradient_is_free_of_sources_but_for_the_rotation_and_symmetric() {
        let p_e = Vector3::from(
            Geodetic { latitude_deg: 25.652_944, longitude_deg: 106.856_667, height_m: 1110.0 }.to_ecef_m(),
        );
        let gradient = normal_gravity_gradient_e(&p_e);
        // Bruns: outside of the masses the trace is 2ω².
        assert!((gradient.trace() - 2.0 * EARTH_RATE_RAD_S * EARTH_RATE_RAD_S).abs() < 1e-14);
        assert!((gradient - gradient.transpose()).norm() < 1e-14);
        // The free-air gradient, 0.3086 mGal/m.
        let up = p_e.normalize();
        assert!((up.dot(&(gradient * up)) - 3.086e-6).abs() < 3e-8);
    }
}
