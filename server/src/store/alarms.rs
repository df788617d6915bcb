//! Alarms that somebody has acknowledged.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;

use super::dialect::{Connection, Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// An alarm that was acknowledged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Acknowledged {
    /// What the alarm is about.
    #[schemars(example = &"fault:0199f1c8-0000-7000-8000-000000000000")]
    pub key: String,
    /// When.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub acknowledged_at: OffsetDateTime,
    /// Who.
    #[schemars(example = &"Zhao Lei")]
    pub acknowledged_by: String,
}

impl FromRow<'_, Row> for Acknowledged {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Acknowledged {
            key: row.try_get("key")?,
            acknowledged_at: columns::instant(row, "acknowledged_at")?,
            acknowledged_by: row.try_get("acknowledged_by")?,
        })
    }
}

/// The newest first.
pub async fn list(db: impl Executor<'_>, most: u32) -> Result<Vec<Acknowledged>, StoreError> {
    let query =
        sqlx::query_as("select * from alarm_acknowledgements order by acknowledged_at desc, key limit $1")
            .bind(most);
    Ok(query.fetch_all(db).await?)
}

/// Notes one; the first who acknowledges an alarm stays. `false` where somebody was before. Those from before `forget` go.
pub async fn acknowledge(
    db: &mut Connection,
    new: &Acknowledged,
    forget: OffsetDateTime,
) -> Result<bool, StoreError> {
    sqlx::query("delete from alarm_acknowledgements where acknowledged_at < $1")
        .bind(utc::to_us(forget))
        .execute(&mut *db)
        .await?;
    let query = sqlx::query(
        "insert into alarm_acknowledgements (key, acknowledged_at, acknowledged_by) values ($1, $2, $3)
         on conflict (key) do nothing",
    )
    .bind(&new.key)
    .bind(utc::to_us(new.acknowledged_at))
    .bind(&new.acknowledged_by);
    Ok(query.execute(&mut *db).await?.rows_affected() > 0)
}
