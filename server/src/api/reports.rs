//! How a walk went.

use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use serde_json::Value;
use uuid::Uuid;

use super::Routes;
use super::extract::Path;
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::state::App;
use crate::store::{reports, sessions};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/report", Right::Read, report)
        .about("How a walk went, by what the filter saw")
        .gives::<Value>()
}

async fn report(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<Response> {
    if let Some(report) = reports::get(app.store.read(), session_id).await? {
        return Ok(([(CONTENT_TYPE, "application/json")], report).into_response());
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
