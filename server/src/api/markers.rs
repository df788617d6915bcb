//! Surveyed actuator anchors.

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use lodestep_engine::parse::markers_csv;

use super::Routes;
use super::extract::{Json, Path};
use crate::error::{Error, Result};
use crate::markers::{self, Imported, NewMarker};
use crate::rights::Right;
use crate::state::App;
use crate::store;
use crate::store::markers::Marker;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/markers", Right::Read, list)
        .post("/markers", Right::Survey, create)
        .get("/markers.csv", Right::Read, export)
        .post("/markers/import", Right::Survey, import)
        .get("/markers/{name}", Right::Read, show)
        .put("/markers/{name}", Right::Survey, put)
        .delete("/markers/{name}", Right::Survey, remove)
}

async fn list(State(app): State<App>) -> Result<axum::Json<Vec<Marker>>> {
    Ok(axum::Json(store::markers::list(app.store.read()).await?))
}

async fn create(
    State(app): State<App>,
    Json(new): Json<NewMarker>,
) -> Result<(StatusCode, axum::Json<Marker>)> {
    Ok((StatusCode::CREATED, axum::Json(markers::add(&app, new).await?)))
}

async fn show(State(app): State<App>, Path(name): Path<String>) -> Result<axum::Json<Marker>> {
    let marker = store::markers::get(app.store.read(), &name).await?;
    Ok(axum::Json(marker.ok_or_else(|| Error::not_found("marker", name))?))
}

async fn put(
    State(app): State<App>,
    Path(name): Path<String>,
    Json(new): Json<NewMarker>,
) -> Result<(StatusCode, axum::Json<Marker>)> {
    let (marker, is_new) = markers::put(&app, &name, new).await?;
    Ok((if is_new { StatusCode::CREATED } else { StatusCode::OK }, axum::Json(marker)))
}

async fn remove(State(app): State<App>, Path(name): Path<String>) -> Result<StatusCode> {
    markers::remove(&app, name).await?;
    Ok(StatusCode::NO_CONTENT)
}

async fn import(State(app): State<App>, headers: HeaderMap, file: Bytes) -> Result<axum::Json<Imported>> {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    if !kind.to_ascii_lowercase().starts_with("text/csv") {
        return Err(Error::http(
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            "csv_expected",
            format!("expected a body of content type text/csv, found {kind:?}: set the Content-Type header"),
        ));
    }
    Ok(axum::Json(markers::import(&app, &file).await?))
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
