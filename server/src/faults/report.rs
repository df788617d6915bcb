//! Takes a fault in: checks it, finds where its inspector was, names the candidates, stores and tells it.

use schemars::JsonSchema;
use serde::Deserialize;
use time::OffsetDateTime;
use uuid::Uuid;

use super::clock::clock;
use super::place::{candidates_at, place};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::faults::{self, Fault, FaultState, Severity};
use crate::store::sessions::{self, Session};
use crate::store::webhooks::EventKind;
use crate::store::{audit, inspectors, markers, webhook_deliveries};
use crate::utc;
use crate::wire::Change;

/// Letters in the word for what is wrong.
pub(super) const KIND_LENGTH: usize = 60;
/// Letters in what the inspector writes.
pub(super) const TEXT_LENGTH: usize = 2_000;
/// A session holds a moment up to this long after its last point, s.
const AFTER_END_S: i64 = 600;

/// A fault as it is reported.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewFault {
    /// Its id, a UUID of the sender's own: sent again after a lost answer, it makes nothing new.
    pub(crate) id: Option<Uuid>,
    /// Who found it; may be left out with a session.
    pub(crate) inspector_id: Option<Uuid>,
    /// The walk it was found on; without it, the inspector's session at that time.
    pub(crate) session_id: Option<Uuid>,
    /// When; now, when both times are left out.
    #[serde(default, with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<crate::utc::Instant>")]
    pub(crate) reported_at: Option<OffsetDateTime>,
    /// When, seconds since the session's start.
    pub(crate) t_s: Option<f64>,
    /// What is wrong, in a word.
    #[schemars(example = &"leak")]
    pub(crate) kind: String,
    /// How bad it is.
    pub(crate) severity: Severity,
    /// What the inspector wrote.
    #[schemars(example = &"Oil on the rail")]
    pub(crate) text: Option<String>,
    /// The actuator the inspector named.
    #[schemars(example = &"A17")]
    pub(crate) marker: Option<String>,
}

/// The fault that was reported under this id before, if there is one.
pub(crate) async fn reported(app: &App, id: Option<Uuid>) -> Result<Option<Fault>> {
    match id {
        Some(id) => Ok(faults::get(app.store.read(), id).await?),
        None => Ok(None),
    }
}

/// Stores a fault with the inspector's position at that time and the candidates, and tells the feed.
pub(crate) async fn report(app: &App, caller: &Caller, new: NewFault) -> Result<Fault> {
    let db = app.store.read();
    let kind = checked("kind", &new.kind, 1, KIND_LENGTH)?;
    let text = checked("text", new.text.as_deref().unwrap_or_default(), 0, TEXT_LENGTH)?;
    if let Some(name) = &new.marker
        && markers::get(db, name).await?.is_none()
    {
        return Err(Error::invalid(
            "unknown_marker",
            format!(
                "expected the name of a marker, found {name:?}: correct it, or leave it out to be offered candidates"
            ),
        ));
    }
    let now = utc::now();
    let (inspector_id, session, reported_at) = whose(app, &new, now).await?;
    caller.writes_for(inspector_id)?;
    let moment = match &session {
        Some(session) => Some(clock(app, session, now).await?.moment(session, reported_at)),
        None => None,
    };
    let place = match (&session, moment) {
        (Some(session), Some(moment)) => place(app, session, moment).await?,
        _ => None,
    };
    let candidates = match &place {
        None => Vec::new(),
        Some(place) => candidates_at(app, place).await?,
    };
    let fault = Fault {
        id: new.id.unwrap_or_else(Uuid::now_v7),
        inspector_id,
        session_id: session.map(|session| session.id),
        reported_at,
        t_ns: moment.map(|moment| moment.t_ns),
        kind,
        severity: new.severity,
        text,
        marker: new.marker,
        position_m: place.map(|place| place.position_m),
        sigma_m: place.map(|place| place.sigma_m),
        covariance_en_m2: place.map(|place| place.covariance_en_m2),
        candidates,
        state: FaultState::Open,
        assignee_id: None,
        photos: 0,
        version: 1,
        closed_at: None,
        created_at: now,
        updated_at: now,
    };
    let row = fault.clone();
    let caller = caller.clone();
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                faults::insert(&mut *db, &row).await?;
                let after = serde_json::to_value(&row).ok();
                audit::insert(&mut *db, &caller.did("fault.reported", row.id, None, after)).await?;
                webhook_deliveries::announce(db, EventKind::FaultReported, &row).await
            })
        })
        .await?;
    app.hub.publish(Change::Fault { fault: fault.clone() });
    Ok(fault)
}

/// The inspector, the walk, where there is one, and the instant.
async fn whose(
    app: &App,
    new: &NewFault,
    now: OffsetDateTime,
) -> Result<(Uuid, Option<Session>, OffsetDateTime)> {
    let db = app.store.read();
    if new.t_s.is_some() && (new.reported_at.is_some() || new.session_id.is_none()) {
        return Err(Error::invalid(
            "wrong_time",
            "expected either reported_at, or t_s together with session_id: a time in a session needs the session, and one time is enough",
        ));
    }
    let given = new.reported_at.map_or(now, |at| utc::from_us(utc::to_us(at)));
    if let Some(id) = new.session_id {
        let session = sessions::get(db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
        if new.inspector_id.is_some_and(|inspector| inspector != session.inspector_id) {
            return Err(Error::invalid(
                "wrong_inspector",
                "expected the inspector of the session, found another: leave inspector_id out, or correct session_id",
            ));
        }
        let at = match new.t_s {
            None => given,
            // A walk of more than a year is a mistake, not a walk.
            Some(t_s) if (0.0..=3.2e7).contains(&t_s) => {
                utc::at(session.started_at, (t_s * 1e9).round() as i64)
            }
            Some(t_s) => {
                return Err(Error::invalid(
                    "wrong_time",
                    format!("expected t_s in seconds since the session's start, 0 or later, found {t_s}"),
                ));
            }
        };
        return Ok((session.inspector_id, Some(session), at));
    }
    let Some(inspector_id) = new.inspector_id else {
        return Err(Error::invalid(
            "who_is_missing",
            "expected inspector_id or session_id, found neither: say who found it",
        ));
    };
    if inspectors::get(db, inspector_id).await?.is_none() {
        return Err(Error::not_found("inspector", inspector_id));
    }
    let session = sessions::of_inspector_at(db, inspector_id, given)
        .await?
        .filter(|session| session.ended_at.is_none_or(|end| (given - end).whole_seconds() <= AFTER_END_S));
    Ok((inspector_id, session, given))
}

/// Words within their bounds, without blanks around them.
pub(super) fn checked(field: &str, words: &str, least: usize, most: usize) -> Result<String> {
    let words = words.trim();
    let length = words.chars().count();
    if length < least || length > most {
        return Err(Error::invalid(
            "wrong_field",
            format!(
                "expected {field} with {least} to {most} letters, found {length}: write it shorter, or write something"
            ),
        ));
    }
    // A text may have lines; a kind is a word or two, and nothing is for a terminal to obey.
    let is_wrong = |c: char| c.is_control() && !(field != "kind" && matches!(c, '\n' | '\r' | '\t'));
    if let Some(wrong) = words.chars().find(|c| is_wrong(*c)) {
        return Err(Error::invalid(
            "wrong_field",
            format!(
                "expected {field} in letters, found the control character U+{:04X}: leave it out",
                u32::from(wrong)
            ),
        ));
    }
    Ok(words.to_owned())
}
