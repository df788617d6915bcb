//! Work that takes a while: asked for, and looked at.

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::extract::Path;
use super::{Needs, Routes};
use crate::error::{Error, Result};
use crate::jobs::queue;
use crate::rights::Right;
use crate::state::App;
use crate::store::jobs::{self, Job};

/// Jobs in the list.
const LISTED: u32 = 200;

pub(super) fn routes() -> Routes {
    Routes::new()
        .post("/sessions/{id}/process", Needs::OwnSession, process)
        .about("Works a walk out again; the answer is a job")
        .gives::<Job>()
        .get("/jobs", Right::Read, list)
        .about("Jobs, the newest first")
        .gives::<Vec<Job>>()
        .get("/jobs/{id}", Right::Read, show)
        .about("One job")
        .gives::<Job>()
}

async fn process(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<Response> {
    let job = queue::enqueue(&app, session_id).await?;
    let location = format!("/api/v1/jobs/{}", job.id);
    Ok((StatusCode::ACCEPTED, [(header::LOCATION, location)], axum::Json(job)).into_response())
}

async fn list(State(app): State<App>) -> Result<axum::Json<Vec<Job>>> {
    let listed = jobs::list(app.store.read(), LISTED).await?;
    Ok(axum::Json(listed.into_iter().map(|job| app.jobs.as_it_stands(job)).collect()))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<Job>> {
    let job = jobs::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("job", id))?;
    Ok(axum::Json(app.jobs.as_it_stands(job)))
}
