//! Who or what is positioned: the carriers. Most are people, so clients know them as inspectors.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// The kind of a carrier that is a person.
pub const PERSON: &str = "person";

/// One who walks, or an instrument that is positioned.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Inspector {
    /// Its id.
    pub id: Uuid,
    /// As it is shown; one carrier, one name.
    #[schemars(example = &"Li Na")]
    pub name: String,
    /// `person`, or the kind that a system declares (`GET /systems`, `carrier_kind`).
    #[serde(default = "person")]
    #[schemars(example = &PERSON)]
    pub kind: String,
    /// When it was added.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
}

/// What a carrier is where nothing is said: clients of earlier releases know people alone.
pub fn person() -> String {
    PERSON.to_owned()
}

impl FromRow<'_, Row> for Inspector {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Inspector {
            id: columns::id(row, "id")?,
            name: row.try_get("name")?,
            kind: row.try_get("kind")?,
            created_at: columns::instant(row, "created_at")?,
        })
    }
}

/// All, by name.
pub async fn list(db: impl Executor<'_>) -> Result<Vec<Inspector>, StoreError> {
    Ok(sqlx::query_as("select * from carriers order by name").fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Inspector>, StoreError> {
    let query = sqlx::query_as("select * from carriers where id = $1").bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// The one with this name.
pub async fn by_name(db: impl Executor<'_>, name: &str) -> Result<Option<Inspector>, StoreError> {
    Ok(sqlx::query_as("select * from carriers where name = $1").bind(name).fetch_optional(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, inspector: &Inspector) -> Result<(), StoreError> {
    sqlx::query("insert into carriers (id, name, created_at, kind) values ($1, $2, $3, $4)")
        .bind(inspector.id.to_string())
        .bind(&inspector.name)
        .bind(utc::to_us(inspector.created_at))
        .bind(&inspector.kind)
        .execute(db)
        .await?;
    Ok(())
}

/// Gives one another name; `false` when there is none with this id.
pub async fn rename(db: impl Executor<'_>, id: Uuid, name: &str) -> Result<bool, StoreError> {
    let query = sqlx::query("update carriers set name = $2 where id = $1").bind(id.to_string()).bind(name);
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Removes one who never walked; `false` when there is none with this id. Fails on one with sessions
/// or faults: those say who it was.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<bool, StoreError> {
    let query = sqlx::query("delete from carriers where id = $1").bind(id.to_string());
    Ok(query.execute(db).await?.rows_affected() > 0)
}
