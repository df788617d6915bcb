//! Normal gravity: the pull of the WGS84 ellipsoid, by latitude and height.

use super::ellipsoid::{ECCENTRICITY_SQUARED, FLATTENING, SEMI_MAJOR_M};

/// Normal gravity at the equator, m/s².
const EQUATORIAL_M_S2: f64 = 9.780_325_335_9;
/// Somigliana's constant k = (b γ_p)/(a γ_e) − 1.
const SOMIGLIANA: f64 = 0.001_931_852_652_41;
/// m = ω² a² b / GM.
const ROTATION_RATIO: f64 = 0.003_449_786_506_84;

/// Magnitude of normal gravity, m/s², at a geodetic latitude (degrees) and height above the
/// ellipsoid (m): Somigliana's formula on the ellipsoid and its second-order series above it
/// (NIMA TR8350.2, equations 4-1 and 4-3), good to 1e-6 m/s² below 10 km.
pub fn normal_gravity_m_s2(latitude_deg: f64, height_m: f64) -> f64 {
    let sin = libm::sin(latitude_deg.to_radians());
    let sin2 = sin * sin;
    let on_ellipsoid =
        EQUATORIAL_M_S2 * (1.0 + SOMIGLIANA * sin2) / libm::sqrt(1.0 - ECCENTRICITY_SQUARED * sin2);
    let h = height_m / SEMI_MAJOR_M;
    on_ellipsoid
        * (1.0 - 2.0 * (1.0 + FLATTENING + ROTATION_RATIO - 2.0 * FLATTENING * sin2) * h + 3.0 * h * h)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_values() {
        assert!((normal_gravity_m_s2(0.0, 0.0) - 9.780_325_335_9).abs() < 1e-9);
        assert!((normal_gravity_m_s2(90.0, 0.0) - 9.832_184_937_9).abs() < 1e-9);
        assert!((normal_gravity_m_s2(45.0, 0.0) - 9.806_197_7).abs() < 1e-6);
        assert!((normal_gravity_m_s2(-45.0, 0.0) - normal_gravity_m_s2(45.0, 0.0)).abs() < 1e-15);
    }

    #[test]
    fn fast_and_the_free_air_gradient() {
        assert!((normal_gravity_m_s2(25.652_944, 1110.0) - 9.787).abs() < 5e-4);
        let gradient = normal_gravity_m_s2(25.65, 1000.0) - normal_gravity_m_s2(25.65, 0.0);
        assert!((gradient + 0.003_086).abs() < 5e-6, "{gradient}");
    }
}
