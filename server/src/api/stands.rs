//! Where inspectors stood: listed with the markers that it may have been, chosen, and taken back.

use axum::extract::State;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Json, Needs, NoContent, Path, Routes};
use crate::rights::Right;
use crate::sessions::stand_choice;
use crate::state::App;
use crate::store::sessions;
use crate::store::stands::{self, Stand};
use crate::store::visits::Visit;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/stands", Right::Read, list)
        .about("list_stands", "Where the inspector stood, with the likely markers")
        .put("/sessions/{id}/stands/{number}/choice", Needs::OwnSession, choose)
        .about("choose_stand_marker", "Makes a visit of a stand")
        .delete("/sessions/{id}/stands/{number}/choice", Needs::OwnSession, take_back)
        .about("clear_stand_marker", "Takes that visit back")
}

async fn list(State(app): State<App>, Path(session_id): Path<Uuid>) -> Result<Json<Vec<Stand>>> {
    if sessions::get(app.store.read(), session_id).await?.is_none() {
        return Err(Error::not_found("session", session_id));
    }
    Ok(Json(stands::of_session(app.store.read(), session_id).await?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MarkerChoice {
    #[schemars(example = &"A17")]
    marker: String,
}

async fn choose(
    State(app): State<App>,
    caller: Caller,
    Path((session_id, number)): Path<(Uuid, u32)>,
    Json(choice): Json<MarkerChoice>,
) -> Result<Json<Visit>> {
    Ok(Json(stand_choice::choose(&app, &caller, session_id, number, choice.marker).await?))
}

async fn take_back(
    State(app): State<App>,
    caller: Caller,
    Path((session_id, number)): Path<(Uuid, u32)>,
) -> Result<NoContent> {
    stand_choice::take_back(&app, &caller, session_id, number).await?;
    Ok(NoContent)
}
