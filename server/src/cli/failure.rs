//! Whose fault it was, as an exit code.

use std::fmt;

use crate::store::StoreError;
use crate::store::health::Disk;

/// Something failed inside, or a result could not be written.
pub(super) const INTERNAL: u8 = 1;
/// The command line is wrong.
pub(super) const USAGE: u8 = 2;
/// An input file is wrong.
pub(super) const BAD_INPUT: u8 = 3;
/// The disk failed under the server: it is to be started again, and goes on from what is on disk. The number is
/// that of an input/output error in `sysexits.h`.
pub(super) const DISK_FAILED: u8 = 74;

/// A failure that its user can put right.
#[derive(Debug)]
pub(super) enum Failure {
    /// The command line asks for what cannot be.
    Usage(String),
    /// An input file is missing or wrong; the sentence names it.
    BadInput(String),
}

impl Failure {
    pub(super) fn usage(sentence: impl Into<String>) -> anyhow::Error {
        Failure::Usage(sentence.into()).into()
    }

    pub(super) fn bad_input(path: &std::path::Path, sentence: impl fmt::Display) -> anyhow::Error {
        Failure::BadInput(format!("{}: {sentence}", path.display())).into()
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Usage(sentence) | Failure::BadInput(sentence) => f.write_str(sentence),
        }
    }
}

impl std::error::Error for Failure {}

pub(super) fn exit_code(error: &anyhow::Error) -> u8 {
    match error.downcast_ref() {
        Some(Failure::Usage(_)) => USAGE,
        Some(Failure::BadInput(_)) => BAD_INPUT,
        None if disk_failed(error) => DISK_FAILED,
        None => INTERNAL,
    }
}

fn disk_failed(error: &anyhow::Error) -> bool {
    let mut causes = error.chain().filter_map(|cause| cause.downcast_ref::<StoreError>());
    causes.any(|error| error.disk() == Some(Disk::Failing))
}
