//! The site and its plan.

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};

use super::Routes;
use crate::rights::Right;
use crate::site::Site;
use crate::state::App;

pub(super) fn routes() -> Routes {
    Routes::new().get("/site", Right::Read, site).get("/site/plan", Right::Read, plan)
}

async fn site(State(app): State<App>) -> Json<Site> {
    Json(app.site.clone())
}

async fn plan(State(app): State<App>) -> Response {
    // It changes only with the configuration, that is with a restart.
    ([(header::CACHE_CONTROL, "max-age=60")], Json(&app.plan)).into_response()
}
