//! The delay of the troposphere, by Saastamoinen with the standard atmosphere at each station's own height.

use crate::geo::Geodetic;

/// Delay along the line of sight, m, at an elevation in radians.
///
/// Pressure, temperature and humidity (70 %) are those of the standard atmosphere at the height; the mapping is 1/sin of the elevation.
pub fn delay_m(place: Geodetic, elevation_rad: f64) -> f64 {
    if !(-100.0..10_000.0).contains(&place.height_m) || elevation_rad <= 0.0 {
        return 0.0;
    }
    zenith_delay_m(place) / libm::sin(elevation_rad)
}

/// Delay towards the zenith, m.
pub fn zenith_delay_m(place: Geodetic) -> f64 {
    let height_m = place.height_m.max(0.0);
    let pressure_hpa = 1013.25 * libm::pow(1.0 - 2.2557e-5 * height_m, 5.2568);
    let temperature_k = 15.0 - 6.5e-3 * height_m + 273.16;
    let vapour_hpa = 6.108 * 0.7 * libm::exp((17.15 * temperature_k - 4684.0) / (temperature_k - 38.45));
    let hydrostatic = 0.002_276_8 * pressure_hpa
        / (1.0 - 0.002_66 * libm::cos(2.0 * place.latitude_deg.to_radians()) - 0.000_28 * height_m * 1e-3);
    let wet = 0.002_277 * (1255.0 / temperature_k + 0.05) * vapour_hpa;
    hydrostatic + wet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zenith_delay_is_that_of_the_standard_atmosphere_and_105_m_of_height_are_28_to_40_mm() {
        let at = |height_m| Geodetic { latitude_deg: 35.0, longitude_deg: 137.0, height_m };
        // Saastamoinen 1972: 2.31 m hydrostatic at sea level, and about a decimetre for the vapour.
        let sea = zenith_delay_m(at(0.0));
        assert!((2.38..2.46).contains(&sea), "{sea}");
        let lost = sea - zenith_delay_m(at(105.0));
        assert!((0.026..0.040).contains(&lost), "{lost}");
        assert!((delay_m(at(0.0), 30.0_f64.to_radians()) - 2.0 * sea).abs() < 1e-9);
    }
}
