//! A date and time of day as devices and their programs write it, made into nanoseconds.
//!
//! Zones are ignored: such a clock is only ever compared with itself and with that of the other foot, whose steps show
//! where the two differ.

use crate::parse::number::seconds_to_ns;

/// Nanoseconds in a day.
pub(super) const DAY_NS: i64 = 86_400_000_000_000;

/// Nanoseconds since 1970-01-01T00:00:00 of the device's own zone, or since midnight where no date is
/// given. Known are `2024-3-19 16:44:16.689`, `2026-07-02 14:28:02:521` (milliseconds behind a colon),
/// `2024-03-19T16:44:16+08:00`, `20240319 164416.689`, `03/19/2024 04:44:16.689 PM` (month first, as SensorConnect writes
/// it), `19/03/2024 16:44:16` and `19.03.2024 16:44:16,689` (day first, where the first number is no month or dots part
/// them), `2024年3月19日 下午4:44:16`, `16:44:16.689`, and `44:16.7` (minutes and seconds, as a spreadsheet shows a time).
pub(super) fn read(field: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(field).ok()?.trim().trim_matches(['"', '\'', '[', ']']).trim();
    let text = without_zone(text);
    let (date, clock) = match text.find([' ', 'T', '_', '日', ',']) {
        Some(at) if is_date(&text[..at]) => {
            (Some(&text[..at]), text[at..].trim_start_matches([' ', 'T', '_', '日', ',']).trim())
        }
        _ => (None, text),
    };
    let days = match date {
        Some(date) => days_since_1970(date)?,
        None => 0,
    };
    days.checked_mul(DAY_NS)?.checked_add(time_of_day_ns(clock, date.is_some())?)
}

/// The text without a zone at its end: `Z`, `UTC`, `+08:00`, `-0330`.
fn without_zone(text: &str) -> &str {
    let text = ["Z", "UTC", "GMT"].iter().find_map(|zone| text.strip_suffix(zone)).unwrap_or(text).trim_end();
    let Some(at) = text.rfind(['+', '-']) else { return text };
    let (before, zone) = text.split_at(at);
    let digits = zone[1..].bytes().filter(u8::is_ascii_digit).count();
    let is_zone = matches!(zone.len(), 3 | 5 | 6)
        && matches!(digits, 2 | 4)
        && zone[1..].bytes().all(|byte| byte.is_ascii_digit() || byte == b':')
        && before.contains(':');
    if is_zone { before.trim_end() } else { text }
}

fn is_date(text: &str) -> bool {
    let parts = text.contains(['-', '/', '年']) || text.matches('.').count() == 2;
    parts || text.len() == 8 && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Whether a field reads as such a time.
pub(super) fn is_time(field: &[u8]) -> bool {
    field.contains(&b':') && read(field).is_some()
}

fn days_since_1970(date: &str) -> Option<i64> {
    if date.len() == 8 && date.bytes().all(|byte| byte.is_ascii_digit()) {
        return days_since_1970(&format!("{}-{}-{}", &date[..4], &date[4..6], &date[6..]));
    }
    let parts: Vec<i32> =
        date.split(['-', '/', '.', '年', '月']).map_while(|part| part.trim().parse().ok()).collect();
    let [a, b, c] = parts[..] else { return None };
    // 2024/3/19 is written, too. Dots part a day from a month; a number above twelve is no month.
    let (year, month, day) = match a {
        100.. => (a, b, c),
        _ if date.contains('.') || a > 12 => (c, b, a),
        _ => (c, a, b),
    };
    let year = if (0..70).contains(&year) { year + 2000 } else { year };
    if !(1970..=9999).contains(&year) {
        return None;
    }
    let month = time::Month::try_from(u8::try_from(month).ok()?).ok()?;
    let date = time::Date::from_calendar_date(year, month, u8::try_from(day).ok()?).ok()?;
    Some(i64::from(date.to_julian_day()) - 2_440_588)
}

fn time_of_day_ns(clock: &str, dated: bool) -> Option<i64> {
    let upper = clock.to_ascii_uppercase();
    let (clock, afternoon) = if let Some(rest) = upper.strip_suffix("AM") {
        (rest.trim_end(), Some(false))
    } else if let Some(rest) = upper.strip_suffix("PM") {
        (rest.trim_end(), Some(true))
    } else if let Some(rest) = clock.strip_prefix("上午") {
        (rest.trim_start(), Some(false))
    } else if let Some(rest) = clock.strip_prefix("下午") {
        (rest.trim_start(), Some(true))
    } else {
        (clock, None)
    };
    let comma;
    let clock = match clock.contains(',') && !clock.contains('.') {
        true => {
            comma = clock.replace(',', ".");
            comma.as_str()
        }
        false => clock,
    };
    let packed;
    let clock = match (dated, clock.find(':'), clock.split('.').next()) {
        // 164416.689 behind a date.
        (true, None, Some(whole)) if whole.len() == 6 && whole.bytes().all(|byte| byte.is_ascii_digit()) => {
            packed = format!("{}:{}:{}", &clock[..2], &clock[2..4], &clock[4..]);
            packed.as_str()
        }
        _ => clock,
    };
    let mut parts: Vec<&str> = clock.split(':').collect();
    // Minutes and seconds with a decimal are what a spreadsheet leaves of a time; hours and minutes have none.
    if parts.len() == 2 && afternoon.is_none() && (dated || parts[1].contains('.')) {
        if dated { parts.push("0") } else { parts.insert(0, "0") }
    }
    let (hour, minute, seconds, milliseconds) = match parts[..] {
        [hour, minute, seconds] => (hour, minute, seconds, None),
        [hour, minute, seconds, milliseconds] => (hour, minute, seconds, Some(milliseconds)),
        _ => return None,
    };
    let mut ns = seconds_to_ns(seconds.as_bytes())?;
    if let Some(milliseconds) = milliseconds {
        if seconds.contains('.') || milliseconds.len() > 3 {
            return None;
        }
        ns = ns.checked_add(milliseconds.parse::<u16>().ok().map(i64::from)? * 1_000_000)?;
    }
    let (hour, minute): (i64, i64) = (hour.parse().ok()?, minute.parse().ok()?);
    let hour = match afternoon {
        Some(afternoon) if (1..=12).contains(&hour) => hour % 12 + if afternoon { 12 } else { 0 },
        Some(_) => return None,
        None => hour,
    };
    let fine = (0..24).contains(&hour) && (0..60).contains(&minute) && (0..61_000_000_000).contains(&ns);
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
            "2024-03-19T16:44:16.689+08:00",
            "2024-03-19 16:44:16.689 -0330",
            "19/03/2024 16:44:16.689",
            "19.3.2024 16:44:16,689",
            "19.03.24 16:44:16.689",
            "20240319 164416.689",
            "20240319T16:44:16.689Z",
            "2024年3月19日 下午4:44:16.689",
            "\"2024-03-19 16:44:16.689\"",
        ] {
            assert_eq!(ns(text), at, "{text}");
        }
        assert_eq!(ns("16:44:16.689"), Some(60_256_689_000_000));
        assert_eq!(ns("12:00:00 AM"), Some(0));
        assert_eq!(ns("44:16.7"), Some(2_656_700_000_000));
        assert_eq!(ns("2024-03-19 16:44"), Some(1_710_866_640_000_000_000));
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
