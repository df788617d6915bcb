//! Visits: what inspectors said, and what the filter made of it.

use lodestep_engine::event::VisitOutcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// An inspector stood at a marker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Visit {
    /// Its id.
    pub id: Uuid,
    /// The walk.
    pub session_id: Uuid,
    /// The marker's name at that time.
    #[schemars(example = &"A17")]
    pub marker: String,
    /// When the inspector arrived, ns.
    pub t_start_ns: i64,
    /// When the inspector left, ns.
    pub t_end_ns: i64,
    /// Who said so.
    #[serde(default)]
    pub origin: Origin,
    /// What was added to its times as they were keyed in, ns: 0 but where the kiosk's clock is known to be another than
    /// the log's.
    #[serde(default)]
    pub keyed_shift_ns: i64,
    /// When it was told.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
    /// What became of it; absent until a run has weighed it.
    #[serde(flatten)]
    pub outcome: Option<Outcome>,
}

/// Who said that it was this marker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "VisitOrigin")]
pub enum Origin {
    /// Somebody keyed it in.
    #[default]
    Keyed,
    /// Somebody chose it among a stand's candidates.
    Chosen,
    /// Automatic mode: the stand was nearly certain.
    Automatic,
}

/// What the filter made of a visit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outcome {
    /// The moment at which it was applied, ns.
    pub t_applied_ns: i64,
    /// Whether it was used.
    pub accepted: bool,
    /// Normalised innovation squared.
    pub nis: f64,
    /// Axes measured.
    pub degrees_of_freedom: u8,
    /// Position before the correction minus the marker's, east-north-up, m.
    pub before_minus_marker_m: [f64; 3],
    /// Position after the correction minus the marker's, east-north-up, m.
    pub after_minus_marker_m: [f64; 3],
    /// Why it was not used; empty when it was.
    #[schemars(example = &"")]
    pub reason: String,
}

impl From<&VisitOutcome> for Outcome {
    fn from(told: &VisitOutcome) -> Self {
        Outcome {
            t_applied_ns: told.t_ns,
            accepted: told.accepted,
            nis: told.nis,
            degrees_of_freedom: told.degrees_of_freedom,
            before_minus_marker_m: told.before_minus_marker_n_m,
            after_minus_marker_m: told.after_minus_marker_n_m,
            reason: told.reason.clone(),
        }
    }
}

impl FromRow<'_, Row> for Visit {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        let accepted: Option<bool> = row.try_get("accepted")?;
        let outcome = match accepted {
            None => None,
            Some(accepted) => Some(Outcome {
                t_applied_ns: row.try_get("t_applied_ns")?,
                accepted,
                nis: row.try_get("nis")?,
                degrees_of_freedom: columns::small(row, "degrees_of_freedom")?,
                before_minus_marker_m: columns::enu(row, ["before_e_m", "before_n_m", "before_u_m"])?,
                after_minus_marker_m: columns::enu(row, ["after_e_m", "after_n_m", "after_u_m"])?,
                reason: row.try_get("reason")?,
            }),
        };
        Ok(Visit {
            id: columns::id(row, "id")?,
            session_id: columns::id(row, "session_id")?,
            marker: row.try_get("marker")?,
            t_start_ns: row.try_get("t_start_ns")?,
            t_end_ns: row.try_get("t_end_ns")?,
            origin: columns::word(row, "origin")?,
            keyed_shift_ns: row.try_get("keyed_shift_ns")?,
            created_at: columns::instant(row, "created_at")?,
            outcome,
        })
    }
}

/// Those of a session, by time.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<Visit>, StoreError> {
    let query = sqlx::query_as("select * from visits where session_id = $1 order by t_start_ns, id")
        .bind(session_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// How many a session has.
pub async fn count(db: impl Executor<'_>, session_id: Uuid) -> Result<u64, StoreError> {
    let query = sqlx::query("select count(*) as visits from visits where session_id = $1")
        .bind(session_id.to_string());
    Ok(columns::count(&query.fetch_one(db).await?, "visits")?)
}

/// Adds one; `false` when this session already has it (same marker, same arrival as it was keyed in): the same list
/// may be handed in twice.
pub async fn insert(db: impl Executor<'_>, visit: &Visit) -> Result<bool, StoreError> {
    let query = sqlx::query(
        "insert into visits (id, session_id, marker, t_start_ns, t_end_ns, created_at, origin)
         select $1, $2, $3, $4, $5, $6, $7 where not exists (
            select 1 from visits where session_id = $2 and marker = $3 and t_start_ns - keyed_shift_ns = $4)
         on conflict (session_id, marker, t_start_ns) do nothing",
    )
    .bind(visit.id.to_string())
    .bind(visit.session_id.to_string())
    .bind(&visit.marker)
    .bind(visit.t_start_ns)
    .bind(visit.t_end_ns)
    .bind(utc::to_us(visit.created_at))
    .bind(columns::to_word(visit.origin));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

/// Removes one, and with it its place in the stream.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from visits where id = $1").bind(id.to_string()).execute(db).await?;
    Ok(())
}

/// Farther than any time in a walk, ns.
const ASIDE_NS: i64 = 1 << 60;

/// Moves visits by so much from the times as they were keyed in, ns.
pub async fn shift(db: &mut Connection, moved: &[(Uuid, i64)]) -> Result<(), StoreError> {
    // Aside first: on its way one may have the time of another that is still to be moved.
    for (id, shift_ns) in moved {
        sqlx::query(
            "update visits set t_start_ns = t_start_ns - keyed_shift_ns + $2 + $3,
                t_end_ns = t_end_ns - keyed_shift_ns + $2 + $3, keyed_shift_ns = $2
             where id = $1 and keyed_shift_ns <> $2",
        )
        .bind(id.to_string())
        .bind(shift_ns)
        .bind(ASIDE_NS)
        .execute(&mut *db)
        .await?;
    }
    for (id, _) in moved {
        sqlx::query(
            "update visits set t_start_ns = t_start_ns - $2, t_end_ns = t_end_ns - $2
             where id = $1 and t_start_ns >= $3",
        )
        .bind(id.to_string())
        .bind(ASIDE_NS)
        .bind(ASIDE_NS / 2)
        .execute(&mut *db)
        .await?;
    }
    Ok(())
}

/// Notes what the filter made of the visit to this marker that was applied at `t_ns`: the one whose
/// stay holds that moment, or else the nearest.
pub async fn set_outcome(
    db: impl Executor<'_>,
    session_id: Uuid,
    told: &VisitOutcome,
) -> Result<(), StoreError> {
    let [before_e, before_n, before_u] = told.before_minus_marker_n_m;
    let [after_e, after_n, after_u] = told.after_minus_marker_n_m;
    sqlx::query(
        "update visits set
            t_applied_ns = $3, accepted = $4, nis = $5, degrees_of_freedom = $6,
            before_e_m = $7, before_n_m = $8, before_u_m = $9,
            after_e_m = $10, after_n_m = $11, after_u_m = $12, reason = $13,
            marker_e_m = case when $14 then 0.0 else (select e_m from markers where name = $2) end,
            marker_n_m = case when $14 then 0.0 else (select n_m from markers where name = $2) end,
            marker_u_m = case when $14 then 0.0 else (select u_m from markers where name = $2) end
         where id = (
            select id from visits where session_id = $1 and marker = $2
            order by case when $3 < t_start_ns then t_start_ns - $3
                          when $3 > t_end_ns then $3 - t_end_ns
                          else 0 end, t_start_ns
            limit 1)",
    )
    .bind(session_id.to_string())
    .bind(&told.marker)
    .bind(told.t_ns)
    .bind(told.accepted)
    .bind(told.nis)
    .bind(i64::from(told.degrees_of_freedom))
    .bind(before_e)
    .bind(before_n)
    .bind(before_u)
    .bind(after_e)
    .bind(after_n)
    .bind(after_u)
    .bind(&told.reason)
    // What was held against no marker has its places from the origin.
    .bind(told.is_of_a_new_point())
    .execute(db)
    .await?;
    Ok(())
}

/// Forgets the outcomes of a session: a new run weighs its visits again.
pub async fn clear_outcomes(db: impl Executor<'_>, session_id: Uuid) -> Result<(), StoreError> {
    sqlx::query(
        "update visits set
            t_applied_ns = null, accepted = null, nis = null, degrees_of_freedom = null,
            before_e_m = null, before_n_m = null, before_u_m = null,
            after_e_m = null, after_n_m = null, after_u_m = null, reason = null,
            marker_e_m = null, marker_n_m = null, marker_u_m = null
         where session_id = $1",
    )
    .bind(session_id.to_string())
    .execute(db)
    .await?;
    Ok(())
}
