//! An epoch of RINEX 2: satellites listed at its head, their fields five to a line.

use super::fixed_columns::{Lines, columns, whole};
use super::observation_header::Header;
use super::observation_reader::{Gather, Read, is_cut, time};
use super::observations::Epoch;
use super::rinex_error::RinexError;
use super::satellite::{Constellation, Satellite};

/// Satellites on a line of the head.
const ON_A_LINE: usize = 12;
/// Fields on a line of a satellite.
const FIELDS: usize = 5;

/// Reads the epoch that begins with `line`.
pub(super) fn epoch(line: &[u8], lines: &mut Lines<'_>, header: &mut Header) -> Result<Read, RinexError> {
    let wrong = |number: usize, expected: &str| {
        RinexError::new(number, expected, line, "the file is damaged here; convert the receiver's log again")
    };
    let head_line = lines.number();
    let flag = columns(line, 28, 1).first().copied().unwrap_or(b'0');
    let Some(count) = whole(columns(line, 29, 3)).filter(|count| *count >= 0) else {
        return if lines.is_at_end() {
            Ok(Read::CutOff)
        } else {
            Err(wrong(head_line, "the number of satellites in columns 30 to 32"))
        };
    };
    let count = count as usize;
    if matches!(flag, b'2'..=b'5') {
        for _ in 0..count {
            match lines.next() {
                Some(record) => header.take(record),
                None => return Ok(Read::CutOff),
            }
        }
        return Ok(Read::Whole(None));
    }
    let starts = [(1, 2), (4, 2), (7, 2), (10, 2), (13, 2), (15, 11)];
    let Some(time) = time(line, starts, header) else {
        return if lines.is_at_end() {
            Ok(Read::CutOff)
        } else {
            Err(wrong(head_line, "date and time in columns 2 to 26"))
        };
    };
    let mut satellites = Vec::with_capacity(count);
    let mut head = line;
    for k in 0..count {
        if k > 0 && k % ON_A_LINE == 0 {
            match lines.next() {
                Some(next) => head = next,
                None => return Ok(Read::CutOff),
            }
        }
        let name = columns(head, 32 + 3 * (k % ON_A_LINE), 3);
        let default = if header.system == b'M' { b'G' } else { header.system };
        satellites.push(Satellite::read(name, default));
    }
    let mut epoch = Epoch { time, power_failure: flag == b'1', ..Epoch::default() };
    let mut gather = Constellation::ALL.map(|system| Gather::new(&header.columns[system.index()]));
    let lines_each = header.column_count_2.div_ceil(FIELDS);
    for satellite in satellites {
        for row in 0..lines_each {
            let Some(line) = lines.next() else { return Ok(Read::CutOff) };
            if lines.is_at_end() && is_cut(line, 0) {
                return Ok(Read::CutOff);
            }
            let Some(satellite) = satellite else { continue };
            let system = satellite.constellation.index();
            for (k, field) in line.chunks(16).take(FIELDS).enumerate() {
                gather[system].take(field, row * FIELDS + k, &header.columns[system]);
            }
        }
        if let Some(satellite) = satellite {
            gather[satellite.constellation.index()].finish(satellite, header, &mut epoch);
        }
    }
    // 6 lists slips in the place of observations.
    Ok(Read::Whole((flag != b'6').then_some(epoch)))
}
