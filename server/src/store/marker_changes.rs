//! The history of the markers: what each was, and what it became.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::many_rows::{placeholders, shaped, shapes};
use super::markers::Place;
use super::{StoreError, columns};
use crate::utc;

/// One change of one marker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MarkerChange {
    /// The marker's name.
    #[schemars(example = &"A17")]
    pub marker: String,
    /// The table's revision after it.
    pub revision: i64,
    /// When.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub changed_at: OffsetDateTime,
    /// Who; `None` where nobody had to sign in.
    #[schemars(example = &"li wei")]
    pub changed_by: Option<String>,
    /// Why; may be empty.
    #[schemars(example = &"survey of November")]
    pub reason: String,
    /// The file that it came with, or whose revert it is.
    pub import_id: Option<Uuid>,
    /// Whether it takes back what the file changed.
    pub is_revert: bool,
    /// Where it stood; `None`: there was none.
    pub before: Option<Place>,
    /// Where it stands now; `None`: it was removed.
    pub after: Option<Place>,
}

impl FromRow<'_, Row> for MarkerChange {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(MarkerChange {
            marker: row.try_get("marker")?,
            revision: row.try_get("revision")?,
            changed_at: columns::instant(row, "changed_at")?,
            changed_by: row.try_get("changed_by")?,
            reason: row.try_get("reason")?,
            import_id: columns::optional_id(row, "import_id")?,
            is_revert: row.try_get("is_revert")?,
            before: place(row, ["before_e_m", "before_n_m", "before_u_m"])?,
            after: place(row, ["after_e_m", "after_n_m", "after_u_m"])?,
        })
    }
}

fn place(row: &Row, [e, n, u]: [&str; 3]) -> sqlx::Result<Option<Place>> {
    let e_m: Option<f64> = row.try_get(e)?;
    let Some(e_m) = e_m else { return Ok(None) };
    Ok(Some(Place { e_m, n_m: row.try_get(n)?, u_m: row.try_get(u)? }))
}

/// Adds one.
pub async fn insert(db: &mut Connection, change: &MarkerChange) -> Result<(), StoreError> {
    insert_all(db, std::slice::from_ref(change)).await
}

/// Adds some. Those of a file are seen when the file's state says that they were made.
pub async fn insert_all(db: &mut Connection, changes: &[MarkerChange]) -> Result<(), StoreError> {
    for rows in shapes(changes, 256) {
        let sql = format!(
            "insert into marker_changes (
                marker, revision, changed_at, changed_by, reason, import_id, is_revert,
                before_e_m, before_n_m, before_u_m, after_e_m, after_n_m, after_u_m
             ) values {}",
            placeholders(rows.len(), 13)
        );
        let query = rows.iter().fold(shaped(sql), |query, change| {
            query
                .bind(change.marker.clone())
                .bind(change.revision)
                .bind(utc::to_us(change.changed_at))
                .bind(change.changed_by.clone())
                .bind(change.reason.clone())
                .bind(change.import_id.map(|id| id.to_string()))
                .bind(change.is_revert)
                .bind(change.before.map(|place| place.e_m))
                .bind(change.before.map(|place| place.n_m))
                .bind(change.before.and_then(|place| place.u_m))
                .bind(change.after.map(|place| place.e_m))
                .bind(change.after.map(|place| place.n_m))
                .bind(change.after.and_then(|place| place.u_m))
        });
        query.execute(&mut *db).await?;
    }
    Ok(())
}

/// Removes so many of a file that were written and not made; whether there were any.
pub async fn clear_some(
    db: impl Executor<'_>,
    import_id: Uuid,
    is_revert: bool,
    at_most: u32,
) -> Result<bool, StoreError> {
    let query = sqlx::query(
        "delete from marker_changes where id in (
            select id from marker_changes where import_id = $1 and is_revert = $2 limit $3)",
    )
    .bind(import_id.to_string())
    .bind(is_revert)
    .bind(i64::from(at_most));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Those of a marker, newest first.
pub async fn of_marker(db: impl Executor<'_>, name: &str) -> Result<Vec<MarkerChange>, StoreError> {
    let query = sqlx::query_as(
        "select * from marker_changes where marker = $1 and (import_id is null or exists (
            select 1 from marker_imports made where made.id = import_id
            and (made.state = 'reverted' or made.state = 'applied' and not is_revert)))
         order by id desc",
    )
    .bind(name);
    Ok(query.fetch_all(db).await?)
}

/// What a file changed, in that order; not what its revert did.
pub async fn of_import(db: impl Executor<'_>, import_id: Uuid) -> Result<Vec<MarkerChange>, StoreError> {
    let query =
        sqlx::query_as("select * from marker_changes where import_id = $1 and not is_revert order by id")
            .bind(import_id.to_string());
    Ok(query.fetch_all(db).await?)
}
