//! Work that takes a while: asked for, and looked at.

use axum::extract::State;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::http::{Accepted, Json, Location, Needs, Path, Routes, With};
use crate::jobs::queue;
use crate::rights::Right;
use crate::state::App;
use crate::store::jobs::{self, Job};

/// Jobs in the list.
const LISTED: u32 = 200;

pub(super) fn routes() -> Routes {
    Routes::new()
        .post("/sessions/{id}/process", Needs::OwnSession, process)
        .about("process_session", "Works a walk out again; the answer is a job")
        .get("/jobs", Right::Read, list)
        .about("list_jobs", "Jobs, the newest first")
        .get("/jobs/{id}", Right::Read, show)
        .about("get_job", "One job")
}

async fn process(
    State(app): State<App>,
    Path(session_id): Path<Uuid>,
) -> Result<With<Location, Accepted<Json<Job>>>> {
    let job = queue::enqueue(&app, session_id).await?;
    let location = format!("/api/v1/jobs/{}", job.id);
    Ok(With(Location(location), Accepted(Json(job))))
}

async fn list(State(app): State<App>) -> Result<Json<Vec<Job>>> {
    let listed = jobs::list(app.store.read(), LISTED).await?;
    Ok(Json(listed.into_iter().map(|job| app.jobs.as_it_stands(job)).collect()))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Job>> {
    let job = jobs::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("job", id))?;
    Ok(Json(app.jobs.as_it_stands(job)))
}
