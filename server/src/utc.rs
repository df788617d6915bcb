//! Instants: UTC at the edge, integer microseconds since 1970 in the tables.

use schemars::{JsonSchema, SchemaGenerator};
use time::{Date, OffsetDateTime};

/// Now, to the microsecond, as it will be read back from a table.
pub fn now() -> OffsetDateTime {
    from_us(to_us(OffsetDateTime::now_utc()))
}

/// Microseconds since 1970-01-01T00:00:00Z.
pub fn to_us(instant: OffsetDateTime) -> i64 {
    // The `time` crate holds years up to ±9999: at most 2.5e17 µs.
    (instant.unix_timestamp_nanos() / 1_000) as i64
}

/// The instant of that many microseconds since 1970-01-01T00:00:00Z; what lies outside the years
/// that can be written (−9999 to 9999) is taken as the first or the last of them.
pub fn from_us(us: i64) -> OffsetDateTime {
    let end = if us < 0 { Date::MIN.midnight() } else { Date::MAX.midnight() };
    OffsetDateTime::from_unix_timestamp_nanos(i128::from(us) * 1_000).unwrap_or(end.assume_utc())
}

/// The instant that lies `t_ns` after a session's start.
pub fn at(started_at: OffsetDateTime, t_ns: i64) -> OffsetDateTime {
    from_us(to_us(started_at).saturating_add(t_ns / 1_000))
}

/// As a file's name can hold it, to a second: `20261125T081500Z`.
pub(crate) fn in_a_file_name(instant: OffsetDateTime) -> String {
    let (year, month, day) = instant.to_calendar_date();
    let (hour, minute, second) = instant.to_hms();
    format!("{year:04}{:02}{day:02}T{hour:02}{minute:02}{second:02}Z", u8::from(month))
}

/// An instant, as it is written: RFC 3339, UTC.
#[derive(Clone, Copy, Debug)]
pub struct Instant;

impl JsonSchema for Instant {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Instant".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({"type": "string", "format": "date-time", "description": "RFC 3339, UTC"})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instant_survives_the_table_to_the_microsecond() {
        let instant = now();
        assert_eq!(from_us(to_us(instant)), instant);
    }

    #[test]
    fn what_lies_beyond_the_years_stays_at_their_end() {
        assert_eq!(at(Date::MAX.midnight().assume_utc(), i64::MAX).year(), 9999);
        assert_eq!(from_us(i64::MIN).year(), -9999);
    }

    #[test]
    fn a_time_in_a_session_is_counted_from_its_start() {
        assert_eq!(to_us(at(from_us(5_000_000), 1_500_000_999)), 6_500_000);
    }
}
