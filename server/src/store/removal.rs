//! A session goes: seen by nobody from one moment on, and out of the tables in pieces, between which others write.

use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor};
use super::track::Place;
use super::{StoreError, columns, stream_chunks, track};
use crate::utc;

/// Points in a piece: some tens of milliseconds.
const POINTS: u32 = 5_000;
/// Chunks of samples in a piece.
const CHUNKS: u32 = 500;

/// Hides a session; `false` when there is none with this id.
pub async fn hide(db: impl Executor<'_>, id: Uuid, at: OffsetDateTime) -> Result<bool, StoreError> {
    let query = sqlx::query("update sessions set removed_at = $2 where id = $1 and removed_at is null")
        .bind(id.to_string())
        .bind(utc::to_us(at));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// The hidden sessions, whose rows are still to go.
pub async fn hidden(db: impl Executor<'_>) -> Result<Vec<Uuid>, StoreError> {
    let rows = sqlx::query("select id from sessions where removed_at is not null").fetch_all(db).await?;
    Ok(rows.iter().map(|row| columns::id(row, "id")).collect::<sqlx::Result<_>>()?)
}

/// The hidden sessions of a carrier.
pub async fn hidden_of(db: impl Executor<'_>, carrier_id: Uuid) -> Result<Vec<Uuid>, StoreError> {
    let query = sqlx::query("select id from sessions where carrier_id = $1 and removed_at is not null");
    let rows = query.bind(carrier_id.to_string()).fetch_all(db).await?;
    Ok(rows.iter().map(|row| columns::id(row, "id")).collect::<sqlx::Result<_>>()?)
}

/// Removes a piece of a hidden session, in the end itself with the few rows that are left; whether there is more to remove.
pub async fn remove_piece(db: &mut Connection, id: Uuid) -> Result<bool, StoreError> {
    for place in [Place::First, Place::Second] {
        if track::clear_some(&mut *db, id, place, POINTS).await? {
            return Ok(true);
        }
    }
    if stream_chunks::remove_some(&mut *db, id, CHUNKS).await? {
        return Ok(true);
    }
    for (table, at_most) in [("raw_chunks", CHUNKS), ("anomalies", POINTS), ("live_states", CHUNKS)] {
        let sql = format!(
            "delete from {table} where id in (select id from {table} where session_id = $1 limit $2)"
        );
        // `table` is one of the words above.
        let query = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(id.to_string()).bind(i64::from(at_most));
        if query.execute(&mut *db).await?.rows_affected() > 0 {
            return Ok(true);
        }
    }
    let query = sqlx::query("delete from sessions where id = $1 and removed_at is not null");
    query.bind(id.to_string()).execute(db).await?;
    Ok(false)
}
