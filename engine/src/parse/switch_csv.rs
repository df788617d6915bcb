//! A switch's changes as CSV: `t_s,contact`, a row at each change.

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::number::need_time_ns;
use crate::parse::table;

const COLUMNS: [&str; 2] = ["t_s", "contact"];

/// Reads a file of changes: time, ns, and whether it is closed from then on.
///
/// # Errors
///
/// At the first thing that is wrong, a time before the one above it included.
pub fn read(bytes: &[u8]) -> Result<Vec<(i64, bool)>, ParseError> {
    let mut last_ns = i64::MIN;
    table::read(
        bytes,
        &COLUMNS.join(","),
        |header| Ok([header.need(COLUMNS[0], &COLUMNS)?, header.need(COLUMNS[1], &COLUMNS)?]),
        |places, record| {
            let t_ns = need_time_ns(record, places[0], COLUMNS[0])?;
            if t_ns < last_ns {
                return Err(ParseError::new(
                    ParseErrorKind::BadTime,
                    "times in order",
                    format!("{} s after {} s", t_ns as f64 * 1e-9, last_ns as f64 * 1e-9),
                    "sort the rows by time",
                )
                .at_line(record.line)
                .in_column(COLUMNS[0]));
            }
            last_ns = t_ns;
            let closed = match record.field(places[1]).trim_ascii() {
                b"1" => true,
                b"0" => false,
                other => {
                    return Err(ParseError::new(
                        ParseErrorKind::OutOfRange,
                        "1 (closed: the tip touches) or 0",
                        quoted(other),
                        "write 1 or 0",
                    )
                    .at_line(record.line)
                    .in_column(COLUMNS[1]));
                }
            };
            Ok((t_ns, closed))
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_read_and_what_is_wrong_is_named() {
        let rows = read(b"t_s,contact\n0.000,1\n65.997,0\n").unwrap();
        assert_eq!(rows, [(0, true), (65_997_000_000, false)]);
        for (wrong, column) in [("0.0,yes\n", "contact"), ("5.0,1\n4.0,0\n", "t_s")] {
            let error = read(format!("t_s,contact\n{wrong}").as_bytes()).unwrap_err();
            assert_eq!(error.column.as_deref(), Some(column), "{error}");
        }
    }
}
