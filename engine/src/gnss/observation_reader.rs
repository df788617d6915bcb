//! RINEX observation files of versions 2.10 to 4, bytes to epochs.
//!
//! What other programs stumble over is read: columns that are no observation (`X1`), blank or missing fields at the end of a
//! line, events between epochs and header lines within them, scale factors, BeiDou's B1I as `1I` or `2I`, BeiDou time, carriage
//! returns. An epoch that is cut off at the end of the file is dropped, with a note.

use super::fixed_columns::{Lines, columns, number, of_century, whole};
use super::observation_header::{Columns, Header, Kind};
use super::observations::{Epoch, Observations, Signal, Tracked};
use super::rinex_error::RinexError;
use super::satellite::Satellite;
use super::time::GpsTime;

/// How an epoch ended.
pub(super) enum Read {
    /// With a whole epoch, or an event that holds none.
    Whole(Option<Epoch>),
    /// The file ended within it.
    CutOff,
    /// With a line that cannot be one of an epoch.
    Damaged(String),
}

/// Reads a file of observations.
///
/// # Errors
///
/// What is no RINEX observation file, a line that cannot be one of an epoch, and a file that holds no epoch.
pub fn read(bytes: &[u8]) -> Result<Observations, RinexError> {
    let mut lines = Lines::new(bytes);
    let mut header = Header::read(&mut lines)?;
    let mut found = Observations {
        approximate_position_m: header.approximate_position_m,
        antenna_delta_hen_m: header.antenna_delta_hen_m,
        ..Observations::default()
    };
    let mut out_of_order = 0;
    let mut damaged = Vec::new();
    let mut power_failure = false;
    while let Some(line) = lines.next() {
        if line.trim_ascii().is_empty() {
            continue;
        }
        let read = if header.version < 300 {
            super::observation_reader_2::epoch(line, &mut lines, &mut header)?
        } else {
            super::observation_reader_3::epoch(line, &mut lines, &mut header)
        };
        match read {
            Read::Whole(None) => {}
            Read::Whole(Some(mut epoch)) => {
                if found.epochs.last().is_some_and(|last| epoch.time <= last.time) {
                    out_of_order += 1;
                    power_failure |= epoch.power_failure;
                    continue;
                }
                epoch.power_failure |= std::mem::take(&mut power_failure);
                found.epochs.push(epoch);
            }
            Read::Damaged(note) => damaged.push(note),
            Read::CutOff => {
                found.notes.push(format!(
                    "line {}: the file ends within an epoch, which is dropped",
                    lines.number()
                ));
            }
        }
    }
    // A file that is damaged all over would fill a page.
    if damaged.len() > 5 {
        let more = damaged.len() - 5;
        damaged.truncate(5);
        damaged.push(format!("{more} more epochs are damaged"));
    }
    found.notes.append(&mut damaged);
    if out_of_order > 0 {
        found
            .notes
            .push(format!("{out_of_order} epochs are not later than the one before them, and are dropped"));
    }
    if found.epochs.is_empty() {
        let advice =
            "the file holds no observation epochs; record again, or convert the receiver's log again";
        return Err(RinexError::new(lines.number().max(1), "an observation epoch", b"", advice));
    }
    Ok(found)
}

/// Year, month, day, hour, minute and second at these columns; none where one of them is no number or out of its range.
pub(super) fn time(line: &[u8], starts: [(usize, usize); 6], header: &Header) -> Option<GpsTime> {
    let mut parts = [0_i16; 5];
    for (part, (start, width)) in parts.iter_mut().zip(starts) {
        *part = whole(columns(line, start, width))?;
    }
    let second = number(columns(line, starts[5].0, starts[5].1))?;
    parts[0] = of_century(parts[0]);
    GpsTime::from_date(parts, second, header.to_gps_time_s)
}

/// Whether a line that ends the file without a line's end was cut within a number.
pub(super) fn is_cut(line: &[u8], start: usize) -> bool {
    let written = line.len().saturating_sub(start);
    let field = columns(line, start + written / 16 * 16, 14);
    let field = field.trim_ascii();
    !field.is_empty() && (field.len() < 5 || field[field.len() - 4] != b'.')
}

/// Gathers the fields of one satellite.
pub(super) struct Gather {
    signals: Vec<Signal>,
}

impl Gather {
    pub(super) fn new(columns: &Columns) -> Gather {
        let signals = columns.signals.iter().map(|&(band, attribute)| Signal {
            band,
            attribute,
            code_m: 0.0,
            phase_cycles: 0.0,
            strength_db_hz: 0.0,
            lost_lock: false,
            half_cycle: false,
        });
        Gather { signals: signals.collect() }
    }

    /// Takes a field of 14 columns with its two flags behind.
    pub(super) fn take(&mut self, field: &[u8], column: usize, of: &Columns) {
        let Some(column) = of.columns.get(column) else { return };
        if column.kind == Kind::Other {
            return;
        }
        let signal = &mut self.signals[column.signal];
        let value = number(columns(field, 0, 14)).unwrap_or(0.0) / column.scale;
        match column.kind {
            Kind::Code => signal.code_m = value,
            Kind::Strength => signal.strength_db_hz = value as f32,
            Kind::Phase => {
                signal.phase_cycles = value;
                let flags = columns(field, 14, 1).first().map_or(0, |flag| flag.wrapping_sub(b'0'));
                if flags < 8 {
                    signal.lost_lock = flags & 1 != 0;
                    signal.half_cycle = flags & 2 != 0;
                }
            }
            Kind::Other => {}
        }
    }

    /// Hands over to the epoch what was observed of a satellite.
    pub(super) fn finish(&mut self, satellite: Satellite, header: &Header, epoch: &mut Epoch) {
        let first = epoch.signals.len();
        if epoch.satellites.iter().any(|known| known.satellite == satellite) {
            return;
        }
        for signal in &mut self.signals {
            // No satellite is nearer than 15,000 km or farther than 60,000 km, and no clock is off by so much.
            if !(1.0e6..1.0e9).contains(&signal.code_m.abs()) {
                signal.code_m = 0.0;
            }
            if header.second_band_half_cycles && signal.band == 2 {
                signal.half_cycle = true;
            }
            if signal.code_m != 0.0 || signal.phase_cycles != 0.0 {
                epoch.signals.push(*signal);
            }
            *signal = Signal {
                code_m: 0.0,
                phase_cycles: 0.0,
                strength_db_hz: 0.0,
                lost_lock: false,
                half_cycle: false,
                ..*signal
            };
        }
        if epoch.signals.len() > first {
            epoch.satellites.push(Tracked {
                satellite,
                first: first as u32,
                end: epoch.signals.len() as u32,
            });
        }
    }
}
