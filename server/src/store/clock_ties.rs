//! How the clock by which a walk's markers were keyed in stands to that of its logs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// What is known of the two clocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockTie {
    /// How it is known.
    pub state: TieState,
    /// The log's time less the keyed one, s; 0 where it is not known.
    #[schemars(example = &241.5)]
    pub offset_s: f64,
    /// Its sigma, s; null where it was not measured.
    #[schemars(example = &0.7)]
    pub sigma_s: Option<f64>,
    /// Visits that were keyed in.
    pub keyed: u64,
    /// Of these, those that fall on a stand of the log where the track agrees.
    pub matched: u64,
    /// When it was found or given.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub tied_at: OffsetDateTime,
}

/// How the offset of two clocks is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "ClockTieState")]
pub enum TieState {
    /// Measured: they are one clock, as far as the stands can tell. Nothing is moved.
    Same,
    /// Measured: what was keyed in is moved by it.
    Tied,
    /// Two offsets explain the visits about as well: somebody has to say which. Nothing is moved.
    Ambiguous,
    /// No offset explains the visits. Nothing is moved.
    Unmatched,
    /// Too few visits were keyed in to measure it. Nothing is moved.
    TooFew,
    /// Somebody gave it: what was keyed in is moved by it.
    Given,
}

impl TieState {
    /// Whether the offset is known.
    pub fn is_known(self) -> bool {
        matches!(self, TieState::Same | TieState::Tied | TieState::Given)
    }

    /// Whether what was keyed in is moved by the offset.
    pub fn moves(self) -> bool {
        matches!(self, TieState::Tied | TieState::Given)
    }
}

impl FromRow<'_, Row> for ClockTie {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(ClockTie {
            state: columns::word(row, "state")?,
            offset_s: row.try_get("offset_s")?,
            sigma_s: row.try_get("sigma_s")?,
            keyed: columns::count(row, "keyed")?,
            matched: columns::count(row, "matched")?,
            tied_at: columns::instant(row, "tied_at")?,
        })
    }
}

/// That of a session; `None` where there was nothing to tie.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Option<ClockTie>, StoreError> {
    let query = sqlx::query_as("select * from clock_ties where session_id = $1").bind(session_id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// Takes the place of the former one.
pub async fn set(db: impl Executor<'_>, session_id: Uuid, tie: &ClockTie) -> Result<(), StoreError> {
    sqlx::query(
        "insert into clock_ties (session_id, state, offset_s, sigma_s, keyed, matched, tied_at)
         values ($1, $2, $3, $4, $5, $6, $7)
         on conflict (session_id) do update set state = excluded.state, offset_s = excluded.offset_s,
            sigma_s = excluded.sigma_s, keyed = excluded.keyed, matched = excluded.matched,
            tied_at = excluded.tied_at",
    )
    .bind(session_id.to_string())
    .bind(columns::to_word(tie.state))
    .bind(tie.offset_s)
    .bind(tie.sigma_s)
    .bind(columns::to_column(tie.keyed))
    .bind(columns::to_column(tie.matched))
    .bind(utc::to_us(tie.tied_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Forgets it: the next run measures it again.
pub async fn clear(db: impl Executor<'_>, session_id: Uuid) -> Result<(), StoreError> {
    sqlx::query("delete from clock_ties where session_id = $1")
        .bind(session_id.to_string())
        .execute(db)
        .await?;
    Ok(())
}
