//! Trouble with sensors or their data.

use axum::Router;
use axum::extract::State;
use axum::routing::get;
use uuid::Uuid;

use super::extract::Path;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::anomalies::{self, Anomaly};
use crate::store::sessions;

pub(super) fn routes() -> Router<App> {
    Router::new().route("/sessions/{id}/anomalies", get(list))
}

async fn list(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<axum::Json<Vec<Anomaly>>> {
    if sessions::get(app.store.read(), session_id).await?.is_none() {
        return Err(Error::not_found("session", session_id));
    }
    Ok(axum::Json(anomalies::of_session(app.store.read(), session_id).await?))
}
