//! Ranges of a UWB tag as a stream of numbers: a row is one range to one anchor. A log is CSV, `t_s,anchor,range_m`.
//!
//! Rows hold numbers alone, and anchors have names: a name's bytes stand in three numbers, six bytes each, which a double holds
//! whole.

use std::collections::HashMap;

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::ranges_csv;
use crate::sample::{TagRange, TagRanges};
use crate::stream::Rows;
use crate::system::Column;

/// The columns of such a stream. A system that declares these reads its logs as `t_s,anchor,range_m`.
pub const COLUMNS: &[Column] = &[
    column(
        "ranged_at_s",
        true,
        "Time of the range by the clock of the UWB computer, s: with satellites the second of the GPS week.",
    ),
    column(
        "anchor_1",
        true,
        "Bytes 1 to 6 of the anchor's name (UTF-8), the first the highest; 0 behind its end.",
    ),
    column("anchor_2", true, "Bytes 7 to 12."),
    column("anchor_3", true, "Bytes 13 to 18."),
    column("range_m", false, "Length of the range, m; empty where it failed."),
];

const fn column(name: &'static str, required: bool, about: &'static str) -> Column {
    Column { name, required, about }
}

const BYTES_A_NUMBER: usize = 6;
/// The longest name of an anchor, bytes.
const MOST_BYTES: usize = 3 * BYTES_A_NUMBER;

/// Whether these are the columns of such a stream.
pub(super) fn are_of(columns: &[Column]) -> bool {
    columns.iter().map(|column| column.name).eq(COLUMNS.iter().map(|column| column.name))
}

/// A name as three numbers; none of one that is empty or too long.
pub fn packed(name: &str) -> Option<[f64; 3]> {
    let bytes = name.as_bytes();
    if bytes.is_empty() || bytes.len() > MOST_BYTES || bytes.contains(&0) {
        return None;
    }
    Some(std::array::from_fn(|part| {
        let of_part = |k: usize| bytes.get(part * BYTES_A_NUMBER + k).copied().unwrap_or(0);
        (0..BYTES_A_NUMBER).fold(0_u64, |number, k| number << 8 | u64::from(of_part(k))) as f64
    }))
}

/// The name of three numbers; none where they are none.
pub fn unpacked(packed: [f64; 3]) -> Option<String> {
    let mut bytes = Vec::with_capacity(MOST_BYTES);
    for number in packed {
        if !(0.0..281_474_976_710_656.0).contains(&number) {
            return None;
        }
        bytes.extend_from_slice(&(number as u64).to_be_bytes()[8 - BYTES_A_NUMBER..]);
    }
    let end = bytes.iter().rposition(|byte| *byte != 0)? + 1;
    bytes.truncate(end);
    String::from_utf8(bytes).ok()
}

/// Reads a whole log: its rows, and what was put right, a sentence each.
///
/// # Errors
///
/// At the first thing that is wrong.
pub(super) fn read(bytes: &[u8]) -> Result<(Rows, Vec<String>), ParseError> {
    let ranges = ranges_csv::read(bytes)?;
    let names = ranges.anchors.iter().map(|name| {
        packed(name).ok_or_else(|| {
            ParseError::new(
                ParseErrorKind::TooLong,
                format!("names of anchors of at most {MOST_BYTES} bytes"),
                quoted(name.as_bytes()),
                "give the anchor a shorter name, in the ranges and in the survey",
            )
            .in_column("anchor")
        })
    });
    let names = names.collect::<Result<Vec<_>, _>>()?;
    let mut rows = Rows::new(COLUMNS.len());
    for row in &ranges.rows {
        rows.push(row.t_ns, values(row.t_ns, names[row.anchor], row.range_m));
    }
    Ok((rows, ranges.notes))
}

/// The numbers of a row.
pub fn values(t_ns: i64, [first, second, third]: [f64; 3], range_m: f64) -> [f64; 5] {
    [t_ns as f64 * 1e-9, first, second, third, range_m]
}

/// Makes ranges of rows again.
#[derive(Clone, Debug, Default)]
pub struct RangeReader {
    /// What came so far, in the order in which it came.
    pub ranges: TagRanges,
    known: HashMap<String, usize>,
}

impl RangeReader {
    /// Takes a row; what is no row of such a stream is left out. Says whether it was one.
    pub fn take(&mut self, values: &[f64]) -> bool {
        let &[t_s, first, second, third, range_m] = values else { return false };
        let Some(name) = unpacked([first, second, third]).filter(|_| t_s.abs() < 9e9) else { return false };
        let anchors = &mut self.ranges.anchors;
        let anchor = *self.known.entry(name).or_insert_with_key(|name| {
            anchors.push(name.clone());
            anchors.len() - 1
        });
        self.ranges.rows.push(TagRange { t_ns: libm::round(t_s * 1e9) as i64, anchor, range_m });
        true
    }

    /// All ranges in order of time, and a sentence where they were not.
    pub fn sorted(&self) -> TagRanges {
        let mut ranges = self.ranges.clone();
        ranges.rows.sort_by_key(|row| row.t_ns);
        ranges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_s_rows_give_its_ranges_again() {
        let text = "t_s,anchor,range_m\n116400.0501,A1,3.25\n116400.1003,门口锚点一号,7.5\n116400.1503,A1,\n";
        let (rows, notes) = read(text.as_bytes()).unwrap();
        assert!(notes.is_empty());
        let mut reader = RangeReader::default();
        assert!(rows.iter().all(|(_, values)| reader.take(values)));
        let (back, file) = (reader.sorted(), ranges_csv::read(text.as_bytes()).unwrap());
        assert_eq!((&back.anchors, back.rows.len()), (&file.anchors, 3));
        assert_eq!(back.rows[..2], file.rows[..2]);
        assert_eq!(back.rows[2].t_ns, file.rows[2].t_ns);
        assert!(back.rows[2].range_m.is_nan());
    }

    #[test]
    fn a_name_that_numbers_cannot_hold_is_refused_and_nonsense_left_out() {
        let error = read(b"t_s,anchor,range_m\n1,an-anchor-in-the-hall,3\n").unwrap_err();
        assert_eq!((error.kind, error.column.as_deref()), (ParseErrorKind::TooLong, Some("anchor")));
        assert_eq!(packed("a-name-of-18-bytes").and_then(unpacked).as_deref(), Some("a-name-of-18-bytes"));
        let mut reader = RangeReader::default();
        assert!(!reader.take(&[1.0, 0.0, 0.0, 0.0, 3.0]));
        assert!(!reader.take(&[1.0, -5.0, 0.0, 0.0, 3.0]));
        assert!(!reader.take(&[1.0; 4]));
    }
}
