//! Photos of faults.

use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::extract::Path;
use super::{Needs, Routes};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::faults::{MOST_BYTES, add_photo, remove_photo};
use crate::rights::Right;
use crate::state::App;
use crate::store::fault_photos::{self, Photo};
use crate::store::faults;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/faults/{id}/photos", Right::Read, list)
        .about("The photos of a fault, without their bytes")
        .gives::<Vec<Photo>>()
        .post("/faults/{id}/photos", Needs::OwnFault, add)
        .about("Add a photo: JPEG, PNG or WebP, at most 8 MiB")
        .takes_bytes("image/*")
        .gives::<Photo>()
        .get("/faults/{id}/photos/{photo_id}", Right::Read, show)
        .about("The photo itself")
        .gives_bytes("image/*")
        .delete("/faults/{id}/photos/{photo_id}", Needs::ReportedFault, remove)
        .about("Remove a photo")
        .with(|router| router.layer(DefaultBodyLimit::max(MOST_BYTES)))
}

async fn list(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<Vec<Photo>>> {
    let db = app.store.read();
    if faults::get(db, id).await?.is_none() {
        return Err(Error::not_found("fault", id));
    }
    Ok(axum::Json(fault_photos::of_fault(db, id).await?))
}

/// The body is the picture itself; what it is is told by its first bytes, whatever the header says.
async fn add(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    body: Bytes,
) -> Result<(StatusCode, axum::Json<Photo>)> {
    let (photo, is_new) = add_photo(&app, caller, id, body.into()).await?;
    Ok((if is_new { StatusCode::CREATED } else { StatusCode::OK }, axum::Json(photo)))
}

/// The picture. It never changes under its id, so a browser keeps it.
async fn show(State(app): State<App>, Path((id, photo_id)): Path<(Uuid, Uuid)>) -> Result<Response> {
    let found = fault_photos::body(app.store.read(), id, photo_id).await?;
    let (content_type, body) = found.ok_or_else(|| Error::not_found("photo", photo_id))?;
    let headers = [
        (header::CONTENT_TYPE, content_type),
        (header::CACHE_CONTROL, "private, max-age=31536000, immutable".to_owned()),
        (header::CONTENT_DISPOSITION, "inline".to_owned()),
    ];
    Ok((headers, body).into_response())
}

async fn remove(
    State(app): State<App>,
    caller: Caller,
    Path((id, photo_id)): Path<(Uuid, Uuid)>,
) -> Result<StatusCode> {
    remove_photo(&app, caller, id, photo_id).await?;
    Ok(StatusCode::NO_CONTENT)
}
