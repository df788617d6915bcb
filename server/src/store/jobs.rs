//! Work on stored sessions that takes a while: their own tracks, and lab runs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// One run over a stored session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Job {
    /// Its id.
    pub id: Uuid,
    /// The walk it computes.
    pub session_id: Uuid,
    /// The lab run that it computes; `None`: the session's own track.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lab_run_id: Option<Uuid>,
    /// How far it has come.
    pub state: JobState,
    /// What it is doing, in a word.
    #[schemars(example = &"filter")]
    pub stage: String,
    /// From 0 to 1.
    pub progress: f64,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = None::<&str>)]
    pub error: Option<String>,
    /// How often it was begun and neither ended nor was asked to stop: the server died under it.
    #[serde(default)]
    pub tries: u32,
    /// When it was asked for.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When it began.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub started_at: Option<OffsetDateTime>,
    /// When it ended.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub finished_at: Option<OffsetDateTime>,
}

/// How far a job has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// It waits for its turn.
    Queued,
    /// It computes.
    Running,
    /// The track stands.
    Finished,
    /// It could not; `error` says why.
    Failed,
    /// Somebody gave it up.
    Cancelled,
}

impl Job {
    /// One that waits for its turn.
    pub fn new(session_id: Uuid, lab_run_id: Option<Uuid>) -> Job {
        Job {
            id: Uuid::now_v7(),
            session_id,
            lab_run_id,
            state: JobState::Queued,
            stage: "waiting".to_owned(),
            progress: 0.0,
            error: None,
            tries: 0,
            created_at: utc::now(),
            started_at: None,
            finished_at: None,
        }
    }
}

impl FromRow<'_, Row> for Job {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Job {
            id: columns::id(row, "id")?,
            session_id: columns::id(row, "session_id")?,
            lab_run_id: columns::optional_id(row, "lab_run_id")?,
            state: columns::word(row, "state")?,
            stage: row.try_get("stage")?,
            progress: row.try_get("progress")?,
            error: row.try_get("error")?,
            tries: columns::small(row, "tries")?,
            created_at: columns::instant(row, "created_at")?,
            started_at: columns::optional_instant(row, "started_at")?,
            finished_at: columns::optional_instant(row, "finished_at")?,
        })
    }
}

/// The newest ones, at most this many, newest first.
pub async fn list(db: impl Executor<'_>, at_most: u32) -> Result<Vec<Job>, StoreError> {
    let query = sqlx::query_as("select * from jobs order by created_at desc, id desc limit $1")
        .bind(i64::from(at_most));
    Ok(query.fetch_all(db).await?)
}

/// Those that have not ended, in the order in which they are done: tracks that people wait for before lab runs, then
/// the oldest first. What a started server goes on with.
pub async fn unfinished(db: impl Executor<'_>) -> Result<Vec<Job>, StoreError> {
    let query = sqlx::query_as(
        "select * from jobs where state in ('queued', 'running') order by lab_run_id is not null, created_at, id",
    );
    Ok(query.fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Job>, StoreError> {
    Ok(sqlx::query_as("select * from jobs where id = $1").bind(id.to_string()).fetch_optional(db).await?)
}

/// The one that computes this session's own track and has not ended.
pub async fn unfinished_of_session(
    db: impl Executor<'_>,
    session_id: Uuid,
) -> Result<Option<Job>, StoreError> {
    let query = sqlx::query_as(
        "select * from jobs where session_id = $1 and lab_run_id is null and state in ('queued', 'running')
         order by created_at desc limit 1",
    )
    .bind(session_id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, job: &Job) -> Result<(), StoreError> {
    write(
        db,
        job,
        "insert into jobs (id, session_id, state, stage, progress, error, created_at, started_at, finished_at, lab_run_id,
            tries)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11)",
    )
    .await
    .map(|_| ())
}

/// Writes one as it now stands; `false` where it has ended already, as one that was given up has.
pub async fn update(db: impl Executor<'_>, job: &Job) -> Result<bool, StoreError> {
    write(
        db,
        job,
        "update jobs set state = $3, stage = $4, progress = $5, error = $6, started_at = $8, finished_at = $9, tries = $11
         where id = $1 and session_id = $2 and created_at = $7 and lab_run_id is not distinct from $10
            and state in ('queued', 'running')",
    )
    .await
}

async fn write(db: impl Executor<'_>, job: &Job, sql: &'static str) -> Result<bool, StoreError> {
    let query = sqlx::query(sql)
        .bind(job.id.to_string())
        .bind(job.session_id.to_string())
        .bind(columns::to_word(job.state))
        .bind(&job.stage)
        .bind(job.progress)
        .bind(&job.error)
        .bind(utc::to_us(job.created_at))
        .bind(job.started_at.map(utc::to_us))
        .bind(job.finished_at.map(utc::to_us))
        .bind(job.lab_run_id.map(|id| id.to_string()))
        .bind(i64::from(job.tries));
    Ok(query.execute(db).await?.rows_affected() > 0)
}
