//! Bands, their frequencies, and which way of tracking is preferred.

use super::satellite::Constellation;

/// Speed of light, m/s.
pub const LIGHT_M_S: f64 = 299_792_458.0;

/// Frequency of a band as RINEX 3 numbers it, Hz; none of a band that is not used here.
pub fn frequency_hz(constellation: Constellation, band: u8) -> Option<f64> {
    let mhz = match (constellation, band) {
        (Constellation::Beidou, 2) => 1561.098,
        (Constellation::Beidou, 6) => 1268.52,
        (Constellation::Gps | Constellation::Qzss, 2) => 1227.60,
        (Constellation::Galileo | Constellation::Qzss, 6) => 1278.75,
        (_, 1) => 1575.42,
        (_, 5) => 1176.45,
        (Constellation::Beidou | Constellation::Galileo, 7) => 1207.14,
        (Constellation::Beidou | Constellation::Galileo, 8) => 1191.795,
        _ => return None,
    };
    Some(mhz * 1e6)
}

/// Wavelength of a band, m.
pub fn wavelength_m(constellation: Constellation, band: u8) -> Option<f64> {
    frequency_hz(constellation, band).map(|hz| LIGHT_M_S / hz)
}

/// Bands of a system, first the one that every receiver has, then the one that helps it most.
pub fn bands(constellation: Constellation) -> &'static [u8] {
    match constellation {
        Constellation::Gps | Constellation::Qzss => &[1, 2, 5],
        Constellation::Beidou => &[2, 6, 7, 5, 1],
        Constellation::Galileo => &[1, 5, 7, 8, 6],
    }
}

/// How much a way of tracking is preferred to others of the same band; the greater the better.
pub fn preference(constellation: Constellation, band: u8, attribute: u8) -> usize {
    let order: &[u8] = match (constellation, band) {
        (Constellation::Gps, 1) => b"NYMSLXWPC",
        (Constellation::Gps, 2) => b"NDMYCSLXPW",
        (Constellation::Beidou, 2 | 6 | 7) => b"ZDPXQI",
        _ => b"ZBADPSILXQC",
    };
    order.iter().position(|&known| known == attribute).map_or(0, |place| place + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wavelengths_are_those_of_the_interface_documents() {
        assert!((wavelength_m(Constellation::Gps, 1).unwrap() - 0.190_293_672_8).abs() < 1e-9);
        assert!((wavelength_m(Constellation::Gps, 2).unwrap() - 0.244_210_213_4).abs() < 1e-9);
        assert!((wavelength_m(Constellation::Beidou, 2).unwrap() - 0.192_039_486_3).abs() < 1e-9);
        assert!((wavelength_m(Constellation::Galileo, 5).unwrap() - 0.254_828_048_8).abs() < 1e-9);
        assert_eq!(frequency_hz(Constellation::Gps, 7), None);
    }

    #[test]
    fn the_civil_code_is_preferred_on_the_first_band_of_gps_and_the_military_on_the_second() {
        assert!(preference(Constellation::Gps, 1, b'C') > preference(Constellation::Gps, 1, b'W'));
        assert!(preference(Constellation::Gps, 2, b'W') > preference(Constellation::Gps, 2, b'L'));
    }
}
