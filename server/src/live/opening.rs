//! A device's hello: which session it is about, and whether it can be streamed.

use lodestep_engine::parse::live_message::{Hello, NextSequence, Start};
use lodestep_engine::sample::Foot;
use lodestep_engine::session::SessionConfig;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::state::App;
use crate::store::sessions::{self, Session, SessionState};
use crate::store::{inspectors, markers, raw_chunks};
use crate::utc;
use crate::wire::Change;

/// How far one foot may run ahead of the other in a stream before the walk goes on without it, ns.
const MAX_LEAD_NS: i64 = 1_000_000_000;

/// What a hello leads to.
#[derive(Debug)]
pub(super) enum Opened {
    /// A session that takes samples.
    Live(Session),
    /// A session that was streamed and finished: the device missed the answer.
    Over(Uuid, NextSequence),
}

/// Finds or begins the session that a hello is about.
pub(super) async fn open(app: &App, hello: Hello) -> Result<Opened> {
    match hello {
        Hello::Continue { session_id } => go_on(app, &session_id).await,
        Hello::Begin { inspector_id, start, feet, initial_heading_deg } => {
            begin(app, &inspector_id, start, feet, initial_heading_deg).await.map(Opened::Live)
        }
    }
}

async fn go_on(app: &App, session_id: &str) -> Result<Opened> {
    let db = app.store.read();
    let not_found = || Error::not_found("session", session_id);
    let id = Uuid::parse_str(session_id).map_err(|_| not_found())?;
    let session = sessions::get(db, id).await?.ok_or_else(not_found)?;
    if matches!(session.state, SessionState::Created | SessionState::Live) {
        return Ok(Opened::Live(session));
    }
    let next_sequence = NextSequence {
        left: raw_chunks::next_sequence(db, id, Foot::Left).await?,
        right: raw_chunks::next_sequence(db, id, Foot::Right).await?,
    };
    if next_sequence == NextSequence::default() {
        return Err(Error::conflict(
            "session_not_streamed",
            "expected a session that is streamed or has no samples yet, found one whose logs were uploaded: begin a session of its own for the stream",
        ));
    }
    Ok(Opened::Over(id, next_sequence))
}

async fn begin(
    app: &App,
    inspector_id: &str,
    start: Option<Start>,
    mut feet: Vec<Foot>,
    initial_heading_deg: Option<f64>,
) -> Result<Session> {
    let db = app.store.read();
    let not_found = || Error::not_found("inspector", inspector_id);
    let inspector_id = Uuid::parse_str(inspector_id).map_err(|_| not_found())?;
    inspectors::get(db, inspector_id).await?.ok_or_else(not_found)?;
    feet.sort_unstable();
    feet.dedup();
    if feet.is_empty() {
        return Err(Error::invalid(
            "wrong_feet",
            r#"expected "left", "right" or both in feet, found none: name the feet that carry a sensor"#,
        ));
    }
    if initial_heading_deg.is_some_and(|heading| !heading.is_finite()) {
        return Err(Error::invalid(
            "wrong_heading",
            "expected a finite number of degrees in initial_heading_deg: leave it out to take the heading from the magnetometer",
        ));
    }
    let start = match start {
        None => sessions::Start::default(),
        Some(Start::PositionM(position_m)) if position_m.iter().all(|x| x.is_finite()) => {
            sessions::Start { marker: None, position_m }
        }
        Some(Start::PositionM(_)) => {
            return Err(Error::invalid(
                "wrong_start",
                "expected three finite numbers, east-north-up in metres, in start.position_m",
            ));
        }
        Some(Start::Marker(name)) => {
            let marker = markers::get(db, &name).await?.ok_or_else(|| Error::not_found("marker", &name))?;
            let position_m = [marker.e_m, marker.n_m, marker.u_m.unwrap_or(0.0)];
            sessions::Start { marker: Some(name), position_m }
        }
    };
    let now = utc::now();
    let session = Session {
        id: Uuid::now_v7(),
        inspector_id,
        title: String::new(),
        state: SessionState::Live,
        started_at: now,
        ended_at: None,
        feet,
        start,
        initial_heading_deg,
        samples: 0,
        epochs: 0,
        duration_s: 0.0,
        distance_m: 0.0,
        since_marker_s: 0.0,
        since_marker_m: 0.0,
        track_sha256: None,
        error: None,
        created_at: now,
    };
    let row = session.clone();
    app.store.writer().run(move |db| Box::pin(async move { sessions::insert(db, &row).await })).await?;
    app.hub.publish(Change::Session { session: Some(session.clone()), deleted: None });
    Ok(session)
}

/// What the engine is told of a session that is streamed.
pub(super) fn session_config(app: &App, session: &Session) -> SessionConfig {
    SessionConfig {
        feet: session.feet.clone(),
        initial_position_n_m: session.start.position_m,
        initial_heading_rad: session.initial_heading_deg.map(f64::to_radians),
        declination_rad: app.site.declination_deg.to_radians(),
        gravity_m_s2: app.site.gravity_m_s2,
        max_lead_ns: Some(MAX_LEAD_NS),
        ..SessionConfig::default()
    }
}
