//! The site.

use axum::extract::State;
use axum::routing::get;
use axum::{Json, Router};

use crate::site::Site;
use crate::state::App;

pub(super) fn routes() -> Router<App> {
    Router::new().route("/site", get(show))
}

async fn show(State(app): State<App>) -> Json<Site> {
    Json(app.site.clone())
}
