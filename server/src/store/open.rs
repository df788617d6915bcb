//! The database in a file: how connections to it are made.

use std::path::Path;
use std::time::Duration;

use sqlx::ConnectOptions as _;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};

use super::dialect::Pool;
use super::writer::Writer;
use super::{StoreError, create};

/// Said of a file that holds nothing: a new database is there whole or not at all.
const EMPTY: &str = "expected a database, found an empty file: bring the last backup back with `lodestep restore FILE --data FOLDER --replace`; if there never was a database, remove the file and start again";

/// Opens the file for reading and for writing, and makes it when it is missing.
pub(super) async fn open(path: &Path, readers: u32) -> Result<(Pool, Writer), StoreError> {
    match std::fs::metadata(path) {
        Ok(file) if file.len() == 0 => return Err(StoreError::Open(EMPTY.to_owned())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => create::create(path).await?,
        _ => {}
    }
    let options = SqliteConnectOptions::new()
        .filename(path)
        .create_if_missing(false)
        .journal_mode(SqliteJournalMode::Wal)
        // FULL syncs the log at every commit: an acknowledgement means *on disk*.
        .synchronous(SqliteSynchronous::Full)
        .foreign_keys(true)
        .busy_timeout(std::time::Duration::from_secs(10));
    let writing = options
        .clone()
        // What the log has grown to in a busy hour is given back afterwards, but for 256 MiB: a thousand inspectors
        // fill half of that between two copies, and a file that is cut has to grow again.
        .pragma("journal_size_limit", "268435456")
        // KiB: all the pages of a commit of a thousand walks, so that none goes to the log twice.
        .pragma("cache_size", "-65536")
        // What a statement may have to take back is set aside meanwhile: in memory.
        .pragma("temp_store", "memory")
        // The writer copies the log itself, where a failure is seen, and after the answers are out.
        .pragma("wal_autocheckpoint", "0")
        // Each write has its own budget and its own warning, and a step of the database says itself that it goes on.
        .log_slow_statements("off".parse().expect("a level of the log"), Duration::ZERO);
    let writer = Writer::start(writing).await?;
    let readers = SqlitePoolOptions::new()
        .max_connections(readers.max(1))
        // Lazily: the writer has just shown that the file opens.
        .connect_lazy_with(options.read_only(true));
    Ok((readers, writer))
}
