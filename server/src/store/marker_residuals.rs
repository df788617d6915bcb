//! How far the walks' positions were from the markers that were visited.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, FromRow, Row, SqliteExecutor};
use time::OffsetDateTime;
use uuid::Uuid;

use super::{StoreError, columns};
use crate::utc;

/// One visit, as it speaks for or against a marker's survey.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VisitResidual {
    /// The marker.
    #[schemars(example = &"A17")]
    pub marker: String,
    /// The walk.
    pub session_id: Uuid,
    /// The moment at which it was weighed, ns.
    pub t_applied_ns: i64,
    /// The same moment.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub visited_at: OffsetDateTime,
    /// Whether it was used.
    pub accepted: bool,
    /// Normalised innovation squared.
    pub nis: f64,
    /// Position before the correction minus the marker as it is surveyed today, east and north, m.
    pub residual_m: [f64; 2],
}

impl FromRow<'_, SqliteRow> for VisitResidual {
    fn from_row(row: &SqliteRow) -> sqlx::Result<Self> {
        let started_at = columns::instant(row, "started_at")?;
        let t_applied_ns = row.try_get("t_applied_ns")?;
        Ok(VisitResidual {
            marker: row.try_get("marker")?,
            session_id: columns::id(row, "session_id")?,
            t_applied_ns,
            visited_at: utc::at(started_at, t_applied_ns),
            accepted: row.try_get("accepted")?,
            nis: row.try_get("nis")?,
            residual_m: [row.try_get("residual_e_m")?, row.try_get("residual_n_m")?],
        })
    }
}

/// A marker that was surveyed anew since the visit is held against where it stands today. What automatic
/// mode chose is no evidence: it chose the nearest. Nor is a walk that was left out.
const WEIGHED: &str = "select v.marker, v.session_id, v.t_applied_ns, v.accepted, v.nis, s.started_at,
        v.before_e_m + (coalesce(v.marker_e_m, m.e_m) - m.e_m) as residual_e_m,
        v.before_n_m + (coalesce(v.marker_n_m, m.n_m) - m.n_m) as residual_n_m
     from visits v
     join markers m on m.name = v.marker
     join sessions s on s.id = v.session_id
     where v.accepted is not null and v.origin <> 'automatic' and s.excluded = 0";

/// All visits of markers that exist which were weighed and whose marker a person named, by time.
pub async fn all(db: impl SqliteExecutor<'_>) -> Result<Vec<VisitResidual>, StoreError> {
    let sql = format!("{WEIGHED} order by s.started_at, v.t_applied_ns");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).fetch_all(db).await?)
}

/// Those of one marker, by time.
pub async fn of_marker(db: impl SqliteExecutor<'_>, name: &str) -> Result<Vec<VisitResidual>, StoreError> {
    let sql = format!("{WEIGHED} and v.marker = ?1 order by s.started_at, v.t_applied_ns");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).bind(name).fetch_all(db).await?)
}
