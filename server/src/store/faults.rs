//! Findings on equipment.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{AssertSqlSafe, FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::{StoreError, columns};
use crate::utc;

/// A finding, placed by where its inspector was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fault {
    /// Its id.
    pub id: Uuid,
    /// Who found it.
    pub inspector_id: Uuid,
    /// The walk it was found on, where there is one.
    pub session_id: Option<Uuid>,
    /// When the inspector saw it.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub reported_at: OffsetDateTime,
    /// The same moment on the session's clock, ns.
    pub t_ns: Option<i64>,
    /// What is wrong, in a word. (`fault_kind` would repeat itself: a change carries it under `fault`.)
    #[schemars(example = &"leak")]
    pub kind: String,
    /// How bad it is.
    pub severity: Severity,
    /// What the inspector wrote.
    #[schemars(example = &"Oil on the rail")]
    pub text: String,
    /// The actuator the inspector named.
    #[schemars(example = &"A17")]
    pub marker: Option<String>,
    /// Where the inspector was, east-north-up, m; `None` when that is not known.
    pub position_m: Option<[f64; 3]>,
    /// Its sigmas, m.
    pub sigma_m: Option<[f64; 3]>,
    /// Its covariance of east and north, m².
    pub covariance_en_m2: Option<f64>,
    /// The actuators it may be about, likeliest first; their probabilities add up to 1.
    pub candidates: Vec<Candidate>,
    /// How far it has come.
    pub state: FaultState,
    /// Who is to see to it.
    pub assignee_id: Option<Uuid>,
    /// How many photos it has.
    pub photos: u64,
    /// Counts its changes: who changes it names the one that was seen.
    pub version: i64,
    /// When it was verified.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<crate::utc::Instant>")]
    pub closed_at: Option<OffsetDateTime>,
    /// When the server had it.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub created_at: OffsetDateTime,
    /// When it last changed.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "crate::utc::Instant")]
    pub updated_at: OffsetDateTime,
}

/// One actuator that a fault may be about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "FaultCandidate")]
pub struct Candidate {
    /// Its name; `None` stands for "none of them".
    #[schemars(example = &"A17")]
    pub marker: Option<String>,
    /// How likely it is, 0 to 1.
    pub probability: f64,
    /// From the inspector's position to the marker in plan, m.
    pub distance_m: Option<f64>,
}

/// How bad a fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "FaultSeverity")]
pub enum Severity {
    /// It can wait.
    Low,
    /// It should be looked at.
    Medium,
    /// Somebody should go now.
    High,
}

/// How far a fault has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultState {
    /// It was reported, and nobody has said that it was seen.
    Open,
    /// Somebody knows of it.
    Acknowledged,
    /// Somebody is at it.
    InWork,
    /// It is repaired.
    Fixed,
    /// Somebody has looked, and it is.
    Verified,
}

impl FaultState {
    /// Whether it is still to be shown and seen to.
    pub fn stands(self) -> bool {
        self != FaultState::Verified
    }

    /// Whether this step may follow: onward as far as fixed, back at any time; only what is fixed is
    /// verified, and what is verified can only be opened again.
    pub fn may_become(self, next: FaultState) -> bool {
        match (self, next) {
            (FaultState::Verified, next) => next == FaultState::Open,
            (now, FaultState::Verified) => now == FaultState::Fixed,
            _ => true,
        }
    }
}

impl FromRow<'_, Row> for Fault {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
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
            assignee_id: columns::optional_id(row, "assignee_id")?,
            photos: columns::count(row, "photos")?,
            version: row.try_get("version")?,
            closed_at: columns::optional_instant(row, "closed_at")?,
            created_at: columns::instant(row, "created_at")?,
            updated_at: columns::instant(row, "updated_at")?,
        })
    }
}

const WITH_PHOTOS: &str =
    "select f.*, (select count(*) from fault_photos p where p.fault_id = f.id) as photos from faults f";

/// Those in this state (`None`: all), newest first.
pub async fn list(db: impl Executor<'_>, state: Option<FaultState>) -> Result<Vec<Fault>, StoreError> {
    let sql =
        format!("{WITH_PHOTOS} where ($1 is null or f.state = $1) order by f.reported_at desc, f.id desc");
    let query = sqlx::query_as(AssertSqlSafe(sql)).bind(state.map(columns::to_word));
    Ok(query.fetch_all(db).await?)
}

/// Which faults to list.
#[derive(Clone, Copy, Debug)]
pub enum Which {
    /// All.
    All,
    /// All that are not verified.
    Standing,
    /// Those in this state.
    In(FaultState),
}

/// At most `limit` of these, newest first, from the one after `before` on (when it was reported, µs, and its id).
pub async fn page(
    db: impl Executor<'_>,
    which: Which,
    before: Option<(i64, Uuid)>,
    limit: u32,
) -> Result<Vec<Fault>, StoreError> {
    let sql = format!(
        "{WITH_PHOTOS} where ($1 is null or f.state = $1) and (not $2 or f.state <> 'verified')
            and ($3 is null or (f.reported_at, f.id) < ($3, $4))
            order by f.reported_at desc, f.id desc limit $5"
    );
    let state = match which {
        Which::In(state) => Some(columns::to_word(state)),
        Which::All | Which::Standing => None,
    };
    let query = sqlx::query_as(AssertSqlSafe(sql))
        .bind(state)
        .bind(matches!(which, Which::Standing))
        .bind(before.map(|(reported_us, _)| reported_us))
        .bind(before.map(|(_, id)| id.to_string()))
        .bind(i64::from(limit));
    Ok(query.fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Fault>, StoreError> {
    let sql = format!("{WITH_PHOTOS} where f.id = $1");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).bind(id.to_string()).fetch_optional(db).await?)
}

/// Those of a walk, in the order in which they were seen.
pub async fn of_session(db: impl Executor<'_>, session_id: Uuid) -> Result<Vec<Fault>, StoreError> {
    let sql = format!("{WITH_PHOTOS} where f.session_id = $1 order by f.reported_at, f.id");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).bind(session_id.to_string()).fetch_all(db).await?)
}

/// Adds one.
pub async fn insert(db: impl Executor<'_>, fault: &Fault) -> Result<(), StoreError> {
    let candidates = candidates_of(fault)?;
    let [e_m, n_m, u_m] = each(fault.position_m);
    let [sigma_e_m, sigma_n_m, sigma_u_m] = each(fault.sigma_m);
    sqlx::query(
        "insert into faults (
            id, inspector_id, session_id, reported_at, t_ns, kind, severity, text, marker,
            e_m, n_m, u_m, sigma_e_m, sigma_n_m, sigma_u_m, covariance_en_m2,
            candidates, state, closed_at, created_at, assignee_id, version, updated_at
         ) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20,
            $21, $22, $23)",
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
    .bind(fault.assignee_id.map(|id| id.to_string()))
    .bind(fault.version)
    .bind(utc::to_us(fault.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// Those that stand, newest first.
pub async fn standing(db: impl Executor<'_>) -> Result<Vec<Fault>, StoreError> {
    let sql = format!("{WITH_PHOTOS} where f.state <> 'verified' order by f.reported_at desc, f.id desc");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).fetch_all(db).await?)
}

/// Notes what people may change of one: its state, who sees to it, severity, kind, text and marker. Its place stays.
pub async fn update(db: impl Executor<'_>, fault: &Fault) -> Result<(), StoreError> {
    sqlx::query(
        "update faults set
            state = $2, assignee_id = $3, severity = $4, kind = $5, text = $6, marker = $7,
            version = $8, closed_at = $9, updated_at = $10
         where id = $1",
    )
    .bind(fault.id.to_string())
    .bind(columns::to_word(fault.state))
    .bind(fault.assignee_id.map(|id| id.to_string()))
    .bind(columns::to_word(fault.severity))
    .bind(&fault.kind)
    .bind(&fault.text)
    .bind(&fault.marker)
    .bind(fault.version)
    .bind(fault.closed_at.map(utc::to_us))
    .bind(utc::to_us(fault.updated_at))
    .execute(db)
    .await?;
    Ok(())
}

/// The walk of these was another inspector's.
pub async fn change_inspector(
    db: impl Executor<'_>,
    session_id: Uuid,
    inspector_id: Uuid,
) -> Result<(), StoreError> {
    sqlx::query("update faults set inspector_id = $2, version = version + 1 where session_id = $1")
        .bind(session_id.to_string())
        .bind(inspector_id.to_string())
        .execute(db)
        .await?;
    Ok(())
}

/// Notes where one was seen and which actuators it may be about.
pub async fn set_place(db: impl Executor<'_>, fault: &Fault) -> Result<(), StoreError> {
    let [e_m, n_m, u_m] = each(fault.position_m);
    let [sigma_e_m, sigma_n_m, sigma_u_m] = each(fault.sigma_m);
    sqlx::query(
        "update faults set
            e_m = $2, n_m = $3, u_m = $4, sigma_e_m = $5, sigma_n_m = $6, sigma_u_m = $7,
            covariance_en_m2 = $8, candidates = $9, version = $10, updated_at = $11, t_ns = $12
         where id = $1",
    )
    .bind(fault.id.to_string())
    .bind(e_m)
    .bind(n_m)
    .bind(u_m)
    .bind(sigma_e_m)
    .bind(sigma_n_m)
    .bind(sigma_u_m)
    .bind(fault.covariance_en_m2)
    .bind(candidates_of(fault)?)
    .bind(fault.version)
    .bind(utc::to_us(fault.updated_at))
    .bind(fault.t_ns)
    .execute(db)
    .await?;
    Ok(())
}

fn candidates_of(fault: &Fault) -> Result<String, StoreError> {
    serde_json::to_string(&fault.candidates).map_err(|error| StoreError::Damaged {
        what: format!("candidates of fault {}", fault.id),
        why: error.to_string(),
    })
}

/// Three nullable columns from one optional vector.
fn each(vector: Option<[f64; 3]>) -> [Option<f64>; 3] {
    match vector {
        Some(vector) => vector.map(Some),
        None => [None; 3],
    }
}
