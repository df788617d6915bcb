//! What a site computes its walks with: the newest row holds.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// A set of parameters as it was when it was made the site's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "ParameterSetVersion")]
pub struct SetVersion {
    /// Its id.
    pub id: Uuid,
    /// Its name at that time.
    #[schemars(example = &"less noise")]
    pub name: String,
    /// Its version at that time.
    pub version: i64,
}

/// What walks are computed with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SiteParameters {
    /// Counts the choices; 0 before the first.
    pub id: i64,
    /// The set that was chosen; `None`: every parameter is the default.
    pub set: Option<SetVersion>,
    /// By key; only what differs from the default.
    pub parameters: BTreeMap<String, f64>,
    /// When it was chosen; `None` before the first choice.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub chosen_at: Option<OffsetDateTime>,
    /// By whom; `None` where nobody had to sign in.
    #[schemars(example = &"li wei")]
    pub chosen_by: Option<String>,
}

impl SiteParameters {
    /// Every parameter as it is by default.
    pub fn defaults() -> SiteParameters {
        SiteParameters { id: 0, set: None, parameters: BTreeMap::new(), chosen_at: None, chosen_by: None }
    }
}

impl FromRow<'_, Row> for SiteParameters {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        let set = match columns::optional_id(row, "set_id")? {
            None => None,
            Some(id) => {
                Some(SetVersion { id, name: row.try_get("set_name")?, version: row.try_get("set_version")? })
            }
        };
        Ok(SiteParameters {
            id: row.try_get("id")?,
            set,
            parameters: columns::json(row, "parameters")?,
            chosen_at: columns::optional_instant(row, "chosen_at")?,
            chosen_by: row.try_get("chosen_by")?,
        })
    }
}

/// Those that hold.
pub async fn newest(db: impl Executor<'_>) -> Result<SiteParameters, StoreError> {
    let query = sqlx::query_as("select * from site_parameters order by id desc limit 1");
    Ok(query.fetch_optional(db).await?.unwrap_or_else(SiteParameters::defaults))
}

/// Those of a choice; the defaults for `None`.
pub async fn chosen(db: impl Executor<'_>, id: Option<i64>) -> Result<SiteParameters, StoreError> {
    let Some(id) = id else { return Ok(SiteParameters::defaults()) };
    let query = sqlx::query_as("select * from site_parameters where id = $1").bind(id);
    query.fetch_optional(db).await?.ok_or_else(|| StoreError::Damaged {
        what: format!("the site's parameters {id}"),
        why: "expected a row, found none".to_owned(),
    })
}

/// Adds a choice; its `id` is given by the table.
pub async fn insert(db: impl Executor<'_>, chosen: SiteParameters) -> Result<SiteParameters, StoreError> {
    let set = chosen.set.as_ref();
    let query = sqlx::query_as(
        "insert into site_parameters (set_id, set_name, set_version, parameters, chosen_at, chosen_by)
         values ($1, $2, $3, $4, $5, $6) returning *",
    )
    .bind(set.map(|set| set.id.to_string()))
    .bind(set.map(|set| set.name.clone()))
    .bind(set.map(|set| set.version))
    .bind(columns::to_json(&chosen.parameters)?)
    .bind(chosen.chosen_at.map(utc::to_us))
    .bind(&chosen.chosen_by);
    Ok(query.fetch_one(db).await?)
}
