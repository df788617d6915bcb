//! What is wrong with a RINEX file, told so that its owner can put it right.

/// A RINEX file that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: expected {expected}, found {found}; {advice}")]
pub struct RinexError {
    /// The line, counted from 1.
    pub line: usize,
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub found: String,
    /// What to do.
    pub advice: String,
}

impl RinexError {
    pub(super) fn new(
        line: usize,
        expected: impl Into<String>,
        found: impl AsRef<[u8]>,
        advice: impl Into<String>,
    ) -> RinexError {
        let text = String::from_utf8_lossy(found.as_ref());
        let printable = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
        let shown: String = text.trim().chars().take(60).map(printable).collect();
        let found = if shown.is_empty() { "nothing".to_owned() } else { format!("\"{shown}\"") };
        RinexError { line, expected: expected.into(), found, advice: advice.into() }
    }
}
