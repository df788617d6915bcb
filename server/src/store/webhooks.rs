//! Other programs that want to hear of events.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// One of them, without its secret.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Webhook {
    /// Its id.
    pub id: Uuid,
    /// What it is for.
    #[schemars(example = &"tickets")]
    pub name: String,
    /// Where events are posted to.
    #[schemars(example = &"https://tickets.example/lodestep")]
    pub url: String,
    /// Which events it wants.
    pub events: Vec<EventKind>,
    /// Whether anything is sent.
    pub enabled: bool,
    /// Why it was switched off, where nothing arrived for long.
    #[schemars(example = None::<&str>)]
    pub disabled_why: Option<String>,
    /// Since when every try has failed.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub failing_since: Option<OffsetDateTime>,
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

/// What may be heard of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "WebhookEvent")]
pub enum EventKind {
    /// A fault was reported.
    #[serde(rename = "fault.reported")]
    FaultReported,
    /// A fault was changed, or taken a step further.
    #[serde(rename = "fault.changed")]
    FaultChanged,
    /// Something is wrong with a sensor or its data.
    #[serde(rename = "anomalies.found")]
    AnomaliesFound,
    /// Somebody is lost or has stood for long, or a fault of high severity is open.
    #[serde(rename = "alarm.raised")]
    AlarmRaised,
    /// Somebody sees to an alarm.
    #[serde(rename = "alarm.acknowledged")]
    AlarmAcknowledged,
    /// Somebody tries the webhook out.
    #[serde(rename = "test")]
    Test,
}

impl EventKind {
    /// As it is told.
    pub fn word(self) -> &'static str {
        match self {
            EventKind::FaultReported => "fault.reported",
            EventKind::FaultChanged => "fault.changed",
            EventKind::AnomaliesFound => "anomalies.found",
            EventKind::AlarmRaised => "alarm.raised",
            EventKind::AlarmAcknowledged => "alarm.acknowledged",
            EventKind::Test => "test",
        }
    }
}

impl FromRow<'_, Row> for Webhook {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Webhook {
            id: columns::id(row, "id")?,
            name: row.try_get("name")?,
            url: row.try_get("url")?,
            events: columns::json(row, "events")?,
            enabled: row.try_get("enabled")?,
            disabled_why: row.try_get("disabled_why")?,
            failing_since: columns::optional_instant(row, "failing_since")?,
            version: row.try_get("version")?,
            created_at: columns::instant(row, "created_at")?,
            created_by: row.try_get("created_by")?,
            updated_at: columns::instant(row, "updated_at")?,
        })
    }
}

/// All of them, by name.
pub async fn list(db: impl Executor<'_>) -> Result<Vec<Webhook>, StoreError> {
    Ok(sqlx::query_as("select * from webhooks order by name, id").fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Webhook>, StoreError> {
    let query = sqlx::query_as("select * from webhooks where id = $1").bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// What the bodies of one are signed with.
pub async fn secret(db: impl Executor<'_>, id: Uuid) -> Result<Option<String>, StoreError> {
    let query = sqlx::query_scalar("select secret from webhooks where id = $1").bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Whether anybody wants to hear of this.
pub async fn anybody_wants(db: impl Executor<'_>, event: EventKind) -> Result<bool, StoreError> {
    let query = sqlx::query_scalar(
        "select exists (select 1 from webhooks, json_each(webhooks.events) where enabled and value = $1)",
    )
    .bind(event.word());
    Ok(query.fetch_one(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, hook: &Webhook, secret: &str) -> Result<(), StoreError> {
    sqlx::query(
        "insert into webhooks (id, name, url, secret, events, enabled, version, created_at, created_by, updated_at)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
    )
    .bind(hook.id.to_string())
    .bind(&hook.name)
    .bind(&hook.url)
    .bind(secret)
    .bind(columns::to_json(&hook.events)?)
    .bind(hook.enabled)
    .bind(hook.version)
    .bind(utc::to_us(hook.created_at))
    .bind(&hook.created_by)
    .bind(utc::to_us(hook.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Writes one as it now stands.
pub async fn update(db: impl Executor<'_>, hook: &Webhook) -> Result<(), StoreError> {
    sqlx::query(
        "update webhooks set name = $2, url = $3, events = $4, enabled = $5, disabled_why = $6, failing_since = $7,
            version = $8, updated_at = $9
         where id = $1",
    )
    .bind(hook.id.to_string())
    .bind(&hook.name)
    .bind(&hook.url)
    .bind(columns::to_json(&hook.events)?)
    .bind(hook.enabled)
    .bind(&hook.disabled_why)
    .bind(hook.failing_since.map(utc::to_us))
    .bind(hook.version)
    .bind(utc::to_us(hook.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Gives one another secret.
pub async fn set_secret(db: impl Executor<'_>, id: Uuid, secret: &str) -> Result<(), StoreError> {
    sqlx::query("update webhooks set secret = $2 where id = $1")
        .bind(id.to_string())
        .bind(secret)
        .execute(db)
        .await?;
    Ok(())
}

/// Notes since when every try has failed; `None`: the last one did not.
pub async fn set_failing_since(
    db: impl Executor<'_>,
    id: Uuid,
    since: Option<OffsetDateTime>,
) -> Result<(), StoreError> {
    sqlx::query("update webhooks set failing_since = $2 where id = $1")
        .bind(id.to_string())
        .bind(since.map(utc::to_us))
        .execute(db)
        .await?;
    Ok(())
}

/// Removes one with all that was on its way to it.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from webhooks where id = $1").bind(id.to_string()).execute(db).await?;
    Ok(())
}
