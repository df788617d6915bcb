//! Everything that is kept: all SQL of the server is in this folder, one function a question.
//!
//! Reads go through a pool of read-only connections ([`Store::read`]); every write goes through the
//! one [`Writer`]. The SQL keeps to the subset that SQLite and PostgreSQL share.

pub mod accounts;
pub mod alarms;
pub mod anomalies;
pub mod audit;
pub mod charts;
pub mod clock_ties;
pub mod dialect;
pub mod fault_changes;
pub mod fault_photos;
pub mod faults;
pub mod health;
pub mod inspectors;
pub mod jobs;
pub mod lab_runs;
pub mod lab_tracks;
pub mod live_states;
pub mod logs;
pub mod mappings;
pub mod marker_changes;
pub mod marker_imports;
pub mod marker_residuals;
pub mod markers;
pub mod parameter_sets;
pub mod raw_chunks;
pub mod record;
pub mod removal;
pub mod reports;
pub mod scrub;
pub mod session_search;
pub mod sessions;
pub mod sign_ins;
pub mod site_parameters;
pub mod stage;
pub mod stands;
pub mod stream_chunks;
pub mod stream_visits;
pub mod tokens;
pub mod track;
pub mod upload_pieces;
pub mod visits;
pub mod webhook_deliveries;
pub mod webhooks;
pub mod writer;

mod checksum;
pub(crate) mod columns;
mod many_rows;
mod sample_columns;
mod waiting;
mod write;

// What is SQLite's own, or PostgreSQL's.
#[cfg_attr(feature = "cluster", path = "postgres/backup.rs")]
pub mod backup;
#[cfg_attr(feature = "cluster", path = "postgres/codes.rs")]
mod codes;
#[cfg(not(feature = "cluster"))]
mod create;
#[cfg_attr(feature = "cluster", path = "postgres/hashes.rs")]
pub mod hashes;
#[cfg(feature = "cluster")]
#[path = "postgres/import.rs"]
pub mod import;
mod migrations;
#[cfg_attr(feature = "cluster", path = "postgres/open.rs")]
mod open;
#[cfg_attr(feature = "cluster", path = "postgres/owned.rs")]
mod owned;
#[cfg(not(feature = "cluster"))]
mod schema;
#[cfg_attr(feature = "cluster", path = "postgres/write_ahead.rs")]
mod write_ahead;

#[cfg(test)]
mod differences_tests;
#[cfg(test)]
#[cfg(feature = "cluster")]
mod import_tests;
#[cfg(test)]
#[cfg(feature = "cluster")]
mod owner_tests;
#[cfg(test)]
#[cfg(not(feature = "cluster"))]
mod rot_tests;
#[cfg(test)]
#[cfg(not(feature = "cluster"))]
mod schema_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
#[cfg(not(feature = "cluster"))]
mod two_schemas_tests;
#[cfg(test)]
#[cfg(not(feature = "cluster"))]
mod upgrade_tests;

use std::path::Path;

pub(crate) use self::columns::to_word as columns_word;
use self::dialect::Pool;
use self::health::{Disk, Health};
pub use self::migrations::{VERSION, version};
pub use self::record::Record;
pub use self::write::WriteError;
pub use self::writer::Writer;

/// Why the store did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database said no.
    #[error(transparent)]
    Database(sqlx::Error),
    /// The database file is damaged, or no database at all.
    #[error(
        "the database is damaged ({0}): stop the server and bring the last backup back with `lodestep restore FILE --data FOLDER --replace`"
    )]
    Corrupt(String),
    /// The database cannot be opened as it is.
    #[error("{0}")]
    Open(String),
    /// The group that this write was committed with did not reach the disk: nothing of it is stored.
    #[error("the write was not stored: {0}")]
    NotCommitted(String),
    /// The disk has no room: nothing of this write is stored, and everything before it is kept.
    #[error("the disk is full: the write was not stored")]
    DiskFull,
    /// The disk failed: nothing is written until the server has started anew.
    #[error("the disk failed ({0}): the write was not stored")]
    DiskFailed(String),
    /// The server is stopping.
    #[error("the writer has stopped: the server is shutting down")]
    Stopped,
    /// Something in a table is not as this program writes it.
    #[error("the stored {what} cannot be read: {why}")]
    Damaged {
        /// Which row or blob.
        what: String,
        /// What is wrong with it.
        why: String,
    },
}

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> StoreError {
        match error {
            error if codes::is_damage(&error) => StoreError::Corrupt(error.to_string()),
            // What a row's own reading found.
            sqlx::Error::Decode(inner) => match inner.downcast::<StoreError>() {
                Ok(own) => *own,
                Err(inner) => StoreError::Database(sqlx::Error::Decode(inner)),
            },
            error => StoreError::Database(error),
        }
    }
}

impl StoreError {
    /// Whether the same request may succeed later.
    pub fn is_passing(&self) -> bool {
        matches!(self, StoreError::NotCommitted(_)) || self.is_stopping() || self.disk().is_some()
    }

    /// Whether the server is about to end: the readers close first.
    pub fn is_stopping(&self) -> bool {
        matches!(self, StoreError::Stopped | StoreError::Database(sqlx::Error::PoolClosed))
    }

    /// What it says about the disk; `None`: nothing.
    pub fn disk(&self) -> Option<Disk> {
        match self {
            StoreError::DiskFull => Some(Disk::Full),
            StoreError::DiskFailed(_) => Some(Disk::Failing),
            StoreError::Database(error) => Disk::of(error),
            _ => None,
        }
    }

    /// Whether it was turned down because such a row (by a unique column) stands already.
    pub fn is_duplicate(&self) -> bool {
        matches!(self, StoreError::Database(sqlx::Error::Database(error)) if error.is_unique_violation())
    }

    /// Whether it was turned down because it names a row that does not exist, or one that others name.
    pub fn is_dangling(&self) -> bool {
        matches!(self, StoreError::Database(sqlx::Error::Database(error)) if error.is_foreign_key_violation())
    }
}

/// Whether several servers reach the database, one after the other.
pub const IS_SHARED: bool = cfg!(feature = "cluster");

/// How long readers may go on once the store closes.
const READERS_CLOSE_WITHIN: std::time::Duration = std::time::Duration::from_secs(2);

/// The open store.
#[derive(Clone, Debug)]
pub struct Store {
    readers: Pool,
    writer: Writer,
}

impl Store {
    /// Opens the database, a file or an address as this program was built, makes it when it is missing, and brings it up to this
    /// version.
    pub async fn open(path: &Path, readers: u32) -> Result<Store, StoreError> {
        let (readers, writer) = open::open(path, readers).await?;
        Ok(Store { readers, writer })
    }

    /// Makes the database this server's own. A file is held by its folder's lock; of a database that several servers reach the last
    /// to say so is the owner, and the one before writes nothing any more.
    pub async fn take_over(&self) -> Result<(), StoreError> {
        self.writer.take_over().await
    }

    /// Where to read.
    pub fn read(&self) -> &Pool {
        &self.readers
    }

    /// Where to write.
    pub fn writer(&self) -> &Writer {
        &self.writer
    }

    /// How the last write went.
    pub fn health(&self) -> Health {
        self.writer.health()
    }

    /// How long the live record has waited that has waited longest, as long as it is not on disk.
    pub fn longest_live_wait(&self) -> std::time::Duration {
        self.writer.longest_live_wait()
    }

    /// Ready when the disk has failed and nothing is acknowledged any more; never otherwise.
    pub async fn disk_failed(&self) {
        self.writer.disk_failed().await;
    }

    /// Writes what still waits, and closes.
    pub async fn close(&self) {
        // The readers first: the last connection that closes writes the log back, and only the writer may.
        if tokio::time::timeout(READERS_CLOSE_WITHIN, self.readers.close()).await.is_err() {
            tracing::warn!(
                "somebody still reads: the log stays beside the database, and is read at the next start"
            );
        }
        self.writer.stop().await;
    }
}
