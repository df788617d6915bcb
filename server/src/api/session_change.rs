//! What people correct of a walk: its title, whose it is, where it began, its clock, and whether it counts.

use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value, json};
use uuid::Uuid;

use super::sessions::{NewStart, carried_by, checked_title, place_of, system_named};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Json, Path};
use crate::jobs;
use crate::sessions::stand_choice;
use crate::sessions::uploads::publish_session;
use crate::state::App;
use crate::store::clock_ties::{self, ClockTie, TieState};
use crate::store::sessions::{self, Session, SessionState, Start};
use crate::store::{audit, faults, inspectors};
use crate::utc;
use crate::wire::Change;

/// No clock is off by more, s: ten days.
const LARGEST_OFFSET_S: f64 = 864_000.0;

/// What is to change; what is left out stays.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SessionChange {
    /// Whether a stand that is nearly certain is taken for a visit.
    automatic_visits: Option<bool>,
    /// Free words.
    #[schemars(example = &"Ring road, north")]
    title: Option<String>,
    /// Who walked.
    inspector_id: Option<Uuid>,
    /// Where it began; null: nobody knows.
    #[serde(default, deserialize_with = "given")]
    start: Option<Option<NewStart>>,
    /// The log's time less that by which markers were keyed in, s; null: measured again.
    #[serde(default, deserialize_with = "given")]
    #[schemars(example = &241.5)]
    clock_offset_s: Option<Option<f64>>,
    /// Whether it is left out of the statistics of markers.
    excluded: Option<bool>,
}

/// A field that is null was given; one that is missing was not.
fn given<'de, T: Deserialize<'de>, D: Deserializer<'de>>(field: D) -> Result<Option<Option<T>>, D::Error> {
    Option::<T>::deserialize(field).map(Some)
}

/// Changes a walk and tells the feed; the track is computed again where it follows from what has changed.
pub(super) async fn change(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(change): Json<SessionChange>,
) -> Result<Json<Session>> {
    let db = app.store.read();
    let before = sessions::get(db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
    let next = next(&app, &caller, &before, &change).await?;
    let tie = clock_ties::of_session(db, id).await?;
    let new_tie = change.clock_offset_s.map(|offset_s| given_tie(offset_s, tie.as_ref())).transpose()?;
    let computes_again = next.start != before.start || new_tie.is_some();
    if before.state == SessionState::Live && (computes_again || next.inspector_id != before.inspector_id) {
        return Err(Error::conflict(
            "session_live",
            "expected a walk that is not live, found one that a device streams: change its start, its inspector or its clock when it has ended",
        ));
    }
    if next != before || new_tie.is_some() {
        write(&app, &caller, (before.clone(), next.clone()), (tie, new_tie)).await?;
        publish_session(&app, id).await?;
    }
    if let Some(automatic) = change.automatic_visits.filter(|automatic| *automatic != before.automatic_visits)
    {
        stand_choice::set_automatic(&app, &caller, id, automatic).await?;
    } else if computes_again
        && matches!(before.state, SessionState::Processing | SessionState::Finished | SessionState::Failed)
    {
        jobs::queue::enqueue(&app, id).await?;
    }
    let session = sessions::get(app.store.read(), id).await?;
    Ok(Json(session.ok_or_else(|| Error::not_found("session", id))?))
}

/// Ends a walk that is live, whose device was switched off before it could say so.
pub(super) async fn end(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
) -> Result<Json<Session>> {
    let session =
        sessions::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("session", id))?;
    if session.state != SessionState::Live {
        return Err(Error::conflict(
            "session_not_live",
            "expected a walk that is live, found one that is not: it needs no end",
        ));
    }
    let entry = caller.did("session.ended", id, None, None);
    app.store
        .writer()
        .run(move |db| Box::pin(async move { Ok::<_, Error>(audit::insert(db, &entry).await?) }))
        .await?;
    app.live.finish(&app, &session).await;
    Ok(Json(session))
}

/// The walk with what is to change.
async fn next(app: &App, caller: &Caller, before: &Session, change: &SessionChange) -> Result<Session> {
    let mut next = before.clone();
    if let Some(title) = &change.title {
        next.title = checked_title(title)?;
    }
    if let Some(inspector_id) = change.inspector_id.filter(|id| *id != before.inspector_id) {
        caller.writes_for(inspector_id)?;
        let carrier = inspectors::get(app.store.read(), inspector_id)
            .await?
            .ok_or_else(|| Error::not_found("inspector", inspector_id))?;
        carried_by(system_named(Some(before.system.as_str()))?, &carrier)?;
        next.inspector_id = inspector_id;
    }
    match &change.start {
        None => {}
        Some(None) => next.start = Start::default(),
        Some(Some(start)) => next.start = place_of(app, start.clone()).await?,
    }
    if let Some(excluded) = change.excluded {
        next.excluded = excluded;
    }
    Ok(next)
}

/// The tie with an offset that somebody gave; `None`: it is measured again.
fn given_tie(offset_s: Option<f64>, former: Option<&ClockTie>) -> Result<Option<ClockTie>> {
    let Some(offset_s) = offset_s else { return Ok(None) };
    if offset_s.abs() > LARGEST_OFFSET_S {
        return Err(Error::invalid(
            "wrong_offset",
            format!(
                "expected clock_offset_s within {LARGEST_OFFSET_S} s, found {offset_s}: give the log's time less the keyed one in seconds"
            ),
        ));
    }
    Ok(Some(ClockTie {
        state: TieState::Given,
        offset_s,
        sigma_s: None,
        keyed: former.map_or(0, |tie| tie.keyed),
        matched: 0,
        tied_at: utc::now(),
    }))
}

async fn write(
    app: &App,
    caller: &Caller,
    (before, next): (Session, Session),
    (tie, new_tie): (Option<ClockTie>, Option<Option<ClockTie>>),
) -> Result<()> {
    let id = before.id;
    let (mut was, mut is) = difference(&before, &next);
    if let Some(new) = &new_tie {
        was.insert("clock_tie".to_owned(), json!(tie));
        is.insert("clock_tie".to_owned(), json!(new));
    }
    let entry = caller.did("session.changed", id, Some(Value::Object(was)), Some(Value::Object(is)));
    let moved = next.inspector_id != before.inspector_id;
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                sessions::update(&mut *db, &next).await?;
                match &new_tie {
                    None => {}
                    Some(None) => clock_ties::clear(&mut *db, id).await?,
                    Some(Some(tie)) => clock_ties::set(&mut *db, id, tie).await?,
                }
                if moved {
                    faults::change_inspector(&mut *db, id, next.inspector_id).await?;
                }
                Ok::<_, Error>(audit::insert(db, &entry).await?)
            })
        })
        .await?;
    if moved {
        for fault in faults::of_session(app.store.read(), id).await? {
            app.hub.publish(Change::Fault { fault });
        }
    }
    Ok(())
}

/// Of two values of a walk, the fields in which they differ.
fn difference(before: &Session, next: &Session) -> (Map<String, Value>, Map<String, Value>) {
    let fields = |session: &Session| match json!(session) {
        Value::Object(fields) => fields,
        _ => Map::new(),
    };
    let (before, next) = (fields(before), fields(next));
    let changed = |key: &String| before.get(key) != next.get(key);
    let of = |fields: &Map<String, Value>| {
        fields
            .iter()
            .filter(|(key, _)| changed(key))
            .map(|(key, value)| (key.clone(), value.clone()))
            .collect()
    };
    (of(&before), of(&next))
}
