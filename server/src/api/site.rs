//! The site and its plan.

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};

use super::Routes;
use crate::rights::Right;
use crate::site::{Plan, Site};
use crate::state::App;
use serde_json::Value;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/site", Right::Read, site)
        .about("The site: place, gravity, magnetic field")
        .gives::<Value>()
        .get("/site/plan", Right::Read, plan)
        .about("What stands still: actuators, road, sectors, towers")
        .gives::<Plan>()
}

async fn site(State(app): State<App>) -> Json<Site> {
    Json(app.site.clone())
}

async fn plan(State(app): State<App>) -> Response {
    // It changes only with the configuration, that is with a restart.
    ([(header::CACHE_CONTROL, "max-age=60")], Json(&app.plan)).into_response()
}
