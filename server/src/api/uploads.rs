//! Logs handed in: begun, appended to, asked about, finished, given up.

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use lodestep_engine::parse::Reading;
use lodestep_engine::stream::StreamId;
use lodestep_engine::system::StreamRule;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::extract::{Json, Path, Query};
use super::sessions::system_named;
use super::{Needs, Routes};
use crate::auth::{self, Caller};
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::sessions::accept_log;
use crate::sessions::preview_log::Preview;
use crate::sessions::uploads::{self, BeginLog, Begun};
use crate::state::App;
use crate::store::logs::{Log, LogState};

/// Where an upload goes on; sent with a chunk, and with every answer about an upload.
const UPLOAD_OFFSET: HeaderName = HeaderName::from_static("upload-offset");

/// Bytes of a log that are looked at without an upload.
const MOST_PREVIEW_BYTES: usize = 16 << 20;

/// The quick ones.
pub(super) fn routes() -> Routes {
    Routes::new()
        .post("/sessions/{id}/logs", Needs::OwnSession, begin)
        .about("Begins the upload of a stream's log")
        .takes::<BeginLog>()
        .gives::<Log>()
}

/// Those that take as long as the link or the log does: no time limit; a sender may be silent for
/// half a minute, and the size is counted as it comes.
pub(super) fn long_routes() -> Routes {
    Routes::new()
        .get("/logs/{id}", Right::Read, show)
        .about("An upload; HEAD tells where to go on, in Upload-Offset")
        .gives::<Log>()
        .patch("/logs/{id}", Needs::OwnLog, append)
        .about("Appends bytes at the header Upload-Offset")
        .takes_bytes("application/octet-stream")
        .delete("/logs/{id}", Needs::OwnLog, give_up)
        .about("Gives an upload up")
        .post("/logs/{id}/finish", Needs::OwnLog, finish)
        .about("Ends an upload: the log is read whole, and stored")
        .takes::<FinishLog>()
        .gives::<Log>()
        .post("/logs/{id}/preview", Needs::OwnLog, preview_upload)
        .about("What an uploaded log is worth, before it is finished")
        .takes::<serde_json::Value>()
        .gives::<serde_json::Value>()
        .post("/logs/preview", Right::Walk, preview)
        .about("What a log, or the beginning of one, is worth; nothing is kept")
        .query::<PreviewQuery>()
        .takes_bytes("application/octet-stream")
        .gives::<serde_json::Value>()
}

async fn begin(
    State(app): State<App>,
    Path(session_id): Path<Uuid>,
    Json(asked): Json<BeginLog>,
) -> Result<Response> {
    let (status, log) = match uploads::begin(&app, session_id, asked).await? {
        Begun::New(log) => (StatusCode::CREATED, log),
        Begun::Known(log) => (StatusCode::OK, log),
    };
    let location = format!("/api/v1/logs/{}", log.id);
    Ok((status, [(header::LOCATION, location)], at_offset(&log), axum::Json(log)).into_response())
}

async fn show(State(app): State<App>, Path(log_id): Path<Uuid>) -> Result<Response> {
    let log = uploads::get(&app, log_id).await?;
    Ok((at_offset(&log), axum::Json(log)).into_response())
}

async fn append(
    State(app): State<App>,
    caller: Caller,
    Path(log_id): Path<Uuid>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response> {
    let offset_bytes = asked_offset(&headers)?;
    // Who is revoked meanwhile is cut off; what had arrived by then is kept.
    let (unknown, cut) = {
        let (app, caller) = (app.clone(), caller.clone());
        let (tell, cut) = tokio::sync::oneshot::channel::<()>();
        let unknown = async move {
            auth::until_unknown(&app, &caller).await;
            let _ = tell.send(());
        };
        (unknown, cut)
    };
    let body = Body::from_stream(body.into_data_stream().take_until(Box::pin(unknown)));
    let appending = {
        let app = app.clone();
        // A task of its own: when the link is cut this request is dropped, and what arrived is to be
        // brought to disk all the same.
        tokio::spawn(async move { uploads::append(&app, log_id, offset_bytes, body).await })
    };
    let appended = ended(appending.await)?;
    let was_cut = cut.await.is_ok();
    match appended {
        Ok(_) if was_cut => Err(auth::not_signed_in()),
        Ok(end_bytes) => {
            Ok((StatusCode::NO_CONTENT, [(UPLOAD_OFFSET, HeaderValue::from(end_bytes))]).into_response())
        }
        Err(error) => {
            // Whatever went wrong, the sender is told where to go on.
            let log = uploads::get(&app, log_id).await.ok().filter(|log| log.state == LogState::Receiving);
            Ok((log.as_ref().map(at_offset), error).into_response())
        }
    }
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FinishLog {
    /// SHA-256 of the bytes as sent, hex; may be left out when it was announced.
    sha256: Option<String>,
    /// What the log does not say itself; as said when it was begun, when it is left out.
    #[schemars(with = "Option<serde_json::Value>")]
    reading: Option<Reading>,
}

async fn finish(
    State(app): State<App>,
    Path(log_id): Path<Uuid>,
    Json(FinishLog { sha256, reading }): Json<FinishLog>,
) -> Result<Response> {
    let finishing = {
        let app = app.clone();
        // A task of its own: a sender who does not wait for the answer finds it with GET.
        tokio::spawn(async move { accept_log::finish(&app, log_id, sha256, reading).await })
    };
    match ended(finishing.await)? {
        Ok(log) => Ok((at_offset(&log), axum::Json(log)).into_response()),
        Err(error) => {
            let log = uploads::get(&app, log_id).await.ok().filter(|log| log.state == LogState::Receiving);
            Ok((log.as_ref().map(at_offset), error).into_response())
        }
    }
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PreviewUpload {
    /// What the log does not say itself.
    #[schemars(with = "Option<serde_json::Value>")]
    reading: Option<Reading>,
}

/// A dry run of an upload: reads what has arrived and keeps nothing of it.
async fn preview_upload(
    State(app): State<App>,
    Path(log_id): Path<Uuid>,
    Json(PreviewUpload { reading }): Json<PreviewUpload>,
) -> Result<axum::Json<Preview>> {
    Ok(axum::Json(accept_log::preview_upload(&app, log_id, reading).await?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PreviewQuery {
    /// What the log does not say itself, as JSON.
    reading: Option<String>,
    /// The system that has the log's stream; the one of walks, when it is left out.
    system: Option<String>,
    /// The name of the log's stream; the system's first, when it is left out.
    stream: Option<String>,
    /// Whether the body is only the beginning of a log.
    #[serde(default)]
    part: bool,
}

/// Looks at a log, or its beginning, in the body; nothing is kept.
async fn preview(
    State(app): State<App>,
    Query(query): Query<PreviewQuery>,
    body: Body,
) -> Result<axum::Json<Preview>> {
    let rule = rule_named(query.system.as_deref(), query.stream.as_deref())?;
    let reading = match query.reading.as_deref() {
        None => Reading::default(),
        Some(text) => serde_json::from_str(text).map_err(|error| {
            Error::invalid(
                "wrong_field",
                format!(
                    "expected reading as JSON such as {{\"rate_hz\":100}}, found something else ({error})"
                ),
            )
        })?,
    };
    let bytes = axum::body::to_bytes(body, MOST_PREVIEW_BYTES).await.map_err(|_| {
        Error::http(
            StatusCode::PAYLOAD_TOO_LARGE,
            "preview_too_large",
            format!("expected at most {MOST_PREVIEW_BYTES} bytes to look at, found more: send the beginning of the log with ?part=true, or look at the whole of it with POST /logs/{{id}}/preview once it is uploaded"),
        )
    })?;
    Ok(axum::Json(accept_log::preview_bytes(&app, bytes, rule, reading, query.part).await?))
}

/// The rule of a system's stream, by their names.
fn rule_named(system: Option<&str>, stream: Option<&str>) -> Result<&'static StreamRule> {
    let system = system_named(system)?;
    let Some(name) = stream else { return Ok(&system.streams[0]) };
    let found = StreamId::read(name).and_then(|id| system.stream(id));
    found.and_then(|stream| system.rule_of(&stream)).ok_or_else(|| {
        let names: Vec<&str> = system.streams.iter().map(|rule| rule.name).collect();
        Error::invalid(
            "unknown_stream",
            format!(
                "expected a stream of the {} system ({}), found {name:?}: name one of these",
                system.name,
                names.join(", ")
            ),
        )
    })
}

async fn give_up(State(app): State<App>, Path(log_id): Path<Uuid>) -> Result<StatusCode> {
    uploads::give_up(&app, log_id).await?;
    Ok(StatusCode::NO_CONTENT)
}

fn at_offset(log: &Log) -> [(HeaderName, HeaderValue); 1] {
    [(UPLOAD_OFFSET, HeaderValue::from(log.offset_bytes))]
}

/// What a task answered; one that panicked is a failure of ours.
fn ended<T>(task: std::result::Result<T, tokio::task::JoinError>) -> Result<T> {
    task.map_err(|error| Error::Internal(anyhow::Error::new(error)))
}

fn asked_offset(headers: &HeaderMap) -> Result<u64> {
    let asked = headers.get(&UPLOAD_OFFSET).and_then(|value| value.to_str().ok()?.parse().ok());
    asked.ok_or_else(|| {
        Error::http(
            StatusCode::BAD_REQUEST,
            "upload_offset_missing",
            format!(
                "expected the header Upload-Offset with a number of bytes, found {:?}: ask with HEAD where to go on",
                headers.get(&UPLOAD_OFFSET)
            ),
        )
    })
}
