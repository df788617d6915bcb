//! Instants: UTC at the edge, integer microseconds since 1970 in the tables.

use time::OffsetDateTime;

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
/// that can be written (−9999 to 9999) is taken as 1970.
pub fn from_us(us: i64) -> OffsetDateTime {
    OffsetDateTime::from_unix_timestamp_nanos(i128::from(us) * 1_000).unwrap_or(OffsetDateTime::UNIX_EPOCH)
}

/// The instant that lies `t_ns` after a session's start.
pub fn at(started_at: OffsetDateTime, t_ns: i64) -> OffsetDateTime {
    from_us(to_us(started_at).saturating_add(t_ns / 1_000))
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
    fn a_time_in_a_session_is_counted_from_its_start() {
        assert_eq!(to_us(at(from_us(5_000_000), 1_500_000_999)), 6_500_000);
    }
}
