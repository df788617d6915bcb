//! What the writer asks of PostgreSQL beside its statements. The log is PostgreSQL's own affair: it is brought to disk at each
//! commit and copied by PostgreSQL itself.

use futures_util::FutureExt;
use sqlx::Row as _;
use tokio::sync::oneshot;

use super::StoreError;
use super::dialect::{ConnectOptions, Connection};
use super::writer::Write;

/// Makes sure that an acknowledgement will mean *on disk*, and that text is compared byte by byte, as SQLite does it.
pub(super) async fn settle(db: &mut Connection) -> Result<(), StoreError> {
    let row = sqlx::query(
        "select current_setting('synchronous_commit') as commits, datcollate, datctype,
            pg_encoding_to_char(encoding) as encoding
         from pg_database where datname = current_database()",
    );
    let row = row.fetch_one(db).await?;
    let commits: &str = row.try_get("commits")?;
    if matches!(commits, "off" | "local") {
        return Err(StoreError::Open(format!(
            "expected a database whose commits are on disk when it says so, found synchronous_commit = {commits}: set it to on"
        )));
    }
    let found: [&str; 3] = [row.try_get("datcollate")?, row.try_get("datctype")?, row.try_get("encoding")?];
    let is_plain = |locale: &str| matches!(locale, "C" | "POSIX");
    if !is_plain(found[0]) || !is_plain(found[1]) || found[2] != "UTF8" {
        return Err(StoreError::Open(format!(
            "expected a database with the collation C and the encoding UTF8, found {}, {} and {}: make it with `createdb --template template0 --locale C --encoding UTF8 NAME`",
            found[0], found[1], found[2]
        )));
    }
    Ok(())
}

/// Waits until no other worker is in a write that reads before it writes, and keeps others waiting until this transaction ends:
/// they are written as if there were one writer. Live records do without; their key keeps others out.
pub(super) async fn be_the_only_one(db: &mut Connection) -> Result<(), sqlx::Error> {
    let lock = "select pg_advisory_xact_lock(hashtextextended('lodestep writes in ' || current_schema(), 0))";
    sqlx::query(lock).execute(db).await?;
    Ok(())
}

/// Copies nothing: PostgreSQL does it.
pub(super) async fn copy_aside(_options: ConnectOptions) -> Result<(), sqlx::Error> {
    Ok(())
}

/// The same.
pub(super) async fn copy(_db: &mut Connection) -> Result<(), sqlx::Error> {
    Ok(())
}

/// A write that changes nothing, to see whether there is room.
pub(super) fn probe() -> Write {
    let (caller, _nobody) = oneshot::channel();
    Write::new(0, |db| touch(db).boxed(), caller)
}

pub(super) async fn touch(db: &mut Connection) -> Result<(), StoreError> {
    sqlx::query("update marker_revision set revision = revision where \"only\" = 1").execute(db).await?;
    Ok(())
}
