//! GPS time, and what other systems call the same moment.

use std::ops::{Add, Range, Sub};

/// Seconds of a week.
pub const WEEK_S: f64 = 604_800.0;
const WEEK_NS: i64 = 604_800_000_000_000;
/// The years and the weeks in which somebody may have observed.
const YEARS: Range<i16> = 1980..2100;
const WEEKS: Range<f64> = 0.0..6_300.0;
/// GPS time − BeiDou time, s.
pub const GPS_MINUS_BEIDOU_S: i64 = 14;
/// GPS time was ahead of UTC by this when the last leap second was put in, s.
pub const GPS_MINUS_UTC_S: i64 = 18;
/// GPS time began here, s since 1970.
const EPOCH_UNIX_S: i64 = 315_964_800;

/// A moment in GPS time: whole nanoseconds since 6 January 1980, 0 h.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct GpsTime {
    /// Nanoseconds since the epoch of GPS time.
    pub ns: i64,
}

impl GpsTime {
    /// The moment of a week and its second.
    pub fn from_week(week: i32, tow_s: f64) -> GpsTime {
        GpsTime { ns: i64::from(week).saturating_mul(WEEK_NS).saturating_add(whole_ns(tow_s)) }
    }

    /// The moment of a date as files write it, with what is to be added to come to GPS time, s; none where a part is out of its range.
    pub fn from_date(
        [year, month, day, hour, minute]: [i16; 5],
        second: f64,
        to_gps_s: i64,
    ) -> Option<GpsTime> {
        let fits = YEARS.contains(&year)
            && (1..=12).contains(&month)
            && (1..=31).contains(&day)
            && (0..=24).contains(&hour)
            && (0..=60).contains(&minute)
            && (0.0..=61.0).contains(&second);
        fits.then(|| {
            let [month, day, hour, minute] = [month, day, hour, minute].map(|part| part as u32);
            let second_ns = libm::round(second * 1e9) as i64 + to_gps_s * 1_000_000_000;
            GpsTime::from_calendar(i32::from(year), month, day, hour, minute, second_ns)
        })
    }

    /// The moment of a week and its second as they stand in a row; none where they are out of their range.
    pub fn from_row(week: f64, tow_s: f64) -> Option<GpsTime> {
        let fits = WEEKS.contains(&week) && (0.0..=WEEK_S).contains(&tow_s);
        fits.then(|| GpsTime::from_week(week as i32, tow_s))
    }

    /// The moment of a date on the calendar of GPS time. Months and days outside of their range go on into the next.
    pub fn from_calendar(year: i32, month: u32, day: u32, hour: u32, minute: u32, second_ns: i64) -> GpsTime {
        let days = days_from_1970(year, month, day) - days_from_1970(1980, 1, 6);
        let seconds = days * 86_400 + i64::from(hour) * 3600 + i64::from(minute) * 60;
        GpsTime { ns: seconds * 1_000_000_000 + second_ns }
    }

    /// The moment of a count of UTC, ns since 1970.
    pub fn from_unix_ns(unix_ns: i64) -> GpsTime {
        GpsTime { ns: unix_ns + (GPS_MINUS_UTC_S - EPOCH_UNIX_S) * 1_000_000_000 }
    }

    /// The week, counted on without rolling over.
    pub fn week(self) -> i32 {
        self.ns.div_euclid(WEEK_NS) as i32
    }

    /// The second of the week.
    pub fn tow_s(self) -> f64 {
        self.ns.rem_euclid(WEEK_NS) as f64 * 1e-9
    }

    /// Seconds from another moment to this one.
    pub fn since(self, other: GpsTime) -> f64 {
        self.ns.saturating_sub(other.ns) as f64 * 1e-9
    }

    /// The date and time of day to a millisecond, `2024-06-24 08:20:00.100`, in GPS time.
    pub fn calendar_ms(self) -> String {
        let ms = (self.ns + 500_000).div_euclid(1_000_000);
        format!("{}.{:03}", GpsTime { ns: ms * 1_000_000 }.calendar(), ms.rem_euclid(1000))
    }

    /// The date and time of day, `2024-06-24 08:20:00`, in GPS time.
    pub fn calendar(self) -> String {
        let seconds = self.ns.div_euclid(1_000_000_000);
        let days = seconds.div_euclid(86_400) + days_from_1970(1980, 1, 6);
        let second = seconds.rem_euclid(86_400);
        // The civil calendar from a count of days, by eras of 400 years that begin in March.
        let z = days + 719_468;
        let era = z.div_euclid(146_097);
        let of_era = z.rem_euclid(146_097);
        let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * year + year / 4 - year / 100);
        let month_from_march = (5 * of_year + 2) / 153;
        let day = of_year - (153 * month_from_march + 2) / 5 + 1;
        let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
        let year = year + era * 400 + i64::from(month <= 2);
        let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
        format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}")
    }
}

/// Seconds as whole nanoseconds.
fn whole_ns(seconds: f64) -> i64 {
    libm::round(seconds * 1e9) as i64
}

/// Days from 1 January 1970 to a date, by eras of 400 years that begin in March.
fn days_from_1970(year: i32, month: u32, day: u32) -> i64 {
    let year = i64::from(year) - i64::from(month <= 2);
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let month = i64::from(month);
    let of_year = (153 * (if month > 2 { month - 3 } else { month + 9 }) + 2) / 5 + i64::from(day) - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

impl Add<f64> for GpsTime {
    type Output = GpsTime;

    fn add(self, seconds: f64) -> GpsTime {
        GpsTime { ns: self.ns.saturating_add(whole_ns(seconds)) }
    }
}

impl Sub<f64> for GpsTime {
    type Output = GpsTime;

    fn sub(self, seconds: f64) -> GpsTime {
        self + (-seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weeks_go_on_over_the_roll_overs_and_leap_days_count() {
        // Both roll-overs of the ten-bit week, and a leap day of a year that 400 divides.
        assert_eq!(GpsTime::from_calendar(1999, 8, 22, 0, 0, 0), GpsTime::from_week(1024, 0.0));
        assert_eq!(GpsTime::from_calendar(2019, 4, 7, 0, 0, 0), GpsTime::from_week(2048, 0.0));
        assert_eq!(
            GpsTime::from_calendar(2000, 3, 1, 0, 0, 0).since(GpsTime::from_calendar(2000, 2, 28, 0, 0, 0)),
            172_800.0
        );
        let time = GpsTime::from_calendar(2024, 6, 24, 8, 20, 0);
        assert_eq!((time.week(), time.tow_s()), (2320, 116_400.0));
        assert_eq!(time.calendar(), "2024-06-24 08:20:00");
        assert_eq!(
            GpsTime::from_calendar(2024, 2, 29, 23, 59, 59_000_000_000).calendar(),
            "2024-02-29 23:59:59"
        );
    }

    #[test]
    fn a_date_that_nobody_observed_on_is_none() {
        let of = |year| GpsTime::from_date([year, 6, 24, 8, 20], 0.5, 14);
        assert_eq!(of(2024), Some(GpsTime::from_calendar(2024, 6, 24, 8, 20, 14_500_000_000)));
        assert_eq!([of(1979), of(2100), of(i16::MAX)], [None; 3]);
        assert_eq!(GpsTime::from_date([2024, 13, 1, 0, 0], 0.0, 0), None);
        assert_eq!(GpsTime::from_date([2024, 1, 1, 0, 0], f64::NAN, 0), None);
        assert_eq!(GpsTime::from_row(2320.0, 116_400.0), Some(GpsTime::from_week(2320, 116_400.0)));
        assert_eq!([GpsTime::from_row(19_999.0, 0.0), GpsTime::from_row(2320.0, f64::NAN)], [None; 2]);
        // Sums of what cannot be stay at the end of time.
        assert_eq!((GpsTime { ns: i64::MAX } + 1e30).since(GpsTime { ns: i64::MIN }), i64::MAX as f64 * 1e-9);
    }

    #[test]
    fn beidou_s_first_week_is_gps_week_1356() {
        let first = GpsTime::from_calendar(2006, 1, 1, 0, 0, GPS_MINUS_BEIDOU_S * 1_000_000_000);
        assert_eq!((first.week(), first.tow_s()), (1356, 14.0));
    }
}
