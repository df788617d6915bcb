//! What is wrong with a file or a message, told so that its sender can put it right.

use std::fmt;

/// The kinds of trouble; [`ParseError::code`] spells each for the API.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ParseErrorKind {
    /// Nothing but white space, or a header without a row.
    EmptyFile,
    /// A picture, an archive or another binary where text belongs.
    NotText,
    /// The first line is data, not a header.
    MissingHeader,
    /// A column that is needed is not in the header.
    MissingColumn,
    /// A column that is in the header twice.
    RepeatedColumn,
    /// A row with more or fewer fields than the header.
    WrongFieldCount,
    /// A field that does not hold a number of the kind that belongs there.
    NotANumber,
    /// A needed field is empty.
    EmptyField,
    /// A field or a line that is longer than any honest one.
    TooLong,
    /// Angular rates that can only be degrees per second.
    DegreesNotRadians,
    /// Specific forces that can only be multiples of g.
    GNotMetres,
    /// Rates said to be in degrees per second that can only be radians.
    RadiansNotDegrees,
    /// Forces said to be in g that can only be metres per second squared.
    MetresNotG,
    /// Values in another unit than was said: counts, mg, gauss, pascals.
    OtherUnit,
    /// A table or a dump in none of the known formats.
    UnknownFormat,
    /// A known format of which the file does not say in which units, or at which rate.
    MappingNeeded,
    /// A mapping of columns to channels that does not hold together.
    BadMapping,
    /// A time that cannot be: not finite, out of range, or an end before its start.
    BadTime,
    /// The same name twice.
    RepeatedName,
    /// A latitude, longitude or coordinate that is out of range.
    OutOfRange,
    /// Text that is neither UTF-8 nor GBK.
    UnknownEncoding,
    /// A binary frame whose length is not what its header says.
    FrameLength,
    /// A binary frame whose header is not that of a frame.
    FrameHeader,
    /// A batch with no sample, or with too many.
    BatchSize,
    /// Text that is not the JSON that was expected.
    NotJson,
    /// A message whose `type` is not known.
    UnknownMessage,
}

/// What is wrong, where, what was expected, what was found, and what to do about it.
#[derive(Clone, Debug, PartialEq)]
pub struct ParseError {
    /// The kind of trouble.
    pub kind: ParseErrorKind,
    /// The line of the file, counted from 1, the header included.
    pub line: Option<u64>,
    /// The column's name.
    pub column: Option<String>,
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub found: String,
    /// What to do.
    pub advice: String,
}

impl ParseError {
    pub(crate) fn new(
        kind: ParseErrorKind,
        expected: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> ParseError {
        ParseError {
            kind,
            line: None,
            column: None,
            expected: printable(expected.into()),
            found: printable(found.into()),
            advice: advice.into(),
        }
    }

    pub(crate) fn at_line(mut self, line: u64) -> ParseError {
        self.line = Some(line);
        self
    }

    pub(crate) fn in_column(mut self, column: impl Into<String>) -> ParseError {
        self.column = Some(printable(column.into()));
        self
    }

    /// The kind in snake case, as problem documents carry it.
    pub fn code(&self) -> &'static str {
        match self.kind {
            ParseErrorKind::EmptyFile => "empty_file",
            ParseErrorKind::NotText => "not_text",
            ParseErrorKind::MissingHeader => "missing_header",
            ParseErrorKind::MissingColumn => "missing_column",
            ParseErrorKind::RepeatedColumn => "repeated_column",
            ParseErrorKind::WrongFieldCount => "wrong_field_count",
            ParseErrorKind::NotANumber => "not_a_number",
            ParseErrorKind::EmptyField => "empty_field",
            ParseErrorKind::TooLong => "too_long",
            ParseErrorKind::DegreesNotRadians => "degrees_not_radians",
            ParseErrorKind::GNotMetres => "g_not_metres",
            ParseErrorKind::RadiansNotDegrees => "radians_not_degrees",
            ParseErrorKind::MetresNotG => "metres_not_g",
            ParseErrorKind::OtherUnit => "other_unit",
            ParseErrorKind::UnknownFormat => "unknown_format",
            ParseErrorKind::MappingNeeded => "mapping_needed",
            ParseErrorKind::BadMapping => "bad_mapping",
            ParseErrorKind::BadTime => "bad_time",
            ParseErrorKind::RepeatedName => "repeated_name",
            ParseErrorKind::OutOfRange => "out_of_range",
            ParseErrorKind::UnknownEncoding => "unknown_encoding",
            ParseErrorKind::FrameLength => "frame_length",
            ParseErrorKind::FrameHeader => "frame_header",
            ParseErrorKind::BatchSize => "batch_size",
            ParseErrorKind::NotJson => "not_json",
            ParseErrorKind::UnknownMessage => "unknown_message",
        }
    }
}

impl fmt::Display for ParseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, &self.column) {
            (Some(line), Some(column)) => write!(f, "line {line}, column {column}: ")?,
            (Some(line), None) => write!(f, "line {line}: ")?,
            (None, Some(column)) => write!(f, "column {column}: ")?,
            (None, None) => {}
        }
        write!(f, "expected {}, found {}; {}", self.expected, self.found, self.advice)
    }
}

impl std::error::Error for ParseError {}

/// A text that may hold what somebody sent, such as a column's name or a library's words about it: whoever
/// reads the error, at a terminal or in a log, is shown no control character and no more than some lines.
fn printable(text: String) -> String {
    const MOST: usize = 600;
    if text.chars().nth(MOST).is_none() && !text.contains(char::is_control) {
        return text;
    }
    let mut out: String = text.chars().take(MOST).map(|c| if c.is_control() { '·' } else { c }).collect();
    if text.chars().nth(MOST).is_some() {
        out.push('…');
    }
    out
}

/// The error of a log that ended before its first row; `of` is what a row holds.
pub(super) fn no_rows(has_header: bool, columns: &str, of: &str) -> ParseError {
    ParseError::new(
        ParseErrorKind::EmptyFile,
        format!("the header {columns} and a row for every {of}"),
        if has_header { "a header and no row" } else { "nothing" },
        "check that the recorder wrote the log, and copy it again",
    )
}

/// A piece of somebody's file, short and printable enough to stand in a sentence.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    const MOST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * MOST)]);
    let mut out = String::from("\"");
    for (i, c) in text.chars().enumerate() {
        if i == MOST {
            out.push('…');
            break;
        }
        out.push(if c.is_control() { '·' } else { c });
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_says_where_what_and_what_to_do() {
        let error = ParseError::new(ParseErrorKind::NotANumber, "a number", quoted(b"abc"), "correct it")
            .at_line(3)
            .in_column("gyr_x_rad_s");
        assert_eq!(
            error.to_string(),
            "line 3, column gyr_x_rad_s: expected a number, found \"abc\"; correct it"
        );
        assert_eq!(error.code(), "not_a_number");
    }

    #[test]
    fn what_others_wrote_cannot_take_the_reader_s_terminal_over_or_fill_it() {
        let error = ParseError::new(ParseErrorKind::NotJson, "a\u{1b}]0;b", "c\r\nd", "correct it")
            .in_column("x".repeat(20_000));
        let text = error.to_string();
        assert!(text.contains("expected a·]0;b, found c··d;"), "{text}");
        assert!(text.chars().count() < 700, "{text}");
    }

    #[test]
    fn quotes_are_short_and_printable() {
        let quote = quoted("\u{1b}[31m一二三".repeat(50).as_bytes());
        assert!(quote.chars().count() <= 43, "{quote}");
        assert!(!quote.contains('\u{1b}'));
    }
}
