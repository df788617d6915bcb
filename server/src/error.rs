//! What can go wrong with a request, as its client sees it: an RFC 9457 problem document.

use axum::Json;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use lodestep_engine::parse::ParseError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use uuid::Uuid;

use crate::store::health::Disk;
use crate::store::{StoreError, WriteError};

/// What a handler gives back.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What is told where there is no room.
pub(crate) const DISK_FULL: &str = "the server's disk is full: nothing of this was stored, and all that was acknowledged is kept; keep it, tell the server's administrator, and send it again when there is room";

/// What is told where the disk failed.
const DISK_FAILED: &str = "the server's disk failed: nothing of this was stored, and the server starts again from what is on disk; keep it and send it again in some seconds";

/// What is told where the server is about to end.
const STOPPING: &str = "the server is stopping, and nothing of this was stored: keep it and send it again when the server is back";

/// When to try again what the disk refused, s.
const RETRY_DISK_AFTER_S: u64 = 10;

/// Why a request was not done.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// What was asked for does not exist.
    #[error("there is no {what} {id:?}")]
    NotFound {
        /// The kind of thing, in the words of the site.
        what: &'static str,
        /// The id or name that was asked for.
        id: String,
    },
    /// The request is well formed, but what stands already speaks against it.
    #[error("{detail}")]
    Conflict {
        /// One word for programs.
        code: &'static str,
        /// Expected, found, what to do.
        detail: String,
    },
    /// Somebody else has changed it meanwhile: the client is told what it is now.
    #[error("{detail}")]
    Changed {
        /// The status: 409, 412 or 428.
        status: StatusCode,
        /// One word for programs.
        code: &'static str,
        /// Expected, found, what to do.
        detail: String,
        /// What it is now.
        current: Value,
    },
    /// The request says something that cannot be.
    #[error("{detail}")]
    Invalid {
        /// One word for programs.
        code: &'static str,
        /// Expected, found, what to do.
        detail: String,
        /// Where in the input, when that can be said.
        place: Option<Place>,
    },
    /// A status of HTTP's own, with its sentence.
    #[error("{detail}")]
    Http {
        /// The status.
        status: StatusCode,
        /// One word for programs.
        code: &'static str,
        /// Expected, found, what to do.
        detail: String,
        /// Where in the input, when that can be said.
        place: Option<Place>,
    },
    /// Asked too often.
    #[error("{detail}")]
    TooMany {
        /// One word for programs.
        code: &'static str,
        /// Expected, found, what to do.
        detail: String,
        /// When to try again, s.
        retry_after_s: u64,
    },
    /// The store failed; its words stay in the log.
    #[error("the store failed: {0}")]
    Store(#[from] StoreError),
    /// Anything else that is the server's fault; its words stay in the log.
    #[error("{0}")]
    Internal(#[from] anyhow::Error),
}

/// Where in the input something is wrong.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "ProblemPlace")]
pub struct Place {
    /// Line, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u64>,
    /// Column by its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"gyr_x_rad_s")]
    pub column: Option<String>,
    /// Letter of the line, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub character: Option<u64>,
    /// Field of a JSON body, as a path such as `visits[2].marker`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"visits[2].marker")]
    pub field: Option<String>,
}

/// An RFC 9457 problem document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Problem {
    /// Always `about:blank`: `code` says which problem it is.
    #[serde(rename = "type")]
    #[schemars(example = &"about:blank")]
    pub kind: String,
    /// The status in words.
    #[schemars(example = &"Not Found")]
    pub title: String,
    /// The HTTP status.
    pub status: u16,
    /// One word for programs.
    #[schemars(example = &"session_not_found")]
    pub code: String,
    /// What was expected, what was found, what to do.
    #[schemars(example = &"there is no session \"0199f3a0-7c1e-7d52-9b1a-4f6e2d8c3b57\"")]
    pub detail: String,
    /// Where in the input, when that can be said.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    #[schemars(example = Value::Null)]
    pub place: Option<Place>,
    /// What stands now, where somebody else has changed it meanwhile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = Value::Null)]
    pub current: Option<Value>,
}

impl Error {
    /// A thing of this kind and id does not exist.
    pub fn not_found(what: &'static str, id: impl ToString) -> Error {
        Error::NotFound { what, id: id.to_string() }
    }

    /// What stands already speaks against it.
    pub fn conflict(code: &'static str, detail: impl Into<String>) -> Error {
        Error::Conflict { code, detail: detail.into() }
    }

    /// Somebody else has changed it meanwhile; `current` is what it is now.
    pub fn changed(
        status: StatusCode,
        code: &'static str,
        detail: impl Into<String>,
        current: impl Serialize,
    ) -> Error {
        let current = serde_json::to_value(current).unwrap_or_default();
        Error::Changed { status, code, detail: detail.into(), current }
    }

    /// The request says something that cannot be.
    pub fn invalid(code: &'static str, detail: impl Into<String>) -> Error {
        Error::Invalid { code, detail: detail.into(), place: None }
    }

    /// The request says something that cannot be, at this place.
    pub fn invalid_at(code: &'static str, detail: impl Into<String>, place: Place) -> Error {
        Error::Invalid { code, detail: detail.into(), place: Some(place) }
    }

    /// A status of HTTP's own.
    pub fn http(status: StatusCode, code: &'static str, detail: impl Into<String>) -> Error {
        Error::Http { status, code, detail: detail.into(), place: None }
    }

    /// A status of HTTP's own, about this place.
    pub fn http_at(status: StatusCode, code: &'static str, detail: impl Into<String>, place: Place) -> Error {
        Error::Http { status, code, detail: detail.into(), place: Some(place) }
    }

    /// Logs a failure of ours, once, and gives the sentence for its client: with an id in place of its words.
    fn logged(&self, detail: &str) -> String {
        let id = Uuid::now_v7();
        tracing::error!(error_id = %id, error = ?self, "request failed, error_id={id}: {detail}");
        format!(
            "the server could not do this and nothing was stored; its log tells why under id {id}: try again, or give that id to the server's administrator"
        )
    }

    /// What the client is told. A failure of ours is logged here.
    pub fn into_problem(self) -> Problem {
        let detail = printable(self.to_string());
        let current = match &self {
            Error::Changed { current, .. } => Some(current.clone()),
            _ => None,
        };
        let (status, code, detail, place) = match self {
            Error::NotFound { what, .. } => {
                let code = format!("{what}_not_found").replace(' ', "_");
                (StatusCode::NOT_FOUND, code, detail, None)
            }
            Error::Conflict { code, .. } => (StatusCode::CONFLICT, code.to_owned(), detail, None),
            Error::Changed { status, code, .. } => (status, code.to_owned(), detail, None),
            Error::Invalid { code, place, .. } => {
                (StatusCode::UNPROCESSABLE_ENTITY, code.to_owned(), detail, place)
            }
            Error::Http { status, code, place, .. } => (status, code.to_owned(), detail, place),
            Error::TooMany { code, .. } => (StatusCode::TOO_MANY_REQUESTS, code.to_owned(), detail, None),
            // Said once in the log, by the writer, not for each who is refused.
            Error::Store(error) if error.disk() == Some(Disk::Full) => {
                (StatusCode::INSUFFICIENT_STORAGE, "disk_full".to_owned(), DISK_FULL.to_owned(), None)
            }
            Error::Store(error) if error.disk() == Some(Disk::Failing) => {
                (StatusCode::SERVICE_UNAVAILABLE, "disk_failed".to_owned(), DISK_FAILED.to_owned(), None)
            }
            Error::Store(error) if error.is_stopping() => {
                (StatusCode::SERVICE_UNAVAILABLE, "stopping".to_owned(), STOPPING.to_owned(), None)
            }
            Error::Store(ref error) if error.is_passing() => {
                (StatusCode::SERVICE_UNAVAILABLE, "internal".to_owned(), self.logged(&detail), None)
            }
            Error::Store(_) | Error::Internal(_) => {
                (StatusCode::INTERNAL_SERVER_ERROR, "internal".to_owned(), self.logged(&detail), None)
            }
        };
        let title = status.canonical_reason().unwrap_or("Error").to_owned();
        Problem {
            kind: "about:blank".to_owned(),
            title,
            status: status.as_u16(),
            code,
            detail,
            place,
            current,
        }
    }
}

impl WriteError for Error {
    fn disk(&self) -> Option<Disk> {
        match self {
            Error::Store(error) => error.disk(),
            _ => None,
        }
    }
}

/// Some libraries repeat what was sent in their own words: no control character of it reaches a log or a
/// terminal, and not all of a long text.
fn printable(text: String) -> String {
    const MOST: usize = 2_000;
    if text.chars().nth(MOST).is_none() && !text.contains(char::is_control) {
        return text;
    }
    text.chars().take(MOST).map(|c| if c.is_control() { '·' } else { c }).collect()
}

impl From<ParseError> for Error {
    /// What a parser says is already a sentence for the one who sent it.
    fn from(error: ParseError) -> Self {
        let detail = error.to_string();
        let place = (error.line.is_some() || error.column.is_some()).then(|| Place {
            line: error.line,
            column: error.column.clone(),
            ..Place::default()
        });
        Error::Invalid { code: error.code(), detail, place }
    }
}

impl IntoResponse for Error {
    fn into_response(self) -> Response {
        let retry_after_s = match &self {
            Error::TooMany { retry_after_s, .. } => Some(*retry_after_s),
            other => other.disk().map(|_| RETRY_DISK_AFTER_S),
        };
        let mut response = self.into_problem().into_response();
        if let Some(seconds) = retry_after_s {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        if response.status() == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = (status, Json(self)).into_response();
        response
            .headers_mut()
            .insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        response
    }
}
