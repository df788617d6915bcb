//! Hashes of all that a database holds, to compare two.

use std::collections::BTreeMap;
use std::path::Path;

use futures_util::TryStreamExt;
use sha2::{Digest, Sha256};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, ConnectOptions, Connection, Row, SqliteConnection};

use super::StoreError;
use super::backup::existing;

/// What a database holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hashes {
    /// By table: how many rows, and a hash over all of them in the order of their keys.
    pub tables: BTreeMap<String, (u64, String)>,
    /// By session that has been worked out: the hash of its track as it was worked out, and of the points that are stored of it.
    pub tracks: BTreeMap<String, (String, String)>,
}

/// Reads all of a database, and changes nothing.
pub async fn of(database: &Path) -> Result<Hashes, StoreError> {
    let mut db = existing(database).read_only(true).connect().await?;
    let mut hashes = Hashes::default();
    let names =
        "select name from sqlite_schema where type = 'table' and name not like 'sqlite%' order by name";
    let tables: Vec<String> = sqlx::query_scalar(names).fetch_all(&mut db).await?;
    for table in tables {
        let columns = sqlx::query_scalar("select name from pragma_table_info(?1) order by cid");
        let columns: Vec<String> = columns.bind(&table).fetch_all(&mut db).await?;
        let key = sqlx::query_scalar("select name from pragma_table_info(?1) where pk > 0 order by pk");
        let key: Vec<String> = key.bind(&table).fetch_all(&mut db).await?;
        let order = if key.is_empty() { columns.join(", ") } else { key.join(", ") };
        let quoted: Vec<String> = columns.iter().map(|column| format!("quote({column})")).collect();
        // Names of the schema, which this program has made.
        // As bytes: what has changed on the disk may be no text any more.
        let sql =
            format!("select cast({} as blob) from {table} order by {order}", quoted.join(" || ',' || "));
        hashes.tables.insert(table, hash(&mut db, sql).await?);
    }
    let finished: Vec<(String, String)> = sqlx::query_as(
        "select id, track_sha256 from sessions where track_sha256 is not null and removed_at is null",
    )
    .fetch_all(&mut db)
    .await?;
    for (id, track_sha256) in finished {
        let sql = format!(
            "select cast(quote(t_ns) || quote(e_m) || quote(n_m) || quote(u_m) || quote(heading_rad) as blob) from track_points
             where session_id = '{id}' and run = 'main' || (select shown_result from sessions where id = '{id}')
             order by t_ns"
        );
        let (_, points) = hash(&mut db, sql).await?;
        hashes.tracks.insert(id, (track_sha256, points));
    }
    db.close().await?;
    Ok(hashes)
}

/// How many rows a statement gives, and a hash over them.
async fn hash(db: &mut SqliteConnection, sql: String) -> Result<(u64, String), StoreError> {
    let (mut rows, mut hash) = (0, Sha256::new());
    let mut stream = sqlx::query(AssertSqlSafe(sql)).fetch(db);
    while let Some(row) = stream.try_next().await? {
        hash.update(bytes(&row)?);
        hash.update([0]);
        rows += 1;
    }
    Ok((rows, hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()))
}

fn bytes(row: &SqliteRow) -> sqlx::Result<&[u8]> {
    row.try_get(0)
}
