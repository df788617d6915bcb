//! How far the walks' positions were from the markers that were visited.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{AssertSqlSafe, FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
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

impl FromRow<'_, Row> for VisitResidual {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
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

/// A visit of a session that it did not correct: where the session has the marker.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldAgainst {
    /// The marker.
    pub marker: String,
    /// Arrival, ns.
    pub t_start_ns: i64,
    /// Departure, ns.
    pub t_end_ns: i64,
    /// The moment at which it was weighed, ns.
    pub t_applied_ns: i64,
    /// Where this visit has it, in the site's frame, m.
    pub alone_m: [f64; 3],
    /// Where all visits of it have it together, m.
    pub together_m: [f64; 3],
    /// The marker's height when it was held against it, m.
    pub marker_u_m: Option<f64>,
    /// Where the marker stands today, east and north, m; `None` where there is none of this name.
    pub stands_m: Option<[f64; 2]>,
    /// Its height today, m.
    pub stands_u_m: Option<f64>,
}

impl FromRow<'_, Row> for HeldAgainst {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(HeldAgainst {
            marker: row.try_get("marker")?,
            t_start_ns: row.try_get("t_start_ns")?,
            t_end_ns: row.try_get("t_end_ns")?,
            t_applied_ns: row.try_get("t_applied_ns")?,
            alone_m: columns::enu(row, ["alone_e_m", "alone_n_m", "alone_u_m"])?,
            together_m: columns::enu(row, ["together_e_m", "together_n_m", "together_u_m"])?,
            marker_u_m: row.try_get("marker_u_m")?,
            stands_m: match row.try_get::<Option<f64>, _>("e_m")? {
                Some(e_m) => Some([e_m, row.try_get("n_m")?]),
                None => None,
            },
            stands_u_m: row.try_get("u_m")?,
        })
    }
}

/// The visits of a session that were held against a marker, by time.
pub async fn held_against(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<HeldAgainst>, StoreError> {
    let query = sqlx::query_as(
        "select v.marker, v.t_start_ns, v.t_end_ns, v.t_applied_ns, v.marker_u_m, m.e_m, m.n_m, m.u_m,
            v.before_e_m + v.marker_e_m as alone_e_m, v.before_n_m + v.marker_n_m as alone_n_m,
            v.before_u_m + coalesce(v.marker_u_m, 0) as alone_u_m,
            v.after_e_m + v.marker_e_m as together_e_m, v.after_n_m + v.marker_n_m as together_n_m,
            v.after_u_m + coalesce(v.marker_u_m, 0) as together_u_m
         from visits v
         left join markers m on m.name = v.marker
         where v.session_id = $1 and v.degrees_of_freedom > 0 and v.marker_e_m is not null
         order by v.t_start_ns",
    );
    Ok(query.bind(session_id.to_string()).fetch_all(db).await?)
}

/// A marker that was surveyed anew since the visit is held against where it stands today. What automatic
/// mode chose is no evidence: it chose the nearest. Nor is a walk that was left out.
const WEIGHED: &str = "select v.marker, v.session_id, v.t_applied_ns, v.accepted, v.nis, s.started_at,
        v.before_e_m + (coalesce(v.marker_e_m, m.e_m) - m.e_m) as residual_e_m,
        v.before_n_m + (coalesce(v.marker_n_m, m.n_m) - m.n_m) as residual_n_m
     from visits v
     join markers m on m.name = v.marker
     join sessions s on s.id = v.session_id
     where v.accepted is not null and v.origin <> 'automatic' and not s.excluded";

/// All visits of markers that exist which were weighed and whose marker a person named, by time.
pub async fn all(db: impl Executor<'_>) -> Result<Vec<VisitResidual>, StoreError> {
    let sql = format!("{WEIGHED} order by s.started_at, v.t_applied_ns");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).fetch_all(db).await?)
}

/// Those of one marker, by time.
pub async fn of_marker(db: impl Executor<'_>, name: &str) -> Result<Vec<VisitResidual>, StoreError> {
    let sql = format!("{WEIGHED} and v.marker = $1 order by s.started_at, v.t_applied_ns");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).bind(name).fetch_all(db).await?)
}
