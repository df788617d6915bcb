//! UWB ranges as CSV: `t_s,anchor,range_m`, further columns ignored.

use std::collections::HashMap;

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::markers_csv::decode;
use crate::parse::number::{bad_number, need_time_ns, number};
use crate::parse::table;
use crate::sample::{TagRange, TagRanges};

const COLUMNS: [&str; 3] = ["t_s", "anchor", "range_m"];
/// No UWB radio is heard this far, m.
const FARTHEST_M: f64 = 2_000.0;

/// Reads a file of ranges.
///
/// An empty range is a range that failed: it is kept as NaN. A last line that is cut off is left out and noted; rows
/// that are not in order of time are sorted and noted.
///
/// # Errors
///
/// At the first thing that is wrong, ranges in millimetres or centimetres and a table without a row included.
pub fn read(bytes: &[u8]) -> Result<TagRanges, ParseError> {
    let text = decode(bytes)?;
    let mut ranges = TagRanges::default();
    let text = match cut_off(&text, &mut ranges.notes) {
        Some(whole) => whole,
        None => &text,
    };
    let mut index: HashMap<String, usize> = HashMap::new();
    let anchors = &mut ranges.anchors;
    let mut rows = table::read(
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
            let t_ns = need_time_ns(record, places[0], COLUMNS[0])?;
            let name = table::name(record, places[1], COLUMNS[1])?;
            let field = record.field(places[2]);
            let range_m = match number(field) {
                Some(value) => value,
                None if field.trim_ascii().is_empty() => f64::NAN,
                None => return Err(bad_number(record, places[2], COLUMNS[2])),
            };
            let anchor = *index.entry(name).or_insert_with_key(|name| {
                anchors.push(name.clone());
                anchors.len() - 1
            });
            Ok(TagRange { t_ns, anchor, range_m })
        },
    )?;
    if rows.is_empty() {
        return Err(ParseError::new(
            ParseErrorKind::EmptyFile,
            "one row for each range",
            "a header without a row",
            "check that the recorder was running and that this is the file you meant",
        ));
    }
    check_unit(&rows)?;
    let backwards = rows.windows(2).filter(|pair| pair[1].t_ns < pair[0].t_ns).count();
    if backwards > 0 {
        rows.sort_by_key(|row| row.t_ns);
        ranges.notes.push(format!("times went back {backwards} times; the ranges were sorted by time"));
    }
    ranges.rows = rows;
    Ok(ranges)
}

/// The text without its last line, where the recorder was cut off while it wrote that line.
fn cut_off<'a>(text: &'a str, notes: &mut Vec<String>) -> Option<&'a str> {
    if text.ends_with(['\n', '\r']) {
        return None;
    }
    let at = text.rfind('\n')? + 1;
    let commas = |line: &str| line.matches(',').count();
    let header = text.lines().next().unwrap_or_default();
    let last = &text[at..];
    // A last line that is only short of its line feed has all its fields.
    if commas(last) >= commas(header) && !last.ends_with([',', '.', '-']) {
        return None;
    }
    notes.push(format!("the last line, {}, is cut off and was left out", quoted(last.as_bytes())));
    Some(&text[..at])
}

/// Refuses ranges that are not in metres.
fn check_unit(rows: &[TagRange]) -> Result<(), ParseError> {
    let mut lengths: Vec<f64> = rows.iter().map(|row| row.range_m).filter(|r| *r > 0.0).collect();
    if lengths.is_empty() {
        return Err(ParseError::new(
            ParseErrorKind::OutOfRange,
            "ranges in metres",
            "no range above zero",
            "check the recorder: every range failed",
        )
        .in_column(COLUMNS[2]));
    }
    lengths.sort_by(f64::total_cmp);
    let median = lengths[lengths.len() / 2];
    if median <= FARTHEST_M {
        return Ok(());
    }
    Err(ParseError::new(
        ParseErrorKind::OutOfRange,
        format!("ranges in metres, at most {FARTHEST_M}"),
        format!("a median of {median:.0}, as if they were in millimetres"),
        "divide the column by 1000, or export the ranges in metres",
    )
    .in_column(COLUMNS[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_with_further_columns_and_sorted_by_time() {
        let text = "anchor,rssi,t_s,range_m\nB,-80,2.5,7.25\nA,-81,1,3\nB,-80,2.5,\n";
        let ranges = read(text.as_bytes()).unwrap();
        assert_eq!(ranges.anchors, ["B", "A"]);
        assert_eq!(ranges.rows[0], TagRange { t_ns: 1_000_000_000, anchor: 1, range_m: 3.0 });
        assert_eq!(ranges.rows[1].range_m, 7.25);
        assert!(ranges.rows[2].range_m.is_nan());
        assert_eq!(ranges.notes.len(), 1);
    }

    #[test]
    fn a_line_that_was_cut_off_is_left_out_and_noted() {
        let whole = "t_s,anchor,range_m\n1,A,3.5\n2,A,3.6";
        assert_eq!(read(whole.as_bytes()).unwrap().rows.len(), 2);
        for cut in ["\n3,A", "\n3,A,", "\n3,", "\n3"] {
            let ranges = read(format!("{whole}{cut}").as_bytes()).unwrap();
            assert_eq!(ranges.rows.len(), 2, "{cut:?}");
            assert!(ranges.notes[0].contains("cut off"), "{:?}", ranges.notes);
        }
    }

    #[test]
    fn ranges_in_millimetres_words_and_other_tables_are_refused() {
        let mm: String = (0..5)
            .fold("t_s,anchor,range_m\n".to_owned(), |text, k| text + &format!("{k},A,{}\n", 34_470 + k));
        let error = read(mm.as_bytes()).unwrap_err();
        assert!(error.to_string().contains("millimetres"), "{error}");
        let error = read(b"t_s,anchor,range_m\n1,A,far\n").unwrap_err();
        assert_eq!((error.line, error.kind), (Some(2), ParseErrorKind::NotANumber));
        let error = read(b"t_s,anchor,distance\n1,A,3\n").unwrap_err();
        assert_eq!(error.kind, ParseErrorKind::MissingColumn);
        assert_eq!(read(b"t_s,anchor,range_m\n").unwrap_err().kind, ParseErrorKind::EmptyFile);
        let error = read(b"t_s,anchor,range_m\n1,A,-3\n").unwrap_err();
        assert!(error.to_string().contains("no range above zero"), "{error}");
    }
}
