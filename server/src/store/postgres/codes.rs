//! What PostgreSQL's codes (SQLSTATE) say about the disk. A disk of PostgreSQL's that fails is PostgreSQL's to deal with: it stops,
//! a standby takes its place, and the worker connects anew. So nothing here ends the worker.

use super::health::Disk;

/// `disk_full`.
const DISK_FULL: &str = "53100";

/// What this failure says about the disk; `None`: nothing.
pub(super) fn disk(error: &sqlx::Error) -> Option<Disk> {
    (error.as_database_error()?.code()? == DISK_FULL).then_some(Disk::Full)
}

/// Whether what SQLite calls a damaged file was found. PostgreSQL tells of damage as of any other failure.
pub(super) fn is_damage(_error: &sqlx::Error) -> bool {
    false
}
