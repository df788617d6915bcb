//! Findings on equipment.

use axum::extract::State;
use axum::http::StatusCode;
use lodestep_engine::parse::live_message::FaultMessage;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::extract::{Json, Path, Query};
use super::{Needs, Routes};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::faults::{FaultPatch, Helper, NewFault, change, nearest, report, reported};
use crate::rights::Right;
use crate::state::App;
use crate::store::fault_changes::{self, FaultChange};
use crate::store::faults::{self, Fault, FaultState, Severity};
use crate::store::sessions::Session;
use crate::utc;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/faults", Right::Read, list)
        .about("Faults, newest first")
        .query::<ListQuery>()
        .gives::<Vec<Fault>>()
        .post("/faults", Right::Walk, create)
        .about("Report a fault: it is placed by where its inspector was")
        .takes::<NewFault>()
        .gives::<Fault>()
        .get("/faults/{id}", Right::Read, show)
        .about("One fault")
        .gives::<Fault>()
        .patch("/faults/{id}", Needs::OwnFault, patch)
        .about("Take a fault a step on, assign it, change what is said of it, or comment on it")
        .takes::<FaultPatch>()
        .gives::<Fault>()
        .get("/faults/{id}/history", Right::Read, history)
        .about("Who changed what of a fault, oldest first")
        .gives::<Vec<FaultChange>>()
        .get("/faults/{id}/nearest", Right::Read, nearest_inspectors)
        .about("Who could go now: free ones first, then by distance")
        .gives::<Vec<Helper>>()
        .post("/faults/{id}/close", Right::Dispatch, close)
        .about("Take a fault for done, wherever it stands")
        .gives::<Fault>()
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ListQuery {
    state: Option<AskedState>,
}

/// A state, or one of the words for several.
#[derive(Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum AskedState {
    Open,
    Acknowledged,
    InWork,
    Fixed,
    Verified,
    /// All that are not verified.
    Standing,
    /// What older clients call verified.
    Closed,
}

async fn list(State(app): State<App>, Query(query): Query<ListQuery>) -> Result<axum::Json<Vec<Fault>>> {
    let db = app.store.read();
    let state = match query.state {
        None => None,
        Some(AskedState::Standing) => return Ok(axum::Json(faults::standing(db).await?)),
        Some(AskedState::Open) => Some(FaultState::Open),
        Some(AskedState::Acknowledged) => Some(FaultState::Acknowledged),
        Some(AskedState::InWork) => Some(FaultState::InWork),
        Some(AskedState::Fixed) => Some(FaultState::Fixed),
        Some(AskedState::Verified | AskedState::Closed) => Some(FaultState::Verified),
    };
    Ok(axum::Json(faults::list(db, state).await?))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewFault>,
) -> Result<(StatusCode, axum::Json<Fault>)> {
    if let Some(fault) = reported(&app, new.id).await? {
        return Ok((StatusCode::OK, axum::Json(fault)));
    }
    Ok((StatusCode::CREATED, axum::Json(report(&app, &caller, new).await?)))
}

/// Takes a fault that a device tells of on its socket.
pub(crate) async fn report_live(
    app: &App,
    caller: &Caller,
    session: &Session,
    message: FaultMessage,
) -> Result<Fault> {
    let severity = match message.severity.as_str() {
        "low" => Severity::Low,
        "medium" => Severity::Medium,
        "high" => Severity::High,
        other => {
            return Err(Error::invalid(
                "wrong_field",
                format!("expected severity low, medium or high, found {other:?}"),
            ));
        }
    };
    let new = NewFault {
        id: None,
        inspector_id: None,
        session_id: Some(session.id),
        reported_at: Some(utc::at(session.started_at, message.t_ns)),
        t_s: None,
        kind: message.kind,
        severity,
        text: message.text,
        marker: message.marker,
    };
    report(app, caller, new).await
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<Fault>> {
    Ok(axum::Json(find(&app, id).await?))
}

async fn find(app: &App, id: Uuid) -> Result<Fault> {
    faults::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("fault", id))
}

async fn patch(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(patch): Json<FaultPatch>,
) -> Result<axum::Json<Fault>> {
    Ok(axum::Json(change(&app, caller, id, patch).await?))
}

/// Takes one for done, wherever it stands; one that is verified already stays as it is.
async fn close(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<axum::Json<Fault>> {
    Ok(axum::Json(crate::faults::close(&app, caller, id).await?))
}

async fn history(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<Vec<FaultChange>>> {
    find(&app, id).await?;
    Ok(axum::Json(fault_changes::of_fault(app.store.read(), id).await?))
}

/// Who could go, free ones first, then by distance.
async fn nearest_inspectors(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<Vec<Helper>>> {
    Ok(axum::Json(nearest(&app, id).await?))
}
