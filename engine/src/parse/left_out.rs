//! Lines of a log that are no row: the first ones are kept with their reasons, the others counted.

use crate::anomaly::Anomaly;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::remark::LogCause;

/// Reasons that are told.
const REASONS: usize = 3;
/// After so many lines it need not be waited for the end of the file to see that it is mostly garbage.
const EARLY_LINES: u64 = 1_000;

/// Counts lines that could not be read, beside those that could.
#[derive(Clone, Debug, Default)]
pub(super) struct LeftOut {
    rows: u64,
    lines: u64,
    reasons: Vec<ParseError>,
    /// Rows without any value, as stand for lost packets.
    empty_rows: u64,
    /// Readings of field and pressure that could not be read, and why not, for the first ones.
    values: u64,
    value_reasons: Vec<ParseError>,
    /// The table began again with its names.
    headers: u64,
}

impl LeftOut {
    /// A line was a row.
    pub(super) fn row(&mut self) {
        self.rows += 1;
    }

    /// A row has no value.
    pub(super) fn empty_row(&mut self) {
        self.empty_rows += 1;
    }

    /// A reading beside rate and force could not be read: it costs itself alone.
    pub(super) fn value(&mut self, error: ParseError) {
        self.values += 1;
        if self.value_reasons.len() < REASONS {
            self.value_reasons.push(error);
        }
    }

    /// The names stand in the table again, as where recordings were put together.
    pub(super) fn header(&mut self) {
        self.headers += 1;
    }

    /// Whether there was a row.
    pub(super) fn has_rows(&self) -> bool {
        self.rows > 0
    }

    /// A line could not be read.
    ///
    /// # Errors
    ///
    /// When that is so for most lines.
    pub(super) fn line(&mut self, error: ParseError) -> Result<(), ParseError> {
        self.lines += 1;
        if self.reasons.len() < REASONS {
            self.reasons.push(error);
        }
        if self.lines >= EARLY_LINES { self.finish() } else { Ok(()) }
    }

    /// Whether most lines were rows.
    ///
    /// # Errors
    ///
    /// The first reasons, when they were not.
    pub(super) fn finish(&self) -> Result<(), ParseError> {
        let Some(first) = self.reasons.first() else { return Ok(()) };
        if self.lines <= self.rows {
            return Ok(());
        }
        if self.lines == 1 {
            return Err(first.clone());
        }
        let reasons: Vec<String> = self
            .reasons
            .iter()
            .map(|reason| match (reason.line, &reason.column) {
                (Some(line), Some(column)) => format!("line {line}, column {column}: {}", reason.found),
                (Some(line), None) => format!("line {line}: {}", reason.found),
                _ => reason.found.clone(),
            })
            .collect();
        let found = format!(
            "{} of {} lines that cannot be read ({})",
            self.lines,
            self.lines + self.rows,
            reasons.join("; ")
        );
        Err(ParseError { found, ..first.clone() })
    }

    /// What is to be told of it.
    pub(super) fn anomalies(&self, filling_bytes: u64, t_ns: [i64; 2]) -> Vec<Anomaly> {
        let mut causes = Vec::new();
        if let Some(first) = self.reasons.first() {
            causes.push(LogCause::LinesLeftOut {
                lines: self.lines as f64,
                first_line: first.line.unwrap_or_default() as f64,
                reasons: self.reasons.iter().map(ToString::to_string).collect(),
            });
        }
        if let Some(first) = self.value_reasons.first() {
            causes.push(LogCause::ValuesLeftOut {
                values: self.values as f64,
                first_line: first.line.unwrap_or_default() as f64,
                reasons: self.value_reasons.iter().map(ToString::to_string).collect(),
            });
        }
        if self.headers > 0 {
            causes.push(LogCause::Recordings { recordings: (self.headers + 1) as f64 });
        }
        if filling_bytes > 0 {
            causes.push(LogCause::Filling { filling_bytes: filling_bytes as f64 });
        }
        if self.empty_rows > 0 {
            causes.push(LogCause::EmptyRows { empty_rows: self.empty_rows as f64 });
        }
        causes.iter().map(|cause| cause.at(t_ns, self.lines)).collect()
    }
}

/// The error for a line that the recorder did not finish.
pub(super) fn cut(line: u64) -> ParseError {
    ParseError::new(
        ParseErrorKind::WrongFieldCount,
        "a whole line",
        "a last line without an end, shorter than those before",
        "nothing: the recorder was switched off while it wrote",
    )
    .at_line(line)
}

/// The error for a line that is longer than any honest one.
pub(super) fn too_long(line: u64) -> ParseError {
    ParseError::new(
        ParseErrorKind::TooLong,
        "a line of at most 16 KiB and 256 fields",
        "a longer one",
        "check that the file is a table with one row a line",
    )
    .at_line(line)
}

/// Notices a last line that was cut within its last number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decimals {
    fewest: usize,
}

impl Default for Decimals {
    fn default() -> Self {
        Decimals { fewest: usize::MAX }
    }
}

impl Decimals {
    /// Takes the last field of a row; `ended` when a line feed ends it. Whether it was cut.
    pub(super) fn cut(&mut self, field: &[u8], ended: bool) -> bool {
        let decimals = field.iter().rev().position(|byte| *byte == b'.' || *byte == b',').unwrap_or(0);
        if ended {
            self.fewest = self.fewest.min(decimals);
        }
        !ended && self.fewest != usize::MAX && decimals < self.fewest
    }
}
