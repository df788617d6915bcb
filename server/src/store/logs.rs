//! Logs on their way and logs that were handed in, one stream each.

use lodestep_engine::parse::ReadOptions;
use lodestep_engine::parse::log_format::LogFormat;
use lodestep_engine::stream::StreamId;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::stream_field::StreamField;
use crate::utc;

/// One stream's log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Log {
    /// Its id.
    pub id: Uuid,
    /// The walk it belongs to.
    pub session_id: Uuid,
    /// The stream it was recorded on.
    #[serde(flatten)]
    pub stream: StreamField,
    /// How far it has come.
    pub state: LogState,
    /// As the sender calls it; shown, never used as a path.
    #[schemars(example = &"left.csv")]
    pub file_name: Option<String>,
    /// Bytes received and on disk, as sent.
    pub offset_bytes: u64,
    /// Bytes announced.
    pub size_bytes: Option<u64>,
    /// Of the bytes as sent, lower-case hex; `None` until announced or finished.
    #[schemars(example = crate::examples::SHA256)]
    pub sha256: Option<String>,
    /// How the bytes were packed; `None` until they were read.
    pub codec: Option<Codec>,
    /// Its format; `None` until it was read.
    pub format: Option<LogFormat>,
    /// What was said of it that it does not say itself.
    #[serde(default, skip_serializing_if = "ReadOptions::is_empty")]
    pub reading: ReadOptions,
    /// Samples found in it.
    pub samples: u64,
    /// Time of the first sample, ns.
    pub t_first_ns: Option<i64>,
    /// Time of the last sample, ns.
    pub t_last_ns: Option<i64>,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = None::<&str>)]
    pub error: Option<String>,
    /// When it was begun.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When it was accepted or failed.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub finished_at: Option<OffsetDateTime>,
}

/// How far a log has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LogState {
    /// Bytes are on their way.
    Receiving,
    /// Read whole; its samples are on disk.
    Accepted,
    /// The session already held these very bytes.
    Unchanged,
    /// It could not be read; `error` says why, and nothing of it is kept.
    Failed,
}

/// How a log was packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "LogCodec")]
pub enum Codec {
    /// Not at all.
    Plain,
    /// gzip.
    Gzip,
    /// Zstandard.
    Zstd,
}

impl FromRow<'_, Row> for Log {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        let codec: Option<&str> = row.try_get("codec")?;
        let format: Option<&str> = row.try_get("format")?;
        Ok(Log {
            id: columns::id(row, "id")?,
            session_id: columns::id(row, "session_id")?,
            stream: StreamField(columns::stream(row, "stream")?),
            state: columns::word(row, "state")?,
            file_name: row.try_get("file_name")?,
            offset_bytes: columns::count(row, "offset_bytes")?,
            size_bytes: columns::optional_count(row, "size_bytes")?,
            sha256: row.try_get("sha256")?,
            codec: codec.map(|_| columns::word(row, "codec")).transpose()?,
            format: format.map(|_| columns::word(row, "format")).transpose()?,
            reading: columns::optional_json(row, "reading")?.unwrap_or_default(),
            samples: columns::count(row, "samples")?,
            t_first_ns: row.try_get("t_first_ns")?,
            t_last_ns: row.try_get("t_last_ns")?,
            error: row.try_get("error")?,
            created_at: columns::instant(row, "created_at")?,
            finished_at: columns::optional_instant(row, "finished_at")?,
        })
    }
}

/// Those of a session, oldest first.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<Log>, StoreError> {
    let query = sqlx::query_as("select * from logs where session_id = $1 order by created_at, id")
        .bind(session_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// How many are on their way of all walks of the inspector whose session this is.
pub async fn receiving_of_same_inspector(db: impl Executor<'_>, session_id: Uuid) -> Result<u64, StoreError> {
    let query = sqlx::query(
        "select count(*) as logs from logs join sessions on sessions.id = logs.session_id
         where logs.state = 'receiving'
         and sessions.carrier_id = (select carrier_id from sessions where id = $1)",
    )
    .bind(session_id.to_string());
    Ok(columns::count(&query.fetch_one(db).await?, "logs")?)
}

/// Those in this state, of all sessions, oldest first.
pub async fn in_state(db: impl Executor<'_>, state: LogState) -> Result<Vec<Log>, StoreError> {
    let query = sqlx::query_as("select * from logs where state = $1 order by created_at, id")
        .bind(columns::to_word(state));
    Ok(query.fetch_all(db).await?)
}

/// The one with this id, of a session that nobody has removed.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Log>, StoreError> {
    let query = sqlx::query_as(
        "select * from logs where id = $1
         and exists (select 1 from sessions where sessions.id = logs.session_id and removed_at is null)",
    )
    .bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// The accepted log of this session and stream with these bytes.
pub async fn accepted_with(
    db: impl Executor<'_>,
    session_id: Uuid,
    stream: StreamId,
    sha256: &str,
) -> Result<Option<Log>, StoreError> {
    let query = sqlx::query_as(
        "select * from logs where session_id = $1 and stream = $2 and sha256 = $3 and state = 'accepted'",
    )
    .bind(session_id.to_string())
    .bind(stream.name().to_owned())
    .bind(sha256);
    Ok(query.fetch_optional(db).await?)
}

/// The accepted logs with these bytes, of all walks that nobody has removed, oldest first.
pub async fn with_bytes(db: impl Executor<'_>, sha256: &str) -> Result<Vec<Log>, StoreError> {
    let query = sqlx::query_as(
        "select * from logs where sha256 = $1 and state = 'accepted'
         and exists (select 1 from sessions where sessions.id = logs.session_id and removed_at is null)
         order by created_at, id",
    )
    .bind(sha256);
    Ok(query.fetch_all(db).await?)
}

/// The log that stands for this stream: the one accepted last.
pub async fn latest_accepted(
    db: impl Executor<'_>,
    session_id: Uuid,
    stream: StreamId,
) -> Result<Option<Log>, StoreError> {
    let query = sqlx::query_as(
        "select * from logs where session_id = $1 and stream = $2 and state = 'accepted'
         order by finished_at desc, id desc limit 1",
    )
    .bind(session_id.to_string())
    .bind(stream.name().to_owned());
    Ok(query.fetch_optional(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, log: &Log) -> Result<(), StoreError> {
    write(
        db,
        log,
        "insert into logs (
            id, session_id, stream, state, file_name, offset_bytes, size_bytes, sha256, codec, samples,
            t_first_ns, t_last_ns, error, created_at, finished_at, format, reading
         ) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17)",
    )
    .await
}

/// Writes one as it now stands; whose it is, which stream and when it began stay.
pub async fn update(db: impl Executor<'_>, log: &Log) -> Result<(), StoreError> {
    write(
        db,
        log,
        "update logs set
            state = $4, file_name = $5, offset_bytes = $6, size_bytes = $7, sha256 = $8, codec = $9,
            samples = $10, t_first_ns = $11, t_last_ns = $12, error = $13, finished_at = $15,
            format = $16, reading = $17
         where id = $1 and session_id = $2 and stream = $3 and created_at = $14",
    )
    .await
}

async fn write(db: impl Executor<'_>, log: &Log, sql: &'static str) -> Result<(), StoreError> {
    let reading = if log.reading.is_empty() { None } else { Some(columns::to_json(&log.reading)?) };
    sqlx::query(sql)
        .bind(log.id.to_string())
        .bind(log.session_id.to_string())
        .bind(log.stream.0.name().to_owned())
        .bind(columns::to_word(log.state))
        .bind(&log.file_name)
        .bind(columns::to_column(log.offset_bytes))
        .bind(log.size_bytes.map(columns::to_column))
        .bind(&log.sha256)
        .bind(log.codec.map(columns::to_word))
        .bind(columns::to_column(log.samples))
        .bind(log.t_first_ns)
        .bind(log.t_last_ns)
        .bind(&log.error)
        .bind(utc::to_us(log.created_at))
        .bind(log.finished_at.map(utc::to_us))
        .bind(log.format.map(LogFormat::name))
        .bind(reading)
        .execute(db)
        .await?;
    Ok(())
}

/// Notes how many bytes have reached the disk.
pub async fn set_offset(db: impl Executor<'_>, id: Uuid, offset_bytes: u64) -> Result<(), StoreError> {
    sqlx::query("update logs set offset_bytes = $2 where id = $1")
        .bind(id.to_string())
        .bind(columns::to_column(offset_bytes))
        .execute(db)
        .await?;
    Ok(())
}

/// Removes one; `false` when there is none with this id.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<bool, StoreError> {
    let query = sqlx::query("delete from logs where id = $1").bind(id.to_string());
    Ok(query.execute(db).await?.rows_affected() > 0)
}
