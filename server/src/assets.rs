//! The pages: embedded in a release binary, read from `static/` while developing.

use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use rust_embed::{EmbeddedFile, RustEmbed};

use crate::error::Error;

/// `static/`, with the browser libraries in `static/vendor/`, which `make vendor` brings.
#[derive(RustEmbed)]
#[folder = "$CARGO_MANIFEST_DIR/../static/"]
#[exclude = "node_modules/*"]
#[exclude = "scripts/*"]
#[exclude = "tests/*"]
#[exclude = "package*.json"]
#[exclude = "jsconfig.json"]
#[allow_missing = true]
struct Pages;

/// What to do when the browser libraries are not there; `None` when they are.
pub(crate) fn missing() -> Option<&'static str> {
    if Pages::get("index.html").is_none() {
        return Some("the pages are not in this build: build it from a checkout that has static/");
    }
    let vendored = Pages::iter().any(|path| path.starts_with("vendor/"));
    (!vendored).then_some(
        "the browser libraries are missing, so the map will stay empty: run `make vendor` (npm ci, then a copy into static/vendor/)",
    )
}

/// Answers every path that no route has.
pub(crate) async fn serve(uri: Uri, headers: HeaderMap) -> Response {
    let path = uri.path().trim_start_matches('/');
    let path = if path.is_empty() { "index.html" } else { path };
    // A debug build reads the folder itself, where such a path could climb to what is kept back.
    let climbs = path.split(['/', '\\']).any(|part| part == "..");
    match (!climbs).then(|| Pages::get(path)).flatten() {
        Some(file) => answer(path, file, &headers),
        None if path.starts_with("api/") => StatusCode::NOT_FOUND.into_response(),
        None => Error::not_found("page", uri.path()).into_response(),
    }
}

fn answer(path: &str, file: EmbeddedFile, headers: &HeaderMap) -> Response {
    let hash: String = file.metadata.sha256_hash().iter().map(|byte| format!("{byte:02x}")).collect();
    let tag = format!("\"{hash}\"");
    // Browsers ask each time and are told 304: a new version is seen at once, and costs one round trip.
    let cached = [(header::ETAG, tag.clone()), (header::CACHE_CONTROL, "no-cache".to_owned())];
    let known = headers.get(header::IF_NONE_MATCH).and_then(|tags| tags.to_str().ok());
    if known.is_some_and(|tags| tags.split(',').any(|known| known.trim().trim_start_matches("W/") == tag)) {
        return (StatusCode::NOT_MODIFIED, cached).into_response();
    }
    let kind = match path.rsplit('.').next() {
        Some("js" | "mjs") => "text/javascript; charset=utf-8".to_owned(),
        Some("html") => "text/html; charset=utf-8".to_owned(),
        Some("css") => "text/css; charset=utf-8".to_owned(),
        Some("json" | "map") => "application/json".to_owned(),
        _ => file.metadata.mimetype().to_owned(),
    };
    (cached, [(header::CONTENT_TYPE, kind)], file.data).into_response()
}
