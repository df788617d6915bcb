//! The site and its plan.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};

use crate::site::Site;
use crate::state::App;

pub(super) fn routes() -> Router<App> {
    Router::new().route("/site", get(site)).route("/site/plan", get(plan))
}

async fn site(State(app): State<App>) -> Json<Site> {
    Json(app.site.clone())
}

async fn plan(State(app): State<App>) -> Response {
    // It changes only with the configuration, that is with a restart.
    ([(header::CACHE_CONTROL, "max-age=60")], Json(&app.plan)).into_response()
}
