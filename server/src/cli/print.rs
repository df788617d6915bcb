//! Results on standard output.

use std::io::Write as _;

use anyhow::{Context, Result};

/// Prints; the reader may have had enough, as `head` does.
pub(super) fn print(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("standard output cannot be written"),
    }
}
