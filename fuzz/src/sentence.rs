//! What every error has to be, whatever was sent.

use lodestep_engine::parse::ParseError;

/// Letters in a sentence that somebody is still going to read.
const MOST_CHARS: usize = 2_000;

/// An error is one printable sentence that ends, about a line that `file` has.
pub(crate) fn check(error: &ParseError, file: &[u8]) {
    let text = error.to_string();
    assert!(!error.expected.is_empty() && !error.found.is_empty() && !error.advice.is_empty(), "{error:?}");
    assert!(text.chars().count() <= MOST_CHARS, "{} characters: {error:?}", text.chars().count());
    assert!(!text.chars().any(char::is_control), "a control character: {error:?}");
    assert!(!error.code().is_empty());
    if let Some(line) = error.line {
        let lines = 1 + file.iter().filter(|byte| **byte == b'\n').count() as u64;
        assert!((1..=lines).contains(&line), "line {line} of {lines}: {error:?}");
    }
}
