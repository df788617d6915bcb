//! The files of a survey: samples, positions, switch and stops.

use std::path::Path;

use anyhow::Result;
use indicatif::ProgressBar;
use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::gnss::{self, GnssClock, GnssFile, GnssQuality, LEAP_SECONDS};
use lodestep_engine::parse::{Reading, stops_csv, switch_csv};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pole::recording::{Fix, Quality, Stop};

use crate::cli::failure::Failure;
use crate::cli::log_file::{LogFile, read_small};
use crate::sessions::in_time_order::StreamReadings as _;

const SECOND_NS: i64 = 1_000_000_000;
const DAY_NS: i64 = 86_400 * SECOND_NS;
const WEEK_NS: i64 = 7 * DAY_NS;
/// The week of GPS time begins on a Sunday; 1970-01-01 was a Thursday.
const WEEK_BEGINS_NS: i64 = 3 * DAY_NS;
/// Sigmas of solutions that do not say them, plan and height, m.
const SIGMAS_M: [(GnssQuality, [f64; 2]); 3] = [
    (GnssQuality::Fixed, [0.012, 0.023]),
    (GnssQuality::Float, [0.5, 1.0]),
    (GnssQuality::Single, [3.0, 6.0]),
];

/// The samples of the sensor, in order of time.
pub(super) fn samples(path: &Path) -> Result<Vec<ImuSample>> {
    let mut log = LogFile::open_as(path, Reading::default(), &ProgressBar::hidden())?;
    let mut samples: Vec<ImuSample> = Vec::new();
    loop {
        let Readings::Imu(piece) = log.next_piece()? else {
            return Err(Failure::bad_input(
                path,
                "expected samples of an inertial sensor, found rows of numbers",
            ));
        };
        if piece.is_empty() {
            break;
        }
        samples.extend(piece);
    }
    // A sample that is no number, or comes twice, or late, is left out: the filter bridges it.
    let mut last_ns = i64::MIN;
    samples.retain(|sample| {
        let numbers = sample.w_ib_b_rad_s.iter().chain(&sample.f_b_m_s2).all(|x| x.is_finite());
        let later = sample.t_ns > last_ns;
        if numbers && later {
            last_ns = sample.t_ns;
        }
        numbers && later
    });
    Ok(samples)
}

/// The positions, on the clock of samples from `from_ns` to `to_ns`.
pub(super) fn fixes(path: &Path, frame: &LocalFrame, [from_ns, to_ns]: [i64; 2]) -> Result<Vec<Fix>> {
    let file = gnss::read(&read_small(path)?).map_err(|error| Failure::bad_input(path, error))?;
    let shift_ns = shift_ns(&file, [from_ns, to_ns]);
    let mut fixes: Vec<Fix> = file
        .rows
        .iter()
        .map(|row| {
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
        })
        .collect();
    fixes.sort_by_key(|fix| fix.t_ns);
    fixes.dedup_by_key(|fix| fix.t_ns);
    Ok(fixes)
}

/// What the sensor's clock shows less than the file's, ns: of the zeros that a clock may have, the first at which the two
/// run at the same time.
fn shift_ns(file: &GnssFile, [from_ns, to_ns]: [i64; 2]) -> i64 {
    let (Some(first), Some(last)) = (file.rows.first(), file.rows.last()) else { return 0 };
    let t_ns = first.t_ns;
    let leap_ns = LEAP_SECONDS * SECOND_NS;
    let zeros = match file.clock {
        GnssClock::Session => vec![0],
        // GPS time since 1970, since the week's start, since midnight; the same in UTC.
        GnssClock::Gps => {
            let week_ns = (t_ns - WEEK_BEGINS_NS).div_euclid(WEEK_NS) * WEEK_NS + WEEK_BEGINS_NS;
            let utc_ns = t_ns - leap_ns;
            vec![
                0,
                week_ns,
                t_ns.div_euclid(DAY_NS) * DAY_NS,
                leap_ns,
                utc_ns.div_euclid(DAY_NS) * DAY_NS + leap_ns,
            ]
        }
        GnssClock::MidnightUtc => vec![-leap_ns, 0],
    };
    let together = |zero: &i64| t_ns - zero <= to_ns && last.t_ns - zero >= from_ns;
    zeros.iter().copied().find(together).unwrap_or(zeros[0])
}

/// The changes of the switch.
pub(super) fn switch(path: &Path) -> Result<Vec<(i64, bool)>> {
    switch_csv::read(&read_small(path)?).map_err(|error| Failure::bad_input(path, error))
}

/// A stop with what passes through.
pub(super) struct StopWithCode {
    pub(super) stop: Stop,
    pub(super) code: String,
    pub(super) description: String,
}

/// When the tip was held on which point.
pub(super) fn stops(path: &Path) -> Result<Vec<StopWithCode>> {
    let rows = stops_csv::read(&read_small(path)?).map_err(|error| Failure::bad_input(path, error))?;
    Ok(rows
        .into_iter()
        .map(|row| StopWithCode {
            stop: Stop { name: row.name, t_start_ns: row.t_start_ns, t_end_ns: row.t_end_ns },
            code: row.code,
            description: row.description,
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lodestep_engine::geo::Geodetic;
    use lodestep_engine::parse::gnss::GnssRow;

    #[test]
    fn the_zero_of_a_clock_is_the_one_at_which_both_run_together() {
        let place = Geodetic { latitude_deg: 40.0, longitude_deg: 8.0, height_m: 100.0 };
        let row = |t_ns: i64| GnssRow { t_ns, place, sigma_n_m: None, quality: GnssQuality::Fixed };
        // Monday 2026-11-30, 08:00:00 in GPS time.
        let t_ns = 1_796_025_600 * SECOND_NS;
        let file = GnssFile { rows: vec![row(t_ns), row(t_ns + 60 * SECOND_NS)], clock: GnssClock::Gps };
        let of_week_ns = DAY_NS + 8 * 3600 * SECOND_NS;
        let of_day_ns = 8 * 3600 * SECOND_NS;
        for seen_ns in [t_ns, of_week_ns, of_day_ns, t_ns - 18 * SECOND_NS, of_day_ns - 18 * SECOND_NS] {
            // A stretch so short that no other zero will do.
            let shift_ns = shift_ns(&file, [seen_ns, seen_ns + SECOND_NS]);
            let shown_ns = t_ns - shift_ns;
            assert!((shown_ns - seen_ns).abs() <= 18 * SECOND_NS, "{seen_ns} {shown_ns}");
        }
        assert_eq!(shift_ns(&file, [5, 6]), 0);
    }
}
