//! What a handler answers when all is well, as types that say status, headers and body.

use std::marker::PhantomData;

use axum::body::Body;
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Serialize;

use super::extract::Json;
use super::media::Media;
use super::operation::{Answered, Content, Describer, Header};
use crate::error::{Error, Result};

/// What a handler gives back.
pub trait Answer: IntoResponse {
    /// Takes down every answer that it may be when all is well.
    fn describe(to: &mut Describer<'_>);
}

/// The body of an answer; alone it is answered with 200.
pub trait AnswerBody: IntoResponse {
    /// What it is in each media type that it may have.
    fn content(schemas: &mut SchemaGenerator) -> Vec<Content>;
}

impl<B: AnswerBody> Answer for B {
    fn describe(to: &mut Describer<'_>) {
        to.answers_with::<B>(StatusCode::OK);
    }
}

impl Describer<'_> {
    fn answers_with<B: AnswerBody>(&mut self, status: StatusCode) {
        let content = B::content(self.given_schemas());
        self.signature.answers.push(Answered { status, content, headers: Vec::new() });
    }

    fn answers(&mut self, status: StatusCode) {
        self.signature.answers.push(Answered { status, content: Vec::new(), headers: Vec::new() });
    }
}

/// What may go wrong, an error does not tell by its type: see [`operation_list`](super::operation_list).
impl<A: Answer, E: Refusal> Answer for std::result::Result<A, E> {
    fn describe(to: &mut Describer<'_>) {
        A::describe(to);
    }
}

/// Why something was not done: becomes a problem document.
pub trait Refusal: IntoResponse {}

impl Refusal for Error {}

impl<H: AnswerHeader, E: Refusal> Refusal for With<Option<H>, E> {}

impl<T: JsonSchema> AnswerBody for Json<T>
where
    Json<T>: IntoResponse,
{
    fn content(schemas: &mut SchemaGenerator) -> Vec<Content> {
        vec![Content::json(schemas.subschema_for::<T>())]
    }
}

/// There is something new: 201.
#[derive(Clone, Copy, Debug)]
pub struct Created<B>(pub B);

impl<B: IntoResponse> IntoResponse for Created<B> {
    fn into_response(self) -> Response {
        (StatusCode::CREATED, self.0).into_response()
    }
}

impl<B: AnswerBody> Answer for Created<B> {
    fn describe(to: &mut Describer<'_>) {
        to.answers_with::<B>(StatusCode::CREATED);
    }
}

/// It will be done: 202.
#[derive(Clone, Copy, Debug)]
pub struct Accepted<B>(pub B);

impl<B: IntoResponse> IntoResponse for Accepted<B> {
    fn into_response(self) -> Response {
        (StatusCode::ACCEPTED, self.0).into_response()
    }
}

impl<B: AnswerBody> Answer for Accepted<B> {
    fn describe(to: &mut Describer<'_>) {
        to.answers_with::<B>(StatusCode::ACCEPTED);
    }
}

/// Something that is made once, however often it is asked for.
#[derive(Clone, Copy, Debug)]
pub enum MaybeNew<B> {
    /// It was made: 201.
    New(B),
    /// It was there already: 200.
    Known(B),
}

impl<B> MaybeNew<B> {
    /// The thing itself.
    pub(crate) fn get(&self) -> &B {
        match self {
            MaybeNew::New(body) | MaybeNew::Known(body) => body,
        }
    }

    /// The same of something made of it.
    pub(crate) fn map<C>(self, change: impl FnOnce(B) -> C) -> MaybeNew<C> {
        match self {
            MaybeNew::New(body) => MaybeNew::New(change(body)),
            MaybeNew::Known(body) => MaybeNew::Known(change(body)),
        }
    }

    /// What was made now, or was there.
    pub(crate) fn of(is_new: bool, body: B) -> MaybeNew<B> {
        if is_new { MaybeNew::New(body) } else { MaybeNew::Known(body) }
    }
}

impl<B: IntoResponse> IntoResponse for MaybeNew<B> {
    fn into_response(self) -> Response {
        match self {
            MaybeNew::New(body) => Created(body).into_response(),
            MaybeNew::Known(body) => body.into_response(),
        }
    }
}

impl<B: AnswerBody> Answer for MaybeNew<B> {
    fn describe(to: &mut Describer<'_>) {
        to.answers_with::<B>(StatusCode::OK);
        to.answers_with::<B>(StatusCode::CREATED);
    }
}

/// It was done, and there is nothing to show: 204.
#[derive(Clone, Copy, Debug)]
pub struct NoContent;

impl IntoResponse for NoContent {
    fn into_response(self) -> Response {
        StatusCode::NO_CONTENT.into_response()
    }
}

impl Answer for NoContent {
    fn describe(to: &mut Describer<'_>) {
        to.answers(StatusCode::NO_CONTENT);
    }
}

/// From here on it is a websocket: 101.
#[derive(Debug)]
pub struct Upgraded(pub Response);

impl IntoResponse for Upgraded {
    fn into_response(self) -> Response {
        self.0
    }
}

impl Answer for Upgraded {
    fn describe(to: &mut Describer<'_>) {
        to.answers(StatusCode::SWITCHING_PROTOCOLS);
    }
}

/// A file of one kind.
#[derive(Debug)]
pub struct File<M> {
    body: Body,
    kind: PhantomData<M>,
}

impl<M: Media> File<M> {
    /// With these bytes.
    pub(crate) fn new(body: impl Into<Body>) -> File<M> {
        File { body: body.into(), kind: PhantomData }
    }
}

impl<M: Media> IntoResponse for File<M> {
    fn into_response(self) -> Response {
        ([(header::CONTENT_TYPE, M::CONTENT_TYPE)], self.body).into_response()
    }
}

impl<M: Media> AnswerBody for File<M> {
    fn content(_: &mut SchemaGenerator) -> Vec<Content> {
        vec![M::content()]
    }
}

/// JSON that was written elsewhere: kept as text, or too long to be held whole. That it is of this shape is for the
/// tests to see, which hold every answer against its description.
#[derive(Debug)]
pub struct WrittenJson<T> {
    body: Body,
    shape: PhantomData<T>,
}

impl<T: JsonSchema> WrittenJson<T> {
    /// With this text.
    pub(crate) fn new(body: impl Into<Body>) -> WrittenJson<T> {
        WrittenJson { body: body.into(), shape: PhantomData }
    }

    /// What is kept elsewhere and not to be copied for an answer.
    pub(crate) fn of(value: &T) -> Result<WrittenJson<T>>
    where
        T: Serialize,
    {
        let text = serde_json::to_vec(value).map_err(|error| Error::Internal(error.into()))?;
        Ok(WrittenJson::new(text))
    }
}

impl<T> IntoResponse for WrittenJson<T> {
    fn into_response(self) -> Response {
        ([(header::CONTENT_TYPE, "application/json")], self.body).into_response()
    }
}

impl<T: JsonSchema> AnswerBody for WrittenJson<T> {
    fn content(schemas: &mut SchemaGenerator) -> Vec<Content> {
        vec![Content::json(schemas.subschema_for::<T>())]
    }
}

/// A header of answers.
pub trait AnswerHeader {
    /// Its name, as it is written.
    const NAME: &'static str;
    /// What it says, in a line.
    const ABOUT: &'static str;

    /// Its value.
    fn value(self) -> HeaderValue;

    /// What its value is.
    fn schema() -> Schema {
        json_schema!({"type": "string"})
    }
}

/// An answer with a header.
#[derive(Clone, Copy, Debug)]
pub struct With<H, A>(pub H, pub A);

impl<H: AnswerHeader, A: IntoResponse> IntoResponse for With<H, A> {
    fn into_response(self) -> Response {
        let mut response = self.1.into_response();
        let name = HeaderName::from_bytes(H::NAME.as_bytes()).expect("the names here are names of headers");
        response.headers_mut().insert(name, self.0.value());
        response
    }
}

impl<H: AnswerHeader, A: IntoResponse> IntoResponse for With<Option<H>, A> {
    fn into_response(self) -> Response {
        match self.0 {
            Some(header) => With(header, self.1).into_response(),
            None => self.1.into_response(),
        }
    }
}

impl<H: AnswerHeader, A: Answer> Answer for With<H, A> {
    fn describe(to: &mut Describer<'_>) {
        let before = to.signature.answers.len();
        A::describe(to);
        for answered in &mut to.signature.answers[before..] {
            let (name, about, schema) = (H::NAME, H::ABOUT, H::schema());
            answered.headers.push(Header { name, about, is_required: true, schema });
        }
    }
}

impl<H: AnswerHeader, A: Answer> Answer for With<Option<H>, A> {
    fn describe(to: &mut Describer<'_>) {
        let before = to.signature.answers.len();
        A::describe(to);
        for answered in &mut to.signature.answers[before..] {
            let (name, about, schema) = (H::NAME, H::ABOUT, H::schema());
            answered.headers.push(Header { name, about, is_required: false, schema });
        }
    }
}

/// Where what was made or begun is found.
#[derive(Clone, Debug)]
pub struct Location(pub String);

impl AnswerHeader for Location {
    const NAME: &'static str = "Location";
    const ABOUT: &'static str = "The path of what was made or begun";

    fn value(self) -> HeaderValue {
        HeaderValue::try_from(self.0).expect("paths of ours are plain text")
    }
}

/// The version of what is shown, for `If-Match`.
#[derive(Clone, Copy, Debug)]
pub struct Version(pub i64);

impl AnswerHeader for Version {
    const NAME: &'static str = "ETag";
    const ABOUT: &'static str = "Its version in quotes, for If-Match";

    fn value(self) -> HeaderValue {
        HeaderValue::try_from(format!("\"{}\"", self.0)).expect("a number in quotes is plain text")
    }
}

/// The name under which a browser keeps a file.
#[derive(Clone, Debug)]
pub struct Attachment(pub String);

impl AnswerHeader for Attachment {
    const NAME: &'static str = "Content-Disposition";
    const ABOUT: &'static str = "attachment, with the file's name";

    fn value(self) -> HeaderValue {
        HeaderValue::try_from(format!("attachment; filename=\"{}\"", self.0))
            .expect("names of ours are plain text")
    }
}

/// How long a browser may keep it.
#[derive(Clone, Copy, Debug)]
pub struct Kept(pub &'static str);

impl AnswerHeader for Kept {
    const NAME: &'static str = "Cache-Control";
    const ABOUT: &'static str = "How long it may be kept";

    fn value(self) -> HeaderValue {
        HeaderValue::from_static(self.0)
    }
}
