//! Where inspectors stood: listed with the markers that it may have been, chosen, and taken back.

use axum::extract::State;
use axum::http::StatusCode;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::extract::{Json, Path};
use super::{Needs, Routes};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::sessions::stand_choice;
use crate::state::App;
use crate::store::sessions;
use crate::store::stands::{self, Stand};
use crate::store::visits::Visit;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/stands", Right::Read, list)
        .about("Where the inspector stood, with the likely markers")
        .gives::<Vec<Stand>>()
        .put("/sessions/{id}/stands/{number}/choice", Needs::OwnSession, choose)
        .about("Makes a visit of a stand")
        .takes::<Choice>()
        .gives::<Visit>()
        .delete("/sessions/{id}/stands/{number}/choice", Needs::OwnSession, take_back)
        .about("Takes that visit back")
}

async fn list(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<axum::Json<Vec<Stand>>> {
    if sessions::get(app.store.read(), session_id).await?.is_none() {
        return Err(Error::not_found("session", session_id));
    }
    Ok(axum::Json(stands::of_session(app.store.read(), session_id).await?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Choice {
    marker: String,
}

async fn choose(
    State(app): State<App>,
    caller: Caller,
    Path((session_id, number)): Path<(Uuid, u32)>,
    Json(choice): Json<Choice>,
) -> Result<axum::Json<Visit>> {
    Ok(axum::Json(stand_choice::choose(&app, &caller, session_id, number, choice.marker).await?))
}

async fn take_back(
    State(app): State<App>,
    caller: Caller,
    Path((session_id, number)): Path<(Uuid, u32)>,
) -> Result<StatusCode> {
    stand_choice::take_back(&app, &caller, session_id, number).await?;
    Ok(StatusCode::NO_CONTENT)
}
