//! An epoch of RINEX 3 and 4: a line of its own for each satellite.

use super::fixed_columns::{Lines, columns, whole};
use super::observation_header::Header;
use super::observation_reader::{Gather, Read, is_cut, time};
use super::observations::Epoch;
use super::satellite::{Constellation, Satellite};

/// Reads the epoch that begins with `line`.
pub(super) fn epoch(line: &[u8], lines: &mut Lines<'_>, header: &mut Header) -> Read {
    let number_of_line = lines.number();
    let wrong = |expected: &str| {
        let found = String::from_utf8_lossy(columns(line, 0, 40)).into_owned();
        Read::Damaged(format!(
            "line {number_of_line}: expected {expected}, found \"{found}\"; passed over up to the next epoch"
        ))
    };
    if line.first() != Some(&b'>') {
        while lines.peek().is_some_and(|line| line.first() != Some(&b'>')) {
            let _ = lines.next();
        }
        return wrong("\">\" at the beginning of an epoch");
    }
    let flag = columns(line, 31, 1).first().copied().unwrap_or(b'0');
    let event = !matches!(flag, b'0' | b'1' | b' ');
    let written = columns(line, 32, 3);
    let count = if event && written.trim_ascii().is_empty() { Some(0) } else { whole(written) };
    let Some(count) = count.filter(|count| *count >= 0) else {
        return if lines.is_at_end() {
            Read::CutOff
        } else {
            wrong("the number of satellites in columns 33 to 35")
        };
    };
    if event {
        // An event: lines of the header, or nothing; 6 is a list of slips, which the flags of the phases tell as well.
        for _ in 0..count {
            match lines.next() {
                Some(record) if flag != b'6' => header.take(record),
                Some(_) => {}
                None => return Read::CutOff,
            }
        }
        return Read::Whole(None);
    }
    let starts = [(2, 4), (6, 3), (9, 3), (12, 3), (15, 3), (18, 11)];
    let Some(time) = time(line, starts, header) else {
        return if lines.is_at_end() { Read::CutOff } else { wrong("date and time in columns 3 to 29") };
    };
    let mut epoch = Epoch { time, power_failure: flag == b'1', ..Epoch::default() };
    let mut gather = Constellation::ALL.map(|system| Gather::new(&header.columns[system.index()]));
    for _ in 0..count {
        // An epoch that is shorter than it says would swallow the next one.
        if lines.peek().is_none_or(|line| line.first() == Some(&b'>')) {
            return if lines.is_at_end() {
                Read::CutOff
            } else {
                Read::Damaged(format!(
                    "line {number_of_line}: the epoch has fewer satellites than it says; dropped"
                ))
            };
        }
        let Some(line) = lines.next() else { return Read::CutOff };
        if lines.is_at_end() && (line.len() < 3 || is_cut(line, 3)) {
            return Read::CutOff;
        }
        let Some(satellite) =
            columns(line, 0, 3).first().and_then(|_| Satellite::read(columns(line, 0, 3), header.system))
        else {
            continue;
        };
        let system = satellite.constellation.index();
        let of = &header.columns[system];
        for (k, field) in line.get(3..).unwrap_or_default().chunks(16).enumerate() {
            gather[system].take(field, k, of);
        }
        gather[system].finish(satellite, header, &mut epoch);
    }
    Read::Whole(Some(epoch))
}
