//! What SQLite's codes say about the disk and the database file.

use sqlx::error::DatabaseError;

use super::health::Disk;

/// Primary result codes of SQLite.
const SQLITE_BUSY: i64 = 5;
const SQLITE_READONLY: i64 = 8;
const SQLITE_IOERR: i64 = 10;
const SQLITE_CORRUPT: i64 = 11;
const SQLITE_FULL: i64 = 13;
const SQLITE_NOTADB: i64 = 26;
/// The index of the log could not grow. It is no part of what is kept, and nothing but room is missing.
const SQLITE_IOERR_SHMSIZE: i64 = SQLITE_IOERR | 19 << 8;

/// What this failure says about the disk; `None`: nothing.
pub(super) fn disk(error: &sqlx::Error) -> Option<Disk> {
    match error {
        sqlx::Error::Database(error) => of_code(extended_code(error.as_ref())?),
        sqlx::Error::WorkerCrashed => Some(Disk::Failing),
        _ => None,
    }
}

fn of_code(code: i64) -> Option<Disk> {
    match (code, code & 0xFF) {
        (SQLITE_IOERR_SHMSIZE, _) | (_, SQLITE_FULL) => Some(Disk::Full),
        // One that takes no writes any more, as after the system has mounted its disk read-only.
        (_, SQLITE_IOERR | SQLITE_READONLY) => Some(Disk::Failing),
        _ => None,
    }
}

/// Whether the database file is damaged, or no database at all.
pub(super) fn is_damage(error: &sqlx::Error) -> bool {
    [SQLITE_CORRUPT, SQLITE_NOTADB].map(Some).contains(&primary_code(error))
}

/// Whether somebody else has the database open and does not let go of it.
pub(super) fn is_busy(error: &sqlx::Error) -> bool {
    primary_code(error) == Some(SQLITE_BUSY)
}

fn primary_code(error: &sqlx::Error) -> Option<i64> {
    Some(extended_code(error.as_database_error()?)? & 0xFF)
}

fn extended_code(error: &dyn DatabaseError) -> Option<i64> {
    error.code()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_told_from_a_failing_one_and_both_from_a_refused_row() {
        let (full, fsync, write, shm, unique, busy, read_only) = (13, 1034, 778, 4874, 2067, 5, 8);
        assert_eq!(of_code(full), Some(Disk::Full));
        assert_eq!(of_code(shm), Some(Disk::Full));
        assert_eq!(of_code(fsync), Some(Disk::Failing));
        assert_eq!(of_code(write), Some(Disk::Failing));
        assert_eq!(of_code(read_only), Some(Disk::Failing));
        assert_eq!(of_code(unique), None);
        assert_eq!(of_code(busy), None);
    }
}
