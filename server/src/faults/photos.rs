//! Photos of a fault: taken by their first bytes for what they are, whatever the sender calls them.

use sha2::{Digest, Sha256};
use uuid::Uuid;

use super::change::write;
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::fault_changes::{FaultChange, What};
use crate::store::fault_photos::{self, Photo};
use crate::utc;

/// The largest photo, bytes.
pub(crate) const MOST_BYTES: usize = 8 << 20;
/// Photos of one fault.
const MOST_PHOTOS: usize = 20;

/// Adds a photo; `false` when this fault has these very bytes already.
pub(crate) async fn add_photo(
    app: &App,
    caller: Caller,
    fault_id: Uuid,
    body: Vec<u8>,
) -> Result<(Photo, bool)> {
    let Some(content_type) = content_type(&body) else {
        return Err(Error::invalid(
            "not_a_photo",
            "expected a JPEG, PNG or WebP picture, found something else: send the picture's own bytes",
        ));
    };
    let sha256 = Sha256::digest(&body).iter().map(|byte| format!("{byte:02x}")).collect();
    let photo = Photo {
        id: Uuid::now_v7(),
        fault_id,
        content_type: content_type.to_owned(),
        size_bytes: body.len() as u64,
        sha256,
        created_at: utc::now(),
        created_by: Some(caller.who.clone()),
    };
    let row = photo.clone();
    write(app, &caller, fault_id, move |db, fault| {
        Box::pin(async move {
            let known = fault_photos::of_fault(&mut *db, fault_id).await?;
            if known.iter().any(|known| known.sha256 == row.sha256) {
                return Ok((fault, Vec::new()));
            }
            if known.len() >= MOST_PHOTOS {
                return Err(Error::conflict(
                    "too_many_photos",
                    format!("expected at most {MOST_PHOTOS} photos of one fault, found as many already: remove one first"),
                ));
            }
            fault_photos::insert(&mut *db, &row, &body).await?;
            let change = changed(&row, None, Some(row.id));
            Ok((fault, vec![change]))
        })
    })
    .await?;
    let kept = fault_photos::of_fault(app.store.read(), fault_id).await?;
    let standing = kept.into_iter().find(|kept| kept.sha256 == photo.sha256).unwrap_or_else(|| photo.clone());
    let is_new = standing.id == photo.id;
    Ok((standing, is_new))
}

/// Removes a photo.
pub(crate) async fn remove_photo(app: &App, caller: Caller, fault_id: Uuid, id: Uuid) -> Result<()> {
    let who = caller.who.clone();
    write(app, &caller, fault_id, move |db, fault| {
        Box::pin(async move {
            let known = fault_photos::of_fault(&mut *db, fault_id).await?;
            let photo = known.into_iter().find(|photo| photo.id == id);
            let mut photo = photo.ok_or_else(|| Error::not_found("photo", id))?;
            fault_photos::delete(&mut *db, fault_id, id).await?;
            (photo.created_by, photo.created_at) = (Some(who), utc::now());
            let change = changed(&photo, Some(id), None);
            Ok((fault, vec![change]))
        })
    })
    .await?;
    Ok(())
}

/// The row of history of a photo that came or went.
fn changed(photo: &Photo, before: Option<Uuid>, after: Option<Uuid>) -> FaultChange {
    FaultChange {
        fault_id: photo.fault_id,
        changed_at: photo.created_at,
        changed_by: photo.created_by.clone(),
        what: What::Photo,
        before: before.map(|id| id.to_string()),
        after: after.map(|id| id.to_string()),
        comment: String::new(),
    }
}

/// What the first bytes say that it is; `None`: no picture that browsers show without risk.
fn content_type(body: &[u8]) -> Option<&'static str> {
    match body {
        [0xFF, 0xD8, 0xFF, ..] => Some("image/jpeg"),
        [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1A, b'\n', ..] => Some("image/png"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_is_what_its_first_bytes_say() {
        assert_eq!(content_type(b"\xFF\xD8\xFF\xE0rest"), Some("image/jpeg"));
        assert_eq!(content_type(b"\x89PNG\r\n\x1A\nrest"), Some("image/png"));
        assert_eq!(content_type(b"RIFF\x10\0\0\0WEBPVP8 "), Some("image/webp"));
        for other in [&b"<svg onload=alert(1)>"[..], b"GIF89a", b"RIFF\x10\0\0\0WAVE", b"", b"\xFF\xD8"] {
            assert_eq!(content_type(other), None);
        }
    }
}
