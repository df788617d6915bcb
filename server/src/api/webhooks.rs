//! Webhooks: who else is told of faults and anomalies, and what became of it.

use axum::extract::State;
use axum::http::StatusCode;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use uuid::Uuid;

use super::lab::name_of;
use crate::auth::{Caller, Secret};
use crate::error::{Error, Result};
use crate::http::{Accepted, Created, Json, NoContent, Path, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::audit;
use crate::store::webhook_deliveries::{self, Delivery, DeliveryState};
use crate::store::webhooks::{self, EventKind, Webhook};
use crate::utc;

/// Letters in a URL.
const URL_LENGTH: usize = 2_000;
/// Deliveries in a list.
const LISTED: u32 = 100;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/webhooks", Right::Administer, list)
        .about("list_webhooks", "Webhooks, by name")
        .post("/webhooks", Right::Administer, create)
        .about("create_webhook", "Registers a webhook; its secret is shown this once")
        .get("/webhooks/{id}", Right::Administer, show)
        .about("get_webhook", "One webhook")
        .patch("/webhooks/{id}", Right::Administer, change)
        .about("update_webhook", "Changes a webhook, or switches it on or off")
        .delete("/webhooks/{id}", Right::Administer, remove)
        .about("delete_webhook", "Removes a webhook with all that was on its way to it")
        .post("/webhooks/{id}/secret", Right::Administer, renew)
        .about("renew_webhook_secret", "Gives a webhook another secret, shown this once")
        .post("/webhooks/{id}/test", Right::Administer, test)
        .about("test_webhook", "Sends a webhook an event to try it out")
        .get("/webhooks/{id}/deliveries", Right::Administer, deliveries)
        .about(
            "list_webhook_deliveries",
            "What was sent to a webhook, the newest first, with the last answers",
        )
        .post("/webhooks/{id}/deliveries/{number}/again", Right::Administer, again)
        .about("repeat_webhook_delivery", "Sends one event again, now")
}

/// A webhook as it is asked for.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewWebhook {
    /// What it is for.
    #[schemars(example = &"tickets")]
    name: String,
    /// Where events are posted to, http or https.
    #[schemars(example = &"https://tickets.example/lodestep")]
    url: String,
    /// Which events it wants.
    events: Vec<EventKind>,
}

/// A webhook whose secret has just been made: the only time that it is shown.
#[derive(Serialize, JsonSchema)]
struct IssuedWebhook {
    #[serde(flatten)]
    webhook: Webhook,
    #[schemars(example = crate::examples::SECRET)]
    secret: String,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct WebhookChange {
    #[schemars(example = &"tickets")]
    name: Option<String>,
    #[schemars(example = &"https://tickets.example/lodestep")]
    url: Option<String>,
    events: Option<Vec<EventKind>>,
    enabled: Option<bool>,
    /// The version that was seen.
    version: i64,
}

async fn list(State(app): State<App>) -> Result<Json<Vec<Webhook>>> {
    Ok(Json(webhooks::list(app.store.read()).await?))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Webhook>> {
    Ok(Json(known(&app, id).await?))
}

async fn known(app: &App, id: Uuid) -> Result<Webhook> {
    webhooks::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("webhook", id))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewWebhook>,
) -> Result<Created<Json<IssuedWebhook>>> {
    let now = utc::now();
    let hook = Webhook {
        id: Uuid::now_v7(),
        name: name_of(&new.name)?,
        url: checked_url(&new.url)?,
        events: checked_events(new.events)?,
        enabled: true,
        disabled_why: None,
        failing_since: None,
        version: 1,
        created_at: now,
        created_by: caller.account.map(|_| caller.who.clone()),
        updated_at: now,
    };
    let secret = Secret::random().text().to_owned();
    let (row, kept) = (hook.clone(), secret.clone());
    let entry = caller.did("webhook.added", hook.id, None, serde_json::to_value(&hook).ok());
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                webhooks::insert(&mut *db, &row, &kept).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    Ok(Created(Json(IssuedWebhook { webhook: hook, secret })))
}

async fn change(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(change): Json<WebhookChange>,
) -> Result<Json<Webhook>> {
    let name = change.name.as_deref().map(name_of).transpose()?;
    let url = change.url.as_deref().map(checked_url).transpose()?;
    let events = change.events.map(checked_events).transpose()?;
    let hook = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let former = webhooks::get(&mut *db, id).await?;
                let former = former.ok_or_else(|| Error::not_found("webhook", id))?;
                if change.version != former.version {
                    return Err(Error::changed(
                        StatusCode::CONFLICT,
                        "webhook_changed",
                        format!(
                            "expected version {} of this webhook, found {}: it has been changed meanwhile, by somebody or because nothing arrived; look at it and change that",
                            former.version, change.version
                        ),
                        former,
                    ));
                }
                let enabled = change.enabled.unwrap_or(former.enabled);
                let switched_on = enabled && !former.enabled;
                let hook = Webhook {
                    name: name.unwrap_or_else(|| former.name.clone()),
                    url: url.unwrap_or_else(|| former.url.clone()),
                    events: events.unwrap_or_else(|| former.events.clone()),
                    enabled,
                    disabled_why: former.disabled_why.clone().filter(|_| !enabled),
                    // Who is switched on is given the whole time again.
                    failing_since: former.failing_since.filter(|_| !switched_on),
                    version: former.version + 1,
                    updated_at: utc::now(),
                    ..former.clone()
                };
                webhooks::update(&mut *db, &hook).await?;
                let (before, after) = (serde_json::to_value(&former).ok(), serde_json::to_value(&hook).ok());
                audit::insert(db, &caller.did("webhook.changed", id, before, after)).await?;
                Ok::<_, Error>(hook)
            })
        })
        .await?;
    app.webhooks.notify_one();
    Ok(Json(hook))
}

async fn remove(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    let former = known(&app, id).await?;
    let entry = caller.did("webhook.removed", id, serde_json::to_value(&former).ok(), None);
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                webhooks::delete(&mut *db, id).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    Ok(NoContent)
}

async fn renew(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<Json<IssuedWebhook>> {
    let webhook = known(&app, id).await?;
    let secret = Secret::random().text().to_owned();
    let kept = secret.clone();
    let entry = caller.did("webhook.secret_renewed", id, None, None);
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                webhooks::set_secret(&mut *db, id, &kept).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    Ok(Json(IssuedWebhook { webhook, secret }))
}

async fn test(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
) -> Result<Accepted<Json<Delivery>>> {
    let hook = known(&app, id).await?;
    if !hook.enabled {
        return Err(Error::conflict(
            "webhook_disabled",
            "expected a webhook that is switched on, found one that is off: switch it on, then try it out",
        ));
    }
    let entry = caller.did("webhook.tested", id, None, None);
    let data = json!({ "webhook": hook.name, "site": app.site.name });
    let delivery = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let made = webhook_deliveries::announce_to(&mut *db, id, EventKind::Test, &data).await?;
                audit::insert(db, &entry).await?;
                Ok::<_, Error>(made)
            })
        })
        .await?;
    app.webhooks.notify_one();
    Ok(Accepted(Json(delivery)))
}

async fn deliveries(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Vec<Delivery>>> {
    known(&app, id).await?;
    Ok(Json(webhook_deliveries::of_webhook(app.store.read(), id, LISTED).await?))
}

async fn again(
    State(app): State<App>,
    caller: Caller,
    Path((id, number)): Path<(Uuid, i64)>,
) -> Result<Accepted<Json<Delivery>>> {
    let delivery = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let former = webhook_deliveries::get(&mut *db, number).await?;
                let former = former
                    .filter(|delivery| delivery.webhook_id == id)
                    .ok_or_else(|| Error::not_found("delivery", number))?;
                let next = Delivery { state: DeliveryState::Waiting, next_at: Some(utc::now()), ..former };
                webhook_deliveries::update(&mut *db, &next).await?;
                let told = json!({ "delivery": number, "event_id": next.event_id });
                audit::insert(db, &caller.did("webhook.sent_again", id, None, Some(told))).await?;
                Ok::<_, Error>(next)
            })
        })
        .await?;
    app.webhooks.notify_one();
    Ok(Accepted(Json(delivery)))
}

fn checked_events(mut events: Vec<EventKind>) -> Result<Vec<EventKind>> {
    events.sort_unstable();
    events.dedup();
    if events.is_empty() || events.contains(&EventKind::Test) {
        return Err(Error::invalid(
            "wrong_events",
            "expected one or more of fault.reported, fault.changed, anomalies.found, alarm.raised and alarm.acknowledged in events: say what is to be told",
        ));
    }
    Ok(events)
}

/// An absolute http or https URL without a password in it. Any host is fine: a site's own network is where they are.
fn checked_url(text: &str) -> Result<String> {
    let text = text.trim();
    let wrong = |found: &str| {
        Error::invalid(
            "wrong_url",
            format!(
                "expected a URL such as https://tickets.example/lodestep, http or https, without a password in it and at most {URL_LENGTH} letters, found {found}: correct it"
            ),
        )
    };
    if text.chars().count() > URL_LENGTH {
        return Err(wrong("a longer one"));
    }
    let uri: axum::http::Uri = text.parse().map_err(|_| wrong("something else"))?;
    match (uri.scheme_str(), uri.authority()) {
        (Some("http" | "https"), Some(authority)) if authority.as_str().contains('@') => {
            Err(wrong("one with a name or password"))
        }
        (Some("http" | "https"), Some(authority)) if !authority.host().is_empty() => Ok(text.to_owned()),
        (Some(scheme), _) => Err(wrong(&format!("{scheme:?} before the colon"))),
        (None, _) => Err(wrong("one without http:// or https:// before it")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_http_and_https_without_a_password() {
        for good in ["http://10.1.2.3:8080/hook?x=1", "https://tickets.intranet/lodestep", " http://[::1]/ "]
        {
            assert_eq!(checked_url(good).unwrap(), good.trim(), "{good}");
        }
        for bad in [
            "",
            "ftp://a/b",
            "file:///etc/passwd",
            "/hook",
            "a.b/c",
            "http://",
            "http://u:p@h/",
            "javascript:alert(1)",
            "http://a b/",
        ] {
            assert!(checked_url(bad).is_err(), "{bad}");
        }
    }
}
