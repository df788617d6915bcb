//! What handlers take from a request; what cannot be taken is told as a problem document.

use std::marker::PhantomData;

use axum::body::{Body, Bytes};
use axum::extract::path::ErrorKind;
use axum::extract::rejection::{BytesRejection, PathRejection};
use axum::extract::{FromRequest, FromRequestParts, RawPathParams, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::{JsonSchema, Schema, json_schema};
use serde::Serialize;
use serde::de::DeserializeOwned;
use uuid::Uuid;

use super::answer::AnswerHeader;
use super::media::{Csv, Media};
use super::operation::{self, Content, Describer, Header};
use super::request::{PathParts, RequestPart};
use super::{json_body, query};
use crate::error::{Error, Result};
use crate::headers;

/// A JSON body, of a request or of an answer.
#[derive(Clone, Copy, Debug)]
pub struct Json<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + JsonSchema> FromRequest<S> for Json<T> {
    type Rejection = Error;

    async fn from_request(request: Request, state: &S) -> Result<Self> {
        let kind = content_type(request.headers());
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
        let body = Bytes::from_request(request, state).await.map_err(not_read)?;
        json_body::read(&body).map(Json)
    }
}

impl<T: JsonSchema> RequestPart for Json<T> {
    fn describe(to: &mut Describer<'_>) {
        let schema = to.taken::<T>();
        to.takes(Content::json(schema));
        to.refuses([(StatusCode::UNSUPPORTED_MEDIA_TYPE, "json_expected")]);
        to.refuses(NOT_THE_JSON);
        to.refuses(NOT_READ);
    }
}

impl<T: Serialize> IntoResponse for Json<T> {
    fn into_response(self) -> Response {
        axum::Json(self.0).into_response()
    }
}

/// What is answered to a body that does not come whole.
pub(crate) const NOT_READ: [(StatusCode, &str); 2] =
    [(StatusCode::PAYLOAD_TOO_LARGE, "body_too_large"), (StatusCode::BAD_REQUEST, "body_not_read")];

/// What is answered to a body that is no JSON, or not of the shape that is taken.
pub(crate) const NOT_THE_JSON: [(StatusCode, &str); 2] =
    [(StatusCode::BAD_REQUEST, "not_json"), (StatusCode::UNPROCESSABLE_ENTITY, "wrong_field")];

/// A body that did not arrive whole.
pub(crate) fn not_read(error: BytesRejection) -> Error {
    match error.status() {
        StatusCode::PAYLOAD_TOO_LARGE => headers::too_large(),
        _ => Error::http(
            StatusCode::BAD_REQUEST,
            "body_not_read",
            "expected the whole body, found that the link broke before its end: send it again",
        ),
    }
}

pub(crate) fn content_type(headers: &HeaderMap) -> Option<&str> {
    headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok())
}

/// Whether a content type is JSON's own or one that is written as JSON.
fn is_json(kind: &str) -> bool {
    let kind = kind.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    kind == "application/json" || (kind.starts_with("application/") && kind.ends_with("+json"))
}

/// A body that is a table as text, and is said to be one.
#[derive(Clone, Debug)]
pub struct CsvBody(pub Bytes);

impl<S: Send + Sync> FromRequest<S> for CsvBody {
    type Rejection = Error;

    async fn from_request(request: Request, state: &S) -> Result<Self> {
        let kind = content_type(request.headers()).unwrap_or_default().to_owned();
        let body = Bytes::from_request(request, state).await.map_err(not_read)?;
        if kind.to_ascii_lowercase().starts_with(Csv::NAME) {
            return Ok(CsvBody(body));
        }
        Err(Error::http(
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            "csv_expected",
            format!("expected a body of content type text/csv, found {kind:?}: set the Content-Type header"),
        ))
    }
}

impl RequestPart for CsvBody {
    fn describe(to: &mut Describer<'_>) {
        to.takes(Csv::content());
        to.refuses([(StatusCode::UNSUPPORTED_MEDIA_TYPE, "csv_expected")]);
        to.refuses(NOT_READ);
    }
}

/// A body of any content type that is held whole; what it is, its bytes say.
#[derive(Clone, Debug)]
pub struct BytesBody<M> {
    /// The bytes.
    pub bytes: Bytes,
    kind: PhantomData<M>,
}

impl<S: Send + Sync, M: Media> FromRequest<S> for BytesBody<M> {
    type Rejection = Error;

    async fn from_request(request: Request, state: &S) -> Result<Self> {
        let bytes = Bytes::from_request(request, state).await.map_err(not_read)?;
        Ok(BytesBody { bytes, kind: PhantomData })
    }
}

impl<M: Media> RequestPart for BytesBody<M> {
    fn describe(to: &mut Describer<'_>) {
        to.takes(M::content());
        to.refuses(NOT_READ);
    }
}

/// A body of any content type that is read as it comes.
#[derive(Debug)]
pub struct StreamedBody<M> {
    /// What comes.
    pub body: Body,
    kind: PhantomData<M>,
}

impl<S: Send + Sync, M: Media> FromRequest<S> for StreamedBody<M> {
    type Rejection = std::convert::Infallible;

    async fn from_request(request: Request, _: &S) -> std::result::Result<Self, Self::Rejection> {
        Ok(StreamedBody { body: request.into_body(), kind: PhantomData })
    }
}

impl<M: Media> RequestPart for StreamedBody<M> {
    fn describe(to: &mut Describer<'_>) {
        to.takes(M::content());
        to.refuses(NOT_READ);
    }
}

/// The variable parts of a path.
#[derive(Clone, Copy, Debug)]
pub struct Path<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for Path<T> {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self> {
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

impl<T: PathParts> RequestPart for Path<T> {
    fn describe(to: &mut Describer<'_>) {
        to.signature.path = T::schemas();
        to.refuses([(StatusCode::NOT_FOUND, "not_an_id")]);
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

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self> {
        query::read(parts.uri.query().unwrap_or_default()).map(Query)
    }
}

impl<T: DeserializeOwned + JsonSchema> RequestPart for Query<T> {
    fn describe(to: &mut Describer<'_>) {
        let schema = T::json_schema(to.taken_schemas());
        to.signature.query =
            Some(operation::Query { schema, reads: |query| query::read::<T>(query).map(drop) });
        to.refuses([(StatusCode::BAD_REQUEST, "wrong_query")]);
    }
}

/// The program that asks, as it names itself; empty where it does not.
#[derive(Clone, Debug)]
pub struct UserAgent(pub String);

impl<S: Send + Sync> FromRequestParts<S> for UserAgent {
    type Rejection = std::convert::Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> std::result::Result<Self, Self::Rejection> {
        let agent = parts.headers.get(header::USER_AGENT).and_then(|agent| agent.to_str().ok());
        Ok(UserAgent(agent.unwrap_or_default().to_owned()))
    }
}

/// Every program may send it.
impl RequestPart for UserAgent {
    fn describe(_: &mut Describer<'_>) {}
}

/// The version that a change is conditional on.
#[derive(Clone, Debug)]
pub struct IfMatch(Option<HeaderValue>);

impl IfMatch {
    /// The number in it; `None` where there is no such header.
    pub(crate) fn version(&self) -> Result<Option<i64>> {
        let Some(tag) = &self.0 else { return Ok(None) };
        let text = tag.to_str().unwrap_or_default().trim();
        let version = text.trim_start_matches("W/").trim_matches('"').parse();
        version.map(Some).map_err(|_| {
            Error::invalid(
                "wrong_if_match",
                format!("expected If-Match with the ETag of one marker, found {text:?}: send back the one that came with it"),
            )
        })
    }
}

impl<S: Send + Sync> FromRequestParts<S> for IfMatch {
    type Rejection = std::convert::Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> std::result::Result<Self, Self::Rejection> {
        Ok(IfMatch(parts.headers.get(header::IF_MATCH).cloned()))
    }
}

impl RequestPart for IfMatch {
    fn describe(to: &mut Describer<'_>) {
        to.signature.headers.push(Header {
            name: "If-Match",
            about: "The ETag that came with what is changed",
            is_required: false,
            schema: json_schema!({"type": "string", "pattern": "^\"[0-9]+\"$"}),
        });
        to.refuses([(StatusCode::UNPROCESSABLE_ENTITY, "wrong_if_match")]);
    }
}

/// Where an upload goes on, bytes: sent with every piece, and with every answer about an upload.
#[derive(Clone, Copy, Debug)]
pub struct UploadOffset(pub u64);

const UPLOAD_OFFSET: &str = "Upload-Offset";

fn offset_schema() -> Schema {
    json_schema!({"type": "integer", "minimum": 0})
}

impl<S: Send + Sync> FromRequestParts<S> for UploadOffset {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self> {
        let sent = parts.headers.get(UPLOAD_OFFSET);
        let offset_bytes = sent.and_then(|value| value.to_str().ok()?.parse().ok());
        offset_bytes.map(UploadOffset).ok_or_else(|| {
            Error::http(
                StatusCode::BAD_REQUEST,
                "upload_offset_missing",
                format!(
                    "expected the header Upload-Offset with a number of bytes, found {sent:?}: ask with HEAD where to go on"
                ),
            )
        })
    }
}

impl RequestPart for UploadOffset {
    fn describe(to: &mut Describer<'_>) {
        to.signature.headers.push(Header {
            name: UPLOAD_OFFSET,
            about: "How many bytes of the log are there already: where this piece begins",
            is_required: true,
            schema: offset_schema(),
        });
        to.refuses([(StatusCode::BAD_REQUEST, "upload_offset_missing")]);
    }
}

impl AnswerHeader for UploadOffset {
    const NAME: &'static str = UPLOAD_OFFSET;
    const ABOUT: &'static str = "How many bytes of the log are there: where to go on";

    fn value(self) -> HeaderValue {
        HeaderValue::from(self.0)
    }

    fn schema() -> Schema {
        offset_schema()
    }
}
