//! Sessions.

use std::collections::BTreeMap;

use lodestep_engine::session::Summary;
use lodestep_engine::stream::{Stream, StreamId};
use lodestep_engine::system::Declaration;
use lodestep_engine::systems::catalogue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use time::OffsetDateTime;
use uuid::Uuid;

use super::dialect::{Connection, Executor, Row};
use super::many_rows::{placeholders, shaped, shapes};
use super::{StoreError, columns};
use crate::utc;

/// One walk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Session {
    /// Its id.
    pub id: Uuid,
    /// Who walks.
    pub inspector_id: Uuid,
    /// Free words; may be empty.
    #[schemars(example = &"Ring road, north")]
    pub title: String,
    /// How far it has come.
    pub state: SessionState,
    /// The instant of `t_ns` = 0.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub started_at: OffsetDateTime,
    /// The instant of its last point; `None` while it goes on.
    #[serde(with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    pub ended_at: Option<OffsetDateTime>,
    /// The system that computes it.
    #[serde(default = "usual_system")]
    #[schemars(example = &"pedestrian")]
    pub system: String,
    /// The streams of its readings, by number.
    #[serde(default)]
    #[schemars(with = "Vec<String>", example = ["left", "right"])]
    pub streams: Vec<StreamId>,
    /// The streams under the key of clients that know none.
    #[serde(flatten, skip_deserializing)]
    #[schemars(with = "BTreeMap<String, Vec<String>>")]
    pub former: BTreeMap<String, Vec<StreamId>>,
    /// Where it started.
    pub start: Start,
    /// Heading of the first sensor's x axis, clockwise from true north, degrees; `None`: from the magnetometer.
    pub initial_heading_deg: Option<f64>,
    /// What the instrument is like, TOML; `None` where its system takes none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = None::<String>)]
    pub instrument: Option<String>,
    /// Whether a stand that is nearly certain is taken for a visit.
    #[serde(default)]
    pub automatic_visits: bool,
    /// The choice of the site's parameters with which its stream is computed; `None`: the defaults.
    #[serde(default)]
    pub site_parameters_id: Option<i64>,
    /// Whether it is left out of the statistics of markers.
    #[serde(default)]
    pub excluded: bool,
    /// Samples processed, of all streams.
    pub samples: u64,
    /// Epochs the engine told.
    pub epochs: u64,
    /// From the first to the last point, s.
    pub duration_s: f64,
    /// Length of the path of the middle of the streams, m.
    pub distance_m: f64,
    /// Seconds since the last accepted visit, or since the start.
    pub since_marker_s: f64,
    /// Metres walked since then.
    pub since_marker_m: f64,
    /// Hash over every epoch of the main run, lower-case hex.
    #[schemars(example = crate::examples::SHA256)]
    pub track_sha256: Option<String>,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = None::<&str>)]
    pub error: Option<String>,
    /// When it was made.
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub created_at: OffsetDateTime,
}

/// Where a walk started.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "SessionStart")]
pub struct Start {
    /// The marker's name; `None` when coordinates were given.
    #[schemars(example = &"A17")]
    pub marker: Option<String>,
    /// Where its point stood, east-north-up, m; the site's origin stands for what is not known.
    pub position_m: [f64; 3],
    /// Whether somebody said so; otherwise it was anywhere on the site.
    #[serde(default)]
    pub known: bool,
}

/// How far a session has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SessionState {
    /// Nothing has come yet.
    Created,
    /// Logs are being handed in.
    Receiving,
    /// A device streams.
    Live,
    /// A job computes its track.
    Processing,
    /// Its track stands.
    Finished,
    /// Its track could not be computed; `error` says why.
    Failed,
}

impl Session {
    /// What its system declares of itself; that of the usual system where this program has none of that name.
    pub fn declaration(&self) -> &'static Declaration {
        catalogue::named(&self.system).unwrap_or_else(catalogue::usual)
    }

    /// Its streams, as the system declares them.
    pub fn declared_streams(&self) -> Vec<Stream> {
        let system = self.declaration();
        self.streams.iter().filter_map(|id| system.stream(*id)).collect()
    }

    /// The same with its streams under the key of clients that know none.
    pub(crate) fn with_former_keys(mut self) -> Session {
        if let Some(former) = self.declaration().former_keys {
            self.former.insert(former.streams.to_owned(), self.streams.clone());
        }
        self
    }
}

fn usual_system() -> String {
    catalogue::usual().name.to_owned()
}

impl FromRow<'_, Row> for Session {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        Ok(Session {
            id: columns::id(row, "id")?,
            inspector_id: columns::id(row, "carrier_id")?,
            title: row.try_get("title")?,
            state: columns::word(row, "state")?,
            started_at: columns::instant(row, "started_at")?,
            ended_at: columns::optional_instant(row, "ended_at")?,
            system: row.try_get("system")?,
            streams: columns::json(row, "stream_names")?,
            former: BTreeMap::new(),
            start: Start {
                marker: row.try_get("start_marker")?,
                position_m: columns::enu(row, ["start_e_m", "start_n_m", "start_u_m"])?,
                known: row.try_get("start_known")?,
            },
            initial_heading_deg: row.try_get("initial_heading_deg")?,
            instrument: row.try_get("instrument")?,
            automatic_visits: row.try_get("automatic_visits")?,
            site_parameters_id: row.try_get("site_parameters_id")?,
            excluded: row.try_get("excluded")?,
            samples: columns::count(row, "samples")?,
            epochs: columns::count(row, "epochs")?,
            duration_s: row.try_get("duration_s")?,
            distance_m: row.try_get("distance_m")?,
            since_marker_s: row.try_get("since_marker_s")?,
            since_marker_m: row.try_get("since_marker_m")?,
            track_sha256: row.try_get("track_sha256")?,
            error: row.try_get("error")?,
            created_at: columns::instant(row, "created_at")?,
        }
        .with_former_keys())
    }
}

/// The sessions that nobody has removed, each with the names of its streams; conditions follow.
macro_rules! session {
    () => {
        "select sessions.*, (select json_group_array(name) from (
            select name from streams where session_id = sessions.id order by number) as named) as stream_names
         from sessions where removed_at is null and "
    };
}

/// Which sessions to list; `None` asks for all.
#[derive(Clone, Copy, Debug, Default)]
pub struct Filter {
    /// Those of this inspector.
    pub inspector_id: Option<Uuid>,
    /// Those in this state.
    pub state: Option<SessionState>,
}

/// Those that pass the filter, newest first.
pub async fn list(db: impl Executor<'_>, filter: Filter) -> Result<Vec<Session>, StoreError> {
    let query = sqlx::query_as(concat!(
        session!(),
        "($1 is null or carrier_id = $1) and ($2 is null or state = $2)
              order by started_at desc, id desc"
    ))
    .bind(filter.inspector_id.map(|id| id.to_string()))
    .bind(filter.state.map(columns::to_word));
    Ok(query.fetch_all(db).await?)
}

/// At most `limit` of those that pass the filter, newest first, from the one after `before` on (its start, µs, and its id).
pub async fn page(
    db: impl Executor<'_>,
    filter: Filter,
    before: Option<(i64, Uuid)>,
    limit: u32,
) -> Result<Vec<Session>, StoreError> {
    let query = sqlx::query_as(concat!(
        session!(),
        "($1 is null or carrier_id = $1) and ($2 is null or state = $2)
            and ($3 is null or (started_at, id) < ($3, $4))
            order by started_at desc, id desc limit $5"
    ))
    .bind(filter.inspector_id.map(|id| id.to_string()))
    .bind(filter.state.map(columns::to_word))
    .bind(before.map(|(started_us, _)| started_us))
    .bind(before.map(|(_, id)| id.to_string()))
    .bind(i64::from(limit));
    Ok(query.fetch_all(db).await?)
}

/// The one with this id.
pub async fn get(db: impl Executor<'_>, id: Uuid) -> Result<Option<Session>, StoreError> {
    let query = sqlx::query_as(concat!(session!(), "id = $1")).bind(id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// The inspector's session that had begun last at this instant.
pub async fn of_inspector_at(
    db: impl Executor<'_>,
    inspector_id: Uuid,
    at: OffsetDateTime,
) -> Result<Option<Session>, StoreError> {
    let query = sqlx::query_as(concat!(
        session!(),
        "carrier_id = $1 and started_at <= $2 order by started_at desc, id desc limit 1"
    ))
    .bind(inspector_id.to_string())
    .bind(utc::to_us(at));
    Ok(query.fetch_optional(db).await?)
}

/// Those that had begun at this instant, at most `longest` before it, and had not ended yet, the oldest first.
pub async fn under_way(
    db: impl Executor<'_>,
    at: OffsetDateTime,
    longest: time::Duration,
) -> Result<Vec<Session>, StoreError> {
    let query = sqlx::query_as(concat!(
        session!(),
        "started_at between $1 and $2 and state <> 'created' and coalesce(ended_at, $2) >= $2 order by started_at, id"
    ))
    .bind(utc::to_us(at - longest))
    .bind(utc::to_us(at));
    Ok(query.fetch_all(db).await?)
}

/// Adds one.
pub async fn insert(db: &mut Connection, session: &Session) -> Result<(), StoreError> {
    sqlx::query(
        "insert into sessions (
            id, carrier_id, title, state, started_at, ended_at, system,
            start_marker, start_e_m, start_n_m, start_u_m, initial_heading_deg, created_at, automatic_visits,
            site_parameters_id, instrument, start_known
         ) values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17)",
    )
    .bind(session.id.to_string())
    .bind(session.inspector_id.to_string())
    .bind(&session.title)
    .bind(columns::to_word(session.state))
    .bind(utc::to_us(session.started_at))
    .bind(session.ended_at.map(utc::to_us))
    .bind(&session.system)
    .bind(&session.start.marker)
    .bind(session.start.position_m[0])
    .bind(session.start.position_m[1])
    .bind(session.start.position_m[2])
    .bind(session.initial_heading_deg)
    .bind(utc::to_us(session.created_at))
    .bind(session.automatic_visits)
    .bind(session.site_parameters_id)
    .bind(&session.instrument)
    .bind(session.start.known)
    .execute(&mut *db)
    .await?;
    for stream in session.declared_streams() {
        sqlx::query("insert into streams (session_id, number, name, role, kind) values ($1, $2, $3, $4, $5)")
            .bind(session.id.to_string())
            .bind(i64::from(stream.number))
            .bind(stream.id.name().to_owned())
            .bind(stream.role)
            .bind(stream.kind.word())
            .execute(&mut *db)
            .await?;
    }
    Ok(())
}

/// Switches automatic mode.
pub async fn set_automatic_visits(
    db: impl Executor<'_>,
    id: Uuid,
    automatic: bool,
) -> Result<(), StoreError> {
    sqlx::query("update sessions set automatic_visits = $2 where id = $1")
        .bind(id.to_string())
        .bind(automatic)
        .execute(db)
        .await?;
    Ok(())
}

/// Notes what people may change of one: whose it is, its title and start, and whether it counts in statistics.
pub async fn update(db: impl Executor<'_>, session: &Session) -> Result<(), StoreError> {
    sqlx::query(
        "update sessions set carrier_id = $2, title = $3, start_marker = $4, start_e_m = $5, start_n_m = $6,
            start_u_m = $7, excluded = $8, start_known = $9
         where id = $1",
    )
    .bind(session.id.to_string())
    .bind(session.inspector_id.to_string())
    .bind(&session.title)
    .bind(&session.start.marker)
    .bind(session.start.position_m[0])
    .bind(session.start.position_m[1])
    .bind(session.start.position_m[2])
    .bind(session.excluded)
    .bind(session.start.known)
    .execute(db)
    .await?;
    Ok(())
}

/// Moves one on; `error` says why, with `Failed`, and is taken away otherwise.
pub async fn set_state(
    db: impl Executor<'_>,
    id: Uuid,
    state: SessionState,
    error: Option<&str>,
) -> Result<(), StoreError> {
    sqlx::query("update sessions set state = $2, error = $3 where id = $1")
        .bind(id.to_string())
        .bind(columns::to_word(state))
        .bind(error)
        .execute(db)
        .await?;
    Ok(())
}

/// Notes what it amounts to so far.
pub async fn set_summary(db: &mut Connection, id: Uuid, summary: &Summary) -> Result<(), StoreError> {
    set_summaries(db, &[(&id.to_string(), summary)]).await
}

/// The same of several, by their ids.
pub(super) async fn set_summaries(
    db: &mut Connection,
    summaries: &[(&str, &Summary)],
) -> Result<(), StoreError> {
    for rows in shapes(summaries, 64) {
        let sql = format!(
            "with told (id, samples, epochs, duration_s, distance_m, since_marker_s, since_marker_m) as (values {})
             update sessions set samples = told.samples, epochs = told.epochs, duration_s = told.duration_s,
                distance_m = told.distance_m, since_marker_s = told.since_marker_s,
                since_marker_m = told.since_marker_m
             from told where sessions.id = told.id",
            placeholders(rows.len(), 7)
        );
        let query = rows.iter().fold(shaped(sql), |query, (id, summary)| {
            query
                .bind((*id).to_owned())
                .bind(columns::to_column(summary.samples))
                .bind(columns::to_column(summary.epochs))
                .bind(summary.duration_s)
                .bind(summary.distance_m)
                .bind(summary.since_marker_s)
                .bind(summary.since_marker_m)
        });
        query.execute(&mut *db).await?;
    }
    Ok(())
}

/// Closes one whose track stands: state `finished`, its end and the hash of its track.
pub async fn finish(
    db: impl Executor<'_>,
    id: Uuid,
    ended_at: OffsetDateTime,
    track_sha256: &str,
) -> Result<(), StoreError> {
    sqlx::query(
        "update sessions set state = 'finished', error = null, ended_at = $2, track_sha256 = $3 where id = $1",
    )
    .bind(id.to_string())
    .bind(utc::to_us(ended_at))
    .bind(track_sha256)
    .execute(db)
    .await?;
    Ok(())
}

/// Removes one with everything that hangs on it; `false` when there is none with this id.
pub async fn delete(db: impl Executor<'_>, id: Uuid) -> Result<bool, StoreError> {
    let query = sqlx::query("delete from sessions where id = $1").bind(id.to_string());
    Ok(query.execute(db).await?.rows_affected() > 0)
}
