//! Sets of parameters that engineers keep under a name.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// Values for some parameters under a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterSet {
    /// Its id.
    pub id: Uuid,
    /// As it is shown; unique.
    #[schemars(example = &"less noise")]
    pub name: String,
    /// What it is for; may be empty.
    #[schemars(example = &"for the new soles")]
    pub about: String,
    /// By key; only what differs from the default.
    pub parameters: BTreeMap<String, f64>,
    /// Counts its changes.
    pub version: i64,
    /// When it was made.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// By whom; `None` where nobody had to sign in.
    #[schemars(example = &"li wei")]
    pub created_by: Option<String>,
    /// When it was last changed.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub updated_at: OffsetDateTime,
}

impl FromRow<'_, Row> for ParameterSet {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(ParameterSet {
            id: columns::id(row, "id")?,
            name: row.try_get("name")?,
            about: row.try_get("about")?,
            parameters: columns::json(row, "parameters")?,
            version: row.try_get("version")?,
            created_at: columns::instant(row, "created_at")?,
            created_by: row.try_get("created_by")?,
            updated_at: columns::instant(row, "updated_at")?,
        })
    }
}

/// All of them, by name.
pub async fn list(db: impl Executor<'_>) -> Result<Vec<ParameterSet>, StoreError> {
    Ok(sqlx::query_as("select * from parameter_sets order by name").fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<ParameterSet>, StoreError> {
    let query = sqlx::query_as("select * from parameter_sets where id = $1").bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, set: &ParameterSet) -> Result<(), StoreError> {
    sqlx::query(
        "insert into parameter_sets (id, name, about, parameters, version, created_at, created_by, updated_at)
         values ($1, $2, $3, $4, $5, $6, $7, $8)",
    )
    .bind(set.id.to_string())
    .bind(&set.name)
    .bind(&set.about)
    .bind(columns::to_json(&set.parameters)?)
    .bind(set.version)
    .bind(utc::to_us(set.created_at))
    .bind(&set.created_by)
    .bind(utc::to_us(set.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Writes one as it now stands.
pub async fn update(db: impl Executor<'_>, set: &ParameterSet) -> Result<(), StoreError> {
    sqlx::query(
        "update parameter_sets set name = $2, about = $3, parameters = $4, version = $5, updated_at = $6
         where id = $1",
    )
    .bind(set.id.to_string())
    .bind(&set.name)
    .bind(&set.about)
    .bind(columns::to_json(&set.parameters)?)
    .bind(set.version)
    .bind(utc::to_us(set.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Removes one; runs that were made with it keep its values.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from parameter_sets where id = $1").bind(id.to_string()).execute(db).await?;
    Ok(())
}
