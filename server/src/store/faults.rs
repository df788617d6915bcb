//! Findings on equipment.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::sqlite::SqliteRow;
use sqlx::{FromRow, Row, SqliteExecutor};
use time::OffsetDateTime;
use uuid::Uuid;

use super::{StoreError, columns};
use crate::utc;

/// A finding, placed by where its inspector was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// Its id.
    pub id: Uuid,
    /// Who found it.
    pub inspector_id: Uuid,
    /// The walk it was found on, where there is one.
    pub session_id: Option<Uuid>,
    /// When the inspector saw it.
    #[serde(with = "time::serde::rfc3339")]
    pub reported_at: OffsetDateTime,
    /// The same moment on the session's clock, ns.
    pub t_ns: Option<i64>,
    /// What is wrong, in a word. (`fault_kind` would repeat itself: a change carries it under `fault`.)
    pub kind: String,
    /// How bad it is.
    pub severity: Severity,
    /// What the inspector wrote.
    pub text: String,
    /// The actuator the inspector named.
    pub marker: Option<String>,
    /// Where the inspector was, east-north-up, m; `None` when that is not known.
    pub position_m: Option<[f64; 3]>,
    /// Its sigmas, m.
    pub sigma_m: Option<[f64; 3]>,
    /// Its covariance of east and north, m².
    pub covariance_en_m2: Option<f64>,
    /// The actuators it may be about, likeliest first; their probabilities add up to 1.
    pub candidates: Vec<Candidate>,
    /// Open or closed.
    pub state: FaultState,
    /// When it was closed.
    #[serde(with = "time::serde::rfc3339::option")]
    pub closed_at: Option<OffsetDateTime>,
    /// When the server had it.
    #[serde(with = "time::serde::rfc3339")]
    pub created_at: OffsetDateTime,
}

/// One actuator that a fault may be about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Candidate {
    /// Its name; `None` stands for "none of them".
    pub marker: Option<String>,
    /// How likely it is, 0 to 1.
    pub probability: f64,
    /// From the inspector's position to the marker in plan, m.
    pub distance_m: Option<f64>,
}

/// How bad a fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// It can wait.
    Low,
    /// It should be looked at.
    Medium,
    /// Somebody should go now.
    High,
}

/// Whether a fault still stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultState {
    /// It stands.
    Open,
    /// It is done with.
    Closed,
}

impl FromRow<'_, SqliteRow> for Fault {
    fn from_row(row: &SqliteRow) -> sqlx::Result<Self> {
        let candidates: &str = row.try_get("candidates")?;
        Ok(Fault {
            id: columns::id(row, "id")?,
            inspector_id: columns::id(row, "inspector_id")?,
            session_id: columns::optional_id(row, "session_id")?,
            reported_at: columns::instant(row, "reported_at")?,
            t_ns: row.try_get("t_ns")?,
            kind: row.try_get("kind")?,
            severity: columns::word(row, "severity")?,
            text: row.try_get("text")?,
            marker: row.try_get("marker")?,
            position_m: columns::optional_enu(row, ["e_m", "n_m", "u_m"])?,
            sigma_m: columns::optional_enu(row, ["sigma_e_m", "sigma_n_m", "sigma_u_m"])?,
            covariance_en_m2: row.try_get("covariance_en_m2")?,
            candidates: serde_json::from_str(candidates).map_err(|error| sqlx::Error::ColumnDecode {
                index: "candidates".to_owned(),
                source: error.into(),
            })?,
            state: columns::word(row, "state")?,
            closed_at: columns::optional_instant(row, "closed_at")?,
            created_at: columns::instant(row, "created_at")?,
        })
    }
}

/// Those in this state (`None`: all), newest first.
pub async fn list(db: impl SqliteExecutor<'_>, state: Option<FaultState>) -> Result<Vec<Fault>, StoreError> {
    let query = sqlx::query_as(
        "select * from faults where (?1 is null or state = ?1) order by reported_at desc, id desc",
    )
    .bind(state.map(columns::to_word));
    Ok(query.fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl SqliteExecutor<'_>, id: Uuid) -> Result<Option<Fault>, StoreError> {
    Ok(sqlx::query_as("select * from faults where id = ?1").bind(id.to_string()).fetch_optional(db).await?)
}

/// Adds one.
pub async fn insert(db: impl SqliteExecutor<'_>, fault: &Fault) -> Result<(), StoreError> {
    let candidates = serde_json::to_string(&fault.candidates).map_err(|error| StoreError::Damaged {
        what: format!("candidates of fault {}", fault.id),
        why: error.to_string(),
    })?;
    let [e_m, n_m, u_m] = each(fault.position_m);
    let [sigma_e_m, sigma_n_m, sigma_u_m] = each(fault.sigma_m);
    sqlx::query(
        "insert into faults (
            id, inspector_id, session_id, reported_at, t_ns, kind, severity, text, marker,
            e_m, n_m, u_m, sigma_e_m, sigma_n_m, sigma_u_m, covariance_en_m2,
            candidates, state, closed_at, created_at
         ) values (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, ?20)",
    )
    .bind(fault.id.to_string())
    .bind(fault.inspector_id.to_string())
    .bind(fault.session_id.map(|id| id.to_string()))
    .bind(utc::to_us(fault.reported_at))
    .bind(fault.t_ns)
    .bind(&fault.kind)
    .bind(columns::to_word(fault.severity))
    .bind(&fault.text)
    .bind(&fault.marker)
    .bind(e_m)
    .bind(n_m)
    .bind(u_m)
    .bind(sigma_e_m)
    .bind(sigma_n_m)
    .bind(sigma_u_m)
    .bind(fault.covariance_en_m2)
    .bind(candidates)
    .bind(columns::to_word(fault.state))
    .bind(fault.closed_at.map(utc::to_us))
    .bind(utc::to_us(fault.created_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Closes one that is open; `false` when there is no open one with this id.
pub async fn close(db: impl SqliteExecutor<'_>, id: Uuid, at: OffsetDateTime) -> Result<bool, StoreError> {
    let query =
        sqlx::query("update faults set state = 'closed', closed_at = ?2 where id = ?1 and state = 'open'")
            .bind(id.to_string())
            .bind(utc::to_us(at));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Three nullable columns from one optional vector.
fn each(vector: Option<[f64; 3]>) -> [Option<f64>; 3] {
    match vector {
        Some(vector) => vector.map(Some),
        None => [None; 3],
    }
}
