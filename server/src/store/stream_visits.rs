//! Visits told while a device streams, with their place in the stream.

use lodestep_engine::session;
use sqlx::{FromRow, Row as _};
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::visits::Visit;
use super::{StoreError, columns};

/// A visit and when it was told.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamVisit {
    /// The visit.
    pub visit: Visit,
    /// Samples of the stream, both streams, that had been taken before it.
    pub after_samples: u64,
    /// The marker at that time, east, north and up, m; no up where its height was not surveyed.
    pub marker_position_m: (f64, f64, Option<f64>),
}

impl StreamVisit {
    /// As the engine takes it.
    pub fn for_engine(&self) -> session::Visit {
        session::Visit {
            marker: self.visit.marker.clone(),
            t_start_ns: self.visit.t_start_ns,
            t_end_ns: self.visit.t_end_ns,
            position_n_m: self.marker_position_m,
        }
    }
}

impl FromRow<'_, Row> for StreamVisit {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(StreamVisit {
            visit: Visit::from_row(row)?,
            after_samples: columns::count(row, "after_samples")?,
            marker_position_m: (row.try_get("e_m")?, row.try_get("n_m")?, row.try_get("u_m")?),
        })
    }
}

/// Those of a session in the order in which they were told.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<StreamVisit>, StoreError> {
    let query = sqlx::query_as(
        "select visits.*, after_samples, e_m, n_m, u_m
         from stream_visits join visits on visits.id = stream_visits.visit_id
         where stream_visits.session_id = $1
         order by after_samples, visits.id",
    )
    .bind(session_id.to_string());
    Ok(query.fetch_all(db).await?)
}

/// Notes where in the stream a visit was told; the visit itself has been added before.
pub async fn insert(db: impl Executor<'_>, told: &StreamVisit) -> Result<(), StoreError> {
    let (e_m, n_m, u_m) = told.marker_position_m;
    sqlx::query(
        "insert into stream_visits (visit_id, session_id, after_samples, e_m, n_m, u_m)
         values ($1, $2, $3, $4, $5, $6)",
    )
    .bind(told.visit.id.to_string())
    .bind(told.visit.session_id.to_string())
    .bind(columns::to_column(told.after_samples))
    .bind(e_m)
    .bind(n_m)
    .bind(u_m)
    .execute(db)
    .await?;
    Ok(())
}
