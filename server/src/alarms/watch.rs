//! Looks for alarms, again and again, and tells what is new or over.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Serialize;

use super::found::found;
use super::{Limits, Watched};
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::alarms::{self, Alarm};
use crate::store::inspectors;
use crate::store::webhook_deliveries;
use crate::store::webhooks::EventKind;
use crate::utc;
use crate::wire::Change;

/// How often it is looked.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Alarms that have ended are known for so long.
const KEPT: time::Duration = time::Duration::days(90);

/// What a webhook is told of an alarm.
#[derive(Serialize)]
struct Told {
    alarm: Alarm,
    /// The inspector's name.
    inspector: Option<String>,
    /// Where the inspector was heard of last, or where the fault is, east-north-up, m.
    position_m: Option<[f64; 3]>,
    sigma_m: Option<[f64; 3]>,
}

/// Watches until the server stops.
pub(crate) async fn work(app: App) {
    let limits = Limits::of(&app.config);
    let mut standing = None;
    while app.stopping.run_until_cancelled(tokio::time::sleep(LOOK_EVERY)).await.is_some() {
        match look(&app, &limits, standing.take()).await {
            Ok(now) => standing = Some(now),
            // Read anew, and tried again.
            Err(error) => tracing::warn!(%error, "alarms could not be looked for: {error}"),
        }
    }
}

/// Looks once; what stands afterwards.
async fn look(
    app: &App,
    limits: &Limits,
    standing: Option<BTreeMap<String, Alarm>>,
) -> Result<BTreeMap<String, Alarm>> {
    let stood = match standing {
        Some(known) => known,
        None => {
            let stored = alarms::standing(app.store.read()).await?;
            stored.into_iter().map(|alarm| (alarm.key.clone(), alarm)).collect()
        }
    };
    let watched = app.hub.watched(limits);
    let now = utc::now();
    let stands = found(&watched, limits, &stood, now);
    let raised: Vec<Alarm> =
        stands.values().filter(|alarm| !stood.contains_key(&alarm.key)).cloned().collect();
    let ended: Vec<String> = stood.keys().filter(|key| !stands.contains_key(*key)).cloned().collect();
    if raised.is_empty() && ended.is_empty() {
        return Ok(stood);
    }
    let mut told = Vec::new();
    for alarm in &raised {
        told.push(told_of(app, &watched, alarm.clone()).await?);
    }
    let over = ended.clone();
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                for key in &over {
                    alarms::end(&mut *db, key, now).await?;
                }
                for told in &told {
                    if alarms::raise(&mut *db, &told.alarm, now - KEPT).await? {
                        webhook_deliveries::announce(&mut *db, EventKind::AlarmRaised, told).await?;
                    }
                }
                Ok::<_, Error>(())
            })
        })
        .await?;
    app.webhooks.notify_one();
    let over = ended.into_iter().map(|key| Change::AlarmEnded { key });
    app.hub.publish_all(over.chain(raised.into_iter().map(|alarm| Change::AlarmRaised { alarm })));
    // Of those that stood, as they were raised.
    let known = |(key, alarm)| {
        let alarm = stood.get(&key).cloned().unwrap_or(alarm);
        (key, alarm)
    };
    Ok(stands.into_iter().map(known).collect())
}

async fn told_of(app: &App, watched: &Watched, alarm: Alarm) -> Result<Told> {
    let inspector = match alarm.inspector_id {
        Some(id) => inspectors::get(app.store.read(), id).await?.map(|inspector| inspector.name),
        None => None,
    };
    let fault = watched.faults.iter().find(|fault| Some(fault.id) == alarm.fault_id);
    let heard = watched.heard.iter().find(|heard| Some(heard.session_id) == alarm.session_id);
    let (position_m, sigma_m) = match (fault, heard) {
        (Some(fault), _) => (fault.position_m, fault.sigma_m),
        (None, Some(heard)) => (Some(heard.position_m), Some(heard.sigma_m)),
        (None, None) => (None, None),
    };
    Ok(Told { alarm, inspector, position_m, sigma_m })
}
