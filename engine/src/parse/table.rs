//! Small tables, read whole: markers, visits, truth.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::header::Header;
use crate::parse::names;
use crate::parse::records::{Record, Records};

/// Reads a table row by row. `places` finds the columns in the header, `row` reads a record with
/// them; a table without rows is an empty list.
pub(super) fn read<P, T>(
    bytes: &[u8],
    example: &str,
    places: impl FnMut(&Header) -> Result<P, ParseError>,
    row: impl FnMut(&P, &Record<'_>) -> Result<T, ParseError>,
) -> Result<Vec<T>, ParseError> {
    read_with(bytes, b',', example, (Header::read, Header::check_row), places, row)
}

/// The same for a table of anybody's, whose fields are parted by another byte: columns may be called alike, and the last cells
/// of a row left out.
pub(super) fn read_parted<P, T>(
    bytes: &[u8],
    delimiter: u8,
    example: &str,
    places: impl FnMut(&Header) -> Result<P, ParseError>,
    row: impl FnMut(&P, &Record<'_>) -> Result<T, ParseError>,
) -> Result<Vec<T>, ParseError> {
    read_with(bytes, delimiter, example, (Header::any, Header::check_longest), places, row)
}

type ReadHeader = fn(&Record<'_>, &[u8], &str) -> Result<Header, ParseError>;
type CheckRow = fn(&Header, &Record<'_>) -> Result<(), ParseError>;

fn read_with<P, T>(
    bytes: &[u8],
    delimiter: u8,
    example: &str,
    (read_header, check_row): (ReadHeader, CheckRow),
    mut places: impl FnMut(&Header) -> Result<P, ParseError>,
    mut row: impl FnMut(&P, &Record<'_>) -> Result<T, ParseError>,
) -> Result<Vec<T>, ParseError> {
    let mut header: Option<(Header, P)> = None;
    let mut rows = Vec::new();
    let mut each = |record: &Record<'_>| {
        match &header {
            None => {
                let found = read_header(record, &bytes[..bytes.len().min(8)], example)?;
                let places = places(&found)?;
                header = Some((found, places));
            }
            Some((header, places)) => {
                check_row(header, record)?;
                rows.push(row(places, record)?);
            }
        }
        Ok(())
    };
    let mut records = Records::parted_by(delimiter);
    records.push(bytes, &mut each)?;
    records.finish(&mut each)?;
    if header.is_none() {
        return Err(ParseError::new(
            ParseErrorKind::EmptyFile,
            format!("a header such as \"{example}\""),
            "nothing",
            "check that this is the file you meant",
        ));
    }
    Ok(rows)
}

/// The text of a cell without the blanks around it. A spreadsheet guard, the apostrophe that keeps
/// `=1+1` from being a formula, is taken off again.
pub(super) fn name(record: &Record<'_>, index: usize, column: &str) -> Result<String, ParseError> {
    const MOST_CHARS: usize = 100;
    let text = String::from_utf8_lossy(record.field(index));
    let text = names::cleaned(unguarded(&text));
    let error = |kind, found: String| {
        ParseError::new(
            kind,
            format!("a name of 1 to {MOST_CHARS} printable characters"),
            found,
            "correct the name",
        )
        .at_line(record.line)
        .in_column(column)
    };
    if text.is_empty() {
        return Err(error(ParseErrorKind::EmptyField, "an empty field".to_owned()));
    }
    let chars = text.chars().count();
    if chars > MOST_CHARS {
        return Err(error(ParseErrorKind::TooLong, format!("{chars} characters")));
    }
    if text.chars().any(char::is_control) {
        return Err(error(ParseErrorKind::NotText, "a control character".to_owned()));
    }
    if names::is_dots(&text) {
        return Err(error(ParseErrorKind::NotText, format!("{text:?}, which no address can hold")));
    }
    Ok(text)
}

/// A cell without the blanks around it and without a spreadsheet guard.
pub(super) fn unguarded(cell: &str) -> &str {
    let text = cell.trim();
    match text.strip_prefix('\'') {
        Some(guarded) if starts_formula(guarded) => guarded,
        _ => text,
    }
}

/// Appends a name as a CSV cell: quoted where it must be, and guarded where a spreadsheet would take
/// it for a formula.
pub(super) fn push_name(name: &str, out: &mut String) {
    let guard = if starts_formula(name) { "'" } else { "" };
    if name.contains([',', '"', '\n', '\r']) {
        out.push('"');
        out.push_str(guard);
        out.push_str(&name.replace('"', "\"\""));
        out.push('"');
    } else {
        out.push_str(guard);
        out.push_str(name);
    }
}

fn starts_formula(text: &str) -> bool {
    // In their wide forms, too: a spreadsheet in Chinese takes them for the narrow ones.
    text.starts_with(['=', '+', '-', '@', '\t', '\r', '＝', '＋', '－', '＠'])
}
