//! Observations of a satellite receiver as a stream of numbers: a row is one signal of one satellite at one time tag.
//!
//! A log is RINEX, read whole; what comes live has the same rows. A week and its second stand in each row, so that a row says
//! its time whatever the session counts from.

use crate::gnss::observation_reader;
use crate::gnss::observations::{Epoch, Observations, Signal, Tracked};
use crate::gnss::satellite::{Constellation, Satellite};
use crate::gnss::time::GpsTime;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::stream::Rows;
use crate::system::Column;

/// The columns of such a stream. A system that declares these reads its logs as RINEX.
pub const COLUMNS: &[Column] = &[
    column("week", "GPS week of the time tag, counted on without rolling over."),
    column("tow_s", "Second of that week by the receiver's clock, s."),
    column("left", "How many rows of this time tag are still to come; 0 in its last."),
    column(
        "satellite",
        "100, 200, 300 or 400 for GPS, BeiDou, Galileo or QZSS, and the number; 0 where none is seen.",
    ),
    column("band", "The band, as RINEX 3 numbers it."),
    column("attribute", "The way of tracking: the ASCII number of RINEX 3's letter."),
    column("code_m", "Pseudorange, m; 0 where there is none."),
    column("phase_cycles", "Carrier phase, cycles; 0 where there is none."),
    column("strength_db_hz", "Signal strength, dB·Hz; 0 where it is not known."),
    column(
        "flags",
        "1: lock was lost since the time tag before, 2: half a cycle is in doubt, 4: the receiver had no power; their sum.",
    ),
    column("x_m", "The station's marker by its own account, Earth-centred, m; empty where it says none."),
    column("y_m", "Likewise."),
    column("z_m", "Likewise."),
    column("antenna_up_m", "The antenna above its marker, m."),
    column("antenna_east_m", "East of it, m."),
    column("antenna_north_m", "North of it, m."),
];

const fn column(name: &'static str, about: &'static str) -> Column {
    Column { name, required: false, about }
}

const LOST_LOCK: u8 = 1;
const HALF_CYCLE: u8 = 2;
const POWER_FAILURE: u8 = 4;

/// Where a station says that it is: its marker, Earth-centred, m, and the antenna above, east and north of it, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Station {
    /// The marker.
    pub position_m: Option<[f64; 3]>,
    /// The antenna.
    pub antenna_delta_hen_m: [f64; 3],
}

/// Whether these are the columns of such a stream.
pub(super) fn are_of(columns: &[Column]) -> bool {
    columns.iter().map(|column| column.name).eq(COLUMNS.iter().map(|column| column.name))
}

/// A satellite as a number.
pub(super) fn number_of(satellite: Satellite) -> f64 {
    (100 * (satellite.constellation.index() + 1) + usize::from(satellite.number)) as f64
}

/// The satellite of a number; none where it is that of none.
pub(super) fn satellite_of(number: f64) -> Option<Satellite> {
    if !(100.0..500.0).contains(&number) {
        return None;
    }
    let number = number as usize;
    let constellation = *Constellation::ALL.get(number / 100 - 1)?;
    let number = u8::try_from(number % 100).ok().filter(|number| *number > 0)?;
    Some(Satellite { constellation, number })
}

/// Reads a whole log: its rows, and what was passed over, a sentence each.
///
/// # Errors
///
/// What is no such RINEX file, or holds no time tag.
pub fn read(bytes: &[u8]) -> Result<(Rows, Vec<String>), ParseError> {
    let file = observation_reader::read(bytes).map_err(|error| {
        let what = match error.line {
            0 | 1 if bytes.trim_ascii().is_empty() => ParseErrorKind::EmptyFile,
            _ => ParseErrorKind::UnknownFormat,
        };
        ParseError::new(what, error.expected, error.found, error.advice).at_line(error.line as u64)
    })?;
    Ok((rows_of(&file), file.notes))
}

/// The rows of a file of observations; times count from the week of its first time tag.
pub fn rows_of(file: &Observations) -> Rows {
    let mut rows = Rows::new(COLUMNS.len());
    let Some(first) = file.epochs.first() else { return rows };
    let station =
        Station { position_m: file.approximate_position_m, antenna_delta_hen_m: file.antenna_delta_hen_m };
    let zero = GpsTime::from_week(first.time.week(), 0.0);
    for epoch in &file.epochs {
        push(epoch, &station, zero, &mut rows);
    }
    rows
}

/// Appends the rows of one time tag, with times that count from `zero`.
pub fn push(epoch: &Epoch, station: &Station, zero: GpsTime, rows: &mut Rows) {
    let t_ns = epoch.time.ns - zero.ns;
    let power = u8::from(epoch.power_failure) * POWER_FAILURE;
    let mut left = epoch.signals.len();
    let mut row = |left: usize, satellite: f64, signal: Option<&Signal>| {
        let [x, y, z] = station.position_m.unwrap_or([f64::NAN; 3]);
        let [up, east, north] = station.antenna_delta_hen_m;
        let flags = signal.map_or(0, |signal| {
            u8::from(signal.lost_lock) * LOST_LOCK + u8::from(signal.half_cycle) * HALF_CYCLE
        });
        let of = |value: fn(&Signal) -> f64| signal.map_or(0.0, value);
        let values = [
            f64::from(epoch.time.week()),
            epoch.time.tow_s(),
            left as f64,
            satellite,
            of(|signal| f64::from(signal.band)),
            of(|signal| f64::from(signal.attribute)),
            of(|signal| signal.code_m),
            of(|signal| signal.phase_cycles),
            of(|signal| f64::from(signal.strength_db_hz)),
            f64::from(flags + power),
            x,
            y,
            z,
            up,
            east,
            north,
        ];
        rows.push(t_ns, values);
    };
    for tracked in &epoch.satellites {
        for signal in epoch.signals_of(tracked) {
            left -= 1;
            row(left, number_of(tracked.satellite), Some(signal));
        }
    }
    if epoch.signals.is_empty() {
        row(0, 0.0, None);
    }
}

/// Makes epochs of rows again.
#[derive(Clone, Debug, Default)]
pub struct EpochReader {
    under_way: Option<Epoch>,
    /// Where the station says that it is, by its newest row.
    pub station: Station,
}

impl EpochReader {
    /// Takes a row; gives the epochs that it completes. What is no row of such a stream is left out.
    pub fn take(&mut self, values: &[f64]) -> [Option<Epoch>; 2] {
        let &[
            week,
            tow_s,
            left,
            satellite,
            band,
            attribute,
            code_m,
            phase,
            strength,
            flags,
            x,
            y,
            z,
            up,
            east,
            north,
        ] = values
        else {
            return [None, None];
        };
        let numbers = [left, satellite, band, attribute, code_m, phase, strength, flags];
        let time = GpsTime::from_row(week, tow_s).filter(|_| numbers.iter().all(|number| number.is_finite()));
        let Some(time) = time else { return [None, None] };
        if [x, y, z].iter().all(|part| part.is_finite()) {
            let delta = [up, east, north].map(|part| if part.is_finite() { part } else { 0.0 });
            self.station = Station { position_m: Some([x, y, z]), antenna_delta_hen_m: delta };
        }
        let cut_off = self.under_way.take_if(|epoch| epoch.time != time);
        let epoch = self.under_way.get_or_insert_with(|| Epoch { time, ..Epoch::default() });
        let flags = flags as u8;
        epoch.power_failure |= flags & POWER_FAILURE != 0;
        if let Some(satellite) = satellite_of(satellite) {
            let end = epoch.signals.len() as u32;
            match epoch.satellites.last_mut() {
                Some(last) if last.satellite == satellite => last.end = end + 1,
                _ => epoch.satellites.push(Tracked { satellite, first: end, end: end + 1 }),
            }
            epoch.signals.push(Signal {
                band: band as u8,
                attribute: attribute as u8,
                code_m,
                phase_cycles: phase,
                strength_db_hz: strength as f32,
                lost_lock: flags & LOST_LOCK != 0,
                half_cycle: flags & HALF_CYCLE != 0,
            });
        }
        [cut_off, self.under_way.take_if(|_| left == 0.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn epoch(tow_s: f64, numbers: &[u8]) -> Epoch {
        let mut epoch = Epoch { time: GpsTime::from_week(2340, tow_s), ..Epoch::default() };
        for number in numbers {
            let satellite = Satellite { constellation: Constellation::Beidou, number: *number };
            let first = epoch.signals.len() as u32;
            for band in [2, 7] {
                epoch.signals.push(Signal {
                    band,
                    attribute: b'I',
                    code_m: 2.1e7 + f64::from(*number) / 3.0,
                    phase_cycles: 1.1e8 / 3.0,
                    strength_db_hz: 41.3,
                    lost_lock: band == 2,
                    half_cycle: band == 7,
                });
            }
            epoch.satellites.push(Tracked { satellite, first, end: first + 2 });
        }
        epoch
    }

    #[test]
    fn epochs_come_back_from_their_rows_to_the_last_bit_over_the_end_of_a_week() {
        let epochs = vec![
            epoch(604_799.9, &[5, 12]),
            epoch(604_800.0, &[]),
            Epoch { power_failure: true, ..epoch(604_800.123_456_789, &[60]) },
        ];
        let file = Observations {
            approximate_position_m: Some([1.25, -2.5, 3.0]),
            antenna_delta_hen_m: [1.5, 0.1, -0.2],
            epochs,
            notes: Vec::new(),
        };
        let rows = rows_of(&file);
        assert_eq!(rows.len(), 7);
        assert_eq!(rows.get(6).unwrap().0, 604_800_123_456_789);
        let mut reader = EpochReader::default();
        let mut back = Vec::new();
        for (_, values) in rows.iter() {
            back.extend(reader.take(values).into_iter().flatten());
        }
        assert_eq!(back, file.epochs);
        assert_eq!(reader.station.position_m, file.approximate_position_m);
        assert_eq!(reader.station.antenna_delta_hen_m, file.antenna_delta_hen_m);
    }

    #[test]
    fn an_epoch_whose_end_never_came_is_told_with_the_next_and_nonsense_is_left_out() {
        let mut rows = Rows::new(COLUMNS.len());
        let zero = GpsTime::from_week(2340, 0.0);
        push(&epoch(10.0, &[5, 6]), &Station::default(), zero, &mut rows);
        push(&epoch(11.0, &[5]), &Station::default(), zero, &mut rows);
        let mut reader = EpochReader::default();
        let taken: Vec<_> = [0, 4, 5].map(|k| reader.take(rows.get(k).unwrap().1)).into_iter().collect();
        assert_eq!(taken[0], [None, None]);
        assert_eq!(taken[1][0].as_ref().unwrap().signals.len(), 1);
        assert_eq!(taken[2][1].as_ref().unwrap().satellites.len(), 1);
        assert_eq!(reader.take(&[f64::NAN; 16]), [None, None]);
        assert_eq!(reader.take(&[1.0; 3]), [None, None]);
        assert_eq!(satellite_of(99.0), None);
        assert_eq!(satellite_of(100.0), None);
    }
}
