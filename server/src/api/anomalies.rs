//! Trouble with sensors or their data.

use axum::extract::State;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::http::{Json, Path, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::anomalies::{self, Anomaly};
use crate::store::sessions;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/anomalies", Right::Read, list)
        .about("list_anomalies", "What was wrong with sensors or data")
}

async fn list(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<Json<Vec<Anomaly>>> {
    if sessions::get(app.store.read(), session_id).await?.is_none() {
        return Err(Error::not_found("session", session_id));
    }
    Ok(Json(anomalies::of_session(app.store.read(), session_id).await?))
}
