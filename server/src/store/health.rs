//! Whether the disk takes what is written: what a failure says about it, and how the store is now.

use super::codes;

/// What a failure of the database says about the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Disk {
    /// There is no room. What is there stays, and the next write may find some.
    Full,
    /// It did not write, sync or read as it should. What it holds of the last writes is unknown.
    Failing,
}

/// How the store is, by the last write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// The last write reached the disk.
    Good,
    /// The last group of writes was not stored; the next one is tried anew.
    NotStored,
    /// There is no room: writes are refused, and room is looked for by itself.
    DiskFull,
    /// The disk failed: nothing is written or acknowledged any more, and the server ends to start from the log.
    DiskFailed,
}

impl Disk {
    /// What this failure says about the disk; `None`: nothing.
    pub(super) fn of(error: &sqlx::Error) -> Option<Disk> {
        codes::disk(error)
    }
}
