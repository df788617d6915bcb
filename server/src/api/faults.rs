//! Findings on equipment.

use axum::extract::State;
use lodestep_engine::parse::live_message::FaultMessage;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::faults::{FaultPatch, Helper, NewFault, change, nearest, report, reported};
use crate::http::{Json, Listed, MaybeNew, Needs, Page, Path, Query, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::columns;
use crate::store::fault_changes::{self, FaultChange};
use crate::store::faults::{self, Fault, FaultState, Severity, Which};
use crate::store::sessions::Session;
use crate::utc;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/faults", Right::Read, list)
        .about("list_faults", "Faults, newest first")
        .post("/faults", Right::Walk, create)
        .about("report_fault", "Report a fault: it is placed by where its inspector was")
        .get("/faults/{id}", Right::Read, show)
        .about("get_fault", "One fault")
        .patch("/faults/{id}", Needs::OwnFault, patch)
        .about(
            "update_fault",
            "Take a fault a step on, assign it, change what is said of it, or comment on it",
        )
        .get("/faults/{id}/history", Right::Read, history)
        .about("list_fault_changes", "Who changed what of a fault, oldest first")
        .get("/faults/{id}/nearest", Right::Read, nearest_inspectors)
        .about("list_nearest_inspectors", "Who could go now: free ones first, then by distance")
        .post("/faults/{id}/close", Right::Dispatch, close)
        .about("close_fault", "Take a fault for done, wherever it stands")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ListQuery {
    state: Option<FaultFilter>,
    /// With `before_id`, where the page before ended: the link in its header has both.
    before_us: Option<i64>,
    before_id: Option<Uuid>,
    limit: Option<u32>,
}

/// A state, or one of the words for several.
#[derive(Clone, Copy, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "FaultFilter")]
enum FaultFilter {
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

async fn list(State(app): State<App>, Query(query): Query<ListQuery>) -> Result<Listed<Fault>> {
    let which = match query.state {
        None => Which::All,
        Some(FaultFilter::Standing) => Which::Standing,
        Some(FaultFilter::Open) => Which::In(FaultState::Open),
        Some(FaultFilter::Acknowledged) => Which::In(FaultState::Acknowledged),
        Some(FaultFilter::InWork) => Which::In(FaultState::InWork),
        Some(FaultFilter::Fixed) => Which::In(FaultState::Fixed),
        Some(FaultFilter::Verified | FaultFilter::Closed) => Which::In(FaultState::Verified),
    };
    let page = Page::new((query.before_us, query.before_id), query.limit);
    let rows = faults::page(app.store.read(), which, page.before, page.rows_to_read()).await?;
    let asked = [("state", query.state.map(columns::to_word))];
    Ok(page.answer(rows, ("/api/v1/faults", &asked), |fault| (utc::to_us(fault.reported_at), fault.id)))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewFault>,
) -> Result<MaybeNew<Json<Fault>>> {
    if let Some(fault) = reported(&app, new.id).await? {
        return Ok(MaybeNew::Known(Json(fault)));
    }
    Ok(MaybeNew::New(Json(report(&app, &caller, new).await?)))
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

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Fault>> {
    Ok(Json(find(&app, id).await?))
}

async fn find(app: &App, id: Uuid) -> Result<Fault> {
    faults::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("fault", id))
}

async fn patch(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(patch): Json<FaultPatch>,
) -> Result<Json<Fault>> {
    Ok(Json(change(&app, caller, id, patch).await?))
}

/// Takes one for done, wherever it stands; one that is verified already stays as it is.
async fn close(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<Json<Fault>> {
    Ok(Json(crate::faults::close(&app, caller, id).await?))
}

async fn history(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Vec<FaultChange>>> {
    find(&app, id).await?;
    Ok(Json(fault_changes::of_fault(app.store.read(), id).await?))
}

/// Who could go, free ones first, then by distance.
async fn nearest_inspectors(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Vec<Helper>>> {
    Ok(Json(nearest(&app, id).await?))
}
