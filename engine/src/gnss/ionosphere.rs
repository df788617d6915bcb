//! The delay of the ionosphere by Klobuchar's model, as GPS broadcasts it (IS-GPS-200, 20.3.3.5.2.5); for single points.

use std::f64::consts::PI;

use super::signal::LIGHT_M_S;
use super::time::GpsTime;
use crate::geo::Geodetic;

/// Delay of the first GPS band along the line of sight, m.
pub fn delay_m(
    coefficients: &[f64; 8],
    time: GpsTime,
    place: Geodetic,
    azimuth_rad: f64,
    elevation_rad: f64,
) -> f64 {
    // Semicircles throughout, as the document has it.
    let elevation = elevation_rad / PI;
    let psi = 0.0137 / (elevation + 0.11) - 0.022;
    let (sin_az, cos_az) = libm::sincos(azimuth_rad);
    let latitude = (place.latitude_deg / 180.0 + psi * cos_az).clamp(-0.416, 0.416);
    let longitude = place.longitude_deg / 180.0 + psi * sin_az / libm::cos(latitude * PI);
    let geomagnetic = latitude + 0.064 * libm::cos((longitude - 1.617) * PI);
    let local_s = (43_200.0 * longitude + time.tow_s()).rem_euclid(86_400.0);
    let slant = 1.0 + 16.0 * (0.53 - elevation) * (0.53 - elevation) * (0.53 - elevation);
    let series = |c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * geomagnetic + c);
    let amplitude = series(&coefficients[..4]).max(0.0);
    let period = series(&coefficients[4..]).max(72_000.0);
    let x = 2.0 * PI * (local_s - 50_400.0) / period;
    let day = if x.abs() < 1.57 { amplitude * (1.0 - x * x / 2.0 + x * x * x * x / 24.0) } else { 0.0 };
    LIGHT_M_S * slant * (5e-9 + day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_published_example_is_met() {
        // The example that implementations are commonly held against: 23.784 m at azimuth 210°, elevation 20°.
        let coefficients = [3.82e-8, 1.49e-8, -1.79e-7, 0.0, 1.43e5, 0.0, -3.28e5, 1.13e5];
        let place = Geodetic { latitude_deg: 40.0, longitude_deg: -100.0, height_m: 0.0 };
        let time = GpsTime::from_week(1000, 20.0 * 3600.0 + 45.0 * 60.0);
        let delay = delay_m(&coefficients, time, place, 210.0_f64.to_radians(), 20.0_f64.to_radians());
        assert!((delay - 23.784).abs() < 1e-3, "{delay}");
    }
}
