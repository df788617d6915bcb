//! What handlers take from a request; what cannot be taken is told as a problem document.

use axum::extract::rejection::{JsonRejection, PathRejection, QueryRejection};
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::request::Parts;
use axum::http::{StatusCode, Uri};
use serde::de::DeserializeOwned;

use crate::error::Error;

/// A JSON body.
#[derive(Clone, Copy, Debug)]
pub struct Json<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Json<T> {
    type Rejection = Error;

    async fn from_request(request: Request, state: &S) -> Result<Self, Error> {
        match axum::Json::from_request(request, state).await {
            Ok(axum::Json(body)) => Ok(Json(body)),
            Err(JsonRejection::MissingJsonContentType(_)) => Err(Error::http(
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "json_expected",
                "expected a body of content type application/json: set the Content-Type header",
            )),
            Err(JsonRejection::JsonSyntaxError(error)) => {
                Err(Error::http(StatusCode::BAD_REQUEST, "not_json", error.body_text()))
            }
            Err(JsonRejection::JsonDataError(error)) => Err(Error::invalid("wrong_field", error.body_text())),
            Err(other) if other.status() == StatusCode::PAYLOAD_TOO_LARGE => Err(Error::http(
                StatusCode::PAYLOAD_TOO_LARGE,
                "body_too_large",
                "the body is larger than this route takes: send less at once",
            )),
            Err(other) => Err(Error::http(other.status(), "body_not_read", other.body_text())),
        }
    }
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
