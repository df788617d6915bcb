//! Walks worked out once more with chosen parameters or aids: what was asked for, what it came to, where it comes from.

use std::collections::BTreeMap;

use lodestep_engine::event::AidKind;
use lodestep_engine::session::Solution;
use lodestep_engine::systems::catalogue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::jobs::JobState;
use super::site_parameters::SetVersion;
use super::{StoreError, columns};
use crate::stream_field::StreamField;
use crate::utc;

/// One lab run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LabRun {
    /// Its id.
    pub id: Uuid,
    /// The walk.
    pub session_id: Uuid,
    /// As it is shown.
    #[schemars(example = &"less noise")]
    pub name: String,
    /// The set of parameters that it was asked for with, while that exists.
    pub parameter_set_id: Option<Uuid>,
    /// By key, what differs from the default.
    pub parameters: BTreeMap<String, f64>,
    /// The aids that it uses; `None`: all that the data allow.
    #[schemars(with = "Option<Vec<String>>", example = ["zupt", "heading"])]
    pub aids: Option<Vec<AidKind>>,
    /// What is told of it: each point as it was known at its time, or smoothed.
    #[schemars(with = "String", example = &"smoothed")]
    pub solution: Solution,
    /// When it was asked for.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// By whom; `None` where nobody had to sign in.
    #[schemars(example = &"li wei")]
    pub created_by: Option<String>,
    /// The job that computes it.
    pub job_id: Uuid,
    /// How far that has come.
    pub state: JobState,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = None::<&str>)]
    pub error: Option<String>,
    /// What it came to; `None` until it has been computed.
    pub figures: Option<Figures>,
    /// Where it comes from; `None` until it has been computed.
    pub provenance: Option<Provenance>,
}

/// What a run came to, in the figures by which runs are compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "RunFigures")]
pub struct Figures {
    /// Epochs that were told.
    pub epochs: u64,
    /// From the first to the last point, s.
    pub duration_s: f64,
    /// Length of the path of the middle of the streams, m.
    pub distance_m: f64,
    /// End against start in plan, m: an error where the walk was a closed one.
    pub closure_m: Option<f64>,
    /// The same in percent of the path.
    pub closure_percent: Option<f64>,
    /// End minus start in height, m.
    pub closure_up_m: Option<f64>,
    /// How far off the track was at the markers before it was corrected, in plan: mean, m.
    pub marker_mean_m: Option<f64>,
    /// Root of the mean square, m.
    pub marker_rms_m: Option<f64>,
    /// Largest, m.
    pub marker_max_m: Option<f64>,
    /// Not exceeded by 95 %, m.
    pub marker_p95_m: Option<f64>,
    /// Visits that were weighed.
    pub visits: u64,
    /// Visits that were used.
    pub visits_accepted: u64,
    /// How far the largest correction by a visit moved the track in plan, m.
    pub largest_correction_m: Option<f64>,
    /// For how much of the time the left stream stood.
    pub left_stance_share: Option<f64>,
    /// For how much of the time the right stream stood.
    pub right_stance_share: Option<f64>,
    /// Mean normalised innovation squared over its degrees of freedom, by aid: 1 where the filter is honest.
    pub nis_per_degree: BTreeMap<String, f64>,
    /// Sigma in plan at the end, m.
    pub end_sigma_plan_m: Option<f64>,
    /// What was found wrong with the samples.
    pub anomalies: u64,
    /// Reading, filtering and smoothing together, s of wall clock.
    pub process_s: f64,
}

/// Where a result comes from: the same of all of these gives the same track, to the last bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Provenance {
    /// The engine's version.
    #[schemars(example = &"0.1.0")]
    pub engine_version: String,
    /// Over the engine's source, lower-case hex.
    #[schemars(example = crate::examples::SHA256)]
    pub engine_sha256: String,
    /// Every parameter that is not the default.
    pub parameters: BTreeMap<String, f64>,
    /// The set that was the site's, where these are the site's.
    #[serde(default)]
    pub parameter_set: Option<SetVersion>,
    /// The aids that were used, as far as the data allowed.
    #[schemars(with = "Vec<String>", example = ["zupt", "heading"])]
    pub aids: Vec<AidKind>,
    /// What was told.
    #[schemars(with = "String", example = &"smoothed")]
    pub solution: Solution,
    /// What was read, a stream each.
    pub inputs: Vec<Input>,
    /// Over the visits with the places of their markers, lower-case hex.
    #[schemars(example = crate::examples::SHA256)]
    pub visits_sha256: String,
    /// How many visits these are.
    pub visits: u64,
    /// Over all that the engine was told before the first sample but the markers to choose from, lower-case hex.
    #[schemars(example = crate::examples::SHA256)]
    pub config_sha256: String,
    /// Over every epoch that came out, lower-case hex.
    #[schemars(example = crate::examples::SHA256)]
    pub track_sha256: String,
}

/// The samples of one stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "RunInput")]
pub struct Input {
    /// Which stream.
    #[serde(flatten)]
    pub stream: StreamField,
    /// Where they came from.
    pub source: Source,
    /// Of a log, over its bytes as they were sent; of a stream, over its samples as the store lays them out.
    #[schemars(example = crate::examples::SHA256)]
    pub sha256: String,
    /// How many samples.
    pub samples: u64,
}

/// How samples came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SampleSource")]
pub enum Source {
    /// As a file at the dock.
    Log,
    /// Live.
    Stream,
}

impl FromRow<'_, Row> for LabRun {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(LabRun {
            id: columns::id(row, "id")?,
            session_id: columns::id(row, "session_id")?,
            name: row.try_get("name")?,
            parameter_set_id: columns::optional_id(row, "parameter_set_id")?,
            parameters: columns::json(row, "parameters")?,
            aids: columns::optional_json::<Vec<AidKind>>(row, "aids")?.map(|mut aids| {
                // In the order in which their system declares them.
                aids.sort_by_key(|aid| catalogue::aid_named(aid.as_str()).unwrap_or(*aid));
                aids
            }),
            solution: columns::word(row, "solution")?,
            created_at: columns::instant(row, "created_at")?,
            created_by: row.try_get("created_by")?,
            job_id: columns::id(row, "job_id")?,
            state: columns::word(row, "state")?,
            error: row.try_get("error")?,
            figures: columns::optional_json(row, "figures")?,
            provenance: columns::optional_json(row, "provenance")?,
        })
    }
}

/// Those of these sessions, or of all where none is named; the oldest first, at most so many of the newest.
pub async fn list(
    db: impl Executor<'_>,
    session_ids: &[Uuid],
    at_most: u32,
) -> Result<Vec<LabRun>, StoreError> {
    let wanted: Vec<String> = session_ids.iter().map(Uuid::to_string).collect();
    let query = sqlx::query_as(
        "select * from (
            select r.*, j.id as job_id, j.state, j.error
            from lab_runs r join jobs j on j.lab_run_id = r.id
            join sessions s on s.id = r.session_id and s.removed_at is null
            where $1 = '[]' or r.session_id in (select value from json_each($1))
            order by r.created_at desc, r.id desc limit $2) as newest
         order by created_at, id",
    )
    .bind(columns::to_json(&wanted)?)
    .bind(i64::from(at_most));
    Ok(query.fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<LabRun>, StoreError> {
    let query = sqlx::query_as(
        "select r.*, j.id as job_id, j.state, j.error
         from lab_runs r join jobs j on j.lab_run_id = r.id where r.id = $1",
    )
    .bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Adds one; its job is added beside it.
pub async fn insert(db: impl Executor<'_>, run: &LabRun) -> Result<(), StoreError> {
    sqlx::query(
        "insert into lab_runs (id, session_id, name, parameter_set_id, parameters, aids, solution, created_at, created_by)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9)",
    )
    .bind(run.id.to_string())
    .bind(run.session_id.to_string())
    .bind(&run.name)
    .bind(run.parameter_set_id.map(|id| id.to_string()))
    .bind(columns::to_json(&run.parameters)?)
    .bind(run.aids.as_ref().map(columns::to_json).transpose()?)
    .bind(columns::to_word(run.solution))
    .bind(utc::to_us(run.created_at))
    .bind(&run.created_by)
    .execute(db)
    .await?;
    Ok(())
}

/// Notes what one came to.
pub async fn set_result(
    db: impl Executor<'_>,
    id: Uuid,
    figures: &Figures,
    provenance: &Provenance,
) -> Result<(), StoreError> {
    sqlx::query("update lab_runs set figures = $2, provenance = $3 where id = $1")
        .bind(id.to_string())
        .bind(columns::to_json(figures)?)
        .bind(columns::to_json(provenance)?)
        .execute(db)
        .await?;
    Ok(())
}

/// Removes one with its job and its track.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from lab_runs where id = $1").bind(id.to_string()).execute(db).await?;
    Ok(())
}
