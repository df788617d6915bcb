//! Files of markers: compared with the table, applied, reverted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{AssertSqlSafe, FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// A file of markers, without its bytes and its difference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MarkerImport {
    /// Its id.
    pub id: Uuid,
    /// How far it has come.
    pub state: ImportState,
    /// As its sender calls it.
    #[schemars(example = &"anchors.csv")]
    pub file_name: Option<String>,
    /// Whether markers that it does not name are removed.
    pub whole_table: bool,
    /// What it changes.
    #[serde(flatten)]
    pub counts: Counts,
    /// The revision of the table that it was compared with.
    pub compared_revision: i64,
    /// The revision that it made; `None` before, or where it changed nothing.
    pub applied_revision: Option<i64>,
    /// The revision that its revert made.
    pub reverted_revision: Option<i64>,
    /// Why, in the words of the one who applied it.
    #[schemars(example = &"survey of November")]
    pub reason: String,
    /// When it came.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub created_at: OffsetDateTime,
    /// Who sent it; `None` where nobody had to sign in.
    #[schemars(example = &"li wei")]
    pub created_by: Option<String>,
    /// When it was applied.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<crate::utc::Instant>")]
    pub applied_at: Option<OffsetDateTime>,
    /// Who applied it.
    #[schemars(example = &"li wei")]
    pub applied_by: Option<String>,
    /// When it was reverted.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<crate::utc::Instant>")]
    pub reverted_at: Option<OffsetDateTime>,
    /// Who reverted it.
    #[schemars(example = &"li wei")]
    pub reverted_by: Option<String>,
}

/// How many markers a file adds, changes, removes and leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "ImportCounts")]
pub struct Counts {
    /// Were not there.
    pub added: u64,
    /// Stand elsewhere.
    pub changed: u64,
    /// Are not in the file, which is the whole table.
    pub removed: u64,
    /// Stand there already.
    pub unchanged: u64,
}

/// How far a file has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "MarkerImportState")]
pub enum ImportState {
    /// Its difference is known, and nothing of it is in the table.
    Compared,
    /// It is in the table.
    Applied,
    /// It was, and was taken back.
    Reverted,
}

impl FromRow<'_, Row> for MarkerImport {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(MarkerImport {
            id: columns::id(row, "id")?,
            state: columns::word(row, "state")?,
            file_name: row.try_get("file_name")?,
            whole_table: row.try_get("whole_table")?,
            counts: Counts {
                added: columns::count(row, "added")?,
                changed: columns::count(row, "changed")?,
                removed: columns::count(row, "removed")?,
                unchanged: columns::count(row, "unchanged")?,
            },
            compared_revision: row.try_get("compared_revision")?,
            applied_revision: row.try_get("applied_revision")?,
            reverted_revision: row.try_get("reverted_revision")?,
            reason: row.try_get("reason")?,
            created_at: columns::instant(row, "created_at")?,
            created_by: row.try_get("created_by")?,
            applied_at: columns::optional_instant(row, "applied_at")?,
            applied_by: row.try_get("applied_by")?,
            reverted_at: columns::optional_instant(row, "reverted_at")?,
            reverted_by: row.try_get("reverted_by")?,
        })
    }
}

/// Adds one, with its bytes and its plan as JSON.
pub async fn insert(
    db: impl Executor<'_>,
    import: &MarkerImport,
    file: &[u8],
    plan: &str,
) -> Result<(), StoreError> {
    sqlx::query(
        "insert into marker_imports (
            id, state, file_name, file, plan, whole_table, added, changed, removed, unchanged,
            compared_revision, applied_revision, reason, created_at, created_by, applied_at, applied_by
         ) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17)",
    )
    .bind(import.id.to_string())
    .bind(columns::to_word(import.state))
    .bind(&import.file_name)
    .bind(file)
    .bind(plan)
    .bind(import.whole_table)
    .bind(columns::to_column(import.counts.added))
    .bind(columns::to_column(import.counts.changed))
    .bind(columns::to_column(import.counts.removed))
    .bind(columns::to_column(import.counts.unchanged))
    .bind(import.compared_revision)
    .bind(import.applied_revision)
    .bind(&import.reason)
    .bind(utc::to_us(import.created_at))
    .bind(&import.created_by)
    .bind(import.applied_at.map(utc::to_us))
    .bind(&import.applied_by)
    .execute(db)
    .await?;
    Ok(())
}

/// Notes what comparing it once more has found.
pub async fn set_plan(db: impl Executor<'_>, import: &MarkerImport, plan: &str) -> Result<(), StoreError> {
    sqlx::query(
        "update marker_imports set
            plan = $2, whole_table = $3, added = $4, changed = $5, removed = $6, unchanged = $7,
            compared_revision = $8
         where id = $1",
    )
    .bind(import.id.to_string())
    .bind(plan)
    .bind(import.whole_table)
    .bind(columns::to_column(import.counts.added))
    .bind(columns::to_column(import.counts.changed))
    .bind(columns::to_column(import.counts.removed))
    .bind(columns::to_column(import.counts.unchanged))
    .bind(import.compared_revision)
    .execute(db)
    .await?;
    Ok(())
}

/// Notes that it was applied or reverted: its state, revisions, times, persons and reason.
pub async fn set_state(db: impl Executor<'_>, import: &MarkerImport) -> Result<(), StoreError> {
    sqlx::query(
        "update marker_imports set
            state = $2, applied_revision = $3, reverted_revision = $4, reason = $5,
            applied_at = $6, applied_by = $7, reverted_at = $8, reverted_by = $9
         where id = $1",
    )
    .bind(import.id.to_string())
    .bind(columns::to_word(import.state))
    .bind(import.applied_revision)
    .bind(import.reverted_revision)
    .bind(&import.reason)
    .bind(import.applied_at.map(utc::to_us))
    .bind(&import.applied_by)
    .bind(import.reverted_at.map(utc::to_us))
    .bind(&import.reverted_by)
    .execute(db)
    .await?;
    Ok(())
}

const WITHOUT_FILE: &str = "select id, state, file_name, whole_table, added, changed, removed, unchanged,
    compared_revision, applied_revision, reverted_revision, reason, created_at, created_by,
    applied_at, applied_by, reverted_at, reverted_by from marker_imports";

/// The newest, newest first.
pub async fn list(db: impl Executor<'_>, most: u32) -> Result<Vec<MarkerImport>, StoreError> {
    let sql = format!("{WITHOUT_FILE} order by created_at desc, id desc limit $1");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).bind(i64::from(most)).fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<MarkerImport>, StoreError> {
    let sql = format!("{WITHOUT_FILE} where id = $1");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).bind(id.to_string()).fetch_optional(db).await?)
}

/// Its plan, as JSON.
pub async fn plan(db: impl Executor<'_>, id: Uuid) -> Result<String, StoreError> {
    let row = sqlx::query("select plan from marker_imports where id = $1").bind(id.to_string());
    Ok(row.fetch_one(db).await?.try_get("plan")?)
}

/// Its bytes.
pub async fn file(db: impl Executor<'_>, id: Uuid) -> Result<Vec<u8>, StoreError> {
    let row = sqlx::query("select file from marker_imports where id = $1").bind(id.to_string());
    Ok(row.fetch_one(db).await?.try_get("file")?)
}

/// Gives one up that was not applied; `false` when there is none such.
pub async fn delete_compared(db: &mut Connection, id: Uuid) -> Result<bool, StoreError> {
    // What was written for it and not made.
    sqlx::query(
        "delete from marker_changes where import_id in (
            select id from marker_imports where id = $1 and state = 'compared')",
    )
    .bind(id.to_string())
    .execute(&mut *db)
    .await?;
    let query =
        sqlx::query("delete from marker_imports where id = $1 and state = 'compared'").bind(id.to_string());
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Gives up those that were compared before then and never applied.
pub async fn delete_forgotten(db: &mut Connection, before: OffsetDateTime) -> Result<(), StoreError> {
    sqlx::query(
        "delete from marker_changes where import_id in (
            select id from marker_imports where state = 'compared' and created_at < $1)",
    )
    .bind(utc::to_us(before))
    .execute(&mut *db)
    .await?;
    sqlx::query("delete from marker_imports where state = 'compared' and created_at < $1")
        .bind(utc::to_us(before))
        .execute(db)
        .await?;
    Ok(())
}
