//! GPS time of a made world.

/// A GPS week and second of the week.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instant {
    pub(super) week: i32,
    pub(super) tow_s: f64,
}

impl Instant {
    pub(super) fn after(self, seconds: f64) -> Instant {
        Instant { week: self.week, tow_s: self.tow_s + seconds }
    }

    /// Year, month, day, hour, minute and second of GPS time.
    pub(super) fn civil(self) -> (i64, i64, i64, i64, i64, f64) {
        let whole = self.tow_s.floor();
        let days = i64::from(self.week) * 7 + (whole as i64).div_euclid(86_400);
        let of_day = (whole as i64).rem_euclid(86_400);
        // Days since 1 March of year 0 (Howard Hinnant's rule); 6 January 1980 is day 723 125 of it.
        let z = days + 723_125;
        let era = z.div_euclid(146_097);
        let of_era = z.rem_euclid(146_097);
        let of_era_year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * of_era_year + of_era_year / 4 - of_era_year / 100);
        let shifted = (5 * of_year + 2) / 153;
        let day = of_year - (153 * shifted + 2) / 5 + 1;
        let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
        let year = of_era_year + era * 400 + i64::from(month <= 2);
        let second = of_day as f64 % 60.0 + (self.tow_s - whole);
        (year, month, day, of_day / 3600, of_day / 60 % 60, second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weeks_and_seconds_are_the_days_that_calendars_say() {
        let civil = |week, tow_s| Instant { week, tow_s }.civil();
        assert_eq!(civil(0, 0.0), (1980, 1, 6, 0, 0, 0.0));
        assert_eq!(civil(2320, 116_967.0), (2024, 6, 24, 8, 29, 27.0));
        assert_eq!(civil(2303, 4.0 * 86_400.0 + 3_661.5), (2024, 2, 29, 1, 1, 1.5));
    }
}
