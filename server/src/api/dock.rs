//! The dock in the evening: walks that wait for their logs, the likeliest for a log first; and a log that is here already.

use std::cmp::Reverse;
use std::collections::HashMap;

use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use time::OffsetDateTime;
use uuid::Uuid;

use crate::error::Result;
use crate::http::{Json, Query, Routes};
use crate::rights::Right;
use crate::sessions::uploads::parse_sha256;
use crate::state::App;
use crate::store::logs::{self, LogState};
use crate::store::sessions::{self, Filter, Session, SessionState};
use crate::store::visits::{self, Origin};
use crate::store::{faults, inspectors};
use crate::utc;

/// More walks than this wait for nobody.
const MOST: usize = 200;
/// A log may end so long before the last marker that was keyed in for it, s: a key is pressed beside a stand.
const SLACK_S: f64 = 60.0;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/waiting", Right::Read, waiting)
        .about("list_waiting_sessions", "Walks that wait for their logs, the likeliest for a log first")
        .get("/known-logs", Right::Read, known)
        .about("list_known_logs", "The walks that hold a log with these bytes already")
}

/// What is known of a log for which a walk is looked for.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct WaitingQuery {
    /// When it began, where its own clock says so.
    #[serde(default, with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    began_at: Option<OffsetDateTime>,
    /// How long it is, s.
    duration_s: Option<f64>,
    /// Who wore the sensors.
    inspector_id: Option<Uuid>,
}

/// A walk that was opened and has no log yet.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
struct WaitingSession {
    /// The walk.
    #[serde(flatten)]
    session: Session,
    /// The inspector's name.
    #[schemars(example = &"Li Na")]
    inspector: String,
    /// Markers keyed in.
    keyed: u64,
    /// From the first to the last marker keyed in, s.
    keyed_span_s: f64,
    /// Faults reported on it.
    faults: u64,
    /// Whether the log is long enough for what was keyed in; true where its length is not given.
    fits: bool,
}

async fn waiting(
    State(app): State<App>,
    Query(query): Query<WaitingQuery>,
) -> Result<Json<Vec<WaitingSession>>> {
    let db = app.store.read();
    let names: HashMap<Uuid, String> =
        inspectors::list(db).await?.into_iter().map(|inspector| (inspector.id, inspector.name)).collect();
    let mut found = Vec::new();
    for state in [SessionState::Created, SessionState::Receiving] {
        let filter = Filter { state: Some(state), inspector_id: None };
        for session in sessions::list(db, filter).await?.into_iter().take(MOST) {
            let logs = logs::of_session(db, session.id).await?;
            if logs.iter().any(|log| log.state == LogState::Accepted) {
                continue;
            }
            let visits = visits::of_session(db, session.id).await?;
            let keyed: Vec<i64> =
                visits.iter().filter(|v| v.origin == Origin::Keyed).map(|v| v.t_start_ns).collect();
            let span_ns = keyed.last().copied().unwrap_or(0) - keyed.first().copied().unwrap_or(0);
            let keyed_span_s = span_ns as f64 / 1e9;
            found.push(WaitingSession {
                inspector: names.get(&session.inspector_id).cloned().unwrap_or_default(),
                keyed: keyed.len() as u64,
                keyed_span_s,
                faults: faults::of_session(db, session.id).await?.len() as u64,
                fits: query.duration_s.is_none_or(|duration_s| keyed_span_s <= duration_s + SLACK_S),
                session,
            });
        }
    }
    // A log without a time of its own was most likely made today: the newest first.
    found.sort_by_key(|walk| {
        let away_us =
            query.began_at.map_or(0, |at| utc::to_us(at).abs_diff(utc::to_us(walk.session.started_at)));
        let anothers = query.inspector_id.is_some_and(|id| id != walk.session.inspector_id);
        (!walk.fits, anothers, away_us, Reverse(walk.session.started_at))
    });
    Ok(Json(found))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct KnownQuery {
    /// Of the bytes as they would be sent.
    #[schemars(example = crate::examples::SHA256)]
    sha256: String,
}

/// A log that is here.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
struct KnownLog {
    /// The log.
    log_id: Uuid,
    /// The stream it was taken for.
    #[schemars(example = &"left")]
    stream: String,
    /// Its walk.
    session: Session,
    /// The inspector's name.
    #[schemars(example = &"Li Na")]
    inspector: String,
}

async fn known(State(app): State<App>, Query(query): Query<KnownQuery>) -> Result<Json<Vec<KnownLog>>> {
    let db = app.store.read();
    let mut found = Vec::new();
    for log in logs::with_bytes(db, &parse_sha256(&query.sha256)?).await? {
        let Some(session) = sessions::get(db, log.session_id).await? else { continue };
        let inspector = inspectors::get(db, session.inspector_id).await?;
        found.push(KnownLog {
            log_id: log.id,
            stream: log.stream.0.to_string(),
            inspector: inspector.map_or_else(String::new, |inspector| inspector.name),
            session,
        });
    }
    Ok(Json(found))
}
