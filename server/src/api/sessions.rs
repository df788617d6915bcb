//! Walks.

use axum::extract::State;
use std::collections::BTreeMap;

use lodestep_engine::stream::StreamId;
use lodestep_engine::system::Declaration;
use lodestep_engine::systems::catalogue;
use schemars::JsonSchema;
use serde::Deserialize;
use time::OffsetDateTime;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Json, Listed, MaybeNew, Needs, NoContent, Page, Path, Query, Routes};
use crate::rights::Right;
use crate::sessions::engine_config::engine_config;
use crate::sessions::{parameters, uploads};
use crate::state::App;
use crate::store::inspectors::{self, Inspector};
use crate::store::logs::LogState;
use crate::store::sessions::{self, Filter, Session, SessionState, Start};
use crate::store::{anomalies, audit, clock_ties, columns, logs, markers, removal, visits};
use crate::utc;
use crate::wire::{Change, SessionView};

use super::session_change::{change, end};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions", Right::Read, list)
        .about("list_sessions", "Walks, the newest first")
        .post("/sessions", Right::Walk, create)
        .about("create_session", "Begins a walk")
        .get("/sessions/{id}", Right::Read, show)
        .about("get_session", "One walk with its logs")
        .patch("/sessions/{id}", Needs::OwnSession, change)
        .about(
            "update_session",
            "Changes what people said of a walk; where it matters, the track is computed again",
        )
        .post("/sessions/{id}/end", Needs::OwnSession, end)
        .about("end_session", "Ends a live walk whose device will not; the track is computed")
        .delete("/sessions/{id}", Needs::OwnSession, remove)
        .about("delete_session", "Removes a walk with all that hangs on it")
}

/// Letters in a title.
const TITLE_LENGTH: usize = 200;

/// Years in which a walk may have begun.
const YEARS: std::ops::RangeInclusive<i32> = 1980..=2199;

/// What no text holds: control characters, and what Unicode says will never be one (as U+FFFE), which no XML may hold.
fn is_no_letter(c: char) -> bool {
    c.is_control() || u32::from(c) & 0xFFFE == 0xFFFE || ('\u{FDD0}'..='\u{FDEF}').contains(&c)
}

/// Farther from the site's origin than this, the flat frame is no place to start in, m.
const FARTHEST_M: f64 = 100_000.0;

/// A session as it is asked for.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSession {
    /// Its id, a UUID of the sender's own: sent again after a lost answer, it makes nothing new.
    #[serde(default)]
    pub id: Option<Uuid>,
    /// Who walks.
    pub inspector_id: Uuid,
    /// The instant of `t_ns` = 0; now, when it is left out.
    #[serde(default, with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub started_at: Option<OffsetDateTime>,
    /// Free words.
    #[serde(default)]
    #[schemars(example = &"Ring road, north")]
    pub title: String,
    /// The system that computes it; the one of walks, when it is left out.
    #[serde(default)]
    #[schemars(example = &"pedestrian")]
    pub system: Option<String>,
    /// The streams of its readings; those that the system usually has, when it is left out.
    #[serde(default)]
    #[schemars(with = "Option<Vec<String>>", example = ["left", "right"])]
    pub streams: Option<Vec<StreamId>>,
    /// Where the system's point is at the start; somewhere on the site, when it is left out: then there is no position until a
    /// marker is keyed in.
    pub start: Option<NewStart>,
    /// Heading of the first sensor's x axis, clockwise from true north, degrees; from the magnetometer,
    /// when it is left out.
    pub initial_heading_deg: Option<f64>,
    /// What the instrument is like, TOML as its system documents it (`instrument` in `GET /systems`); asked for by systems
    /// that need it.
    #[serde(default)]
    #[schemars(example = None::<String>)]
    pub instrument: Option<String>,
    /// Whether a stand that is nearly certain is taken for a visit; not, when it is left out.
    #[serde(default)]
    pub automatic_visits: bool,
}

impl NewSession {
    /// Of this carrier, all else as it is when it is left out.
    pub(crate) fn of(inspector_id: Uuid) -> NewSession {
        NewSession {
            id: None,
            inspector_id,
            started_at: None,
            title: String::new(),
            system: None,
            streams: None,
            start: None,
            initial_heading_deg: None,
            instrument: None,
            automatic_visits: false,
        }
    }
}

/// The system of this name; the usual one without one.
pub(super) fn system_named(name: Option<&str>) -> Result<&'static Declaration> {
    let Some(name) = name else { return Ok(catalogue::usual()) };
    catalogue::named(name).ok_or_else(|| {
        let known: Vec<&str> = catalogue::SYSTEMS.iter().map(|system| system.name).collect();
        Error::invalid(
            "unknown_system",
            format!("expected one of the systems {}, found {name:?}: name one of these", known.join(", ")),
        )
    })
}

/// The system of this name, and the streams of these names in the order of their numbers.
fn system_and_streams(
    name: Option<&str>,
    wanted: Option<Vec<StreamId>>,
) -> Result<(&'static Declaration, Vec<StreamId>)> {
    let system = system_named(name)?;
    let Some(wanted) = wanted else {
        return Ok((system, system.usual_streams().iter().map(|stream| stream.id).collect()));
    };
    let all =
        || system.usual_streams().iter().map(|stream| stream.id.to_string()).collect::<Vec<_>>().join(", ");
    let wrong = |found: String| {
        Error::invalid(
            "wrong_feet",
            format!(
                "expected streams of the {} system ({}), found {found}: name those that send readings",
                system.name,
                all()
            ),
        )
    };
    let mut streams = Vec::new();
    for id in wanted {
        streams.push(system.stream(id).ok_or_else(|| wrong(id.to_string()))?);
    }
    if streams.is_empty() {
        return Err(wrong("none".to_owned()));
    }
    streams.sort_by_key(|stream| stream.number);
    streams.dedup();
    system.check_streams(&streams).map_err(|error| Error::invalid("wrong_feet", error.to_string()))?;
    Ok((system, streams.into_iter().map(|stream| stream.id).collect()))
}

/// Whether this carrier can be what the system positions. A person may stand for any: the one who
/// carries the instrument.
pub(super) fn carried_by(system: &Declaration, carrier: &Inspector) -> Result<()> {
    if carrier.kind == inspectors::PERSON || carrier.kind == system.carrier_kind {
        return Ok(());
    }
    Err(Error::conflict(
        "carrier_of_another_kind",
        format!(
            "the {} system positions a carrier of the kind {}, and {} is of the kind {}: choose another carrier or another system",
            system.name, system.carrier_kind, carrier.name, carrier.kind
        ),
    ))
}

/// Bytes of an instrument's document: a hundred times what the largest needs.
const INSTRUMENT_BYTES: usize = 256 << 10;

/// The instrument that a session of this system is told of.
fn checked_instrument(system: &Declaration, told: Option<String>) -> Result<Option<String>> {
    match (&told, system.instrument) {
        (Some(text), Some(_)) if text.len() > INSTRUMENT_BYTES => Err(Error::invalid(
            "wrong_instrument",
            format!(
                "expected an instrument in at most {INSTRUMENT_BYTES} bytes of TOML, found {}: give the document alone",
                text.len()
            ),
        )),
        (Some(_), None) => Err(Error::invalid(
            "wrong_instrument",
            format!("the {} system is told of no instrument: leave it out", system.name),
        )),
        _ => Ok(told),
    }
}

/// Makes sure that the system starts with what the session says: an instrument that it cannot use is refused before
/// anything is stored.
fn starts(app: &App, session: &Session) -> Result<()> {
    let config = engine_config(&app.site, session, &session.streams);
    match lodestep_engine::Session::new(config) {
        Ok(_) => Ok(()),
        Err(error) => Err(Error::invalid("wrong_instrument", error.to_string())),
    }
}

/// `{"marker":"A17"}` or `{"position_m":[e,n,u]}`.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "NewSessionStart")]
pub enum NewStart {
    /// At this marker; at the origin's height where it has none.
    Marker(#[schemars(example = &"A17")] String),
    /// Here, east-north-up, m.
    PositionM([f64; 3]),
}

/// A title within its bounds, without blanks around it.
pub(super) fn checked_title(title: &str) -> Result<String> {
    let title = title.trim();
    if title.chars().count() > TITLE_LENGTH || title.chars().any(is_no_letter) {
        return Err(Error::invalid(
            "wrong_title",
            format!(
                "expected a title of at most {TITLE_LENGTH} letters without line breaks and without what is no letter in Unicode: shorten it"
            ),
        ));
    }
    Ok(title.to_owned())
}

/// Where this start is.
pub(super) async fn place_of(app: &App, start: NewStart) -> Result<Start> {
    match start {
        NewStart::PositionM(position_m) => {
            if position_m.iter().any(|metres| metres.abs() > FARTHEST_M) {
                return Err(Error::invalid(
                    "wrong_start",
                    format!(
                        "expected start.position_m as [east, north, up] within {FARTHEST_M} m of the site's origin, found {position_m:?}: check the frame and the unit"
                    ),
                ));
            }
            Ok(Start { marker: None, position_m, known: true })
        }
        NewStart::Marker(name) => {
            let marker = markers::get(app.store.read(), &name).await?;
            let marker = marker.ok_or_else(|| Error::not_found("marker", &name))?;
            let position_m = [marker.e_m, marker.n_m, marker.u_m.unwrap_or(0.0)];
            Ok(Start { marker: Some(name), position_m, known: true })
        }
    }
}

/// Checks a new session and whether its caller may begin it, puts it on disk in this state and tells the feed.
pub(crate) async fn begin(
    app: &App,
    caller: &Caller,
    new: NewSession,
    state: SessionState,
) -> Result<Session> {
    caller.writes_for(new.inspector_id)?;
    let db = app.store.read();
    let carrier = inspectors::get(db, new.inspector_id)
        .await?
        .ok_or_else(|| Error::not_found("inspector", new.inspector_id))?;
    let (system, streams) = system_and_streams(new.system.as_deref(), new.streams)?;
    carried_by(system, &carrier)?;
    if new.initial_heading_deg.is_some_and(|heading| heading.abs() > 360.0) {
        return Err(Error::invalid(
            "wrong_heading",
            "expected initial_heading_deg from −360 to 360 degrees, clockwise from true north: leave it out to take the heading from the magnetometer",
        ));
    }
    if let Some(at) = new.started_at
        && !YEARS.contains(&at.year())
    {
        return Err(Error::invalid(
            "wrong_time",
            format!(
                "expected started_at in a year from {} to {}, found {}: look at the clock of the device, or leave it out for now",
                YEARS.start(),
                YEARS.end(),
                at.year()
            ),
        ));
    }
    let title = checked_title(&new.title)?;
    let start = match new.start {
        None => Start::default(),
        Some(start) => place_of(app, start).await?,
    };
    let now = utc::now();
    let session = Session {
        id: new.id.unwrap_or_else(Uuid::now_v7),
        inspector_id: new.inspector_id,
        title,
        state,
        // To the microsecond, as it will be read back.
        started_at: new.started_at.map_or(now, |at| utc::from_us(utc::to_us(at))),
        ended_at: None,
        system: system.name.to_owned(),
        streams,
        former: BTreeMap::new(),
        start,
        initial_heading_deg: new.initial_heading_deg,
        instrument: checked_instrument(system, new.instrument)?,
        automatic_visits: new.automatic_visits,
        site_parameters_id: parameters::of_new_session(app).await?,
        excluded: false,
        samples: 0,
        epochs: 0,
        duration_s: 0.0,
        distance_m: 0.0,
        since_marker_s: 0.0,
        since_marker_m: 0.0,
        track_sha256: None,
        error: None,
        created_at: now,
    }
    .with_former_keys();
    starts(app, &session)?;
    let row = session.clone();
    let entry = caller.did("session.added", session.id, None, serde_json::to_value(&session).ok());
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                sessions::insert(&mut *db, &row).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    app.hub.publish(Change::Session { session: Some(session.clone()), deleted: None });
    Ok(session)
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewSession>,
) -> Result<MaybeNew<Json<SessionView>>> {
    if let Some(id) = new.id
        && let Some(session) = sessions::get(app.store.read(), id).await?
    {
        if session.inspector_id != new.inspector_id {
            return Err(Error::conflict(
                "id_taken",
                "there is already a session of another inspector with this id: choose a new UUID",
            ));
        }
        return Ok(MaybeNew::Known(show(State(app), Path(id)).await?));
    }
    let session = begin(&app, &caller, new, SessionState::Created).await?;
    Ok(MaybeNew::New(Json(SessionView {
        session,
        logs: Vec::new(),
        visits: 0,
        anomalies: 0,
        clock_tie: None,
    })))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ListQuery {
    inspector_id: Option<Uuid>,
    state: Option<SessionState>,
    /// With `before_id`, where the page before ended: the link in its header has both.
    before_us: Option<i64>,
    before_id: Option<Uuid>,
    limit: Option<u32>,
}

async fn list(State(app): State<App>, Query(query): Query<ListQuery>) -> Result<Listed<Session>> {
    let page = Page::new((query.before_us, query.before_id), query.limit);
    let filter = Filter { inspector_id: query.inspector_id, state: query.state };
    let rows = sessions::page(app.store.read(), filter, page.before, page.rows_to_read()).await?;
    let asked = [
        ("inspector_id", query.inspector_id.map(|id| id.to_string())),
        ("state", query.state.map(columns::to_word)),
    ];
    Ok(page
        .answer(rows, ("/api/v1/sessions", &asked), |session| (utc::to_us(session.started_at), session.id)))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<SessionView>> {
    let db = app.store.read();
    let session = sessions::get(db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
    Ok(Json(SessionView {
        session,
        logs: logs::of_session(db, id).await?,
        visits: visits::count(db, id).await?,
        anomalies: anomalies::count(db, id).await?,
        clock_tie: clock_ties::of_session(db, id).await?,
    }))
}

/// Removes a walk with its samples; not while a device or a job works on it.
async fn remove(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    let logs = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let session =
                    sessions::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
                if matches!(session.state, SessionState::Live | SessionState::Processing) {
                    return Err(Error::conflict(
                        "session_busy",
                        "this session is live or being processed: wait until it is finished, then delete it",
                    ));
                }
                let logs = logs::of_session(&mut *db, id).await?;
                let accepted = logs.iter().any(|log| log.state == LogState::Accepted);
                if accepted || session.samples > 0 {
                    // Raw samples are kept for ever, but for one who knows what that means.
                    caller.needs(Right::Engineer)?;
                }
                let entry = caller.did("session.removed", id, serde_json::to_value(&session).ok(), None);
                audit::insert(&mut *db, &entry).await?;
                removal::hide(db, id, utc::now()).await?;
                Ok::<_, Error>(logs)
            })
        })
        .await?;
    app.removals.notify_one();
    uploads::forget(&app, &logs).await?;
    app.hub.publish(Change::Session { session: None, deleted: Some(id) });
    Ok(NoContent)
}
