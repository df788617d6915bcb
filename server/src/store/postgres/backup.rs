//! What of the one-machine program's backups there is here: the sentence that says where those of PostgreSQL are made.

use std::path::Path;

use super::StoreError;

/// Said in place of a backup.
const ELSEWHERE: &str = "this program keeps everything in PostgreSQL: make backups with pg_basebackup and archived WAL, as docs/cluster.md tells, and bring them back with PostgreSQL";

/// None can be made here.
pub async fn copy(_database: &Path, _copy: &Path) -> Result<Vec<String>, StoreError> {
    Err(StoreError::Open(ELSEWHERE.to_owned()))
}

/// There is no log beside a database here.
pub async fn take_in_log(_database: &Path) -> Result<(), StoreError> {
    Err(StoreError::Open(ELSEWHERE.to_owned()))
}

/// None can be looked at here.
pub async fn check(_database: &Path) -> Result<Vec<String>, StoreError> {
    Err(StoreError::Open(ELSEWHERE.to_owned()))
}
