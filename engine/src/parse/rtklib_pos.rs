//! Positions as RTKLIB writes them: `.pos` with latitude, longitude and height in degrees and metres.
//!
//! `%` begins a comment; then `yyyy/mm/dd hh:mm:ss.sss` or week and seconds of it, in GPS time or UTC as the header says,
//! latitude, longitude, height, Q, ns, sdn, sde, sdu. Mind the order: north before east.

use crate::geo::Geodetic;
use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::gnss::{GnssClock, GnssFile, GnssQuality, GnssRow, LEAP_SECONDS, check_place};
use crate::parse::number::{number, seconds_to_ns};

/// GPS time began here, s since 1970.
const GPS_EPOCH_S: i64 = 315_964_800;
const WEEK_S: i64 = 604_800;

/// Reads a file of positions.
///
/// # Errors
///
/// At the first thing that is wrong: coordinates in another form than degrees and metres, too.
pub fn read(bytes: &[u8]) -> Result<GnssFile, ParseError> {
    let mut rows = Vec::new();
    let mut utc = false;
    for (line, text) in (1_u64..).zip(bytes.split(|byte| *byte == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() {
            continue;
        }
        if text.starts_with(b"%") {
            let is = |word: &[u8]| text.windows(word.len()).any(|window| window == word);
            utc |= is(b"UTC") && !is(b"GPST");
            if is(b"x-ecef") || is(b"e-baseline") {
                return Err(wrong("latitude(deg) longitude(deg) height(m)", text, line));
            }
            continue;
        }
        let comma = text.contains(&b',');
        let fields: Vec<&[u8]> = text
            .split(|byte| if comma { *byte == b',' } else { byte.is_ascii_whitespace() })
            .map(<[u8]>::trim_ascii)
            .filter(|field| !field.is_empty())
            .collect();
        let [day, second, rest @ ..] = &fields[..] else {
            return Err(wrong("a day and a time", text, line));
        };
        let t_ns = time_ns(day, second)
            .ok_or_else(|| wrong("yyyy/mm/dd hh:mm:ss or week and seconds", text, line))?;
        let numbers: Vec<f64> = rest.iter().map_while(|field| number(field)).collect();
        let [latitude_deg, longitude_deg, height_m, q, _, sdn, sde, sdu, ..] = numbers[..] else {
            return Err(wrong("latitude, longitude, height, Q, ns, sdn, sde, sdu as numbers", text, line));
        };
        let quality = match q as i64 {
            1 => GnssQuality::Fixed,
            2 => GnssQuality::Float,
            3..=6 => GnssQuality::Single,
            // None, and dead reckoning: no satellite tells where it was.
            0 | 7 => continue,
            _ => return Err(wrong("a quality Q from 0 (none) and 1 (fix) to 7", text, line)),
        };
        let sigma_n_m = [sde, sdn, sdu];
        rows.push(GnssRow {
            t_ns: t_ns + if utc { LEAP_SECONDS * 1_000_000_000 } else { 0 },
            place: check_place(Geodetic { latitude_deg, longitude_deg, height_m }, line)?,
            sigma_n_m: sigma_n_m.iter().all(|sigma| *sigma > 0.0).then_some(sigma_n_m),
            quality,
        });
    }
    if rows.is_empty() {
        return Err(ParseError::new(
            ParseErrorKind::EmptyFile,
            "positions of RTKLIB below its header",
            "none",
            "check that the solution has epochs",
        ));
    }
    Ok(GnssFile { rows, clock: GnssClock::Gps })
}

fn wrong(expected: &str, found: &[u8], line: u64) -> ParseError {
    let advice = "write the solution as lat/lon/height in degrees, with times in GPST";
    ParseError::new(ParseErrorKind::NotANumber, expected, quoted(found), advice).at_line(line)
}

/// Nanoseconds of GPS time since 1970.
fn time_ns(day: &[u8], second: &[u8]) -> Option<i64> {
    let whole = |text: &[u8]| std::str::from_utf8(text).ok()?.parse::<i64>().ok();
    if !day.contains(&b'/') {
        return Some((GPS_EPOCH_S + whole(day)? * WEEK_S) * 1_000_000_000 + seconds_to_ns(second)?);
    }
    let parts: Vec<&[u8]> = day.split(|byte| *byte == b'/').collect();
    let [year, month, day] = parts[..] else { return None };
    let month = time::Month::try_from(u8::try_from(whole(month)?).ok()?).ok()?;
    let year = i32::try_from(whole(year)?).ok()?;
    let date = time::Date::from_calendar_date(year, month, u8::try_from(whole(day)?).ok()?).ok()?;
    let clock: Vec<&[u8]> = second.split(|byte| *byte == b':').collect();
    let [hours, minutes, seconds] = clock[..] else { return None };
    let midnight_s = date.midnight().assume_utc().unix_timestamp();
    let whole_s = midnight_s + whole(hours)? * 3600 + whole(minutes)? * 60;
    Some(whole_s * 1_000_000_000 + seconds_to_ns(seconds)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::solution::{Fix, Solution, nmea, pos};
    use crate::gnss::time::GpsTime;

    const TEXT: &str = "% program   : RTKPOST\n\
        %  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)\n\
        2023/08/27 20:15:00.249   40.096691600 -105.147166500  1601.4310   1  12   0.0080   0.0099   0.0100 0 0 0 0 9\n\
        2277 72900.499   40.096691600 -105.147166500  1601.4350   2  12   0.0080   0.0099   0.0100\n";

    #[test]
    fn both_ways_of_telling_time_are_one_and_north_stands_before_east() {
        let file = read(TEXT.as_bytes()).unwrap();
        let [first, second] = file.rows[..] else { panic!("{file:?}") };
        assert_eq!(second.t_ns - first.t_ns, 250_000_000);
        assert_eq!(first.sigma_n_m, Some([0.0099, 0.0080, 0.0100]));
        assert_eq!((first.quality, second.quality), (GnssQuality::Fixed, GnssQuality::Float));
    }

    #[test]
    fn utc_is_turned_into_gps_time() {
        let utc = read(TEXT.replace("GPST", "UTC ").as_bytes()).unwrap();
        assert_eq!(utc.rows[0].t_ns - read(TEXT.as_bytes()).unwrap().rows[0].t_ns, 18_000_000_000);
    }

    #[test]
    fn what_is_written_is_read_again_and_what_rests_on_no_satellite_is_passed_over() {
        let solution = Solution {
            time: GpsTime::from_calendar(2023, 8, 27, 20, 15, 249_000_000),
            place: Geodetic { latitude_deg: 40.0966916, longitude_deg: -105.1471665, height_m: 1601.431 },
            sigma_n_m: [0.0099, 0.0080, 0.0100],
            covariance_en_m2: 0.0,
            fix: Fix::Fixed,
            satellites: Some(12),
            base_age_s: Some(0.0),
            ratio: None,
        };
        let mut out = Vec::new();
        pos::write([solution, Solution { fix: Fix::Estimated, ..solution }], &mut out).unwrap();
        assert_eq!(read(&out).unwrap().rows, read(TEXT.as_bytes()).unwrap().rows[..1]);
        let mut out = Vec::new();
        nmea::write([solution, Solution { fix: Fix::Estimated, ..solution }], &mut out).unwrap();
        let [again] = crate::parse::nmea::read(&out).unwrap().rows[..] else { panic!("{out:?}") };
        let first = read(TEXT.as_bytes()).unwrap().rows[0];
        assert_eq!(
            (again.t_ns, again.sigma_n_m, again.quality),
            (first.t_ns, first.sigma_n_m, first.quality)
        );
        assert!((again.place.latitude_deg - first.place.latitude_deg).abs() < 1e-9);
        assert!((again.place.height_m - first.place.height_m).abs() < 1e-4);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let error = read(TEXT.replace("   1  12", "   9  12").as_bytes()).unwrap_err();
        assert_eq!(error.line, Some(3));
        assert!(read(TEXT.replace("latitude(deg)", "x-ecef(m)").as_bytes()).is_err());
    }
}
