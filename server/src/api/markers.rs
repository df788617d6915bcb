//! Surveyed actuator anchors, one by one: their places, their history, and what the walks found at them.

use axum::extract::State;
use lodestep_engine::parse::markers_csv;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::media::Csv;
use crate::http::{
    Attachment, Created, CsvBody, File, IfMatch, Json, MaybeNew, NoContent, Path, Query, Routes, Version,
    With,
};
use crate::markers::{self, Imported, NewMarker, Residuals, Seen};
use crate::rights::Right;
use crate::state::App;
use crate::store;
use crate::store::marker_changes::{self, MarkerChange};
use crate::store::marker_residuals::{self, VisitResidual};
use crate::store::markers::Marker;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/markers", Right::Read, list)
        .about("list_markers", "The surveyed markers, by name")
        .post("/markers", Right::Survey, create)
        .about("create_marker", "Add a marker")
        .get("/markers.csv", Right::Read, export)
        .about("export_markers", "The table as a file that an import takes back unchanged")
        .post("/markers/import", Right::Survey, import)
        .about("import_markers", "Put a file of markers into the table at once")
        .get("/markers/residuals", Right::Read, all_residuals)
        .about("get_marker_residuals", "What the walks found at the markers, suspect surveys first")
        .get("/markers/{name}", Right::Read, show)
        .about("get_marker", "One marker; its version is its ETag")
        .put("/markers/{name}", Right::Survey, put)
        .about(
            "put_marker",
            "Make a marker stand there; one that stands elsewhere moves only with the version that was seen",
        )
        .delete("/markers/{name}", Right::Survey, remove)
        .about("delete_marker", "Remove a marker; its history stays")
        .get("/markers/{name}/history", Right::Read, history)
        .about("list_marker_changes", "What a marker was, newest first")
        .get("/markers/{name}/residuals", Right::Read, residuals_of)
        .about("list_visit_residuals", "What each visit of a marker found")
}

async fn list(State(app): State<App>) -> Result<Json<Vec<Marker>>> {
    Ok(Json(store::markers::list(app.store.read()).await?))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewMarker>,
) -> Result<With<Version, Created<Json<Marker>>>> {
    let marker = markers::add(&app, caller, new).await?;
    Ok(With(Version(marker.version), Created(Json(marker))))
}

async fn show(State(app): State<App>, Path(name): Path<String>) -> Result<With<Version, Json<Marker>>> {
    let marker = store::markers::get(app.store.read(), &name).await?;
    let marker = marker.ok_or_else(|| Error::not_found("marker", name))?;
    Ok(With(Version(marker.version), Json(marker)))
}

async fn put(
    State(app): State<App>,
    caller: Caller,
    Path(name): Path<String>,
    if_match: IfMatch,
    Json(new): Json<NewMarker>,
) -> Result<With<Version, MaybeNew<Json<Marker>>>> {
    let seen = Seen { if_match: if_match.version()?, ..Seen::default() };
    let (marker, is_new) = markers::put(&app, caller, &name, seen, new).await?;
    Ok(With(Version(marker.version), MaybeNew::of(is_new, Json(marker))))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RemoveQuery {
    reason: Option<String>,
    version: Option<i64>,
}

async fn remove(
    State(app): State<App>,
    caller: Caller,
    Path(name): Path<String>,
    Query(query): Query<RemoveQuery>,
    if_match: IfMatch,
) -> Result<NoContent> {
    let seen = Seen { version: query.version, if_match: if_match.version()?, force: false };
    markers::remove(&app, caller, name, seen, query.reason.as_deref()).await?;
    Ok(NoContent)
}

/// What a marker was, newest first; of one that is gone, too.
async fn history(State(app): State<App>, Path(name): Path<String>) -> Result<Json<Vec<MarkerChange>>> {
    let db = app.store.read();
    let changes = marker_changes::of_marker(db, &name).await?;
    // One from before histories were kept has none.
    if changes.is_empty() && store::markers::get(db, &name).await?.is_none() {
        return Err(Error::not_found("marker", name));
    }
    Ok(Json(changes))
}

/// What all walks found at the markers, suspect surveys first.
async fn all_residuals(State(app): State<App>) -> Result<Json<Residuals>> {
    Ok(Json(markers::residuals(&marker_residuals::all(app.store.read()).await?)))
}

/// What each visit of a marker found, by time.
async fn residuals_of(State(app): State<App>, Path(name): Path<String>) -> Result<Json<Vec<VisitResidual>>> {
    let db = app.store.read();
    if store::markers::get(db, &name).await?.is_none() {
        return Err(Error::not_found("marker", name));
    }
    Ok(Json(marker_residuals::of_marker(db, &name).await?))
}

async fn import(State(app): State<App>, caller: Caller, CsvBody(file): CsvBody) -> Result<Json<Imported>> {
    Ok(Json(markers::import(&app, caller, file.into()).await?))
}

/// The table as a file that `import` takes back unchanged.
async fn export(State(app): State<App>) -> Result<With<Attachment, File<Csv>>> {
    let all = store::markers::list(app.store.read()).await?;
    let text = markers_csv::write(
        all.iter().map(|marker| (marker.name.as_str(), marker.e_m, marker.n_m, marker.u_m)),
    );
    Ok(With(Attachment("markers.csv".to_owned()), File::new(text)))
}
