//! Surveyed actuator anchors, one by one: their places, their history, and what the walks found at them.

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use lodestep_engine::parse::markers_csv;
use schemars::JsonSchema;
use serde::Deserialize;

use super::Routes;
use super::extract::{Json, Path, Query};
use crate::auth::Caller;
use crate::error::{Error, Result};
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
        .about("The surveyed markers, by name")
        .gives::<Vec<Marker>>()
        .post("/markers", Right::Survey, create)
        .about("Add a marker")
        .takes::<NewMarker>()
        .gives::<Marker>()
        .get("/markers.csv", Right::Read, export)
        .about("The table as a file that an import takes back unchanged")
        .gives_bytes("text/csv")
        .post("/markers/import", Right::Survey, import)
        .about("Put a file of markers into the table at once")
        .takes_bytes("text/csv")
        .gives::<Imported>()
        .get("/markers/residuals", Right::Read, all_residuals)
        .about("What the walks found at the markers, suspect surveys first")
        .gives::<Residuals>()
        .get("/markers/{name}", Right::Read, show)
        .about("One marker; its version is its ETag")
        .gives::<Marker>()
        .put("/markers/{name}", Right::Survey, put)
        .about(
            "Make a marker stand there; one that stands elsewhere moves only with the version that was seen",
        )
        .takes::<NewMarker>()
        .gives::<Marker>()
        .delete("/markers/{name}", Right::Survey, remove)
        .about("Remove a marker; its history stays")
        .query::<RemoveQuery>()
        .get("/markers/{name}/history", Right::Read, history)
        .about("What a marker was, newest first")
        .gives::<Vec<MarkerChange>>()
        .get("/markers/{name}/residuals", Right::Read, residuals_of)
        .about("What each visit of a marker found")
        .gives::<Vec<VisitResidual>>()
}

async fn list(State(app): State<App>) -> Result<axum::Json<Vec<Marker>>> {
    Ok(axum::Json(store::markers::list(app.store.read()).await?))
}

async fn create(State(app): State<App>, caller: Caller, Json(new): Json<NewMarker>) -> Result<Response> {
    Ok(told(StatusCode::CREATED, markers::add(&app, caller, new).await?))
}

async fn show(State(app): State<App>, Path(name): Path<String>) -> Result<Response> {
    let marker = store::markers::get(app.store.read(), &name).await?;
    Ok(told(StatusCode::OK, marker.ok_or_else(|| Error::not_found("marker", name))?))
}

async fn put(
    State(app): State<App>,
    caller: Caller,
    Path(name): Path<String>,
    headers: HeaderMap,
    Json(new): Json<NewMarker>,
) -> Result<Response> {
    let seen = Seen { if_match: if_match(&headers)?, ..Seen::default() };
    let (marker, is_new) = markers::put(&app, caller, &name, seen, new).await?;
    Ok(told(if is_new { StatusCode::CREATED } else { StatusCode::OK }, marker))
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
    headers: HeaderMap,
) -> Result<StatusCode> {
    let seen = Seen { version: query.version, if_match: if_match(&headers)?, force: false };
    markers::remove(&app, caller, name, seen, query.reason.as_deref()).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// A marker with its version as its entity tag.
fn told(status: StatusCode, marker: Marker) -> Response {
    let tag = HeaderValue::from_str(&format!("\"{}\"", marker.version));
    let mut response = (status, axum::Json(marker)).into_response();
    if let Ok(tag) = tag {
        response.headers_mut().insert(header::ETAG, tag);
    }
    response
}

/// The version that a change is conditional on.
fn if_match(headers: &HeaderMap) -> Result<Option<i64>> {
    let Some(tag) = headers.get(header::IF_MATCH) else { return Ok(None) };
    let text = tag.to_str().unwrap_or_default().trim();
    let version = text.trim_start_matches("W/").trim_matches('"').parse();
    version.map(Some).map_err(|_| {
        Error::invalid(
            "wrong_if_match",
            format!("expected If-Match with the ETag of one marker, found {text:?}: send back the one that came with it"),
        )
    })
}

/// What a marker was, newest first; of one that is gone, too.
async fn history(State(app): State<App>, Path(name): Path<String>) -> Result<axum::Json<Vec<MarkerChange>>> {
    let db = app.store.read();
    let changes = marker_changes::of_marker(db, &name).await?;
    // One from before histories were kept has none.
    if changes.is_empty() && store::markers::get(db, &name).await?.is_none() {
        return Err(Error::not_found("marker", name));
    }
    Ok(axum::Json(changes))
}

/// What all walks found at the markers, suspect surveys first.
async fn all_residuals(State(app): State<App>) -> Result<axum::Json<Residuals>> {
    Ok(axum::Json(markers::residuals(&marker_residuals::all(app.store.read()).await?)))
}

/// What each visit of a marker found, by time.
async fn residuals_of(
    State(app): State<App>,
    Path(name): Path<String>,
) -> Result<axum::Json<Vec<VisitResidual>>> {
    let db = app.store.read();
    if store::markers::get(db, &name).await?.is_none() {
        return Err(Error::not_found("marker", name));
    }
    Ok(axum::Json(marker_residuals::of_marker(db, &name).await?))
}

async fn import(
    State(app): State<App>,
    caller: Caller,
    headers: HeaderMap,
    file: Bytes,
) -> Result<axum::Json<Imported>> {
    expect_csv(&headers)?;
    Ok(axum::Json(markers::import(&app, caller, file.into()).await?))
}

/// Refuses a body that is not said to be CSV.
pub(super) fn expect_csv(headers: &HeaderMap) -> Result<()> {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    if kind.to_ascii_lowercase().starts_with("text/csv") {
        return Ok(());
    }
    Err(Error::http(
        StatusCode::UNSUPPORTED_MEDIA_TYPE,
        "csv_expected",
        format!("expected a body of content type text/csv, found {kind:?}: set the Content-Type header"),
    ))
}

/// The table as a file that `import` takes back unchanged.
async fn export(State(app): State<App>) -> Result<Response> {
    let all = store::markers::list(app.store.read()).await?;
    let text = markers_csv::write(
        all.iter().map(|marker| (marker.name.as_str(), marker.e_m, marker.n_m, marker.u_m)),
    );
    let headers = [
        (header::CONTENT_TYPE, "text/csv; charset=utf-8"),
        (header::CONTENT_DISPOSITION, "attachment; filename=\"markers.csv\""),
    ];
    Ok((headers, text).into_response())
}
