//! The files of a survey: samples, positions, switch and stops.

use std::path::Path;

use anyhow::Result;
use indicatif::ProgressBar;
use lodestep_engine::parse::gnss::{self, GnssClock, GnssRow, LEAP_SECONDS};
use lodestep_engine::parse::{ReadOptions, stops_csv, switch_csv};
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pole::recorder::Recorder;
use lodestep_engine::systems::pole::recording::Stop;

use crate::cli::failure::Failure;
use crate::cli::log_file::{LogFile, read_small};
use crate::sessions::merge_by_time::StreamReadings as _;

/// The samples of the sensor.
pub(super) fn samples(path: &Path, recorder: &mut Recorder) -> Result<()> {
    let mut log = LogFile::open_as(path, ReadOptions::default(), &ProgressBar::hidden())?;
    loop {
        let Readings::Imu(piece) = log.next_piece()? else {
            return Err(Failure::bad_input(
                path,
                "expected samples of an inertial sensor, found rows of numbers",
            ));
        };
        if piece.is_empty() {
            return Ok(());
        }
        for sample in &piece {
            recorder.sample(sample);
        }
    }
}

/// The positions, in any form that receivers and programs write.
pub(super) fn positions(path: &Path, recorder: &mut Recorder) -> Result<()> {
    let file = gnss::read(&read_small(path)?).map_err(|error| Failure::bad_input(path, error))?;
    // Times of day in UTC become such in GPS time, as all others are.
    let ahead_ns = if file.clock == GnssClock::MidnightUtc { LEAP_SECONDS * 1_000_000_000 } else { 0 };
    for row in file.rows {
        recorder.position(GnssRow { t_ns: row.t_ns + ahead_ns, ..row });
    }
    Ok(())
}

/// The changes of the switch.
pub(super) fn switch(path: &Path, recorder: &mut Recorder) -> Result<()> {
    let rows = switch_csv::read(&read_small(path)?).map_err(|error| Failure::bad_input(path, error))?;
    rows.into_iter().for_each(|(t_ns, closed)| recorder.contact(t_ns, closed));
    Ok(())
}

/// A stop with what passes through.
#[derive(Debug)]
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
