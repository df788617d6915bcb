//! A copy of everything that is kept, made while the server goes on; and whether such a copy can be believed.

use std::path::Path;
use std::time::Duration;

use sqlx::sqlite::{SqliteConnectOptions, SqliteSynchronous};
use sqlx::{ConnectOptions, Connection, SqliteConnection};

use super::codes::is_busy;
use super::{StoreError, migrations, scrub};
use crate::data_folder;

/// The step since which what is stored has checksums.
const CHECKSUMS_SINCE: i64 = 20;

/// Writes a copy of the database in `database` to `copy`, a new or an empty file: as it stands at one moment, packed,
/// whatever is written meanwhile. What [`check`] finds damaged in it.
pub async fn copy(database: &Path, copy: &Path) -> Result<Vec<String>, StoreError> {
    let mut connection = existing(database).busy_timeout(Duration::from_secs(10)).connect().await?;
    sqlx::query("vacuum into ?1").bind(copy.to_string_lossy().into_owned()).execute(&mut connection).await?;
    connection.close().await?;
    check(copy).await
}

/// Makes a database one file that is complete without a log: what a log beside it holds is written into it and synced, and
/// the log is removed. An error where another program has the database open, and where the database is damaged; the log
/// then stays.
pub async fn take_in_log(database: &Path) -> Result<(), StoreError> {
    // Closing a damaged one that is open for writing would remove a log that cannot be read any more, either. Any other failure
    // to read it comes again below, or was one of reading alone.
    if let Err(error @ StoreError::Corrupt(_)) = first_page(database).await.map_err(StoreError::from) {
        return Err(named(database, error));
    }
    let taken = async {
        let mut connection = existing(database).busy_timeout(Duration::ZERO).connect().await?;
        let mode: String =
            sqlx::query_scalar("pragma journal_mode = delete").fetch_one(&mut connection).await?;
        connection.close().await?;
        Ok::<_, sqlx::Error>(mode)
    };
    match taken.await {
        Ok(mode) if mode == "delete" => without_logs(database),
        Err(error) if !is_busy(&error) => Err(named(database, error.into())),
        _ => Err(StoreError::Open(format!(
            "the log of {} could not be written into it, for another program has it open: end that program",
            database.display()
        ))),
    }
}

/// Makes sure that nothing lies beside a database that has taken its log in. SQLite passes over a file that it could not
/// remove; whatever database came to have this name would be read with what that file says of this one.
fn without_logs(database: &Path) -> Result<(), StoreError> {
    let left = data_folder::logs_of(database);
    let Some((_, log)) = left.first() else { return Ok(()) };
    Err(StoreError::Open(format!(
        "{} was written into {}, and then could not be removed: see whether the disk and the folder take changes",
        log.display(),
        database.display()
    )))
}

/// Reads what a database is made of, and changes nothing.
async fn first_page(database: &Path) -> Result<(), sqlx::Error> {
    let mut connection = existing(database).read_only(true).connect().await?;
    let read = sqlx::query("select count(*) from sqlite_schema").fetch_one(&mut connection).await;
    connection.close().await?;
    read.map(|_| ())
}

/// Reads a database file from end to end; an error when anything in it is damaged, when it is not one of ours, when it is of a
/// newer version, or when it has anything that our steps do not make. What is not as it was written by its own checksum, though the
/// database holds together, is named: all else of it can be read.
pub async fn check(database: &Path) -> Result<Vec<String>, StoreError> {
    let mut connection =
        existing(database).read_only(true).connect().await.map_err(|error| named(database, error.into()))?;
    let checked = async {
        let version = migrations::check(&mut connection).await?;
        whole(database, &mut connection).await?;
        // Before that step there were no checksums.
        if version < CHECKSUMS_SINCE { Ok(Vec::new()) } else { scrub::look_at_all(&mut connection).await }
    };
    let checked = checked.await;
    connection.close().await?;
    checked.map_err(|error| named(database, error))
}

pub(super) fn existing(database: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(database)
        .create_if_missing(false)
        .synchronous(SqliteSynchronous::Full)
        // What a file brings along may name functions; none of them is called but the harmless ones.
        .pragma("trusted_schema", "off")
}

/// Whether every page, index and reference of a database is as it has to be.
async fn whole(database: &Path, connection: &mut SqliteConnection) -> Result<(), StoreError> {
    let told: String = sqlx::query_scalar("pragma integrity_check").fetch_one(&mut *connection).await?;
    if told != "ok" {
        return Err(damaged(database, told));
    }
    let dangling: Option<String> =
        sqlx::query_scalar("select \"table\" from pragma_foreign_key_check limit 1")
            .fetch_optional(connection)
            .await?;
    match dangling {
        Some(table) => Err(damaged(database, format!("a row of {table} names a row that is not there"))),
        None => Ok(()),
    }
}

/// Of a database that is not the server's own it is said which it is.
fn named(database: &Path, error: StoreError) -> StoreError {
    match error {
        StoreError::Corrupt(why) => damaged(database, why),
        other => other,
    }
}

fn damaged(database: &Path, why: String) -> StoreError {
    StoreError::Damaged { what: format!("database {}", database.display()), why }
}
