//! Positions as the filter takes them: on the sensor's clock, in the plane of the site.

use super::recording::{Fix, Quality};
use crate::geo::LocalFrame;
use crate::parse::gnss::{GnssQuality, GnssRow, LEAP_SECONDS};

const SECOND_NS: i64 = 1_000_000_000;
const DAY_NS: i64 = 86_400 * SECOND_NS;
const WEEK_NS: i64 = 7 * DAY_NS;
/// The week of GPS time begins on a Sunday; 1970-01-01 was a Thursday.
const WEEK_BEGINS_NS: i64 = 3 * DAY_NS;
/// A time that is later than this counts from 1970, ns: no session lasts for ten years.
const SINCE_1970_NS: i64 = 3652 * DAY_NS;
/// Sigmas of solutions that do not say them, plan and height, m.
const SIGMAS_M: [(GnssQuality, [f64; 2]); 3] = [
    (GnssQuality::Fixed, [0.012, 0.023]),
    (GnssQuality::Float, [0.5, 1.0]),
    (GnssQuality::Single, [3.0, 6.0]),
];

/// A row as a fix on the sensor's clock, which shows `shift_ns` less.
pub(super) fn fix(row: &GnssRow, shift_ns: i64, frame: &LocalFrame) -> Fix {
    let usual = SIGMAS_M.iter().find(|(quality, _)| *quality == row.quality);
    let [plan, height] = usual.map_or([3.0, 6.0], |(_, sigmas)| *sigmas);
    Fix {
        t_ns: row.t_ns - shift_ns,
        p_n_m: frame.to_local_m(row.place).into(),
        sigma_n_m: row.sigma_n_m.unwrap_or([plan, plan, height]).into(),
        quality: match row.quality {
            GnssQuality::Fixed => Quality::Fixed,
            GnssQuality::Float => Quality::Float,
            GnssQuality::Single => Quality::Single,
        },
    }
}

/// All rows as fixes in order of time, on the clock of samples from `from_ns` to `to_ns`.
pub(super) fn fixes(rows: &[GnssRow], frame: &LocalFrame, [from_ns, to_ns]: [i64; 2]) -> Vec<Fix> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Vec::new() };
    let together = |zero: i64| first.t_ns - zero <= to_ns && last.t_ns - zero >= from_ns;
    let shift_ns = zero_ns(first.t_ns, together);
    let mut fixes: Vec<Fix> = rows.iter().map(|row| fix(row, shift_ns, frame)).collect();
    fixes.sort_by_key(|fix| fix.t_ns);
    fixes.dedup_by_key(|fix| fix.t_ns);
    fixes
}

/// What the sensor's clock shows less than the receiver's, ns: of the zeros that a clock may have, the first that is right.
pub(super) fn zero_ns(t_ns: i64, is_right: impl Fn(i64) -> bool) -> i64 {
    let leap_ns = LEAP_SECONDS * SECOND_NS;
    let zeros = if t_ns < SINCE_1970_NS {
        vec![0, leap_ns]
    } else {
        // GPS time since 1970, since the week's start, since midnight; the same in UTC.
        let week_ns = (t_ns - WEEK_BEGINS_NS).div_euclid(WEEK_NS) * WEEK_NS + WEEK_BEGINS_NS;
        let utc_ns = t_ns - leap_ns;
        let day_ns = |t_ns: i64| t_ns.div_euclid(DAY_NS) * DAY_NS;
        vec![0, week_ns, day_ns(t_ns), leap_ns, day_ns(utc_ns) + leap_ns]
    };
    zeros.iter().copied().find(|zero| is_right(*zero)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_zero_of_a_clock_is_the_one_at_which_both_run_together() {
        // Monday 2026-11-30, 08:00:00 in GPS time.
        let t_ns = 1_796_025_600 * SECOND_NS;
        let of_week_ns = DAY_NS + 8 * 3600 * SECOND_NS;
        let of_day_ns = 8 * 3600 * SECOND_NS;
        for seen_ns in [t_ns, of_week_ns, of_day_ns, t_ns - 18 * SECOND_NS, of_day_ns - 18 * SECOND_NS] {
            let zero = zero_ns(t_ns, |zero| (t_ns - zero - seen_ns).abs() < SECOND_NS);
            assert_eq!(t_ns - zero, seen_ns);
        }
        assert_eq!(zero_ns(5 * SECOND_NS, |_| false), 0);
    }
}
