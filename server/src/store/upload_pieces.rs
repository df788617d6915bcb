//! The bytes of logs on their way, piece by piece, where several servers share the database: whichever takes it over goes on with
//! them. A file has no such table, for the bytes lie beside it.

use futures_util::{Stream, TryStreamExt};
use sqlx::Row as _;
use uuid::Uuid;

use super::dialect::Executor;
use super::{StoreError, columns};

/// Adds the piece that begins at this offset. It goes with its log, and when that is finished.
pub async fn insert(
    db: impl Executor<'_>,
    log_id: Uuid,
    offset_bytes: u64,
    body: Vec<u8>,
) -> Result<(), StoreError> {
    sqlx::query("insert into upload_pieces (log_id, offset_bytes, body) values ($1, $2, $3)")
        .bind(log_id.to_string())
        .bind(columns::to_column(offset_bytes))
        .bind(body)
        .execute(db)
        .await?;
    Ok(())
}

/// Those of a log in order.
pub fn of_log<'a>(
    db: impl Executor<'a> + 'a,
    log_id: Uuid,
) -> impl Stream<Item = Result<Vec<u8>, StoreError>> + 'a {
    sqlx::query("select body from upload_pieces where log_id = $1 order by offset_bytes")
        .bind(log_id.to_string())
        .fetch(db)
        .map_err(StoreError::from)
        .and_then(|row| std::future::ready(row.try_get("body").map_err(StoreError::from)))
}
