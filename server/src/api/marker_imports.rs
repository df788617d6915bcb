//! Files of markers, step by step: compared, looked at, applied, reverted.

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::Routes;
use super::extract::{Json, Path, Query};
use super::markers::expect_csv;
use crate::auth::Caller;
use crate::error::Result;
use crate::markers::{self, Apply, ImportView, Reading, Revert};
use crate::rights::Right;
use crate::state::App;
use crate::store::marker_imports::{self, MarkerImport};

/// Imports that are listed.
const LISTED: u32 = 100;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/markers/imports", Right::Read, list)
        .about("Files of markers, newest first")
        .gives::<Vec<MarkerImport>>()
        .post("/markers/imports", Right::Survey, create)
        .about("Compare a file of markers with the table; nothing is changed")
        .query::<CreateQuery>()
        .takes_bytes("text/csv")
        .gives::<ImportView>()
        .get("/markers/imports/{id}", Right::Read, show)
        .about("A file of markers with its exact difference")
        .gives::<ImportView>()
        .delete("/markers/imports/{id}", Right::Survey, give_up)
        .about("Give up a file that was not applied")
        .put("/markers/imports/{id}/reading", Right::Survey, read_again)
        .about("Compare it again, by another mapping of its columns or as the whole table")
        .takes::<Reading>()
        .gives::<ImportView>()
        .post("/markers/imports/{id}/apply", Right::Survey, apply)
        .about("Make its difference, against the table that it was compared with")
        .takes::<Apply>()
        .gives::<MarkerImport>()
        .post("/markers/imports/{id}/revert", Right::Survey, revert)
        .about("Take back exactly what it changed")
        .takes::<Revert>()
        .gives::<MarkerImport>()
}

async fn list(State(app): State<App>) -> Result<axum::Json<Vec<MarkerImport>>> {
    Ok(axum::Json(marker_imports::list(app.store.read(), LISTED).await?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CreateQuery {
    file_name: Option<String>,
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Query(query): Query<CreateQuery>,
    headers: HeaderMap,
    file: Bytes,
) -> Result<(StatusCode, axum::Json<ImportView>)> {
    expect_csv(&headers)?;
    let view = markers::create(&app, caller, query.file_name, file.into()).await?;
    Ok((StatusCode::CREATED, axum::Json(view)))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<ImportView>> {
    Ok(axum::Json(markers::view(&app, id).await?))
}

async fn give_up(State(app): State<App>, Path(id): Path<Uuid>) -> Result<StatusCode> {
    markers::give_up(&app, id).await?;
    Ok(StatusCode::NO_CONTENT)
}

async fn read_again(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Json(reading): Json<Reading>,
) -> Result<axum::Json<ImportView>> {
    Ok(axum::Json(markers::read_again(&app, id, reading).await?))
}

async fn apply(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(asked): Json<Apply>,
) -> Result<axum::Json<MarkerImport>> {
    Ok(axum::Json(markers::apply(&app, caller, id, asked).await?))
}

async fn revert(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(asked): Json<Revert>,
) -> Result<axum::Json<MarkerImport>> {
    Ok(axum::Json(markers::revert(&app, caller, id, asked).await?))
}
