//! The end of an upload: the log is read whole and its samples are stored at once, or nothing is.

use std::io;

use axum::http::StatusCode;
use bytes::Bytes;
use futures_util::FutureExt;
use lodestep_engine::parse::ReadOptions;
use lodestep_engine::system::StreamRule;
use uuid::Uuid;

use super::preview_log::{self, Preview};
use super::read_log::{self, ReadLog, ReadLogError};
use super::unpack::{Packing, UnpackError, UnpackLimits};
use super::uploads::{self, disk_error, parse_sha256};
use super::{upload_copy, upload_file};
use crate::background::in_background;
use crate::error::{Error, Place, Result};
use crate::state::App;
use crate::store::logs::{self, Codec, Log, LogState};
use crate::store::{anomalies, raw_chunks, session_search, sessions};
use crate::utc;

/// Finishes an upload whose bytes have this SHA-256, to be read as this says (or as was said when it
/// began). Finishing again is answered in the same way.
pub(crate) async fn finish(
    app: &App,
    log_id: Uuid,
    sha256: Option<String>,
    reading: Option<ReadOptions>,
) -> Result<Log> {
    let _turn = app.upload_turns.take(log_id).await;
    let log = uploads::get(app, log_id).await?;
    let sha256 = sha256.as_deref().map(parse_sha256).transpose()?;
    match log.state {
        LogState::Receiving => {}
        LogState::Accepted | LogState::Unchanged => return finished_before(log, sha256.as_deref()),
        LogState::Failed => {
            return Err(Error::conflict(
                "upload_failed",
                format!(
                    "this upload ended because of its content ({}): correct the log and begin a new upload",
                    log.error.unwrap_or_default()
                ),
            ));
        }
    }
    let sha256 = sha256.or_else(|| log.sha256.clone()).ok_or_else(|| {
        Error::invalid("sha256_missing", "expected {\"sha256\":\"…\"} of the bytes as sent, found none: send what `sha256sum` prints for the file")
    })?;
    if let Some(size_bytes) = log.size_bytes
        && log.offset_bytes < size_bytes
    {
        return Err(Error::conflict(
            "upload_incomplete",
            format!(
                "expected {size_bytes} bytes, found {}: send the rest from there, then finish",
                log.offset_bytes
            ),
        ));
    }
    upload_copy::bring(app, &log).await?;
    check_hash(app, &log, &sha256).await?;
    let log = Log { reading: reading.unwrap_or_else(|| log.reading.clone()), ..log };
    if let Some(held) = logs::accepted_with(app.store.read(), log.session_id, log.stream.0, &sha256).await? {
        uploads::same_reading(&held, &log.reading)?;
        return settle(app, Log { state: LogState::Unchanged, sha256: Some(sha256), ..log }).await;
    }
    let rule = rule_of(app, &log).await?;
    match read(app, &log, rule).await {
        Ok(read) => accept(app, Log { sha256: Some(sha256), ..log }, read).await,
        Err(ReadLogError::Unpack(UnpackError::Io(error)) | ReadLogError::Spill(error)) => {
            Err(disk_error(error))
        }
        Err(ReadLogError::Store(error)) => Err(error.into()),
        Err(error) => {
            let failed = Log { state: LogState::Failed, error: Some(error.to_string()), ..log };
            settle(app, failed).await?;
            Err(problem(error))
        }
    }
}

/// The answer to finishing a log that was accepted: the first answer may have been lost.
fn finished_before(log: Log, sha256: Option<&str>) -> Result<Log> {
    match sha256 {
        Some(asked) if log.sha256.as_deref() != Some(asked) => Err(Error::conflict(
            "upload_finished",
            format!(
                "this upload was accepted with sha256 {}: begin a new upload for another log",
                log.sha256.unwrap_or_default()
            ),
        )),
        _ => Ok(log),
    }
}

/// Compares the hash of what is on disk. On a difference the upload stays: the sender may have
/// hashed the wrong file, and then only has to finish again.
async fn check_hash(app: &App, log: &Log, sha256: &str) -> Result<()> {
    if log.offset_bytes == 0 {
        // Nothing was ever sent; the reader says so in better words.
        return Ok(());
    }
    let path = upload_file::path(&app.config.uploads(), log.id);
    let found = blocking(move || read_log::sha256(&path)).await?.map_err(disk_error)?;
    if found == sha256 {
        return Ok(());
    }
    Err(Error::invalid(
        "wrong_hash",
        format!(
            "expected bytes with sha256 {sha256}, found {found} over the {} bytes that arrived. The upload is kept: finish again with the hash of the file that was sent, or give it up with DELETE /logs/{} and send the file anew",
            log.offset_bytes, log.id
        ),
    ))
}

/// What the system of a log's session declares for the log's stream.
async fn rule_of(app: &App, log: &Log) -> Result<&'static StreamRule> {
    let session = sessions::get(app.store.read(), log.session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("log", log.id))?;
    let system = session.declaration();
    let rule = system.stream(log.stream.0).and_then(|stream| system.rule_of(&stream));
    rule.ok_or_else(|| {
        Error::Internal(anyhow::anyhow!("the {} system has no stream {}", system.name, log.stream.0))
    })
}

async fn read(app: &App, log: &Log, rule: &'static StreamRule) -> Result<ReadLog, ReadLogError> {
    let folder = app.config.uploads();
    let path = upload_file::path(&folder, log.id);
    let spill_path = upload_file::spill_path(&folder, log.id);
    if log.offset_bytes == 0 {
        return Err(UnpackError::Empty.into());
    }
    let limits = limits(app);
    let (stream, reading) = (log.stream.0, log.reading.clone());
    // Reading is work for a core: a few at a time, the others wait here.
    let _permit = app.log_readers.acquire().await;
    match blocking(move || read_log::read_log(&path, &spill_path, (stream, rule), reading, limits)).await {
        Ok(read) => read,
        Err(error) => Err(ReadLogError::Spill(io::Error::other(error.to_string()))),
    }
}

/// How far a log may unpack here.
fn limits(app: &App) -> UnpackLimits {
    UnpackLimits { max_unpacked_bytes: app.config.unpacked_bytes, max_ratio: app.config.unpacked_ratio }
}

/// What the bytes that have arrived would be read as; nothing changes.
pub(crate) async fn preview_upload(app: &App, log_id: Uuid, reading: Option<ReadOptions>) -> Result<Preview> {
    let _turn = app.upload_turns.take(log_id).await;
    let log = uploads::get(app, log_id).await?;
    if log.state != LogState::Receiving {
        return Err(Error::conflict(
            "upload_finished",
            "this upload is finished and its bytes are gone: look at a log before it is finished",
        ));
    }
    upload_copy::bring(app, &log).await?;
    let rule = rule_of(app, &log).await?;
    let path = upload_file::path(&app.config.uploads(), log_id);
    let part = log.size_bytes.is_none_or(|size_bytes| log.offset_bytes < size_bytes);
    let reading = reading.unwrap_or(log.reading);
    let empty = log.offset_bytes == 0;
    look(
        app,
        move || if empty { Ok(Box::new(io::empty())) } else { Ok(Box::new(std::fs::File::open(path)?)) },
        rule,
        reading,
        part,
    )
    .await
}

/// What these bytes, the whole of a log or its beginning, would be read as; nothing is kept.
pub(crate) async fn preview_bytes(
    app: &App,
    bytes: Bytes,
    rule: &'static StreamRule,
    reading: ReadOptions,
    part: bool,
) -> Result<Preview> {
    look(app, move || Ok(Box::new(io::Cursor::new(bytes))), rule, reading, part).await
}

async fn look(
    app: &App,
    open: impl FnOnce() -> io::Result<Box<dyn io::Read>> + Send + 'static,
    rule: &'static StreamRule,
    reading: ReadOptions,
    part: bool,
) -> Result<Preview> {
    let limits = limits(app);
    let _permit = app.log_readers.acquire().await;
    let looked =
        blocking(move || preview_log::preview(open().map_err(UnpackError::Io)?, rule, limits, reading, part));
    looked.await?.map_err(|error| problem(error.into()))
}

/// Stores the samples in pieces, then the log's new state, with which they count; then lets go of the bytes. What an earlier try
/// left of the log goes first.
async fn accept(app: &App, log: Log, read: ReadLog) -> Result<Log> {
    let accepted = Log {
        state: LogState::Accepted,
        codec: Some(match read.packing {
            Packing::Plain => Codec::Plain,
            Packing::Gzip => Codec::Gzip,
            Packing::Zstd => Codec::Zstd,
        }),
        format: Some(read.format),
        samples: read.samples,
        t_first_ns: Some(read.t_first_ns),
        t_last_ns: Some(read.t_last_ns),
        finished_at: Some(utc::now()),
        ..log.clone()
    };
    clear_chunks(app, log.id).await?;
    let stored = store_chunks(app, &log, read.chunks.into_chunks().map_err(disk_error)?).await;
    let row = accepted.clone();
    let found = read.anomalies;
    let stored = match stored {
        Err(error) => Err(error),
        Ok(()) => {
            app.store
                .writer()
                .run(move |db| {
                    async move {
                        logs::update(&mut *db, &row).await?;
                        anomalies::put_of_log(&mut *db, row.session_id, row.stream.0, &found).await?;
                        Ok::<_, Error>(session_search::count_stored(&mut *db, row.session_id).await?)
                    }
                    .boxed()
                })
                .await
        }
    };
    match stored {
        Ok(()) => {}
        // The same bytes came in by another upload at the same moment.
        Err(Error::Store(error)) if error.is_duplicate() => {
            clear_chunks(app, log.id).await?;
            return settle(app, Log { state: LogState::Unchanged, ..log }).await;
        }
        // Its session was deleted meanwhile.
        Err(Error::Store(error)) if error.is_dangling() => return Err(Error::not_found("log", log.id)),
        Err(error) => return Err(error),
    }
    upload_file::remove(&app.config.uploads(), accepted.id).await.map_err(disk_error)?;
    metrics::counter!("lodestep_uploaded_samples_total").increment(accepted.samples);
    Ok(accepted)
}

/// Chunks in a piece: some thousand samples each.
const CHUNKS: usize = 16;

async fn store_chunks(
    app: &App,
    log: &Log,
    chunks: impl Iterator<Item = io::Result<raw_chunks::Packed>>,
) -> Result<()> {
    let (session_id, log_id) = (log.session_id, log.id);
    let mut chunks = chunks.peekable();
    while chunks.peek().is_some() {
        let piece = chunks.by_ref().take(CHUNKS).collect::<io::Result<Vec<_>>>().map_err(disk_error)?;
        app.store
            .writer()
            .run(move |db| {
                async move {
                    for chunk in piece {
                        raw_chunks::insert(&mut *db, session_id, log_id, chunk).await?;
                    }
                    Ok::<_, Error>(())
                }
                .boxed()
            })
            .await?;
    }
    Ok(())
}

async fn clear_chunks(app: &App, log_id: Uuid) -> Result<()> {
    loop {
        if !app
            .store
            .writer()
            .run(move |db| {
                async move { raw_chunks::clear_some(db, log_id, 500).await.map_err(Error::from) }.boxed()
            })
            .await?
        {
            return Ok(());
        }
    }
}

/// Ends an upload of which nothing is kept but its row.
async fn settle(app: &App, log: Log) -> Result<Log> {
    let log = Log { finished_at: Some(utc::now()), ..log };
    let row = log.clone();
    app.store
        .writer()
        .run(move |db| async move { Ok::<_, Error>(logs::update(&mut *db, &row).await?) }.boxed())
        .await?;
    upload_file::remove(&app.config.uploads(), log.id).await.map_err(disk_error)?;
    Ok(log)
}

async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T> {
    in_background(work).await.map_err(|error| Error::Internal(anyhow::Error::new(error)))
}

/// What the sender is told about a log that is not right.
fn problem(error: ReadLogError) -> Error {
    let detail = format!("{error}. Nothing of this log was stored");
    match error {
        ReadLogError::Parse(error) => {
            let place = Place { line: error.line, column: error.column.clone(), ..Place::default() };
            Error::invalid_at(error.code(), detail, place)
        }
        ReadLogError::Unpack(error) => match error {
            UnpackError::Empty => Error::invalid("empty_file", detail),
            UnpackError::NotALog { .. } => Error::invalid("not_text", detail),
            UnpackError::Truncated { .. } => Error::invalid("truncated", detail),
            UnpackError::Damaged { .. } | UnpackError::Archive { .. } => Error::invalid("damaged", detail),
            UnpackError::NoSensorFiles(error) => Error::invalid(error.code(), detail),
            UnpackError::TooLarge { .. } | UnpackError::RatioTooHigh { .. } => {
                Error::http(StatusCode::PAYLOAD_TOO_LARGE, "unpacked_too_large", detail)
            }
            UnpackError::Io(error) => disk_error(error),
        },
        ReadLogError::Spill(error) => disk_error(error),
        ReadLogError::Store(error) => Error::Store(error),
    }
}
