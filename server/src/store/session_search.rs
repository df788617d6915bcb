//! Walks that are looked for: by who, when, how they came, how they went, what was said of them; a page at a time.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{AssertSqlSafe, FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Pool, Row, like};
use super::sessions::{Session, SessionState};
use super::{StoreError, columns, stream_chunks};
use crate::utc;

/// An end as far as this from the start is large, m: what paper 1 takes for a failure at a marker.
pub const LARGE_CLOSURE_M: f64 = 11.0;
/// Only a walk that was meant to be closed has a closure: one whose end is this near to its start, in percent of its path.
pub const CLOSED_PERCENT: f64 = 5.0;

/// What is looked for; what is `None` does not narrow it.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// Words in the title, the note or the inspector's name, or the beginning of the id.
    pub text: Option<String>,
    /// Whose.
    pub inspector_id: Option<Uuid>,
    /// In which state.
    pub state: Option<SessionState>,
    /// Begun at this instant or later.
    pub from: Option<OffsetDateTime>,
    /// Begun before this instant.
    pub to: Option<OffsetDateTime>,
    /// How it came.
    pub mode: Option<Mode>,
    /// What all of them have.
    pub flags: Vec<Flag>,
    /// In which order.
    pub sort: Sort,
    /// The smallest, the oldest first.
    pub ascending: bool,
    /// At most so many.
    pub limit: u32,
    /// Not the first so many.
    pub offset: u32,
}

/// How a walk came, and how its visits are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SessionMode")]
pub enum Mode {
    /// As files at the dock.
    Log,
    /// Live.
    Stream,
    /// Stands that are nearly certain are taken for visits.
    Automatic,
}

/// What a walk may have that is worth a look.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Flag {
    /// Its end is far from its start, though it was meant to be closed.
    Closure,
    /// A marker was turned down.
    Rejected,
    /// Something was wrong with its samples.
    Anomalies,
    /// Samples are missing.
    Gap,
    /// Somebody marked it.
    Starred,
    /// Somebody wrote a note.
    Noted,
}

/// By what walks are ordered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SessionOrder")]
pub enum Sort {
    /// When they began.
    #[default]
    Started,
    /// How far they went.
    Distance,
    /// How long they took.
    Duration,
    /// How far the end is from the start.
    Closure,
    /// How much is stored.
    Stored,
    /// By name.
    Inspector,
}

impl Sort {
    fn column(self) -> &'static str {
        match self {
            Sort::Started => "started_at",
            Sort::Distance => "distance_m",
            Sort::Duration => "duration_s",
            Sort::Closure => "closure_m",
            Sort::Stored => "stored_bytes",
            Sort::Inspector => "inspector",
        }
    }
}

impl Flag {
    fn condition(self) -> &'static str {
        match self {
            Flag::Closure => "closure_is_large",
            Flag::Rejected => "rejected_visits > 0",
            Flag::Anomalies => "anomalies > 0",
            Flag::Gap => "gaps > 0",
            Flag::Starred => "starred",
            Flag::Noted => "note <> ''",
        }
    }
}

/// A walk that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "FoundSession")]
pub struct Found {
    /// The walk itself.
    #[serde(flatten)]
    pub session: Session,
    /// Who walked.
    #[schemars(example = &"Li Na")]
    pub inspector: String,
    /// Whether its samples came as files.
    pub from_log: bool,
    /// Visits that were turned down.
    pub rejected_visits: u64,
    /// What was found wrong with its samples.
    pub anomalies: u64,
    /// Of these the gaps.
    pub gaps: u64,
    /// End against start in plan, m.
    pub closure_m: Option<f64>,
    /// Whether that is large, though the walk was meant to be closed.
    pub closure_is_large: bool,
    /// Its samples, packed, in bytes; counted when they were accepted or the walk was finished.
    pub stored_bytes: u64,
    /// Whether somebody marked it.
    pub starred: bool,
    /// What somebody wrote of it; may be empty.
    #[schemars(example = &"repeat this one")]
    pub note: String,
    /// Who marked it or wrote that.
    #[schemars(example = &"li wei")]
    pub noted_by: Option<String>,
    /// When.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub noted_at: Option<OffsetDateTime>,
}

impl FromRow<'_, Row> for Found {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Found {
            session: Session::from_row(row)?,
            inspector: row.try_get("inspector")?,
            from_log: row.try_get("from_log")?,
            rejected_visits: columns::count(row, "rejected_visits")?,
            anomalies: columns::count(row, "anomalies")?,
            gaps: columns::count(row, "gaps")?,
            closure_m: row.try_get("closure_m")?,
            closure_is_large: row.try_get("closure_is_large")?,
            stored_bytes: columns::count(row, "stored_bytes")?,
            starred: row.try_get("starred")?,
            note: row.try_get("note")?,
            noted_by: row.try_get("noted_by")?,
            noted_at: columns::optional_instant(row, "noted_at")?,
        })
    }
}

/// A page of walks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "SessionPage")]
pub struct Page {
    /// How many there are, on all pages.
    pub total: u64,
    /// What is stored of all of these, in bytes.
    pub stored_bytes: u64,
    /// Those of this page.
    pub sessions: Vec<Found>,
}

/// Every walk with what it may be looked for by.
const ALL: &str = "
    with weighed as (
        select s.*, i.name as inspector,
            (select json_group_array(name) from (
                select name from streams where session_id = s.id order by number) as named) as stream_names,
            exists (select 1 from logs l where l.session_id = s.id and l.state = 'accepted') as from_log,
            (select count(*) from visits v where v.session_id = s.id and not v.accepted) as rejected_visits,
            (select cast(coalesce(sum(times), 0) as bigint) from anomalies a where a.session_id = s.id) as anomalies,
            (select cast(coalesce(sum(times), 0) as bigint) from anomalies a
                where a.session_id = s.id and a.kind = 'gap') as gaps,
            json_extract(r.report, '$.closure.end_error_m') as closure_m,
            json_extract(r.report, '$.closure.end_error_percent') as closure_percent
        from sessions s join carriers i on i.id = s.carrier_id
            left join session_reports r on r.session_id = s.id
        where s.removed_at is null
    ), found as (
        select *, coalesce(closure_m > $6 and closure_percent < $7, false) as closure_is_large from weighed
    )";

/// Those that are wanted.
pub async fn page(db: &Pool, wanted: &Wanted) -> Result<Page, StoreError> {
    let mut conditions = vec![
        "($1 is null or carrier_id = $1)",
        "($2 is null or state = $2)",
        "($3 is null or started_at >= $3)",
        "($4 is null or started_at < $4)",
        concat!(
            "($5 is null or title ",
            like!(),
            " $5 escape '\\' or note ",
            like!(),
            " $5 escape '\\' or inspector ",
            like!(),
            " $5 escape '\\' or id ",
            like!(),
            " substr($5, 2) escape '\\')"
        ),
    ];
    conditions.extend(wanted.mode.map(|mode| match mode {
        Mode::Log => "from_log",
        Mode::Stream => "not from_log and samples > 0",
        Mode::Automatic => "automatic_visits",
    }));
    conditions.extend(wanted.flags.iter().map(|flag| flag.condition()));
    let conditions = conditions.join(" and ");
    let direction = if wanted.ascending { "asc" } else { "desc" };
    let column = wanted.sort.column();
    // Safe: put together of this file's own words.
    let count = AssertSqlSafe(format!(
        "{ALL} select count(*) as total, cast(coalesce(sum(stored_bytes), 0) as bigint) as stored_bytes from found where {conditions}"
    ));
    let rows = AssertSqlSafe(format!(
        "{ALL} select * from found where {conditions}
         order by {column} is null, {column} {direction}, started_at desc, id desc limit $8 offset $9"
    ));
    let text = wanted
        .text
        .as_deref()
        .map(|text| format!("%{}%", text.replace('\\', "\\\\").replace('%', "\\%").replace('_', "\\_")));
    let counted = sqlx::query(count)
        .bind(wanted.inspector_id.map(|id| id.to_string()))
        .bind(wanted.state.map(columns::to_word))
        .bind(wanted.from.map(utc::to_us))
        .bind(wanted.to.map(utc::to_us))
        .bind(&text)
        .bind(LARGE_CLOSURE_M)
        .bind(CLOSED_PERCENT)
        .fetch_one(db)
        .await?;
    let sessions = sqlx::query_as(rows)
        .bind(wanted.inspector_id.map(|id| id.to_string()))
        .bind(wanted.state.map(columns::to_word))
        .bind(wanted.from.map(utc::to_us))
        .bind(wanted.to.map(utc::to_us))
        .bind(&text)
        .bind(LARGE_CLOSURE_M)
        .bind(CLOSED_PERCENT)
        .bind(i64::from(wanted.limit))
        .bind(i64::from(wanted.offset))
        .fetch_all(db)
        .await?;
    Ok(Page {
        total: columns::count(&counted, "total")?,
        stored_bytes: columns::count(&counted, "stored_bytes")?,
        sessions,
    })
}

/// What was said of a walk.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "SessionNote")]
pub struct Note {
    /// Whether it is marked.
    pub starred: bool,
    /// A short text; may be empty.
    #[serde(default)]
    #[schemars(example = &"repeat this one")]
    pub note: String,
}

/// What was said of this one; `None` when there is none with this id.
pub async fn note(db: impl Executor<'_>, id: Uuid) -> Result<Option<Note>, StoreError> {
    let query = sqlx::query("select starred, note from sessions where id = $1")
        .bind(id.to_string())
        .try_map(|row: Row| Ok(Note { starred: row.try_get("starred")?, note: row.try_get("note")? }));
    Ok(query.fetch_optional(db).await?)
}

/// Notes what somebody says of one.
pub async fn set_note(
    db: impl Executor<'_>,
    id: Uuid,
    note: &Note,
    (by, at): (&str, OffsetDateTime),
) -> Result<(), StoreError> {
    sqlx::query("update sessions set starred = $2, note = $3, noted_by = $4, noted_at = $5 where id = $1")
        .bind(id.to_string())
        .bind(note.starred)
        .bind(&note.note)
        .bind(by)
        .bind(utc::to_us(at))
        .execute(db)
        .await?;
    Ok(())
}

/// Counts anew what is stored of a walk's samples.
pub async fn count_stored(db: &mut Connection, id: Uuid) -> Result<(), StoreError> {
    let streamed_bytes = stream_chunks::bytes(db, id).await?;
    sqlx::query(
        "update sessions set stored_bytes = $2
            + (select coalesce(sum(length(body)), 0) from raw_chunks
               where log_id in (select l.id from logs l where l.session_id = $1 and l.state = 'accepted'))
         where id = $1",
    )
    .bind(id.to_string())
    .bind(streamed_bytes)
    .execute(db)
    .await?;
    Ok(())
}
