//! Alarms: those that stand, and acknowledging them by name, once for everybody.

use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Json, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::alarms::{self, Acknowledged, Alarm};
use crate::store::webhooks::EventKind;
use crate::store::{audit, webhook_deliveries};
use crate::utc;
use crate::wire::Change;

/// More than are open at once.
const MOST: u32 = 1_000;
/// What was acknowledged is known for so long.
const KEPT: time::Duration = time::Duration::days(90);
/// Characters in a key.
const KEY_LENGTH: usize = 120;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/alarms", Right::Read, standing)
        .about("list_alarms", "Alarms that stand, and from when on something is one")
        .get("/alarms/acknowledged", Right::Read, list)
        .about("list_acknowledged_alarms", "Alarms that somebody has acknowledged, the newest first")
        .post("/alarms/acknowledged", Right::Dispatch, acknowledge)
        .about("acknowledge_alarm", "Acknowledges an alarm for everybody who looks")
}

/// What stands, and what makes an alarm.
#[derive(Serialize, JsonSchema)]
struct Alarms {
    /// A live session of which nothing was heard for so long is lost.
    lost_after_s: u32,
    /// A person who stayed on one spot for so long; 0: never.
    standing_after_s: u32,
    /// Of a session of which nothing was heard for so long none is raised: it left without saying so.
    gone_after_s: u32,
    /// By key; also those that somebody has acknowledged.
    alarms: Vec<Alarm>,
}

async fn standing(State(app): State<App>) -> Result<Json<Alarms>> {
    let config = &app.config;
    Ok(Json(Alarms {
        lost_after_s: config.lost_after_s,
        standing_after_s: config.standing_after_s,
        gone_after_s: config.gone_after_s,
        alarms: alarms::standing(app.store.read()).await?,
    }))
}

async fn list(State(app): State<App>) -> Result<Json<Vec<Acknowledged>>> {
    Ok(Json(alarms::list(app.store.read(), MOST).await?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct AlarmKey {
    /// The alarm's: `fault:ID`, `lost:SESSION:T_NS` or `standing:SESSION:T_NS`.
    #[schemars(example = &"fault:0199f1c8-0000-7000-8000-000000000000")]
    key: String,
}

async fn acknowledge(
    State(app): State<App>,
    caller: Caller,
    Json(AlarmKey { key }): Json<AlarmKey>,
) -> Result<Json<Acknowledged>> {
    let is_key = |c: char| c.is_ascii_alphanumeric() || matches!(c, ':' | '-' | '_');
    if key.is_empty() || key.len() > KEY_LENGTH || !key.chars().all(is_key) {
        return Err(Error::invalid(
            "wrong_key",
            format!(
                "expected a key of 1 to {KEY_LENGTH} letters, digits, colons and hyphens, such as fault:ID, found {} characters: send the alarm's own",
                key.chars().count()
            ),
        ));
    }
    let now = utc::now();
    let new = Acknowledged { key, acknowledged_at: now, acknowledged_by: caller.who.clone() };
    let row = new.clone();
    let is_new = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let is_new = alarms::acknowledge(&mut *db, &row, now - KEPT).await?;
                if is_new {
                    let entry = caller.did("alarm.acknowledged", &row.key, None, None);
                    audit::insert(&mut *db, &entry).await?;
                    webhook_deliveries::announce(db, EventKind::AlarmAcknowledged, &row).await?;
                }
                Ok::<_, Error>(is_new)
            })
        })
        .await?;
    if is_new {
        app.webhooks.notify_one();
        app.hub.publish(Change::Alarm { acknowledged: new.clone() });
        return Ok(Json(new));
    }
    // The first who acknowledged it stays.
    let known = alarms::list(app.store.read(), MOST).await?.into_iter().find(|known| known.key == new.key);
    Ok(Json(known.unwrap_or(new)))
}
