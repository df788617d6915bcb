//! What an operation takes and gives, read from the types of its handler: no second place could say otherwise.

use std::future::Future;

use axum::handler::Handler;
use axum::http::StatusCode;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::Value;

use super::answer::Answer;
use super::request::{ReadsQuery, RequestPart};
use super::schemas::Schemas;
use crate::state::App;

/// What an operation takes, and what it gives when all is well.
#[derive(Clone, Debug, Default)]
pub struct Signature {
    /// The variable parts of the path, in their order.
    pub path: Vec<Schema>,
    /// What comes after the question mark.
    pub query: Option<Query>,
    /// Headers that are read.
    pub headers: Vec<Header>,
    /// The body, in each of the media types that are taken.
    pub body: Vec<Content>,
    /// The answers, one a status.
    pub answers: Vec<Answered>,
    /// The problems of what cannot be taken, each with its status.
    pub problems: Vec<(StatusCode, &'static str)>,
}

/// The parameters after the question mark.
#[derive(Clone, Debug)]
pub struct Query {
    /// An object with a property a parameter.
    pub schema: Schema,
    /// Reads one as the handler will.
    pub reads: ReadsQuery,
}

/// A header of a request or an answer.
#[derive(Clone, Debug)]
pub struct Header {
    /// Its name.
    pub name: &'static str,
    /// What it says, in a line.
    pub about: &'static str,
    /// Whether it is always there.
    pub is_required: bool,
    /// Its value.
    pub schema: Schema,
}

/// A body in one media type.
#[derive(Clone, Debug)]
pub struct Content {
    /// Such as `application/json`.
    pub media_type: &'static str,
    /// What is in it.
    pub schema: Schema,
    /// What one looks like, where the schema does not tell.
    pub example: Option<Value>,
}

/// An answer.
#[derive(Clone, Debug)]
pub struct Answered {
    /// Its status.
    pub status: StatusCode,
    /// Its body, in each of the media types that it may have; none: it has no body.
    pub content: Vec<Content>,
    /// Its headers.
    pub headers: Vec<Header>,
}

impl Content {
    /// JSON.
    pub(crate) fn json(schema: Schema) -> Content {
        Content { media_type: "application/json", schema, example: None }
    }
}

/// Takes down what the types of a handler tell.
pub struct Describer<'s> {
    /// The schemas of all operations, which they share.
    schemas: &'s mut Schemas,
    /// What was told so far.
    pub(super) signature: Signature,
}

impl Describer<'_> {
    /// The codes of problems that are answered where this part of a request cannot be taken.
    pub(crate) fn refuses(&mut self, problems: impl IntoIterator<Item = (StatusCode, &'static str)>) {
        self.signature.problems.extend(problems);
    }

    /// A body that is taken in this media type.
    pub(crate) fn takes(&mut self, content: Content) {
        self.signature.body.push(content);
    }

    /// The schema of what is sent here.
    pub(crate) fn taken<T: JsonSchema>(&mut self) -> Schema {
        self.schemas.taken.subschema_for::<T>()
    }

    /// What makes the schemas of what is sent here.
    pub(super) fn taken_schemas(&mut self) -> &mut SchemaGenerator {
        &mut self.schemas.taken
    }

    /// What makes the schemas of what is answered.
    pub(super) fn given_schemas(&mut self) -> &mut SchemaGenerator {
        &mut self.schemas.given
    }
}

/// Tells a handler's signature.
pub type Describe = fn(&mut Schemas) -> Signature;

/// A handler of which every part tells what it takes, and the answer what it gives.
pub trait Operation<Parts>: Handler<Parts, App> {
    /// What its types say.
    fn signature(schemas: &mut Schemas) -> Signature;
}

impl<F, Answering, A> Operation<((),)> for F
where
    F: Handler<((),), App> + FnOnce() -> Answering,
    Answering: Future<Output = A>,
    A: Answer,
{
    fn signature(schemas: &mut Schemas) -> Signature {
        let mut to = Describer { schemas, signature: Signature::default() };
        A::describe(&mut to);
        to.signature
    }
}

macro_rules! operation {
    ($($part:ident)+) => {
        impl<F, Answering, A, M, $($part),+> Operation<(M, $($part,)+)> for F
        where
            F: Handler<(M, $($part,)+), App> + FnOnce($($part),+) -> Answering,
            Answering: Future<Output = A>,
            A: Answer,
            $($part: RequestPart,)+
        {
            fn signature(schemas: &mut Schemas) -> Signature {
                let mut to = Describer { schemas, signature: Signature::default() };
                $($part::describe(&mut to);)+
                A::describe(&mut to);
                to.signature
            }
        }
    };
}

operation!(P1);
operation!(P1 P2);
operation!(P1 P2 P3);
operation!(P1 P2 P3 P4);
operation!(P1 P2 P3 P4 P5);
operation!(P1 P2 P3 P4 P5 P6);
