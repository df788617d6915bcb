//! Surveyed UWB anchors as CSV: `anchor,e_m,n_m,u_m`.

use std::collections::HashMap;

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::markers_csv::decode;
use crate::parse::number::need_finite;
use crate::parse::table;
use crate::sample::SurveyedAnchor;

const COLUMNS: [&str; 4] = ["anchor", "e_m", "n_m", "u_m"];
/// Farther from the frame's origin than this, it is no frame to work in.
const FARTHEST_M: f64 = 100_000.0;
/// Two antennas do not hang in one place.
const NEAREST_M: f64 = 0.01;

/// Reads a file of anchors; they come back in the order of the file.
///
/// # Errors
///
/// At the first thing that is wrong: a name that is there twice, two anchors in one place, or a table without a row.
pub fn read(bytes: &[u8]) -> Result<Vec<SurveyedAnchor>, ParseError> {
    let text = decode(bytes)?;
    let mut seen: HashMap<String, u64> = HashMap::new();
    let mut places_seen: Vec<(String, [f64; 3])> = Vec::new();
    let rows = table::read(
        text.as_bytes(),
        &COLUMNS.join(","),
        |header| {
            let mut places = [0; 4];
            for (place, column) in places.iter_mut().zip(COLUMNS) {
                *place = header.need(column, &COLUMNS)?;
            }
            Ok(places)
        },
        |places, record| {
            let name = table::name(record, places[0], COLUMNS[0])?;
            let mut p_n = [0.0; 3];
            for ((value, place), column) in p_n.iter_mut().zip(&places[1..]).zip(&COLUMNS[1..]) {
                *value = need_finite(record, *place, column)?;
                if value.abs() > FARTHEST_M {
                    return Err(ParseError::new(
                        ParseErrorKind::OutOfRange,
                        format!("metres within {FARTHEST_M} of the frame's origin"),
                        quoted(record.field(*place)),
                        "give the anchors in a local frame in metres, not in millimetres or grid coordinates",
                    )
                    .at_line(record.line)
                    .in_column(*column));
                }
            }
            if let Some(first) = seen.insert(name.clone(), record.line) {
                return Err(ParseError::new(
                    ParseErrorKind::RepeatedName,
                    "every anchor once",
                    format!("{} in line {first} already", quoted(name.as_bytes())),
                    "remove or rename one of the two",
                )
                .at_line(record.line)
                .in_column(COLUMNS[0]));
            }
            let same = |other: &[f64; 3]| other.iter().zip(&p_n).all(|(a, b)| (a - b).abs() < NEAREST_M);
            if let Some((other, _)) = places_seen.iter().find(|(_, p)| same(p)) {
                return Err(ParseError::new(
                    ParseErrorKind::OutOfRange,
                    "every anchor in a place of its own",
                    format!("{} where {} is", quoted(name.as_bytes()), quoted(other.as_bytes())),
                    "correct the survey of one of the two",
                )
                .at_line(record.line));
            }
            places_seen.push((name.clone(), p_n));
            Ok(SurveyedAnchor { name, p_n })
        },
    )?;
    if rows.is_empty() {
        return Err(ParseError::new(
            ParseErrorKind::EmptyFile,
            "one row for each anchor",
            "a header without a row",
            "list the surveyed anchors with their coordinates",
        ));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_are_read_in_any_order_of_columns() {
        let anchors = read(b"u_m,anchor,n_m,e_m,who\n1.5,A1,-2,3,x\n0,7,4,5e0,y\n").unwrap();
        assert_eq!(anchors[0], SurveyedAnchor { name: "A1".into(), p_n: [3.0, -2.0, 1.5] });
        assert_eq!(anchors[1], SurveyedAnchor { name: "7".into(), p_n: [5.0, 4.0, 0.0] });
    }

    #[test]
    fn what_cannot_be_an_anchor_is_refused_with_its_line() {
        for (text, word, line) in [
            ("anchor,e_m,n_m\nA,1,2\n", "u_m", 1),
            ("anchor,e_m,n_m,u_m\nA,1,2,3\nA,4,5,6\n", "line 2 already", 3),
            ("anchor,e_m,n_m,u_m\nA,1,2,3\nB,1,2,3\n", "where \"A\" is", 3),
            ("anchor,e_m,n_m,u_m\nA,1,,3\n", "empty", 2),
            ("anchor,e_m,n_m,u_m\nA,1,2,nan\n", "number", 2),
            ("anchor,e_m,n_m,u_m\nA,482300,4001200,3\n", "millimetres", 2),
        ] {
            let error = read(text.as_bytes()).unwrap_err();
            assert_eq!(error.line, Some(line), "{error}");
            assert!(error.to_string().contains(word), "{error}");
        }
        assert_eq!(read(b"anchor,e_m,n_m,u_m\n").unwrap_err().kind, ParseErrorKind::EmptyFile);
        assert_eq!(read(b"").unwrap_err().kind, ParseErrorKind::EmptyFile);
    }
}
