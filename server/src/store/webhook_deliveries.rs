//! What is on its way to other programs: the outbox, written in the transaction of the event.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;
use uuid::Uuid;

use super::anomalies::Gathered;
use super::dialect::{Connection, Executor, Row};
use super::webhooks::{self, EventKind};
use super::{StoreError, columns, sessions};
use crate::utc;

/// Anomalies that one event names; of more it tells how many there are.
const NAMED_ANOMALIES: usize = 50;

/// One event on its way to one webhook.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "WebhookDelivery")]
pub struct Delivery {
    /// Its number, in the order of the events.
    pub id: i64,
    /// Where it goes.
    pub webhook_id: Uuid,
    /// The event's id: the same for every webhook and every try.
    pub event_id: Uuid,
    /// What it tells of.
    pub event: EventKind,
    /// JSON, as it is signed and sent.
    #[schemars(example = &"{}")]
    pub body: String,
    /// How far it has come.
    pub state: DeliveryState,
    /// How often it was tried.
    pub tries: u64,
    /// When it is tried next.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub next_at: Option<OffsetDateTime>,
    /// When it was tried last.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub tried_at: Option<OffsetDateTime>,
    /// How long that took, ms.
    pub took_ms: Option<i64>,
    /// HTTP status of the last answer; `None` where there was none.
    pub status: Option<u16>,
    /// The first bytes of the last answer, or why there was none.
    #[schemars(example = &"ok")]
    pub answer: Option<String>,
    /// When the event happened.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
}

/// How far a delivery has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "WebhookDeliveryState")]
pub enum DeliveryState {
    /// It will be tried.
    Waiting,
    /// It was answered with a status of 2xx.
    Delivered,
    /// It was tried for so long that it was given up.
    Failed,
}

impl FromRow<'_, Row> for Delivery {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        let status: Option<i64> = row.try_get("status")?;
        Ok(Delivery {
            id: row.try_get("id")?,
            webhook_id: columns::id(row, "webhook_id")?,
            event_id: columns::id(row, "event_id")?,
            event: columns::word(row, "event")?,
            body: row.try_get("body")?,
            state: columns::word(row, "state")?,
            tries: columns::count(row, "tries")?,
            next_at: columns::optional_instant(row, "next_at")?,
            tried_at: columns::optional_instant(row, "tried_at")?,
            took_ms: row.try_get("took_ms")?,
            status: status.and_then(|status| u16::try_from(status).ok()),
            answer: row.try_get("answer")?,
            created_at: columns::instant(row, "created_at")?,
        })
    }
}

/// Puts an event into the outbox, for each webhook that wants it: in the transaction in which it happens.
pub async fn announce(
    db: &mut Connection,
    event: EventKind,
    data: &impl Serialize,
) -> Result<(), StoreError> {
    if !webhooks::anybody_wants(&mut *db, event).await? {
        return Ok(());
    }
    let (event_id, now) = (Uuid::now_v7(), utc::now());
    let body = body(event, event_id, now, data)?;
    sqlx::query(
        "insert into webhook_deliveries (webhook_id, event_id, event, body, state, next_at, created_at)
         select id, $1, $2, $3, 'waiting', $4, $4 from webhooks
         where enabled and exists (select 1 from json_each(events) where value = $2) order by id",
    )
    .bind(event_id.to_string())
    .bind(event.word())
    .bind(body)
    .bind(utc::to_us(now))
    .execute(db)
    .await?;
    Ok(())
}

/// The body of an event.
fn body(
    event: EventKind,
    event_id: Uuid,
    at: OffsetDateTime,
    data: &impl Serialize,
) -> Result<String, StoreError> {
    let damaged = |why: String| StoreError::Damaged { what: "event".to_owned(), why };
    let at = at.format(&Rfc3339).map_err(|error| damaged(error.to_string()))?;
    let data: Value = serde_json::to_value(data).map_err(|error| damaged(error.to_string()))?;
    Ok(json!({ "event": event, "id": event_id, "at": at, "data": data }).to_string())
}

/// Puts anomalies of a walk into the outbox.
pub async fn announce_anomalies(
    db: &mut Connection,
    session_id: Uuid,
    found: &[Gathered],
) -> Result<(), StoreError> {
    if found.is_empty() || !webhooks::anybody_wants(&mut *db, EventKind::AnomaliesFound).await? {
        return Ok(());
    }
    let session = sessions::get(&mut *db, session_id).await?;
    let named: Vec<_> =
        found.iter().take(NAMED_ANOMALIES).map(|found| found.clone().of(session_id)).collect();
    let data = json!({
        "session_id": session_id,
        "inspector_id": session.map(|session| session.inspector_id),
        "count": found.iter().map(|found| found.times).sum::<u64>(),
        "anomalies": named,
    });
    announce(db, EventKind::AnomaliesFound, &data).await
}

/// Puts one event for one webhook into the outbox, whatever that wants.
pub async fn announce_to(
    db: &mut Connection,
    webhook_id: Uuid,
    event: EventKind,
    data: &impl Serialize,
) -> Result<Delivery, StoreError> {
    let (event_id, now) = (Uuid::now_v7(), utc::now());
    let query = sqlx::query_as(
        "insert into webhook_deliveries (webhook_id, event_id, event, body, state, next_at, created_at)
         values ($1, $2, $3, $4, 'waiting', $5, $5) returning *",
    )
    .bind(webhook_id.to_string())
    .bind(event_id.to_string())
    .bind(event.word())
    .bind(body(event, event_id, now, data)?)
    .bind(utc::to_us(now));
    Ok(query.fetch_one(db).await?)
}

/// Those of a webhook, the newest first, at most so many.
pub async fn of_webhook(
    db: impl Executor<'_>,
    webhook_id: Uuid,
    at_most: u32,
) -> Result<Vec<Delivery>, StoreError> {
    let query =
        sqlx::query_as("select * from webhook_deliveries where webhook_id = $1 order by id desc limit $2")
            .bind(webhook_id.to_string())
            .bind(i64::from(at_most));
    Ok(query.fetch_all(db).await?)
}

/// The one with this number.
pub async fn get(db: impl Executor<'_>, id: i64) -> Result<Option<Delivery>, StoreError> {
    Ok(sqlx::query_as("select * from webhook_deliveries where id = $1").bind(id).fetch_optional(db).await?)
}

/// Lets nothing wait until later than this: the clock may have been ahead when it was told to wait.
pub async fn wait_until_at_most(db: impl Executor<'_>, latest: OffsetDateTime) -> Result<u64, StoreError> {
    let query =
        sqlx::query("update webhook_deliveries set next_at = $1 where state = 'waiting' and next_at > $1");
    Ok(query.bind(utc::to_us(latest)).execute(db).await?.rows_affected())
}

/// The webhooks that something is to be sent to now.
pub async fn due(db: impl Executor<'_>, now: OffsetDateTime) -> Result<Vec<Uuid>, StoreError> {
    let query = sqlx::query(
        "select distinct d.webhook_id from webhook_deliveries d join webhooks w on w.id = d.webhook_id
         where d.state = 'waiting' and d.next_at <= $1 and w.enabled",
    )
    .bind(utc::to_us(now))
    .try_map(|row: Row| columns::id(&row, "webhook_id"));
    Ok(query.fetch_all(db).await?)
}

/// What is to be sent to this one first.
pub async fn next_of(
    db: impl Executor<'_>,
    webhook_id: Uuid,
    now: OffsetDateTime,
) -> Result<Option<Delivery>, StoreError> {
    let query = sqlx::query_as(
        "select d.* from webhook_deliveries d join webhooks w on w.id = d.webhook_id
         where d.webhook_id = $1 and d.state = 'waiting' and d.next_at <= $2 and w.enabled
         order by d.id limit 1",
    )
    .bind(webhook_id.to_string())
    .bind(utc::to_us(now));
    Ok(query.fetch_optional(db).await?)
}

/// Writes one as it now stands.
pub async fn update(db: impl Executor<'_>, delivery: &Delivery) -> Result<(), StoreError> {
    sqlx::query(
        "update webhook_deliveries set state = $2, tries = $3, next_at = $4, tried_at = $5, took_ms = $6,
            status = $7, answer = $8
         where id = $1",
    )
    .bind(delivery.id)
    .bind(columns::to_word(delivery.state))
    .bind(columns::to_column(delivery.tries))
    .bind(delivery.next_at.map(utc::to_us))
    .bind(delivery.tried_at.map(utc::to_us))
    .bind(delivery.took_ms)
    .bind(delivery.status.map(i64::from))
    .bind(&delivery.answer)
    .execute(db)
    .await?;
    Ok(())
}

/// Whether anything has arrived at a webhook after this instant.
pub async fn any_arrived_since(
    db: impl Executor<'_>,
    webhook_id: Uuid,
    instant: OffsetDateTime,
) -> Result<bool, StoreError> {
    let query = sqlx::query_scalar(
        "select exists (select 1 from webhook_deliveries
            where webhook_id = $1 and state = 'delivered' and tried_at > $2)",
    )
    .bind(webhook_id.to_string())
    .bind(utc::to_us(instant));
    Ok(query.fetch_one(db).await?)
}

/// Forgets those that have ended before this instant.
pub async fn forget_before(db: impl Executor<'_>, instant: OffsetDateTime) -> Result<(), StoreError> {
    sqlx::query("delete from webhook_deliveries where state <> 'waiting' and tried_at < $1")
        .bind(utc::to_us(instant))
        .execute(db)
        .await?;
    Ok(())
}
