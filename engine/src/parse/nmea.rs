//! Positions as NMEA 0183: GGA, with the sigmas of GST and the date of RMC or ZDA where they come along.
//!
//! GGA's height is orthometric: with the separation of the geoid, which stands beside it, it is the ellipsoid's. Its time
//! is UTC.

use crate::geo::Geodetic;
use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::gnss::{GnssClock, GnssFile, GnssQuality, GnssRow, LEAP_SECONDS, check_place};
use crate::parse::number::{number, seconds_to_ns};

const SECOND_NS: i64 = 1_000_000_000;
const DAY_NS: i64 = 86_400 * SECOND_NS;

/// Reads a log of sentences; those that say nothing of a position are left alone.
///
/// # Errors
///
/// At a sentence whose checksum is wrong in its middle, and where no GGA has a position.
pub fn read(bytes: &[u8]) -> Result<GnssFile, ParseError> {
    let mut rows: Vec<GnssRow> = Vec::new();
    let mut sigmas: Option<(i64, [f64; 3])> = None;
    let mut midnight_ns: Option<i64> = None;
    let mut days_ns = 0;
    let mut last_ns = i64::MIN;
    for (line, text) in (1_u64..).zip(bytes.split(|byte| *byte == b'\n')) {
        let text = text.trim_ascii();
        // A recorder that is switched off leaves half a sentence: without a checksum it is none.
        let Some((sentence, said)) = sentence(text) else { continue };
        if said != sum(sentence) {
            return Err(ParseError::new(
                ParseErrorKind::NotANumber,
                format!("the checksum {:02X}", sum(sentence)),
                quoted(text),
                "copy the log again, or delete the line",
            )
            .at_line(line));
        }
        let fields: Vec<&[u8]> = sentence.split(|byte| *byte == b',').collect();
        let kind = fields[0].get(2..).unwrap_or_default();
        let field = |k: usize| fields.get(k).copied().unwrap_or_default();
        match kind {
            b"RMC" => midnight_ns = date_ns(field(9)).or(midnight_ns),
            b"GST" => {
                let [n, e, u] = [6, 7, 8].map(|k| number(field(k)).filter(|sigma| *sigma > 0.0));
                if let (Some(t_ns), Some(n), Some(e), Some(u)) = (clock_ns(field(1)), n, e, u) {
                    sigmas = Some((t_ns, [e, n, u]));
                    if let Some(row) = rows.last_mut().filter(|_| last_ns == t_ns) {
                        row.sigma_n_m = Some([e, n, u]);
                    }
                }
            }
            b"GGA" => {
                let quality = match field(6) {
                    b"4" => GnssQuality::Fixed,
                    b"5" => GnssQuality::Float,
                    b"1" | b"2" | b"3" => GnssQuality::Single,
                    _ => continue,
                };
                let place = || {
                    let latitude_deg = angle_deg(field(2), field(3) == b"S")?;
                    let longitude_deg = angle_deg(field(4), field(5) == b"W")?;
                    let height_m = number(field(9))? + number(field(11))?;
                    Some((clock_ns(field(1))?, Geodetic { latitude_deg, longitude_deg, height_m }))
                };
                let (t_ns, place) = place().ok_or_else(|| {
                    ParseError::new(
                        ParseErrorKind::NotANumber,
                        "a GGA with time, latitude, longitude, height and the geoid's separation",
                        quoted(text),
                        "let the receiver send whole GGA sentences",
                    )
                    .at_line(line)
                })?;
                if t_ns < last_ns.saturating_sub(DAY_NS / 2) {
                    days_ns += DAY_NS;
                }
                last_ns = t_ns;
                rows.push(GnssRow {
                    t_ns: t_ns + days_ns,
                    place: check_place(place, line)?,
                    sigma_n_m: sigmas.filter(|(of_ns, _)| *of_ns == t_ns).map(|(_, sigma)| sigma),
                    quality,
                });
            }
            _ => {}
        }
    }
    if rows.is_empty() {
        return Err(ParseError::new(
            ParseErrorKind::EmptyFile,
            "GGA sentences with a position",
            "none",
            "let the receiver log GGA, and GST for the sigmas",
        ));
    }
    if let Some(midnight_ns) = midnight_ns {
        for row in &mut rows {
            row.t_ns += midnight_ns + LEAP_SECONDS * SECOND_NS;
        }
        return Ok(GnssFile { rows, clock: GnssClock::Gps });
    }
    Ok(GnssFile { rows, clock: GnssClock::MidnightUtc })
}

/// What stands between `$` and `*`, and the checksum behind it.
fn sentence(text: &[u8]) -> Option<(&[u8], u8)> {
    let star = text.iter().rposition(|byte| *byte == b'*')?;
    let said = std::str::from_utf8(text.get(star + 1..)?).ok()?;
    Some((text.get(..star)?.strip_prefix(b"$")?, u8::from_str_radix(said.trim(), 16).ok()?))
}

fn sum(sentence: &[u8]) -> u8 {
    sentence.iter().fold(0, |sum, byte| sum ^ byte)
}

/// hhmmss.ss as nanoseconds since midnight.
fn clock_ns(field: &[u8]) -> Option<i64> {
    let whole = |text: &[u8]| std::str::from_utf8(text).ok()?.parse::<i64>().ok();
    let (hours, minutes) = (whole(field.get(..2)?)?, whole(field.get(2..4)?)?);
    Some((hours * 3600 + minutes * 60) * SECOND_NS + seconds_to_ns(field.get(4..)?)?)
}

/// ddmmyy as nanoseconds since 1970.
fn date_ns(field: &[u8]) -> Option<i64> {
    let whole = |at: usize| std::str::from_utf8(field.get(at..at + 2)?).ok()?.parse::<u8>().ok();
    let month = time::Month::try_from(whole(2)?).ok()?;
    let date = time::Date::from_calendar_date(2000 + i32::from(whole(4)?), month, whole(0)?).ok()?;
    Some(date.midnight().assume_utc().unix_timestamp() * SECOND_NS)
}

/// ddmm.mmmm as degrees.
fn angle_deg(field: &[u8], negative: bool) -> Option<f64> {
    let point = field.iter().position(|byte| *byte == b'.').unwrap_or(field.len());
    let (degrees, minutes) = field.split_at_checked(point.checked_sub(2)?)?;
    let angle = number(degrees)? + number(minutes)? / 60.0;
    Some(if negative { -angle } else { angle })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(sentence: &str) -> String {
        format!("${sentence}*{:02X}\r\n", sum(sentence.as_bytes()))
    }

    #[test]
    fn height_is_the_ellipsoid_s_sigmas_are_gst_s_and_the_day_is_rmc_s() {
        let log = line("GNRMC,201500.25,A,4005.80,N,10508.83,W,0,0,270823,,,R")
            + &line("GNGGA,201500.25,4005.80150,N,10508.83000,W,4,12,0.6,1618.43,M,-17.00,M,1.0,0")
            + &line("GNGST,201500.25,,,,,0.008,0.009,0.015");
        let file = read(log.as_bytes()).unwrap();
        assert_eq!(file.clock, GnssClock::Gps);
        let row = file.rows[0];
        assert!((row.place.height_m - 1601.43).abs() < 1e-9 && row.place.longitude_deg < -105.1);
        assert!((row.place.latitude_deg - (40.0 + 5.8015 / 60.0)).abs() < 1e-12);
        assert_eq!((row.sigma_n_m, row.quality), (Some([0.009, 0.008, 0.015]), GnssQuality::Fixed));
        // 2023-08-27 20:15:00.25 UTC and 18 leap seconds.
        assert_eq!(row.t_ns, (1_693_167_300 + 18) * SECOND_NS + 250_000_000);
    }

    #[test]
    fn a_wrong_checksum_is_named_and_half_a_sentence_is_left_alone() {
        let good = line("GNGGA,201500.25,4005.80150,N,10508.83000,W,5,12,0.6,1618.43,M,-17.00,M,1.0,0");
        let half = good.clone() + "$GNGGA,201500.50,400";
        let file = read(half.as_bytes()).unwrap();
        assert_eq!((file.rows.len(), file.clock), (1, GnssClock::MidnightUtc));
        let error = read((good.clone() + &good.replace("1618", "1619")).as_bytes()).unwrap_err();
        assert_eq!(error.line, Some(2));
    }

    #[test]
    fn after_midnight_time_goes_on() {
        let at = |clock: &str| {
            line(&format!("GNGGA,{clock},4005.80150,N,10508.83000,W,4,12,0.6,1618.43,M,-17.00,M,1.0,0"))
        };
        let file = read((at("235959.80") + &at("000000.00")).as_bytes()).unwrap();
        assert_eq!(file.rows[1].t_ns - file.rows[0].t_ns, 200_000_000);
    }
}
