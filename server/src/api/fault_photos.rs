//! Photos of faults.

use axum::extract::{DefaultBodyLimit, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use schemars::SchemaGenerator;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::faults::{MOST_BYTES, add_photo, remove_photo};
use crate::http::media::{Image, Jpeg, Media, Png, WebP};
use crate::http::operation::Content;
use crate::http::{AnswerBody, BytesBody, Json, MaybeNew, Needs, NoContent, Path, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::fault_photos::{self, Photo};
use crate::store::faults;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/faults/{id}/photos", Right::Read, list)
        .about("list_fault_photos", "The photos of a fault, without their bytes")
        .post("/faults/{id}/photos", Needs::OwnFault, add)
        .about("add_fault_photo", "Add a photo: JPEG, PNG or WebP, at most 8 MiB")
        .get("/faults/{id}/photos/{photo_id}", Right::Read, show)
        .about("get_fault_photo", "The photo itself")
        .delete("/faults/{id}/photos/{photo_id}", Needs::ReportedFault, remove)
        .about("delete_fault_photo", "Remove a photo")
        .with(|router| router.layer(DefaultBodyLimit::max(MOST_BYTES)))
}

async fn list(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Vec<Photo>>> {
    let db = app.store.read();
    if faults::get(db, id).await?.is_none() {
        return Err(Error::not_found("fault", id));
    }
    Ok(Json(fault_photos::of_fault(db, id).await?))
}

/// The body is the picture itself; what it is is told by its first bytes, whatever the header says.
async fn add(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    picture: BytesBody<Image>,
) -> Result<MaybeNew<Json<Photo>>> {
    let (photo, is_new) = add_photo(&app, caller, id, picture.bytes.into()).await?;
    Ok(MaybeNew::of(is_new, Json(photo)))
}

/// The picture. It never changes under its id, so a browser keeps it.
async fn show(State(app): State<App>, Path((id, photo_id)): Path<(Uuid, Uuid)>) -> Result<Picture> {
    let found = fault_photos::body(app.store.read(), id, photo_id).await?;
    let (content_type, body) = found.ok_or_else(|| Error::not_found("photo", photo_id))?;
    Ok(Picture { content_type, body })
}

struct Picture {
    content_type: String,
    body: Vec<u8>,
}

impl IntoResponse for Picture {
    fn into_response(self) -> Response {
        let headers = [
            (header::CONTENT_TYPE, self.content_type),
            (header::CACHE_CONTROL, "private, max-age=31536000, immutable".to_owned()),
            (header::CONTENT_DISPOSITION, "inline".to_owned()),
        ];
        (headers, self.body).into_response()
    }
}

impl AnswerBody for Picture {
    fn content(_: &mut SchemaGenerator) -> Vec<Content> {
        vec![Jpeg::content(), Png::content(), WebP::content()]
    }
}

async fn remove(
    State(app): State<App>,
    caller: Caller,
    Path((id, photo_id)): Path<(Uuid, Uuid)>,
) -> Result<NoContent> {
    remove_photo(&app, caller, id, photo_id).await?;
    Ok(NoContent)
}
