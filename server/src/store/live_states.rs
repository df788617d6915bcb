//! States of live walks, saved in the transaction that stores the samples that they have taken.

use std::collections::BTreeMap;

use lodestep_engine::stream::StreamId;
use sqlx::{FromRow, Row as _};
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::{StoreError, columns};

/// The state of a walk, and what it has taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveState {
    /// Since when it knows its past, ns.
    pub t_ns: i64,
    /// What saved it, and what the walk was told: only the same may take it up.
    pub fits: String,
    /// Samples that it has taken, of all streams.
    pub samples: u64,
    /// The next batch of each stream.
    pub next_sequences: BTreeMap<StreamId, u64>,
    /// The state.
    pub body: Vec<u8>,
}

impl FromRow<'_, Row> for LiveState {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(LiveState {
            t_ns: row.try_get("t_ns")?,
            fits: row.try_get("fits")?,
            samples: columns::count(row, "samples")?,
            next_sequences: columns::json(row, "next_sequences")?,
            body: row.try_get("body")?,
        })
    }
}

/// Saves a state in place of the one of the same moment, and forgets those from more than `kept_ns` before it.
pub(super) async fn save(
    db: &mut Connection,
    session_id: Uuid,
    state: &LiveState,
    kept_ns: i64,
) -> Result<(), StoreError> {
    // What a visit went back to before is not to be taken up again, whichever moment it has.
    sqlx::query("delete from live_states where session_id = $1 and (t_ns < $2 or t_ns >= $3)")
        .bind(session_id.to_string())
        .bind(state.t_ns - kept_ns)
        .bind(state.t_ns)
        .execute(&mut *db)
        .await?;
    let query = sqlx::query(
        "insert into live_states (session_id, t_ns, fits, samples, next_sequences, body)
         values ($1, $2, $3, $4, $5, $6)",
    );
    query
        .bind(session_id.to_string())
        .bind(state.t_ns)
        .bind(state.fits.clone())
        .bind(columns::to_column(state.samples))
        .bind(columns::to_json(&state.next_sequences)?)
        .bind(state.body.clone())
        .execute(db)
        .await?;
    Ok(())
}

/// The states of a walk that fit, from more than `before_ns` before the newest of them, newest first.
pub async fn from_before_the_newest(
    db: impl Executor<'_>,
    session_id: Uuid,
    fits: &str,
    before_ns: i64,
) -> Result<Vec<LiveState>, StoreError> {
    let query = sqlx::query_as(
        "select * from live_states where session_id = $1 and fits = $2 and t_ns < (
            select max(t_ns) from live_states where session_id = $1 and fits = $2) - $3
         order by t_ns desc",
    );
    Ok(query.bind(session_id.to_string()).bind(fits).bind(before_ns).fetch_all(db).await?)
}

/// Forgets the states of a walk: it is over, or was worked out again.
pub async fn clear(db: impl Executor<'_>, session_id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from live_states where session_id = $1")
        .bind(session_id.to_string())
        .execute(db)
        .await?;
    Ok(())
}
