//! Takes events from the outbox to those who want them. A try that fails is made again, each time after a longer pause;
//! who does not answer for days is switched off, and what waits for him waits on. At least once: a server that is killed
//! between an answer and its note sends the event again, with the same id.

use std::collections::HashSet;
use std::io::Read as _;
use std::time::{Duration, Instant};

use futures_util::FutureExt;
use time::OffsetDateTime;
use tokio::task::JoinSet;
use uuid::Uuid;

use super::sign::signature;
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::audit;
use crate::store::webhook_deliveries::{self, Delivery, DeliveryState};
use crate::store::webhooks::{self, Webhook};
use crate::utc;

/// The outbox is looked into so often.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// One try takes no longer than this.
const TRY_WITHIN: Duration = Duration::from_secs(8);
/// Each pause is so many times the one before,
const PAUSE_GROWS: f64 = 4.0;
/// up to this, s.
const LONGEST_PAUSE_S: f64 = 4.0 * 3600.0;
/// Bytes of an answer that are kept.
const ANSWER_BYTES: u64 = 500;
/// What has ended is kept for this long, to be looked up.
const KEPT: time::Duration = time::Duration::days(30);

/// Delivers until the server stops.
pub(crate) async fn work(app: App) {
    let agent = agent();
    let mut busy: HashSet<Uuid> = HashSet::new();
    let mut tasks = JoinSet::new();
    let mut cleaned: Option<Instant> = None;
    loop {
        tokio::select! {
            () = tokio::time::sleep(LOOK_EVERY) => {}
            () = app.webhooks.notified() => {}
            Some(ended) = tasks.join_next() => {
                match ended {
                    Ok(id) => { busy.remove(&id); }
                    // Which one is not told: all are looked at again.
                    Err(error) => {
                        tracing::error!(%error, "a delivery ended badly: {error}");
                        busy.clear();
                    }
                }
            }
            () = app.stopping.cancelled() => break,
        }
        match webhook_deliveries::due(app.store.read(), utc::now()).await {
            Ok(due) => {
                for id in due {
                    // One after the other to each, so that a slow one keeps nobody else waiting.
                    if busy.insert(id) {
                        tasks.spawn(deliver_to(app.clone(), agent.clone(), id));
                    }
                }
            }
            Err(error) => tracing::error!(%error, "the outbox of webhooks could not be read: {error}"),
        }
        if cleaned.is_none_or(|at| at.elapsed() > Duration::from_secs(3600)) {
            cleaned = Some(Instant::now());
            let (before, latest) = (utc::now() - KEPT, utc::now() + longest_pause());
            let forgotten = app
                .store
                .writer()
                .run(move |db| {
                    async move {
                        webhook_deliveries::wait_until_at_most(&mut *db, latest).await?;
                        webhook_deliveries::forget_before(db, before).await
                    }
                    .boxed()
                })
                .await;
            if let Err(error) = forgotten {
                tracing::warn!(%error, "old deliveries of webhooks could not be forgotten: {error}");
            }
        }
    }
    // What is under way is let go; where its end is not noted it is sent again at the next start.
    tasks.abort_all();
}

fn longest_pause() -> time::Duration {
    time::Duration::seconds_f64(LONGEST_PAUSE_S)
}

/// No redirects: who registered a URL meant that one. No proxy: a site's intranet has none, and what the environment says is
/// meant for others. Certificates are those that the machine trusts.
fn agent() -> ureq::Agent {
    let tls = ureq::tls::TlsConfig::builder().root_certs(ureq::tls::RootCerts::PlatformVerifier).build();
    ureq::Agent::config_builder()
        .timeout_global(Some(TRY_WITHIN))
        .max_redirects(0)
        .max_redirects_will_error(false)
        .http_status_as_error(false)
        .proxy(None)
        .user_agent(concat!("lodestep/", env!("CARGO_PKG_VERSION")))
        .tls_config(tls)
        .build()
        .into()
}

/// Sends what is due to one, in its order.
async fn deliver_to(app: App, agent: ureq::Agent, webhook_id: Uuid) -> Uuid {
    while !app.stopping.is_cancelled() {
        match deliver_next(&app, &agent, webhook_id).await {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => {
                tracing::error!(%webhook_id, %error, "a delivery could not be noted: {error}");
                tokio::time::sleep(LOOK_EVERY).await;
                break;
            }
        }
    }
    webhook_id
}

/// `false` when nothing is due.
async fn deliver_next(app: &App, agent: &ureq::Agent, webhook_id: Uuid) -> Result<bool> {
    let db = app.store.read();
    let Some(delivery) = webhook_deliveries::next_of(db, webhook_id, utc::now()).await? else {
        return Ok(false);
    };
    let (Some(hook), Some(secret)) =
        (webhooks::get(db, webhook_id).await?, webhooks::secret(db, webhook_id).await?)
    else {
        return Ok(false);
    };
    let (agent, sent) = (agent.clone(), delivery.clone());
    let begun = Instant::now();
    let tried = tokio::task::spawn_blocking(move || post(&agent, &hook, &secret, &sent)).await;
    let answer = tried.unwrap_or_else(|error| Answer { status: None, text: error.to_string() });
    note(app, delivery, answer, begun.elapsed()).await?;
    Ok(true)
}

/// What came back.
struct Answer {
    status: Option<u16>,
    /// Its first bytes, or why there was none.
    text: String,
}

fn post(agent: &ureq::Agent, hook: &Webhook, secret: &str, delivery: &Delivery) -> Answer {
    let unix_s = utc::now().unix_timestamp();
    let sent = agent
        .post(&hook.url)
        .header("Content-Type", "application/json")
        .header("Lodestep-Event", delivery.event.word())
        .header("Lodestep-Event-Id", delivery.event_id.to_string())
        .header("Lodestep-Signature", signature(secret, unix_s, &delivery.body))
        .send(delivery.body.as_bytes());
    match sent {
        Ok(mut response) => {
            let mut bytes = Vec::new();
            // An answer that breaks off was an answer: its status counts.
            let _ = response.body_mut().as_reader().take(ANSWER_BYTES).read_to_end(&mut bytes);
            let text = String::from_utf8_lossy(&bytes).into_owned();
            Answer { status: Some(response.status().as_u16()), text }
        }
        Err(error) => Answer { status: None, text: error.to_string() },
    }
}

/// Writes down what became of a try, and what follows from it.
async fn note(app: &App, delivery: Delivery, answer: Answer, took: Duration) -> Result<()> {
    let now = utc::now();
    let arrived = answer.status.is_some_and(|status| (200..300).contains(&status));
    let give_up_after = time::Duration::seconds_f64(app.config.webhook_give_up_s);
    let tries = delivery.tries + 1;
    let next_at = now + pause(app.config.webhook_retry_s, tries);
    metrics::counter!("lodestep_webhook_tries_total", "arrived" => if arrived { "yes" } else { "no" })
        .increment(1);
    let tried = Delivery {
        tries,
        tried_at: Some(now),
        took_ms: i64::try_from(took.as_millis()).ok(),
        status: answer.status,
        answer: Some(answer.text),
        ..delivery
    };
    let disabled = app
        .store
        .writer()
        .run(move |db| {
            async move {
                let Some(hook) = webhooks::get(&mut *db, tried.webhook_id).await? else { return Ok(None) };
                // While others arrive it is this one that is not wanted; while none does, all of them wait.
                let unwanted = now - tried.created_at >= give_up_after
                    && webhook_deliveries::any_arrived_since(&mut *db, hook.id, tried.created_at).await?;
                let (state, next_at) = match (arrived, unwanted) {
                    (true, _) => (DeliveryState::Delivered, None),
                    (false, true) => (DeliveryState::Failed, None),
                    (false, false) => (DeliveryState::Waiting, Some(next_at)),
                };
                let tried = Delivery { state, next_at, ..tried };
                webhook_deliveries::update(&mut *db, &tried).await?;
                let since = hook.failing_since.unwrap_or(now);
                let failing = !arrived && state != DeliveryState::Failed;
                webhooks::set_failing_since(&mut *db, hook.id, failing.then_some(since)).await?;
                if !failing || !hook.enabled || now - since < give_up_after {
                    return Ok(None);
                }
                let disabled = switched_off(&hook, since, now, &tried);
                webhooks::update(&mut *db, &disabled).await?;
                let (before, after) =
                    (serde_json::to_value(&hook).ok(), serde_json::to_value(&disabled).ok());
                let entry = Caller::itself("webhooks").did("webhook.disabled", hook.id, before, after);
                audit::insert(&mut *db, &entry).await?;
                Ok::<_, Error>(Some(disabled))
            }
            .boxed()
        })
        .await?;
    if let Some(hook) = disabled {
        let why = hook.disabled_why.unwrap_or_default();
        tracing::warn!(webhook_id = %hook.id, "a webhook was switched off: {why}");
    }
    Ok(())
}

fn switched_off(hook: &Webhook, since: OffsetDateTime, now: OffsetDateTime, last: &Delivery) -> Webhook {
    let hours = (now - since).whole_hours();
    let answer = match last.status {
        Some(status) => format!("the last answer was {status}"),
        None => format!("the last try ended with: {}", last.answer.as_deref().unwrap_or_default()),
    };
    Webhook {
        enabled: false,
        disabled_why: Some(format!(
            "expected an answer of 2xx, found none for {hours} h ({answer}): what waits is kept; put the receiver right, then switch the webhook on again"
        )),
        failing_since: Some(since),
        version: hook.version + 1,
        updated_at: now,
        ..hook.clone()
    }
}

/// How long after so many tries the next one is made.
fn pause(first_s: f64, tries: u64) -> time::Duration {
    let exponent = i32::try_from(tries.saturating_sub(1)).unwrap_or(i32::MAX).min(30);
    time::Duration::seconds_f64((first_s * PAUSE_GROWS.powi(exponent)).min(LONGEST_PAUSE_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_up_to_four_hours() {
        let s = |tries| pause(10.0, tries).whole_seconds();
        assert_eq!([s(1), s(2), s(3), s(4)], [10, 40, 160, 640]);
        assert_eq!(s(8), 14_400);
        assert_eq!(s(u64::MAX), 14_400);
    }
}
