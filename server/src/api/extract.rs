//! What handlers take from a request; what cannot be taken is told as a problem document.

use axum::body::Bytes;
use axum::extract::path::ErrorKind;
use axum::extract::rejection::PathRejection;
use axum::extract::{FromRequest, FromRequestParts, RawPathParams, Request};
use axum::http::request::Parts;
use axum::http::{StatusCode, header};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use uuid::Uuid;

use super::{json_body, query};
use crate::error::Error;

/// A JSON body.
#[derive(Clone, Copy, Debug)]
pub struct Json<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + JsonSchema> FromRequest<S> for Json<T> {
    type Rejection = Error;

    async fn from_request(request: Request, state: &S) -> Result<Self, Error> {
        let kind = request.headers().get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok());
        if !kind.is_some_and(is_json) {
            let found = kind.map_or("none".to_owned(), |kind| format!("{kind:?}"));
            return Err(Error::http(
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "json_expected",
                format!(
                    "expected a body of content type application/json, found {found}: set the Content-Type header"
                ),
            ));
        }
        let body = Bytes::from_request(request, state).await.map_err(|error| match error.status() {
            StatusCode::PAYLOAD_TOO_LARGE => Error::http(
                StatusCode::PAYLOAD_TOO_LARGE,
                "body_too_large",
                "the body is larger than this route takes: send less at once",
            ),
            status => Error::http(
                status,
                "body_not_read",
                "expected the whole body, found that the link broke before its end: send it again",
            ),
        })?;
        json_body::read(&body).map(Json)
    }
}

/// Whether a content type is JSON's own or one that is written as JSON.
fn is_json(kind: &str) -> bool {
    let kind = kind.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    kind == "application/json" || (kind.starts_with("application/") && kind.ends_with("+json"))
}

/// The variable parts of a path.
#[derive(Clone, Copy, Debug)]
pub struct Path<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for Path<T> {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Error> {
        let path = axum::extract::Path::from_request_parts(parts, state).await;
        match path {
            Ok(axum::extract::Path(path)) => Ok(Path(path)),
            Err(error) => {
                let given = RawPathParams::from_request_parts(parts, state).await;
                Err(wrong_path(error, given.iter().flatten().map(|(_, value)| value)))
            }
        }
    }
}

/// A path whose variable parts, `given`, are not what the route takes.
fn wrong_path<'g>(error: PathRejection, mut given: impl Iterator<Item = &'g str>) -> Error {
    let kind = match error {
        PathRejection::FailedToDeserializePathParams(error) => Some(error.into_kind()),
        _ => None,
    };
    let (expected, found) = match kind {
        Some(
            ErrorKind::ParseErrorAtKey { value, .. }
            | ErrorKind::ParseErrorAtIndex { value, .. }
            | ErrorKind::ParseError { value, .. },
        ) => ("a whole number", format!("{value:?}")),
        Some(ErrorKind::InvalidUtf8InPathParam { .. }) => ("UTF-8", "other bytes".to_owned()),
        _ => {
            let other = given.find(|part| Uuid::parse_str(part).is_err() && part.parse::<u64>().is_err());
            ("an id (a UUID)", other.map_or("another word".to_owned(), |part| format!("{part:?}")))
        }
    };
    let detail = format!("expected {expected}, found {found} in the path: check the id");
    Error::http(StatusCode::NOT_FOUND, "not_an_id", detail)
}

/// The query, after the question mark.
#[derive(Clone, Copy, Debug)]
pub struct Query<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + JsonSchema> FromRequestParts<S> for Query<T> {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Error> {
        query::read(parts.uri.query().unwrap_or_default()).map(Query)
    }
}
