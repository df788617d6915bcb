//! Visits as CSV: `t_start_s,t_end_s,marker`.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::markers_csv::decode;
use crate::parse::number::need_time_ns;
use crate::parse::table;

const COLUMNS: [&str; 3] = ["t_start_s", "t_end_s", "marker"];

/// An inspector stood at a marker, as the file tells it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VisitRow {
    /// When the inspector arrived, ns since the session's start.
    pub t_start_ns: i64,
    /// When the inspector left, ns since the session's start.
    pub t_end_ns: i64,
    /// The marker's name.
    pub marker: String,
}

/// Reads a file of visits; they come back in the order of the file.
///
/// # Errors
///
/// At the first thing that is wrong, an end before its start included.
pub fn read(bytes: &[u8]) -> Result<Vec<VisitRow>, ParseError> {
    let text = decode(bytes)?;
    table::read(
        text.as_bytes(),
        &COLUMNS.join(","),
        |header| {
            let mut places = [0; 3];
            for (place, column) in places.iter_mut().zip(COLUMNS) {
                *place = header.need(column, &COLUMNS)?;
            }
            Ok(places)
        },
        |places, record| {
            let t_start_ns = need_time_ns(record, places[0], COLUMNS[0])?;
            let t_end_ns = need_time_ns(record, places[1], COLUMNS[1])?;
            if t_end_ns < t_start_ns {
                return Err(ParseError::new(
                    ParseErrorKind::BadTime,
                    "an end that is not before its start",
                    format!("{} s after {} s", t_end_ns as f64 * 1e-9, t_start_ns as f64 * 1e-9),
                    "correct one of the two times",
                )
                .at_line(record.line)
                .in_column(COLUMNS[1]));
            }
            Ok(VisitRow { t_start_ns, t_end_ns, marker: table::name(record, places[2], COLUMNS[2])? })
        },
    )
}

/// Visits as CSV, which [`read`] takes back unchanged.
pub fn write<'a>(visits: impl IntoIterator<Item = &'a VisitRow>) -> String {
    let mut out = COLUMNS.join(",") + "\n";
    for visit in visits {
        crate::track::csv::push_seconds(visit.t_start_ns, &mut out);
        out.push(',');
        crate::track::csv::push_seconds(visit.t_end_ns, &mut out);
        out.push(',');
        table::push_name(&visit.marker, &mut out);
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visits_are_read_and_written() {
        let visits = read("marker,t_start_s,t_end_s\nA17,10.5,22\n\"B,1\",100,100\n".as_bytes()).unwrap();
        assert_eq!(
            visits[0],
            VisitRow { t_start_ns: 10_500_000_000, t_end_ns: 22_000_000_000, marker: "A17".into() }
        );
        assert_eq!(read(write(&visits).as_bytes()).unwrap(), visits);
        assert_eq!(read(b"t_start_s,t_end_s,marker\n").unwrap(), []);
    }

    #[test]
    fn an_end_before_its_start_is_refused() {
        let error = read(b"t_start_s,t_end_s,marker\n5,4,A\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 2, column t_end_s: expected an end that is not before its start, found 4 s after 5 s; \
             correct one of the two times"
        );
    }
}
