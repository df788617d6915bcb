//! Positions of a GNSS antenna, in the three forms that receivers and programs write: canonical CSV ([`gnss_csv`]),
//! RTKLIB's `.pos` ([`rtklib_pos`]) and NMEA ([`nmea`]).
//!
//! [`gnss_csv`]: crate::parse::gnss_csv
//! [`rtklib_pos`]: crate::parse::rtklib_pos
//! [`nmea`]: crate::parse::nmea

use crate::geo::Geodetic;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::{gnss_csv, nmea, rtklib_pos};

/// GPS time was ahead of UTC by this when the last leap second was put in, s.
pub const LEAP_SECONDS: i64 = crate::gnss::time::GPS_MINUS_UTC_S;

/// How the receiver came to a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GnssQuality {
    /// Carrier phase with whole ambiguities.
    Fixed,
    /// Carrier phase with ambiguities as they come.
    Float,
    /// By code, with corrections or without.
    Single,
}

impl GnssQuality {
    /// As RTKLIB numbers it.
    pub fn number(self) -> f64 {
        match self {
            GnssQuality::Fixed => 1.0,
            GnssQuality::Float => 2.0,
            GnssQuality::Single => 5.0,
        }
    }

    /// The quality of a number of RTKLIB; what is no such number is believed least.
    pub fn numbered(number: f64) -> GnssQuality {
        let all = [GnssQuality::Fixed, GnssQuality::Float];
        all.into_iter().find(|quality| quality.number() == number).unwrap_or(GnssQuality::Single)
    }
}

/// A position of the antenna's phase centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssRow {
    /// Time on the clock of the file, ns: see [`GnssClock`].
    pub t_ns: i64,
    /// WGS84, with the height above the ellipsoid.
    pub place: Geodetic,
    /// Sigmas east, north and up, m; `None` where the file does not say them.
    pub sigma_n_m: Option<[f64; 3]>,
    /// How it came about.
    pub quality: GnssQuality,
}

/// What the times of a file count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GnssClock {
    /// The session's own zero.
    Session,
    /// GPS time: 1970-01-01, without leap seconds.
    Gps,
    /// The midnight before, UTC: sentences without a date.
    MidnightUtc,
}

/// A file of positions.
#[derive(Clone, Debug, PartialEq)]
pub struct GnssFile {
    /// Positions in order of the file.
    pub rows: Vec<GnssRow>,
    /// What their times count from.
    pub clock: GnssClock,
}

/// Reads a file in any of the three forms, recognised by its first line.
///
/// # Errors
///
/// At the first thing that is wrong.
pub fn read(bytes: &[u8]) -> Result<GnssFile, ParseError> {
    let first = bytes.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii).find(|line| !line.is_empty());
    let first = first.unwrap_or_default();
    let dated = first.len() > 10 && first[..4].iter().all(u8::is_ascii_digit) && first[4] == b'/';
    if first.starts_with(b"%") || dated {
        return rtklib_pos::read(bytes);
    }
    if first.starts_with(b"$") {
        return nmea::read(bytes);
    }
    gnss_csv::read(bytes)
}

/// An error for a place on no Earth.
pub(super) fn check_place(place: Geodetic, line: u64) -> Result<Geodetic, ParseError> {
    let fine = place.latitude_deg.abs() <= 90.0
        && place.longitude_deg.abs() <= 360.0
        && (-1000.0..=20_000.0).contains(&place.height_m);
    if fine {
        return Ok(place);
    }
    Err(ParseError::new(
        ParseErrorKind::OutOfRange,
        "a latitude within ±90°, a longitude within ±360° and a height from -1000 to 20000 m",
        format!("{}, {}, {}", place.latitude_deg, place.longitude_deg, place.height_m),
        "check the order and the units of the columns",
    )
    .at_line(line))
}
