//! A date and time of day as devices and their programs write it, made into nanoseconds.
//!
//! Zones are ignored: such a clock is only ever compared with itself and with that of the other foot.

use crate::parse::number::seconds_to_ns;

/// Nanoseconds in a day.
pub(super) const DAY_NS: i64 = 86_400_000_000_000;

/// Nanoseconds since 1970-01-01T00:00:00 of the device's own zone, or since midnight where no date is
/// given. Known are `2024-3-19 16:44:16.689`, `2026-07-02 14:28:02:521` (milliseconds behind a colon),
/// `2024-03-19T16:44:16`, `03/19/2024 04:44:16.689 PM` (month first, as SensorConnect writes it) and
/// `16:44:16.689`.
pub(super) fn read(field: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(field).ok()?.trim();
    let text = text.strip_suffix('Z').unwrap_or(text);
    let (date, clock) = match text.find([' ', 'T']) {
        Some(at) if text[..at].contains(['-', '/']) => (Some(&text[..at]), text[at + 1..].trim_start()),
        _ => (None, text),
    };
    let days = match date {
        Some(date) => days_since_1970(date)?,
        None => 0,
    };
    days.checked_mul(DAY_NS)?.checked_add(time_of_day_ns(clock)?)
}

/// Whether a field reads as such a time.
pub(super) fn is_time(field: &[u8]) -> bool {
    field.contains(&b':') && read(field).is_some()
}

fn days_since_1970(date: &str) -> Option<i64> {
    let (parts, month_first) = match date.contains('/') {
        true => (date.splitn(3, '/'), true),
        false => (date.splitn(3, '-'), false),
    };
    let parts: Vec<i32> = parts.map_while(|part| part.parse().ok()).collect();
    let [a, b, c] = parts[..] else { return None };
    // 2024/3/19 is written, too.
    let (year, month, day) = if month_first && a < 100 { (c, a, b) } else { (a, b, c) };
    if !(1970..=9999).contains(&year) {
        return None;
    }
    let month = time::Month::try_from(u8::try_from(month).ok()?).ok()?;
    let date = time::Date::from_calendar_date(year, month, u8::try_from(day).ok()?).ok()?;
    Some(i64::from(date.to_julian_day()) - 2_440_588)
}

fn time_of_day_ns(clock: &str) -> Option<i64> {
    let (clock, afternoon) = match clock.to_ascii_uppercase().as_str() {
        upper if upper.ends_with("AM") => (clock[..clock.len() - 2].trim_end(), Some(false)),
        upper if upper.ends_with("PM") => (clock[..clock.len() - 2].trim_end(), Some(true)),
        _ => (clock, None),
    };
    let mut parts = clock.split(':');
    let hour: i64 = parts.next()?.parse().ok()?;
    let minute: i64 = parts.next()?.parse().ok()?;
    let seconds = parts.next()?;
    let mut ns = seconds_to_ns(seconds.as_bytes())?;
    if let Some(milliseconds) = parts.next() {
        if seconds.contains('.') || milliseconds.len() > 3 {
            return None;
        }
        ns = ns.checked_add(milliseconds.parse::<u16>().ok().map(i64::from)? * 1_000_000)?;
    }
    let hour = match afternoon {
        Some(afternoon) if (1..=12).contains(&hour) => hour % 12 + if afternoon { 12 } else { 0 },
        Some(_) => return None,
        None => hour,
    };
    let fine = parts.next().is_none()
        && (0..24).contains(&hour)
        && (0..60).contains(&minute)
        && (0..61_000_000_000).contains(&ns);
    fine.then(|| (hour * 60 + minute) * 60_000_000_000 + ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ways_in_which_devices_write_it() {
        let ns = |text: &str| read(text.as_bytes());
        let at = Some(1_710_866_656_689_000_000);
        for text in [
            "2024-3-19 16:44:16.689",
            " 2024-03-19T16:44:16.689Z",
            "2024-03-19 16:44:16:689",
            "03/19/2024 04:44:16.689 PM",
            "3/19/2024 16:44:16.689",
            "2024/3/19 16:44:16.689",
        ] {
            assert_eq!(ns(text), at, "{text}");
        }
        assert_eq!(ns("16:44:16.689"), Some(60_256_689_000_000));
        assert_eq!(ns("12:00:00 AM"), Some(0));
        assert_eq!(ns("1970-01-01 00:00:00.000000001"), Some(1));
        for wrong in [
            "",
            "12",
            "2024-3-19",
            "2024-13-19 1:0:0",
            "25:00:00",
            "1:2",
            "1:2:3:4:5",
            "1:2:3.5:6",
            "é1:2:3",
            "13:00:00 PM",
            "AM",
            "-1:2:3",
        ] {
            assert_eq!(ns(wrong), None, "{wrong}");
        }
    }

    proptest::proptest! {
        #[test]
        fn arbitrary_text_never_panics(text in "\\PC{0,30}", near in "[0-9:/. TAPMZ-]{0,30}") {
            let _ = (read(text.as_bytes()), read(near.as_bytes()));
        }
    }
}
