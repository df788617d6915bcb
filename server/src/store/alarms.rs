//! Alarms: those that stand or stood, and those that somebody has acknowledged.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// Something that somebody has to see to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Alarm {
    /// `fault:ID`, `lost:SESSION:T_NS` or `standing:SESSION:T_NS`, with the time on the session's clock since when it has been so.
    #[schemars(example = &"lost:0199f1c8-0000-7000-8000-000000000000:120000000000")]
    pub key: String,
    /// What it is.
    pub kind: AlarmKind,
    /// The walk.
    pub session_id: Option<Uuid>,
    /// Who walks, or who reported the fault.
    pub inspector_id: Option<Uuid>,
    /// The fault.
    pub fault_id: Option<Uuid>,
    /// The last word, the last step, or the report.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub since: OffsetDateTime,
    /// When the server noticed.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub raised_at: OffsetDateTime,
}

/// What an alarm is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AlarmKind {
    /// Nothing has been heard of a live session for some time.
    Lost,
    /// A person has stayed on one spot for long.
    Standing,
    /// A fault of high severity that nobody has taken on.
    Fault,
}

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

impl FromRow<'_, Row> for Alarm {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Alarm {
            key: row.try_get("key")?,
            kind: columns::word(row, "kind")?,
            session_id: columns::optional_id(row, "session_id")?,
            inspector_id: columns::optional_id(row, "carrier_id")?,
            fault_id: columns::optional_id(row, "fault_id")?,
            since: columns::instant(row, "since")?,
            raised_at: columns::instant(row, "raised_at")?,
        })
    }
}

/// Those that stand, by key.
pub async fn standing(db: impl Executor<'_>) -> Result<Vec<Alarm>, StoreError> {
    Ok(sqlx::query_as("select * from alarms where ended_at is null order by key").fetch_all(db).await?)
}

/// Notes that one stands; `false` where it was noted before and has not ended. Those that ended before `forget` go.
pub async fn raise(db: &mut Connection, alarm: &Alarm, forget: OffsetDateTime) -> Result<bool, StoreError> {
    sqlx::query("delete from alarms where ended_at < $1").bind(utc::to_us(forget)).execute(&mut *db).await?;
    let query = sqlx::query(
        "insert into alarms (key, kind, session_id, carrier_id, fault_id, since, raised_at)
         values ($1, $2, $3, $4, $5, $6, $7)
         on conflict (key) do update set raised_at = excluded.raised_at, ended_at = null where alarms.ended_at is not null",
    )
    .bind(&alarm.key)
    .bind(columns::to_word(alarm.kind))
    .bind(alarm.session_id.map(|id| id.to_string()))
    .bind(alarm.inspector_id.map(|id| id.to_string()))
    .bind(alarm.fault_id.map(|id| id.to_string()))
    .bind(utc::to_us(alarm.since))
    .bind(utc::to_us(alarm.raised_at));
    Ok(query.execute(&mut *db).await?.rows_affected() > 0)
}

/// Notes that one stands no longer.
pub async fn end(db: impl Executor<'_>, key: &str, at: OffsetDateTime) -> Result<(), StoreError> {
    sqlx::query("update alarms set ended_at = $2 where key = $1 and ended_at is null")
        .bind(key)
        .bind(utc::to_us(at))
        .execute(db)
        .await?;
    Ok(())
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

/// Those that were acknowledged, the newest first.
pub async fn list(db: impl Executor<'_>, most: u32) -> Result<Vec<Acknowledged>, StoreError> {
    let query =
        sqlx::query_as("select * from alarm_acknowledgements order by acknowledged_at desc, key limit $1")
            .bind(i64::from(most));
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
