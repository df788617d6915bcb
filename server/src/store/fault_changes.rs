//! The history of the faults: each thing that changed, who changed it, and what was said with it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// One thing that changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultChange {
    /// The fault.
    pub fault_id: Uuid,
    /// When.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub changed_at: OffsetDateTime,
    /// Who; `None` where nobody had to sign in.
    #[schemars(example = &"li wei")]
    pub changed_by: Option<String>,
    /// What.
    pub what: What,
    /// What it was: a word, an id or a text.
    #[schemars(example = &"open")]
    pub before: Option<String>,
    /// What it became.
    #[schemars(example = &"acknowledged")]
    pub after: Option<String>,
    /// What was said with it; may be empty.
    #[schemars(example = &"Spare part ordered")]
    pub comment: String,
}

/// What may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "FaultPart")]
pub enum What {
    /// How far it has come.
    State,
    /// Who is to see to it.
    Assignee,
    /// How bad it is.
    Severity,
    /// What is wrong.
    Kind,
    /// What is said of it.
    Text,
    /// The actuator that was named.
    Marker,
    /// A photo came or went.
    Photo,
    /// Nothing but the comment.
    Comment,
    /// Where it was seen, by its walk's track.
    Place,
}

impl FromRow<'_, Row> for FaultChange {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(FaultChange {
            fault_id: columns::id(row, "fault_id")?,
            changed_at: columns::instant(row, "changed_at")?,
            changed_by: row.try_get("changed_by")?,
            what: columns::word(row, "what")?,
            before: row.try_get("before")?,
            after: row.try_get("after")?,
            comment: row.try_get("comment")?,
        })
    }
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, change: &FaultChange) -> Result<(), StoreError> {
    sqlx::query(
        "insert into fault_changes (fault_id, changed_at, changed_by, what, before, after, comment)
         values ($1, $2, $3, $4, $5, $6, $7)",
    )
    .bind(change.fault_id.to_string())
    .bind(utc::to_us(change.changed_at))
    .bind(&change.changed_by)
    .bind(columns::to_word(change.what))
    .bind(&change.before)
    .bind(&change.after)
    .bind(&change.comment)
    .execute(db)
    .await?;
    Ok(())
}

/// Those of a fault, oldest first.
pub async fn of_fault(db: impl Executor<'_>, fault_id: Uuid) -> Result<Vec<FaultChange>, StoreError> {
    let query = sqlx::query_as("select * from fault_changes where fault_id = $1 order by id")
        .bind(fault_id.to_string());
    Ok(query.fetch_all(db).await?)
}
