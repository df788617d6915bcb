//! NMEA 0183: RMC with the date, GGA with the position, GST with the sigmas, for each position. Times are UTC.
//!
//! Heights are above the ellipsoid: GGA's height and the geoid's separation add up to it, and no geoid is assumed. With
//! positions to a tenth of a millimetre a sentence may be longer than the 82 characters of the standard, as those of RTK receivers are.

use std::io::{self, Write};

use super::{Fix, Solution};
use crate::geo::Geodetic;
use crate::gnss::time::{GPS_MINUS_UTC_S, GpsTime};

/// A minute of arc is written in so many parts.
const PARTS_OF_MINUTE: f64 = 1e7;

/// Writes the sentences of each position.
///
/// # Errors
///
/// When `out` does not take it.
pub fn write(solutions: impl IntoIterator<Item = Solution>, out: &mut impl Write) -> io::Result<()> {
    for solution in solutions {
        for body in [rmc(&solution), gga("GN", &solution, ""), gst(&solution)] {
            out.write_all(sentence(&body).as_bytes())?;
        }
    }
    Ok(())
}

/// Where a rover is, as casters that make a base near it are told: a GGA that looks like that of a receiver with ten satellites, for
/// some refuse less.
pub fn told_to_caster(place: Geodetic, unix_ns: i64) -> String {
    let solution = Solution {
        time: GpsTime::from_unix_ns(unix_ns),
        place,
        sigma_n_m: [f64::NAN; 3],
        covariance_en_m2: 0.0,
        fix: Fix::Single,
        satellites: Some(10),
        base_age_s: None,
        ratio: None,
    };
    sentence(&gga("GP", &solution, "1.0"))
}

/// A sentence with its checksum and the end of its line.
fn sentence(body: &str) -> String {
    let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${body}*{sum:02X}\r\n")
}

/// Date, place and mode, without its checksum.
fn rmc(solution: &Solution) -> String {
    let (day, clock) = utc(solution.time);
    let mode = match solution.fix {
        Fix::Fixed => 'R',
        Fix::Float => 'F',
        Fix::Single => 'A',
        Fix::Estimated => 'E',
    };
    format!("GNRMC,{clock},A,{},,,{day},,,{mode}", place(solution))
}

/// The position, without its checksum: from which receivers, and the dilution of precision where it is known.
fn gga(talker: &str, solution: &Solution, hdop: &str) -> String {
    let quality = match solution.fix {
        Fix::Fixed => 4,
        Fix::Float => 5,
        Fix::Single => 1,
        Fix::Estimated => 6,
    };
    let satellites = solution.satellites.map_or_else(String::new, |count| format!("{:02}", count.min(99)));
    let age = solution.base_age_s.map_or_else(String::new, |age_s| format!("{age_s:.1}"));
    format!(
        "{talker}GGA,{},{},{quality},{satellites},{hdop},{:.4},M,0.0,M,{age},",
        utc(solution.time).1,
        place(solution),
        solution.place.height_m
    )
}

/// The sigmas, without their checksum: the ellipse's axes, its direction from north, and those of latitude, longitude and height.
fn gst(solution: &Solution) -> String {
    let [east, north, up] = solution.sigma_n_m;
    let covariance = solution.covariance_en_m2;
    let (sum, difference) = ((east * east + north * north) / 2.0, (north * north - east * east) / 2.0);
    let root = libm::hypot(difference, covariance);
    let (major, minor) = (libm::sqrt(sum + root), libm::sqrt((sum - root).max(0.0)));
    let direction = libm::atan2(covariance, difference).to_degrees() / 2.0;
    let direction = if direction < 0.0 { direction + 180.0 } else { direction };
    format!(
        "GNGST,{},,{major:.4},{minor:.4},{direction:.1},{north:.4},{east:.4},{up:.4}",
        utc(solution.time).1
    )
}

/// `ddmm.mmmmmmm,N,dddmm.mmmmmmm,E`.
fn place(solution: &Solution) -> String {
    let angle = |degrees: f64, width: usize| {
        let parts = libm::round(degrees.abs() * 60.0 * PARTS_OF_MINUTE) as u64;
        let minute = PARTS_OF_MINUTE as u64;
        let (minutes, part) = (parts / minute, parts % minute);
        format!("{:0width$}{:02}.{part:07}", minutes / 60, minutes % 60)
    };
    let (latitude, longitude) = (solution.place.latitude_deg, solution.place.longitude_deg);
    format!(
        "{},{},{},{}",
        angle(latitude, 2),
        if latitude < 0.0 { 'S' } else { 'N' },
        angle(longitude, 3),
        if longitude < 0.0 { 'W' } else { 'E' }
    )
}

/// `ddmmyy` and `hhmmss.sss` of UTC.
fn utc(time: GpsTime) -> (String, String) {
    let text = GpsTime { ns: time.ns - GPS_MINUS_UTC_S * 1_000_000_000 }.calendar_ms();
    let [year, month, day] = [2..4, 5..7, 8..10].map(|at| text.get(at).unwrap_or_default());
    (format!("{day}{month}{year}"), text.get(11..).unwrap_or_default().replace(':', ""))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::solution::tests::two;

    #[test]
    fn a_position_is_told_as_receivers_tell_it() {
        let mut out = Vec::new();
        write(two(), &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines[0].starts_with("$GNRMC,081942.100,A,4005.8014982,N,10508.8299907,E,,,240624,,,R*"),
            "{}",
            lines[0]
        );
        assert!(
            lines[1].starts_with(
                "$GNGGA,081942.100,4005.8014982,N,10508.8299907,E,4,14,,1601.4312,M,0.0,M,1.0,*"
            )
        );
        // A place a hair below a whole degree, at the last moment of a day.
        assert!(
            lines[3].starts_with("$GNRMC,000000.000,A,3400.0000000,S,15100.0000000,W,,,010724,,,E*"),
            "{}",
            lines[3]
        );
        for line in lines {
            let (body, sum) = line.strip_prefix('$').and_then(|rest| rest.split_once('*')).unwrap();
            assert_eq!(format!("{:02X}", body.bytes().fold(0, |sum, byte| sum ^ byte)), sum);
        }
    }

    #[test]
    fn a_caster_is_told_where_a_rover_is() {
        let place = Geodetic { latitude_deg: -33.5, longitude_deg: 151.25, height_m: 12.0 };
        let text = told_to_caster(place, 1_719_217_182_000_000_000);
        assert!(
            text.starts_with("$GPGGA,081942.000,3330.0000000,S,15115.0000000,E,1,10,1.0,12.0000,M,0.0,M,,*"),
            "{text}"
        );
    }

    #[test]
    fn the_ellipse_is_that_of_the_covariance() {
        // Long to the north-west: east and north go against each other.
        let [solution, _] = two();
        let turned = Solution { sigma_n_m: [0.05, 0.05, 0.1], covariance_en_m2: -0.0016, ..solution };
        let body = gst(&turned);
        let fields: Vec<&str> = body.split(',').collect();
        assert_eq!(fields[3..], ["0.0640", "0.0300", "135.0", "0.0500", "0.0500", "0.1000"]);
    }
}
