//! Whether the server is well, for the machines that watch it.

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::Routes;
use crate::error::{Error, Result};
use crate::figures;
use crate::rights::Right;
use crate::state::App;
use crate::store::health::Health;
use crate::store::markers;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/healthz", Right::Open, health)
        .about("Whether the database answers and the last write reached the disk")
        .gives_bytes("text/plain")
        .get("/metrics", Right::Read, figures_text)
        .about("Figures for Prometheus")
        .gives_bytes("text/plain")
}

/// `ok` when the database answers and the last write reached the disk.
async fn health(State(app): State<App>) -> Result<&'static str> {
    markers::revision(app.store.read()).await?;
    if app.store.health() != Health::Good {
        return Err(Error::http(
            StatusCode::SERVICE_UNAVAILABLE,
            "disk",
            "the last write did not reach the disk: see the server's log, and whether the disk is full",
        ));
    }
    Ok("ok")
}

/// Prometheus text.
async fn figures_text(State(app): State<App>) -> Response {
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], figures::render(&app.metrics))
        .into_response()
}
