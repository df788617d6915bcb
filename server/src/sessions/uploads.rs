//! A log on its way: begun, appended to until it is whole, finished or given up.
//!
//! What is promised to the sender: every byte before `offset_bytes` is on disk. Nothing else of an
//! upload outlives a killed server, and nothing of it counts before [`accept_log`](super::accept_log).

use std::io;
use std::time::Duration;

use axum::body::{Body, BodyDataStream};
use axum::http::StatusCode;
use bytes::Bytes;
use futures_util::{FutureExt, StreamExt};
use lodestep_engine::parse::ReadOptions;
use lodestep_engine::stream::StreamId;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::upload_copy;
use super::upload_file::{self, UploadFile};
use super::upload_turns::Turn;
use crate::error::{Error, Result};
use crate::http::MaybeNew;
use crate::state::App;
use crate::store::health::Health;
use crate::store::logs::{self, Log, LogState};
use crate::store::sessions::{self, SessionState};
use crate::store::{StoreError, upload_pieces};
use crate::stream_field::StreamField;
use crate::utc;
use crate::wire::Change;

/// How often a running request brings what it received to disk: what a killed server loses at most.
const SYNC_BYTES: u64 = 8 << 20;

/// How long a sender may be silent within a request before it is taken to be gone.
const SILENT_FOR: Duration = Duration::from_secs(30);

/// Uploads that one session may have on the way at once.
const MOST_UNFINISHED: usize = 16;

/// Uploads that one inspector may have on the way at once, over all sessions: nobody fills the disk with what
/// is never finished.
const MOST_UNFINISHED_OF_ONE: u64 = 64;

/// How an upload begins.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "NewLog")]
pub(crate) struct BeginLog {
    /// The stream that the log was recorded on.
    #[schemars(with = "String", example = &"left")]
    pub(crate) stream: StreamId,
    /// The file's name, to be shown.
    #[schemars(example = &"left.csv")]
    pub(crate) file_name: Option<String>,
    /// How many bytes will be sent.
    pub(crate) size_bytes: Option<u64>,
    /// SHA-256 of these bytes, hex.
    #[schemars(example = crate::examples::SHA256)]
    pub(crate) sha256: Option<String>,
    /// What the log does not say itself.
    #[serde(default)]
    pub(crate) reading: ReadOptions,
}

/// Begins an upload, or finds the one of these very bytes that was begun before, to go on from there.
pub(crate) async fn begin(app: &App, session_id: Uuid, asked: BeginLog) -> Result<MaybeNew<Log>> {
    let session = sessions::get(app.store.read(), session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    if !session.streams.contains(&asked.stream) {
        let streams: Vec<_> = session.streams.iter().map(|stream| stream.name()).collect();
        return Err(Error::invalid(
            "foot_not_worn",
            format!(
                "expected a log of one of the streams of this session ({}), found {}: choose one of these, or make a session that has it",
                streams.join(", "),
                asked.stream.name()
            ),
        ));
    }
    if let Some(size_bytes) = asked.size_bytes {
        check_size(app, size_bytes)?;
    }
    let sha256 = asked.sha256.as_deref().map(parse_sha256).transpose()?;
    let begun = logs::of_session(app.store.read(), session_id).await?;
    if let Some(sha256) = &sha256
        && let Some(log) = known(&begun, asked.stream, sha256)
    {
        if log.state == LogState::Unchanged {
            same_reading(&log, &asked.reading)?;
        }
        return Ok(MaybeNew::Known(log));
    }
    if begun.iter().filter(|log| log.state == LogState::Receiving).count() >= MOST_UNFINISHED {
        return Err(Error::conflict(
            "too_many_uploads",
            format!(
                "this session has {MOST_UNFINISHED} uploads on the way already: finish one, or give one up with DELETE /logs/{{id}}"
            ),
        ));
    }
    if logs::receiving_of_same_inspector(app.store.read(), session_id).await? >= MOST_UNFINISHED_OF_ONE {
        return Err(Error::conflict(
            "too_many_uploads_of_one",
            format!(
                "this inspector's sessions have {MOST_UNFINISHED_OF_ONE} uploads on the way already: finish one, or give one up with DELETE /logs/{{id}}"
            ),
        ));
    }
    let log = Log {
        id: Uuid::now_v7(),
        session_id,
        stream: StreamField(asked.stream),
        state: LogState::Receiving,
        file_name: asked.file_name.map(|name| name.chars().filter(|c| !c.is_control()).take(200).collect()),
        offset_bytes: 0,
        size_bytes: asked.size_bytes,
        sha256,
        codec: None,
        format: None,
        reading: asked.reading,
        samples: 0,
        t_first_ns: None,
        t_last_ns: None,
        error: None,
        created_at: utc::now(),
        finished_at: None,
    };
    let row = log.clone();
    let first = session.state == SessionState::Created;
    app.store
        .writer()
        .run(move |db| {
            async move {
                logs::insert(&mut *db, &row).await?;
                if first {
                    sessions::set_state(&mut *db, row.session_id, SessionState::Receiving, None).await?;
                }
                Ok::<_, Error>(())
            }
            .boxed()
        })
        .await?;
    if first {
        publish_session(app, session_id).await?;
    }
    Ok(MaybeNew::New(log))
}

/// The log with these bytes that this stream has, accepted or on its way.
fn known(begun: &[Log], stream: StreamId, sha256: &str) -> Option<Log> {
    let same = |log: &&Log| log.stream.0 == stream && log.sha256.as_deref() == Some(sha256);
    let accepted = begun.iter().filter(same).find(|log| log.state == LogState::Accepted);
    if let Some(log) = accepted {
        return Some(Log { state: LogState::Unchanged, ..log.clone() });
    }
    begun.iter().filter(same).rfind(|log| log.state == LogState::Receiving).cloned()
}

/// Refuses bytes that this session holds already, read in another way: they would be other samples.
pub(crate) fn same_reading(held: &Log, asked: &ReadOptions) -> Result<()> {
    // The clock's zero follows from the other stream's log, which may have come later.
    let said = |reading: &ReadOptions| ReadOptions { clock_zero_ns: None, ..reading.clone() };
    if said(&held.reading) == said(asked) {
        return Ok(());
    }
    Err(Error::conflict(
        "other_reading",
        "this session holds these very bytes, read with another mapping, rate or field: make a new session to read them anew",
    ))
}

/// Appends a request's body at `offset_bytes`, and tells how far the upload is on disk then. A sender
/// who vanishes leaves what arrived.
pub(crate) async fn append(app: &App, log_id: Uuid, offset_bytes: u64, body: Body) -> Result<u64> {
    let turn = app.upload_turns.take(log_id).await;
    let log = receiving(app, log_id).await?;
    if log.offset_bytes != offset_bytes {
        return Err(wrong_offset(offset_bytes, log.offset_bytes));
    }
    if app.store.health() == Health::DiskFailed {
        // Whether the last promise reached the disk will be known at the next start. Until then nothing is cut off:
        // it may hold more than this server believes.
        return Err(StoreError::DiskFailed("nothing is taken until the next start".to_owned()).into());
    }
    let folder = app.config.uploads();
    upload_copy::bring(app, &log).await?;
    let mut file = UploadFile::open_at(&folder, log_id, offset_bytes).await.map_err(disk_error)?;
    let mut promised_bytes = offset_bytes;
    let received = receive(app, &log, &mut file, body.into_data_stream(), &turn, &mut promised_bytes).await;
    let promised = match received {
        Err(error) if file.has_failed() => Err(error),
        // What a sender who went away has left is kept.
        received => promise(app, log_id, &mut file, &mut promised_bytes).await.and(received),
    };
    if file.has_failed() {
        file.cut_back(promised_bytes).await;
    }
    promised.map(|()| promised_bytes)
}

/// Writes what comes, until the body ends, the sender is gone or a newer request wants the turn.
async fn receive(
    app: &App,
    log: &Log,
    file: &mut UploadFile,
    mut body: BodyDataStream,
    turn: &Turn,
    promised_bytes: &mut u64,
) -> Result<()> {
    loop {
        let next: Option<Result<Bytes, axum::Error>> = tokio::select! {
            biased;
            () = turn.displaced() => {
                return Err(Error::conflict(
                    "upload_taken_over",
                    "a newer request goes on with this upload: ask for the offset and send the rest there",
                ));
            }
            () = app.stopping.cancelled() => {
                return Err(Error::http(
                    StatusCode::SERVICE_UNAVAILABLE,
                    "stopping",
                    "the server is stopping and has kept what arrived: ask for the offset when it is back and go on from there",
                ));
            }
            next = tokio::time::timeout(SILENT_FOR, body.next()) => next.unwrap_or_else(|_| {
                Some(Err(axum::Error::new(io::Error::from(io::ErrorKind::TimedOut))))
            }),
        };
        let bytes = match next {
            None => return Ok(()),
            Some(Ok(bytes)) => bytes,
            Some(Err(error)) => {
                return Err(Error::http(
                    StatusCode::REQUEST_TIMEOUT,
                    "upload_cut",
                    format!(
                        "the body ended early ({error}); what arrived is kept: ask for the offset and go on from there"
                    ),
                ));
            }
        };
        let end_bytes = file.end_bytes() + bytes.len() as u64;
        if let Some(size_bytes) = log.size_bytes
            && end_bytes > size_bytes
        {
            return Err(Error::invalid(
                "longer_than_announced",
                format!(
                    "expected at most the {size_bytes} bytes that were announced, found more: begin a new upload with the right size_bytes"
                ),
            ));
        }
        check_size(app, end_bytes)?;
        file.append(&bytes).await.map_err(disk_error)?;
        if end_bytes - *promised_bytes >= SYNC_BYTES {
            promise(app, log.id, file, promised_bytes).await?;
        }
    }
}

/// Brings what was received to disk and notes how far that is.
async fn promise(app: &App, log_id: Uuid, file: &mut UploadFile, promised_bytes: &mut u64) -> Result<()> {
    let end_bytes = file.sync().await.map_err(disk_error)?;
    let from_bytes = *promised_bytes;
    let piece = upload_copy::piece(app, log_id, (from_bytes, end_bytes)).await?;
    app.store
        .writer()
        .run(move |db| {
            async move {
                if let Some(piece) = piece {
                    upload_pieces::insert(&mut *db, log_id, from_bytes, piece).await?;
                }
                Ok::<_, Error>(logs::set_offset(&mut *db, log_id, end_bytes).await?)
            }
            .boxed()
        })
        .await?;
    *promised_bytes = end_bytes;
    Ok(())
}

/// Gives an upload up: its row and its bytes go.
pub(crate) async fn give_up(app: &App, log_id: Uuid) -> Result<()> {
    let _turn = app.upload_turns.take(log_id).await;
    let log = get(app, log_id).await?;
    if matches!(log.state, LogState::Accepted | LogState::Unchanged) {
        return Err(Error::conflict(
            "log_accepted",
            "this log was accepted, and raw samples are kept as long as their session: delete the session to remove it",
        ));
    }
    app.store
        .writer()
        .run(move |db| async move { Ok::<_, Error>(logs::delete(&mut *db, log_id).await?) }.boxed())
        .await?;
    upload_file::remove(&app.config.uploads(), log_id).await.map_err(disk_error)
}

/// Lets go of the bytes of logs whose rows went with their session.
pub(crate) async fn forget(app: &App, logs: &[Log]) -> Result<()> {
    for log in logs.iter().filter(|log| log.state == LogState::Receiving) {
        let _turn = app.upload_turns.take(log.id).await;
        upload_file::remove(&app.config.uploads(), log.id).await.map_err(disk_error)?;
    }
    Ok(())
}

/// The log with this id.
pub(crate) async fn get(app: &App, log_id: Uuid) -> Result<Log> {
    logs::get(app.store.read(), log_id).await?.ok_or_else(|| Error::not_found("log", log_id))
}

/// The log with this id, which must still be on its way.
async fn receiving(app: &App, log_id: Uuid) -> Result<Log> {
    let log = get(app, log_id).await?;
    match log.state {
        LogState::Receiving => Ok(log),
        LogState::Accepted | LogState::Unchanged => Err(Error::conflict(
            "upload_finished",
            "this upload is finished and its log was accepted: there is nothing more to send",
        )),
        LogState::Failed => Err(Error::conflict(
            "upload_failed",
            format!(
                "this upload ended because of its content ({}): correct the log and begin a new upload",
                log.error.unwrap_or_default()
            ),
        )),
    }
}

/// Tells the dashboards what a session has become.
pub(crate) async fn publish_session(app: &App, session_id: Uuid) -> Result<()> {
    if let Some(session) = sessions::get(app.store.read(), session_id).await? {
        app.hub.publish(Change::Session { session: Some(session), deleted: None });
    }
    Ok(())
}

/// A SHA-256 as 64 hex digits, made lower-case.
pub(crate) fn parse_sha256(text: &str) -> Result<String> {
    if text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Ok(text.to_ascii_lowercase());
    }
    Err(Error::invalid(
        "not_a_sha256",
        format!(
            "expected sha256 as 64 hex digits, found {} characters: send what `sha256sum` prints for the file",
            text.chars().count()
        ),
    ))
}

fn check_size(app: &App, size_bytes: u64) -> Result<()> {
    let limit_bytes = app.config.upload_bytes;
    if size_bytes <= limit_bytes {
        return Ok(());
    }
    Err(Error::http(
        StatusCode::PAYLOAD_TOO_LARGE,
        "upload_too_large",
        format!(
            "expected a log of at most {limit_bytes} bytes as sent, found {size_bytes} or more: pack it with gzip or zstd, split the session, or raise --upload-bytes"
        ),
    ))
}

fn wrong_offset(asked_bytes: u64, offset_bytes: u64) -> Error {
    Error::conflict(
        "wrong_offset",
        format!(
            "expected Upload-Offset {offset_bytes}, which is how much is on disk, found {asked_bytes}: go on from {offset_bytes}"
        ),
    )
}

/// A failure of the disk, told apart where the sender can do something about it.
pub(crate) fn disk_error(error: io::Error) -> Error {
    if matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded) {
        return StoreError::DiskFull.into();
    }
    Error::Internal(anyhow::Error::new(error).context("the folder of uploads"))
}
