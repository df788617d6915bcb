//! A device's hello: which session it is about, and whether it can be streamed.

use lodestep_engine::parse::live_message::{Hello, NextSequence, Start};
use lodestep_engine::session::{SessionConfig, Solution};
use uuid::Uuid;

use crate::api;
use crate::api::sessions::{NewSession, NewStart};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::sessions::engine_config::engine_config;
use crate::sessions::identification::identification;
use crate::sessions::parameters;
use crate::state::App;
use crate::store::sessions::{self, Session, SessionState};
use crate::store::{StoreError, stream_chunks};

/// How far one stream may run ahead of the other in a stream before the walk goes on without it, ns.
const MAX_LEAD_NS: i64 = 1_000_000_000;

/// What a hello leads to.
#[derive(Debug)]
pub(super) enum Opened {
    /// A session that takes samples.
    Live(Box<Session>),
    /// A session that was streamed and finished: the device missed the answer.
    Over(Uuid, NextSequence),
}

/// Finds or begins the session that a hello is about, for who may write it.
pub(super) async fn open(app: &App, caller: &Caller, hello: Hello) -> Result<Opened> {
    caller.needs(Right::Walk)?;
    match hello {
        Hello::Continue { session_id } => go_on(app, caller, &session_id).await,
        Hello::Begin { inspector_id, start, system, streams, initial_heading_deg, instrument } => {
            let new = NewSession {
                start: start.map(|start| match start {
                    Start::Marker(name) => NewStart::Marker(name),
                    Start::PositionM(position_m) => NewStart::PositionM(position_m),
                }),
                system,
                streams,
                initial_heading_deg,
                instrument,
                ..NewSession::of(inspector(&inspector_id)?)
            };
            api::sessions::begin(app, caller, new, SessionState::Live)
                .await
                .map(|session| Opened::Live(Box::new(session)))
        }
    }
}

async fn go_on(app: &App, caller: &Caller, session_id: &str) -> Result<Opened> {
    let db = app.store.read();
    let not_found = || Error::not_found("session", session_id);
    let id = Uuid::parse_str(session_id).map_err(|_| not_found())?;
    let session = sessions::get(db, id).await?.ok_or_else(not_found)?;
    caller.writes_for(session.inspector_id)?;
    if matches!(session.state, SessionState::Created | SessionState::Live) {
        return Ok(Opened::Live(Box::new(session)));
    }
    let mut next_sequence = NextSequence::new();
    let usual = session.declaration().usual_streams().into_iter().map(|stream| stream.id);
    for stream in usual.chain(session.streams.iter().copied()) {
        next_sequence.insert(stream, stream_chunks::next_sequence(db, id, stream).await?);
    }
    if next_sequence.values().all(|next| *next == 0) {
        return Err(Error::conflict(
            "session_not_streamed",
            "expected a session that is streamed or has no samples yet, found one whose logs were uploaded: begin a session of its own for the stream",
        ));
    }
    Ok(Opened::Over(id, next_sequence))
}

fn inspector(id: &str) -> Result<Uuid> {
    Uuid::parse_str(id).map_err(|_| Error::not_found("inspector", id))
}

/// What the engine is told of a session that is streamed.
pub(super) async fn session_config(app: &App, session: &Session) -> Result<SessionConfig, StoreError> {
    let config = engine_config(&app.site, session, &session.streams);
    let identification = identification(app, session).await?;
    let parameters = parameters::of_stream(app, session).await?;
    let mut config =
        SessionConfig { max_lead_ns: Some(MAX_LEAD_NS), solution: Solution::Trail, identification, ..config };
    parameters.apply(&mut config);
    Ok(config)
}
