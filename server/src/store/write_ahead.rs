//! The database's log: brought to disk at the start, copied into the database file while the server runs.

use futures_util::FutureExt;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, Row, SqliteConnection};
use tokio::sync::oneshot;

use super::StoreError;
use super::health::Disk;
use super::writer::Write;

/// Makes sure that what the log holds is on disk, before anybody is told of it.
///
/// A server that died after a failed sync leaves a log whose last pages may be in the system's memory only, and
/// look as if they were on disk. So they are not believed: what the log holds is written into the database file
/// and that is synced. When this fails, the server does not start.
pub(super) async fn settle(db: &mut SqliteConnection) -> Result<(), StoreError> {
    let row = sqlx::query("pragma wal_checkpoint(full)").fetch_one(db).await?;
    let (busy, log, copied): (i64, i64, i64) = (row.try_get(0)?, row.try_get(1)?, row.try_get(2)?);
    if busy == 0 || log == copied {
        return Ok(());
    }
    Err(StoreError::Open(
        "expected the database for this server alone, found another program reading an old state of it: end that program and start again".to_owned(),
    ))
}

/// Makes sure that nobody else writes: a file has one writer, and the group has begun as such.
pub(super) async fn be_the_only_one(_db: &mut SqliteConnection) -> Result<(), sqlx::Error> {
    Ok(())
}

/// Copies the log from a connection of its own, while the writer goes on.
///
/// What is written meanwhile is copied in another turn, and what is written during that stays to be copied, so the log
/// cannot begin anew after this alone: the writer copies the little that is left, between two commits.
pub(super) async fn copy_aside(options: SqliteConnectOptions) -> Result<(), sqlx::Error> {
    let mut connection = options.connect().await?;
    let copied = match copy(&mut connection).await {
        Ok(()) => copy(&mut connection).await,
        failed => failed,
    };
    if let Err(error) = copied {
        if Disk::of(&error) == Some(Disk::Failing) {
            // Closing it would ask the disk once more.
            std::mem::forget(connection);
        }
        return Err(error);
    }
    connection.close().await
}

/// Copies as much of the log as no reader needs; waits for nobody.
pub(super) async fn copy(db: &mut SqliteConnection) -> Result<(), sqlx::Error> {
    sqlx::query("pragma wal_checkpoint(passive)").execute(db).await?;
    Ok(())
}

/// A write that changes nothing, to see whether there is room.
pub(super) fn probe() -> Write {
    let (caller, _nobody) = oneshot::channel();
    Write::new(0, |db| touch(db).boxed(), caller)
}

pub(super) async fn touch(db: &mut SqliteConnection) -> Result<(), StoreError> {
    sqlx::query("update marker_revision set revision = revision where \"only\" = 1").execute(db).await?;
    Ok(())
}
