//! Mappings of columns to channels that people keep under a name.

use lodestep_engine::parse::mapping::Mapping;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// A mapping under a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NamedMapping {
    /// Its id.
    pub id: Uuid,
    /// As it is shown; unique.
    #[schemars(example = &"the blue loggers")]
    pub name: String,
    /// Which column is which channel.
    pub mapping: Mapping,
    /// Whose account made it.
    #[serde(skip)]
    pub created_by: Option<Uuid>,
    /// When it was first kept.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When it was last changed.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub updated_at: OffsetDateTime,
}

impl FromRow<'_, Row> for NamedMapping {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(NamedMapping {
            id: columns::id(row, "id")?,
            name: row.try_get("name")?,
            mapping: columns::json(row, "mapping")?,
            created_by: columns::optional_id(row, "created_by")?,
            created_at: columns::instant(row, "created_at")?,
            updated_at: columns::instant(row, "updated_at")?,
        })
    }
}

/// All of them, by name.
pub async fn list(db: impl Executor<'_>) -> Result<Vec<NamedMapping>, StoreError> {
    Ok(sqlx::query_as("select * from mappings order by name").fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<NamedMapping>, StoreError> {
    let query = sqlx::query_as("select * from mappings where id = $1").bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, named: &NamedMapping) -> Result<(), StoreError> {
    sqlx::query(
        "insert into mappings (id, name, mapping, created_at, updated_at, created_by) values ($1, $2, $3, $4, $5, $6)",
    )
    .bind(named.id.to_string())
    .bind(&named.name)
    .bind(columns::to_json(&named.mapping)?)
    .bind(utc::to_us(named.created_at))
    .bind(utc::to_us(named.updated_at))
    .bind(named.created_by.map(|id| id.to_string()))
    .execute(db)
    .await?;
    Ok(())
}

/// Changes the name and the mapping of one; `false` when there is none with this id.
pub async fn update(db: impl Executor<'_>, named: &NamedMapping) -> Result<bool, StoreError> {
    let query = sqlx::query("update mappings set name = $2, mapping = $3, updated_at = $4 where id = $1")
        .bind(named.id.to_string())
        .bind(&named.name)
        .bind(columns::to_json(&named.mapping)?)
        .bind(utc::to_us(named.updated_at));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Removes one; `false` when there is none with this id.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<bool, StoreError> {
    let query = sqlx::query("delete from mappings where id = $1").bind(id.to_string());
    Ok(query.execute(db).await?.rows_affected() > 0)
}
