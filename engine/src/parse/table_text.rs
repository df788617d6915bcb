//! The text of a small table, whatever wrote it: its encoding, what parts its fields, and where its header is.

use std::borrow::Cow;

use crate::parse::encoding::{legacy, utf16};
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::records::not_text;
use crate::parse::surveyed;

/// Lines by which the fields' delimiter is found.
const JUDGED_BY: usize = 40;
/// A row of units has no longer cells, letters.
const LONGEST_UNIT: usize = 12;

/// The text of a table.
#[derive(Debug)]
pub(super) struct TableText<'a> {
    pub(super) encoding: &'static str,
    pub(super) text: Cow<'a, str>,
    pub(super) delimiter: u8,
    /// Lines that stand before the header, and are no part of the table.
    pub(super) above: u64,
    /// Whether commas part decimals.
    pub(super) decimal_comma: bool,
    /// Whether a row of units follows the header.
    pub(super) units_below: bool,
    /// The number of columns of a table without names, whose first line is a row.
    pub(super) headless: Option<usize>,
}

/// Text in UTF-8, UTF-16, GBK or western letters, without mark and without filling at its end.
pub(super) fn decode(bytes: &[u8]) -> Result<(&'static str, Cow<'_, str>), ParseError> {
    if let Some(encoding) = utf16(bytes) {
        let (text, _, broken) = encoding.decode(bytes);
        if !broken {
            return Ok(("UTF-16", Cow::Owned(text.trim_end_matches(['\0', '\u{1a}']).to_owned())));
        }
    }
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let whole = bytes;
    let end = bytes.iter().rposition(|byte| !matches!(byte, 0 | 0x1A)).map_or(0, |last| last + 1);
    let bytes = &bytes[..end];
    let odd = if bytes.contains(&0x1A) { not_text(whole, whole) } else { not_text(bytes, bytes) };
    if let Some(error) = odd {
        return Err(error);
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Ok(("UTF-8", Cow::Borrowed(text)));
    }
    let decoded = legacy(bytes).and_then(|encoding| {
        let name = if encoding == encoding_rs::GBK { "GBK" } else { "windows-1252" };
        Some((name, encoding.decode_without_bom_handling_and_without_replacement(bytes)?))
    });
    decoded.ok_or_else(|| {
        let end = std::str::from_utf8(bytes).map_or_else(|error| error.valid_up_to(), |_| bytes.len());
        let line = 1 + bytes[..end].iter().filter(|byte| **byte == b'\n').count() as u64;
        ParseError::new(
            ParseErrorKind::UnknownEncoding,
            "text in UTF-8, UTF-16 or GBK",
            "bytes that are none of these",
            "save the table as CSV in UTF-8",
        )
        .at_line(line)
    })
}

impl TableText<'_> {
    pub(super) fn read(bytes: &[u8]) -> Result<TableText<'_>, ParseError> {
        let (encoding, text) = decode(bytes)?;
        let text = match text.contains('\n') {
            false if text.contains('\r') => Cow::Owned(text.replace('\r', "\n")),
            _ => text,
        };
        let text = parted_by_blanks(&text).map_or(text, Cow::Owned);
        let (mut above, said) = match text.lines().next().map(str::trim) {
            Some(first) if first.len() == 5 && first.to_ascii_lowercase().starts_with("sep=") => {
                (1, first.bytes().last())
            }
            // A tabulator may have been trimmed.
            Some(first) if first.eq_ignore_ascii_case("sep=") => (1, Some(b'\t')),
            _ => (0, None),
        };
        let lines: Vec<&str> = text.lines().skip(above).take(JUDGED_BY).collect();
        let delimiter = said.unwrap_or_else(|| delimiter_of(&lines));
        let split = |line: &str| -> Vec<String> {
            fields(line, delimiter).map(|field| field.trim().trim_matches('"').trim().to_owned()).collect()
        };
        let rows: Vec<Vec<String>> = lines.iter().map(|line| split(line)).collect();
        let decimal_comma = delimiter != b','
            && rows.iter().flatten().any(|field| {
                field.contains(',') && !field.contains('.') && surveyed::number(field, true).is_some()
            });
        let is_number = |field: &String| {
            surveyed::number(field, decimal_comma).is_some()
                || surveyed::angle_deg(field, decimal_comma).is_some()
        };
        let numbers = |row: &[String]| row.iter().filter(|field| is_number(field)).count();
        let filled = |row: &[String]| row.iter().filter(|field| !field.is_empty()).count();
        let width = usual(rows.iter().map(|row| filled(row)));
        // The header is the first line as wide as the table, of words, with numbers below it.
        let header = (0..rows.len()).find(|&k| {
            let words = filled(&rows[k]);
            words * 3 >= width * 2
                && words >= 2
                && numbers(&rows[k]) * 2 < words
                && rows[k + 1..].iter().filter(|row| filled(row) > 0).take(2).any(|row| numbers(row) >= 2)
        });
        let mut units_below = false;
        // A name and two coordinates in the first line that is as wide as the table: nobody has named the columns.
        let first_row = rows.iter().position(|row| filled(row) * 3 >= width * 2 && filled(row) >= 3);
        let headless = first_row.filter(|&row| header.is_none() && numbers(&rows[row]) >= 2).map(|row| {
            above += row;
            rows[row].len()
        });
        if let Some(header) = header {
            above += header;
            let below: Vec<&Vec<String>> =
                rows[header + 1..].iter().filter(|row| filled(row) > 0).take(2).collect();
            if let [units, row] = below[..] {
                units_below = numbers(units) == 0
                    && numbers(row) >= 2
                    && units.iter().all(|unit| unit.chars().count() <= LONGEST_UNIT)
                    && units.iter().any(|unit| is_unit(unit));
            }
        }
        Ok(TableText { encoding, above: above as u64, delimiter, decimal_comma, units_below, headless, text })
    }

    /// The bytes from the header on.
    pub(super) fn header_onward(&self) -> &[u8] {
        let mut rest: &str = &self.text;
        for _ in 0..self.above {
            rest = rest.find('\n').map_or("", |at| &rest[at + 1..]);
        }
        rest.as_bytes()
    }
}

/// The table with tabulators, where nothing but blanks parts its columns, as surveyors' programs line them up.
fn parted_by_blanks(text: &str) -> Option<String> {
    let lines = || text.lines().filter(|line| !line.trim().is_empty()).take(JUDGED_BY);
    if lines().any(|line| line.contains([',', ';', '\t', '|'])) {
        return None;
    }
    let widths: Vec<usize> = lines().map(|line| line.split_whitespace().count()).collect();
    let most = usual(widths.iter().copied());
    let agree = widths.iter().filter(|width| **width == most).count();
    if most < 3 || agree * 10 < widths.len() * 7 {
        return None;
    }
    Some(text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join("\t") + "\n").collect())
}

/// Whether a cell names a unit.
fn is_unit(cell: &str) -> bool {
    let bare = cell.trim_matches(['(', ')', '[', ']', '（', '）']).to_lowercase();
    matches!(
        bare.as_str(),
        "m" | "deg"
            | "°"
            | "米"
            | "度"
            | "metre"
            | "metres"
            | "meter"
            | "meters"
            | "mm"
            | "毫米"
            | "cm"
            | "厘米"
            | "km"
            | "千米"
            | "公里"
            | "ft"
            | "degrees"
    )
}

/// The fields of a line as far as they tell how many there are. A quotation mark where a field begins holds it together;
/// elsewhere it may stand for seconds.
fn fields(line: &str, delimiter: u8) -> impl Iterator<Item = &str> {
    let (mut quoted, mut at_start, mut just_closed) = (false, true, false);
    line.split(move |letter: char| {
        if quoted {
            just_closed = letter == '"';
            quoted = !just_closed;
            return false;
        }
        if letter == '"' && (at_start || just_closed) {
            (quoted, at_start) = (true, false);
            return false;
        }
        let parts = letter == char::from(delimiter);
        // Whatever may turn out to be the delimiter: the others' quotes hold, too.
        at_start = matches!(letter, ',' | ';' | '\t' | '|') || (at_start && letter == ' ');
        just_closed = false;
        parts
    })
}

/// What most lines have as often as each other, and not at all rarely.
fn delimiter_of(lines: &[&str]) -> u8 {
    let counts = |delimiter: u8| {
        let of_lines: Vec<usize> = lines
            .iter()
            .filter(|line| !line.trim().is_empty())
            .map(|line| fields(line, delimiter).count() - 1)
            .collect();
        let most = usual(of_lines.iter().copied());
        let agree = of_lines.iter().filter(|count| **count == most).count();
        (most > 0).then_some((agree * 100 / of_lines.len().max(1), most))
    };
    // A tabulator or a semicolon is no decimal comma.
    [b'\t', b';', b',', b'|']
        .into_iter()
        .filter_map(|delimiter| Some((counts(delimiter)?, delimiter)))
        .max_by_key(|((agree, most), delimiter)| (*agree >= 60, *most >= 2, *delimiter != b',', *agree))
        .map_or(b',', |(_, delimiter)| delimiter)
}

/// The commonest of some numbers, the larger one of two that are as common; blank lines count for nothing.
fn usual(counts: impl Iterator<Item = usize>) -> usize {
    let mut all: Vec<usize> = counts.filter(|count| *count > 0).collect();
    all.sort_unstable();
    all.chunk_by(|a, b| a == b).max_by_key(|same| (same.len(), same[0])).map_or(0, |same| same[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_in_quotes_parts_nothing() {
        let line = r#""a;b","say ""c;d"";e",25°39'11.69",f"#;
        assert_eq!(fields(line, b',').count(), 4);
        assert_eq!(delimiter_of(&[line, line]), b',');
        assert_eq!(delimiter_of(&["a;1,5;2,5", "b;2,5;3,5"]), b';');
    }
}
