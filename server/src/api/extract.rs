//! What handlers take from a request; what cannot be taken is told as a problem document.

use axum::body::Bytes;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::request::Parts;
use axum::http::{StatusCode, Uri, header};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::json_body;
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
        path.map(|axum::extract::Path(path)| Path(path)).map_err(|error: PathRejection| {
            Error::http(
                StatusCode::NOT_FOUND,
                "not_an_id",
                format!("{}: check the id in the path", error.body_text()),
            )
        })
    }
}

/// The query, after the question mark.
#[derive(Clone, Copy, Debug)]
pub struct Query<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for Query<T> {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Error> {
        let query = axum::extract::Query::from_request_parts(parts, state).await;
        query.map(|axum::extract::Query(query)| Query(query)).map_err(wrong_query)
    }
}

/// Reads a query as a handler's [`Query`] would; what no line of a request can hold is told likewise.
pub fn read_query<T: DeserializeOwned>(query: &str) -> Result<T, Error> {
    let uri: Uri = format!("/?{query}").parse().map_err(|error: axum::http::uri::InvalidUri| {
        Error::http(StatusCode::BAD_REQUEST, "wrong_query", error.to_string())
    })?;
    let read = axum::extract::Query::try_from_uri(&uri);
    read.map(|axum::extract::Query(query)| query).map_err(wrong_query)
}

fn wrong_query(error: QueryRejection) -> Error {
    Error::http(StatusCode::BAD_REQUEST, "wrong_query", error.body_text())
}
