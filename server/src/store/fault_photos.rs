//! Photos of faults.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// A photo, without its bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "FaultPhoto")]
pub struct Photo {
    /// Its id.
    pub id: Uuid,
    /// The fault.
    pub fault_id: Uuid,
    /// `image/jpeg`, `image/png` or `image/webp`.
    #[schemars(example = &"image/jpeg")]
    pub content_type: String,
    /// Its size, bytes.
    pub size_bytes: u64,
    /// Of its bytes, lower-case hex.
    #[schemars(example = crate::examples::SHA256)]
    pub sha256: String,
    /// When it came.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub created_at: OffsetDateTime,
    /// Who sent it; `None` where nobody had to sign in.
    #[schemars(example = &"li wei")]
    pub created_by: Option<String>,
}

impl FromRow<'_, Row> for Photo {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Photo {
            id: columns::id(row, "id")?,
            fault_id: columns::id(row, "fault_id")?,
            content_type: row.try_get("content_type")?,
            size_bytes: columns::count(row, "size_bytes")?,
            sha256: row.try_get("sha256")?,
            created_at: columns::instant(row, "created_at")?,
            created_by: row.try_get("created_by")?,
        })
    }
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, photo: &Photo, body: &[u8]) -> Result<(), StoreError> {
    sqlx::query(
        "insert into fault_photos (id, fault_id, content_type, size_bytes, sha256, created_at, created_by, body)
         values ($1, $2, $3, $4, $5, $6, $7, $8)",
    )
    .bind(photo.id.to_string())
    .bind(photo.fault_id.to_string())
    .bind(&photo.content_type)
    .bind(columns::to_column(photo.size_bytes))
    .bind(&photo.sha256)
    .bind(utc::to_us(photo.created_at))
    .bind(&photo.created_by)
    .bind(body)
    .execute(db)
    .await?;
    Ok(())
}

/// Those of a fault, oldest first.
pub async fn of_fault(db: impl Executor<'_>, fault_id: Uuid) -> Result<Vec<Photo>, StoreError> {
    let query = sqlx::query_as(
        "select id, fault_id, content_type, size_bytes, sha256, created_at, created_by
         from fault_photos where fault_id = $1 order by created_at, id",
    )
    .bind(fault_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// Content type and bytes of one.
pub async fn body(
    db: impl Executor<'_>,
    fault_id: Uuid,
    id: Uuid,
) -> Result<Option<(String, Vec<u8>)>, StoreError> {
    let query = sqlx::query_as("select content_type, body from fault_photos where fault_id = $1 and id = $2")
        .bind(fault_id.to_string())
        .bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Removes one; `false` when there is none such.
pub async fn delete(db: impl Executor<'_>, fault_id: Uuid, id: Uuid) -> Result<bool, StoreError> {
    let query = sqlx::query("delete from fault_photos where fault_id = $1 and id = $2")
        .bind(fault_id.to_string())
        .bind(id.to_string());
    Ok(query.execute(db).await?.rows_affected() > 0)
}
