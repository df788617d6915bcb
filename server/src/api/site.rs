//! The site and its plan.

use axum::extract::State;

use crate::error::Result;
use crate::http::{Json, Kept, Routes, With, WrittenJson};
use crate::rights::Right;
use crate::site::{Plan, Site};
use crate::state::App;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/site", Right::Read, site)
        .about("get_site", "The site: place, gravity, magnetic field")
        .get("/site/plan", Right::Read, plan)
        .about("get_site_plan", "What stands still: actuators, road, sectors, towers")
}

async fn site(State(app): State<App>) -> Json<Site> {
    Json(app.site.clone())
}

async fn plan(State(app): State<App>) -> Result<With<Kept, WrittenJson<Plan>>> {
    // It changes only with the configuration, that is with a restart.
    Ok(With(Kept("max-age=60"), WrittenJson::of(&app.plan)?))
}
