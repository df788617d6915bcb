//! When an instrument was held on which point, as CSV: `name,t_start_s,t_end_s`. What stands in other columns is kept.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::markers_csv::decode;
use crate::parse::number::need_time_ns;
use crate::parse::table;

const COLUMNS: [&str; 3] = ["name", "t_start_s", "t_end_s"];

/// A stop on a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StopRow {
    /// The point's name.
    pub name: String,
    /// Start, ns since the session's start.
    pub t_start_ns: i64,
    /// End, ns.
    pub t_end_ns: i64,
    /// Its code, where the file has one: it passes through.
    pub code: String,
    /// Its description, where the file has one.
    pub description: String,
}

/// Reads a file of stops; they come back in the order of the file, several of one point too.
///
/// # Errors
///
/// At the first thing that is wrong, an end that is not after its start included.
pub fn read(bytes: &[u8]) -> Result<Vec<StopRow>, ParseError> {
    let text = decode(bytes)?;
    table::read(
        text.as_bytes(),
        &COLUMNS.join(","),
        |header| {
            let mut places = [0; 3];
            for (place, column) in places.iter_mut().zip(COLUMNS) {
                *place = header.need(column, &COLUMNS)?;
            }
            Ok((places, [header.find("code"), header.find("description")]))
        },
        |(places, passed), record| {
            let t_start_ns = need_time_ns(record, places[1], COLUMNS[1])?;
            let t_end_ns = need_time_ns(record, places[2], COLUMNS[2])?;
            if t_end_ns <= t_start_ns {
                return Err(ParseError::new(
                    ParseErrorKind::BadTime,
                    "an end after its start",
                    format!("{} s after {} s", t_end_ns as f64 * 1e-9, t_start_ns as f64 * 1e-9),
                    "correct one of the two times",
                )
                .at_line(record.line)
                .in_column(COLUMNS[2]));
            }
            let [code, description] = passed.map(|place| {
                place.map_or_else(String::new, |place| {
                    String::from_utf8_lossy(record.field(place)).trim().to_owned()
                })
            });
            let name = table::name(record, places[0], COLUMNS[0])?;
            Ok(StopRow { name, t_start_ns, t_end_ns, code, description })
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_are_read_with_what_passes_through_and_an_end_before_its_start_is_named() {
        let rows = read(b"name,t_start_s,t_end_s,code\nT,111.968,118.925,BM\nT,300,310,\n").unwrap();
        assert_eq!((rows.len(), rows[0].code.as_str()), (2, "BM"));
        assert_eq!(rows[0].t_end_ns, 118_925_000_000);
        let error = read(b"name,t_start_s,t_end_s\nT,9,3\n").unwrap_err();
        assert_eq!((error.line, error.column.as_deref()), (Some(2), Some("t_end_s")));
    }
}
