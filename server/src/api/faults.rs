//! Findings on equipment.

use axum::extract::State;
use axum::http::StatusCode;
use lodestep_engine::parse::live_message::FaultMessage;
use serde::Deserialize;
use uuid::Uuid;

use super::Routes;
use super::extract::{Json, Path, Query};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::faults::{NewFault, report, reported};
use crate::rights::Right;
use crate::state::App;
use crate::store::faults::{self, Fault, FaultState, Severity};
use crate::store::sessions::Session;
use crate::utc;
use crate::wire::Change;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/faults", Right::Read, list)
        .post("/faults", Right::Walk, create)
        .get("/faults/{id}", Right::Read, show)
        .post("/faults/{id}/close", Right::Dispatch, close)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ListQuery {
    state: Option<FaultState>,
}

async fn list(State(app): State<App>, Query(query): Query<ListQuery>) -> Result<axum::Json<Vec<Fault>>> {
    Ok(axum::Json(faults::list(app.store.read(), query.state).await?))
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
pub(crate) async fn report_live(app: &App, session: &Session, message: FaultMessage) -> Result<Fault> {
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
    // Whether the device may write this walk was asked when it said hello.
    report(app, &Caller::itself("a device"), new).await
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<Fault>> {
    let fault = faults::get(app.store.read(), id).await?;
    Ok(axum::Json(fault.ok_or_else(|| Error::not_found("fault", id))?))
}

/// Closes one; one that is closed already stays as it is.
async fn close(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<Fault>> {
    let (fault, closed) = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let closed = faults::close(&mut *db, id, utc::now()).await?;
                let fault = faults::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("fault", id))?;
                Ok::<_, Error>((fault, closed))
            })
        })
        .await?;
    if closed {
        app.hub.publish(Change::Fault { fault: fault.clone() });
    }
    Ok(axum::Json(fault))
}
