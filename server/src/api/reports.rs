//! How a walk went.

use axum::extract::State;
use lodestep_engine::evaluate::SessionReport;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::http::{Path, Routes, WrittenJson};
use crate::rights::Right;
use crate::state::App;
use crate::store::{reports, sessions};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/report", Right::Read, report)
        .about("get_session_report", "How a walk went, by what the filter saw")
}

async fn report(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<WrittenJson<SessionReport>> {
    if let Some(report) = reports::get(app.store.read(), session_id).await? {
        return Ok(WrittenJson::new(report));
    }
    match sessions::get(app.store.read(), session_id).await? {
        None => Err(Error::not_found("session", session_id)),
        Some(_) => Err(Error::conflict(
            "no_report",
            "expected a session that has been processed, found one that has not: a report is made with \
             the track, by POST /sessions/{id}/process",
        )),
    }
}
