//! Logs handed in: begun, appended to, asked about, finished, given up.

use axum::body::Body;
use axum::extract::State;
use axum::http::StatusCode;
use futures_util::StreamExt;
use lodestep_engine::parse::ReadOptions;
use lodestep_engine::stream::StreamId;
use lodestep_engine::system::StreamRule;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::sessions::system_named;
use crate::auth::{self, Caller};
use crate::error::{Error, Result};
use crate::http::media::Binary;
use crate::http::{
    Json, Location, MaybeNew, Needs, NoContent, Path, Query, Routes, StreamedBody, UploadOffset, With,
};
use crate::rights::Right;
use crate::sessions::accept_log;
use crate::sessions::preview_log::Preview;
use crate::sessions::uploads::{self, BeginLog};
use crate::state::App;
use crate::store::logs::{Log, LogState};

/// Bytes of a log that are looked at without an upload.
const MOST_PREVIEW_BYTES: usize = 16 << 20;

/// The quick ones.
pub(super) fn routes() -> Routes {
    Routes::new()
        .post("/sessions/{id}/logs", Needs::OwnSession, begin)
        .about("begin_log", "Begins the upload of a stream's log")
}

/// Those that take as long as the link or the log does: no time limit; a sender may be silent for
/// half a minute, and the size is counted as it comes.
pub(super) fn long_routes() -> Routes {
    Routes::new()
        .get("/logs/{id}", Right::Read, show)
        .about("get_log", "An upload; HEAD tells where to go on, in Upload-Offset")
        .patch("/logs/{id}", Needs::OwnLog, append)
        .about("append_to_log", "Appends bytes at the header Upload-Offset")
        .delete("/logs/{id}", Needs::OwnLog, give_up)
        .about("abandon_log", "Gives an upload up")
        .post("/logs/{id}/finish", Needs::OwnLog, finish)
        .about("finish_log", "Ends an upload: the log is read whole, and stored")
        .post("/logs/{id}/preview", Needs::OwnLog, preview_upload)
        .about("preview_uploaded_log", "What an uploaded log is worth, before it is finished")
        .post("/logs/preview", Right::Walk, preview)
        .about("preview_log", "What a log, or the beginning of one, is worth; nothing is kept")
}

async fn begin(
    State(app): State<App>,
    Path(session_id): Path<Uuid>,
    Json(asked): Json<BeginLog>,
) -> Result<With<Location, With<UploadOffset, MaybeNew<Json<Log>>>>> {
    let begun = uploads::begin(&app, session_id, asked).await?;
    let log = begun.get();
    let (location, offset) = (format!("/api/v1/logs/{}", log.id), UploadOffset(log.offset_bytes));
    Ok(With(Location(location), With(offset, begun.map(Json))))
}

/// An answer about an upload, or a refusal: with either, the sender is told where to go on.
type GoingOn<A> = std::result::Result<With<UploadOffset, A>, With<Option<UploadOffset>, Error>>;

async fn show(State(app): State<App>, Path(log_id): Path<Uuid>) -> Result<With<UploadOffset, Json<Log>>> {
    let log = uploads::get(&app, log_id).await?;
    Ok(With(UploadOffset(log.offset_bytes), Json(log)))
}

async fn append(
    State(app): State<App>,
    caller: Caller,
    Path(log_id): Path<Uuid>,
    UploadOffset(offset_bytes): UploadOffset,
    piece: StreamedBody<Binary>,
) -> GoingOn<NoContent> {
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
    let body = Body::from_stream(piece.body.into_data_stream().take_until(Box::pin(unknown)));
    let appending = {
        let app = app.clone();
        // A task of its own: when the link is cut this request is dropped, and what arrived is to be
        // brought to disk all the same.
        tokio::spawn(async move { uploads::append(&app, log_id, offset_bytes, body).await })
    };
    let appended = ended(appending.await);
    let was_cut = cut.await.is_ok();
    match appended {
        Ok(_) if was_cut => Err(With(None, auth::not_signed_in())),
        Ok(end_bytes) => Ok(With(UploadOffset(end_bytes), NoContent)),
        Err(error) => Err(refused(&app, log_id, error).await),
    }
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FinishLog {
    /// SHA-256 of the bytes as sent, hex; may be left out when it was announced.
    #[schemars(example = crate::examples::SHA256)]
    sha256: Option<String>,
    /// What the log does not say itself; as said when it was begun, when it is left out.
    reading: Option<ReadOptions>,
}

async fn finish(
    State(app): State<App>,
    Path(log_id): Path<Uuid>,
    Json(FinishLog { sha256, reading }): Json<FinishLog>,
) -> GoingOn<Json<Log>> {
    let finishing = {
        let app = app.clone();
        // A task of its own: a sender who does not wait for the answer finds it with GET.
        tokio::spawn(async move { accept_log::finish(&app, log_id, sha256, reading).await })
    };
    match ended(finishing.await) {
        Ok(log) => Ok(With(UploadOffset(log.offset_bytes), Json(log))),
        Err(error) => Err(refused(&app, log_id, error).await),
    }
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PreviewOptions {
    /// What the log does not say itself.
    reading: Option<ReadOptions>,
}

/// A dry run of an upload: reads what has arrived and keeps nothing of it.
async fn preview_upload(
    State(app): State<App>,
    Path(log_id): Path<Uuid>,
    Json(PreviewOptions { reading }): Json<PreviewOptions>,
) -> Result<Json<Preview>> {
    Ok(Json(accept_log::preview_upload(&app, log_id, reading).await?))
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
    log: StreamedBody<Binary>,
) -> Result<Json<Preview>> {
    let rule = rule_named(query.system.as_deref(), query.stream.as_deref())?;
    let reading = match query.reading.as_deref() {
        None => ReadOptions::default(),
        Some(text) => serde_json::from_str(text).map_err(|error| {
            Error::invalid(
                "wrong_field",
                format!(
                    "expected reading as JSON such as {{\"rate_hz\":100}}, found something else ({error})"
                ),
            )
        })?,
    };
    let bytes = axum::body::to_bytes(log.body, MOST_PREVIEW_BYTES).await.map_err(|_| {
        Error::http(
            StatusCode::PAYLOAD_TOO_LARGE,
            "preview_too_large",
            format!("expected at most {MOST_PREVIEW_BYTES} bytes to look at, found more: send the beginning of the log with ?part=true, or look at the whole of it with POST /logs/{{id}}/preview once it is uploaded"),
        )
    })?;
    Ok(Json(accept_log::preview_bytes(&app, bytes, rule, reading, query.part).await?))
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

async fn give_up(State(app): State<App>, Path(log_id): Path<Uuid>) -> Result<NoContent> {
    uploads::give_up(&app, log_id).await?;
    Ok(NoContent)
}

/// Whatever went wrong, the sender is told where to go on.
async fn refused(app: &App, log_id: Uuid, error: Error) -> With<Option<UploadOffset>, Error> {
    let log = uploads::get(app, log_id).await.ok().filter(|log| log.state == LogState::Receiving);
    With(log.map(|log| UploadOffset(log.offset_bytes)), error)
}

/// What a task answered; one that panicked is a failure of ours.
fn ended<T>(task: std::result::Result<Result<T>, tokio::task::JoinError>) -> Result<T> {
    task.unwrap_or_else(|error| Err(Error::Internal(anyhow::Error::new(error))))
}
