//! Where inspectors stood, with the markers that it may have been.

use lodestep_engine::event;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::faults::Candidate;
use super::{StoreError, columns};

/// A place at which an inspector stands or stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Stand {
    /// Counts the stands of a session from 1.
    pub number: u32,
    /// When the streams came to rest, ns.
    pub t_start_ns: i64,
    /// When the first stream lifted, ns; the latest time known while it lasts.
    pub t_end_ns: i64,
    /// Whether the inspector still stands there.
    pub lasts: bool,
    /// Where the track had it when it was first told, east-north-up, m.
    pub position_m: [f64; 3],
    /// Likeliest first, and last the share of all that is not named; they add up to 1.
    pub candidates: Vec<Candidate>,
}

impl Stand {
    /// Whether a time span overlaps it.
    pub fn overlaps(&self, t_start_ns: i64, t_end_ns: i64) -> bool {
        t_start_ns <= self.t_end_ns && t_end_ns >= self.t_start_ns
    }
}

impl From<&event::Stand> for Stand {
    fn from(told: &event::Stand) -> Self {
        let candidates = told.candidates.iter().map(|candidate| Candidate {
            marker: candidate.marker.clone(),
            probability: candidate.probability,
            distance_m: candidate.distance_m,
        });
        Stand {
            number: told.number,
            t_start_ns: told.t_start_ns,
            t_end_ns: told.t_end_ns,
            lasts: told.lasts,
            position_m: told.position_n_m,
            candidates: candidates.collect(),
        }
    }
}

impl FromRow<'_, Row> for Stand {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        let candidates: &str = row.try_get("candidates")?;
        Ok(Stand {
            number: columns::small(row, "number")?,
            t_start_ns: row.try_get("t_start_ns")?,
            t_end_ns: row.try_get("t_end_ns")?,
            lasts: row.try_get("lasts")?,
            position_m: columns::enu(row, ["e_m", "n_m", "u_m"])?,
            candidates: serde_json::from_str(candidates).map_err(|error| sqlx::Error::ColumnDecode {
                index: "candidates".to_owned(),
                source: error.into(),
            })?,
        })
    }
}

/// Those of a session, by time.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<Stand>, StoreError> {
    let query = sqlx::query_as("select * from stands where session_id = $1 order by number")
        .bind(session_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// The one of this number.
pub async fn get(db: impl Executor<'_>, session_id: Uuid, number: u32) -> Result<Option<Stand>, StoreError> {
    let query = sqlx::query_as("select * from stands where session_id = $1 and number = $2")
        .bind(session_id.to_string())
        .bind(i64::from(number));
    Ok(query.fetch_optional(db).await?)
}

/// Puts stands in the place of those of the same numbers.
pub async fn upsert(db: &mut Connection, session_id: Uuid, stands: &[Stand]) -> Result<(), StoreError> {
    for stand in stands {
        let candidates = serde_json::to_string(&stand.candidates).map_err(|error| StoreError::Damaged {
            what: format!("candidates of stand {} of session {session_id}", stand.number),
            why: error.to_string(),
        })?;
        let [e_m, n_m, u_m] = stand.position_m;
        sqlx::query(
            "insert into stands (session_id, number, t_start_ns, t_end_ns, lasts, e_m, n_m, u_m, candidates)
             values ($1, $2, $3, $4, $5, $6, $7, $8, $9)
             on conflict (session_id, number) do update set
                t_start_ns = excluded.t_start_ns, t_end_ns = excluded.t_end_ns, lasts = excluded.lasts,
                e_m = excluded.e_m, n_m = excluded.n_m, u_m = excluded.u_m, candidates = excluded.candidates",
        )
        .bind(session_id.to_string())
        .bind(i64::from(stand.number))
        .bind(stand.t_start_ns)
        .bind(stand.t_end_ns)
        .bind(stand.lasts)
        .bind(e_m)
        .bind(n_m)
        .bind(u_m)
        .bind(candidates)
        .execute(&mut *db)
        .await?;
    }
    Ok(())
}

/// Removes those of a session: a new run finds its own.
pub async fn clear(db: impl Executor<'_>, session_id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from stands where session_id = $1").bind(session_id.to_string()).execute(db).await?;
    Ok(())
}

/// Where a session's automatic visits were undone, by the stand's start, ns.
pub async fn undone(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<i64>, StoreError> {
    let query =
        sqlx::query_scalar("select t_start_ns from undone_stands where session_id = $1 order by t_start_ns")
            .bind(session_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// Notes that the automatic visit of the stand that began then was undone.
pub async fn undo(db: impl Executor<'_>, session_id: Uuid, t_start_ns: i64) -> Result<(), StoreError> {
    sqlx::query("insert into undone_stands (session_id, t_start_ns) values ($1, $2) on conflict do nothing")
        .bind(session_id.to_string())
        .bind(t_start_ns)
        .execute(db)
        .await?;
    Ok(())
}
