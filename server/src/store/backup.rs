//! A copy of everything that is kept, made while the server goes on.

use std::path::Path;

use sqlx::sqlite::{SqliteConnectOptions, SqliteSynchronous};
use sqlx::{ConnectOptions, Connection, SqliteConnection};

use super::StoreError;

/// Writes a copy of the database in `database` to the new file `copy`: as it stands at one moment, packed, whatever
/// is written meanwhile.
pub async fn copy(database: &Path, copy: &Path) -> Result<(), StoreError> {
    let mut connection = SqliteConnectOptions::new()
        .filename(database)
        .create_if_missing(false)
        .synchronous(SqliteSynchronous::Full)
        .busy_timeout(std::time::Duration::from_secs(10))
        .connect()
        .await?;
    sqlx::query("vacuum into ?1").bind(copy.to_string_lossy().into_owned()).execute(&mut connection).await?;
    connection.close().await?;
    check(copy).await
}

/// Reads a database file from end to end; an error when anything in it is damaged, or when it is not one of ours.
pub async fn check(database: &Path) -> Result<(), StoreError> {
    let damaged = |why: String| StoreError::Damaged { what: database.display().to_string(), why };
    let mut connection: SqliteConnection = SqliteConnectOptions::new()
        .filename(database)
        .create_if_missing(false)
        .read_only(true)
        .connect()
        .await?;
    let told: String = sqlx::query_scalar("pragma integrity_check").fetch_one(&mut connection).await?;
    if told != "ok" {
        return Err(damaged(told));
    }
    let dangling: Option<String> =
        sqlx::query_scalar("select \"table\" from pragma_foreign_key_check limit 1")
            .fetch_optional(&mut connection)
            .await?;
    if let Some(table) = dangling {
        return Err(damaged(format!("a row of {table} names a row that is not there")));
    }
    let sessions: Result<i64, _> =
        sqlx::query_scalar("select count(*) from sessions").fetch_one(&mut connection).await;
    connection.close().await?;
    sessions
        .map(|_| ())
        .map_err(|_| damaged("it has no table of sessions: it is no database of Lodestep".to_owned()))
}
