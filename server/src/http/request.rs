//! What a part of a request is described as, by the type that a handler takes it with.

use axum::extract::State;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::StatusCode;
use schemars::{Schema, json_schema};
use uuid::Uuid;

use super::operation::Describer;
use crate::error::Result;

/// Something that a handler takes.
pub trait RequestPart {
    /// Takes down what of the request it reads.
    fn describe(to: &mut Describer<'_>);
}

/// Reads a query and says what is wrong with it.
pub type ReadsQuery = fn(&str) -> Result<()>;

/// Comes from the server itself.
impl<S> RequestPart for State<S> {
    fn describe(_: &mut Describer<'_>) {}
}

/// The headers of a handshake are the protocol's own (RFC 6455).
impl RequestPart for WebSocketUpgrade {
    fn describe(to: &mut Describer<'_>) {
        to.refuses(
            [StatusCode::BAD_REQUEST, StatusCode::UPGRADE_REQUIRED].map(|status| (status, "bad_request")),
        );
    }
}

/// The variable parts of a path, as a handler takes them.
pub trait PathParts {
    /// Their schemas, in the order of the path.
    fn schemas() -> Vec<Schema>;
}

/// A variable part of a path.
pub trait PathPart {
    /// Its schema.
    fn schema() -> Schema;
}

impl<P: PathPart> PathParts for P {
    fn schemas() -> Vec<Schema> {
        vec![P::schema()]
    }
}

impl<P: PathPart, Q: PathPart> PathParts for (P, Q) {
    fn schemas() -> Vec<Schema> {
        vec![P::schema(), Q::schema()]
    }
}

impl PathPart for Uuid {
    fn schema() -> Schema {
        json_schema!({"type": "string", "format": "uuid"})
    }
}

impl PathPart for String {
    fn schema() -> Schema {
        json_schema!({"type": "string", "minLength": 1})
    }
}

impl PathPart for u32 {
    fn schema() -> Schema {
        json_schema!({"type": "integer", "minimum": 0, "maximum": u32::MAX})
    }
}

impl PathPart for i64 {
    fn schema() -> Schema {
        json_schema!({"type": "integer"})
    }
}
