//! Where inspectors were.

use futures_util::{Stream, TryStreamExt};
use lodestep_engine::event::{Part, Tilt, TrackPoint};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, Row as _};
use uuid::Uuid;

use super::checksum::Checksum;
use super::dialect::{Connection, Executor, Row};
use super::many_rows::{Statement, placeholder, placeholders, shaped, shapes};
use super::{StoreError, columns};

/// Which computation of a walk a track comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrackKind {
    /// With every aid that the data allow; smoothed, once the walk is finished.
    #[default]
    Main,
    /// The same as the filter told it, before smoothing.
    Filtered,
    /// The same walk with no visit used.
    WithoutMarkers,
}

impl TrackKind {
    /// `main`, `filtered` or `without_markers`, as tables and the wire spell it.
    pub const fn name(self) -> &'static str {
        match self {
            TrackKind::Main => "main",
            TrackKind::Filtered => "filtered",
            TrackKind::WithoutMarkers => "without_markers",
        }
    }
}

/// One of two places for the result of a session: while one is shown, a new result is written into the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// The one that a session begins with.
    #[default]
    First,
    /// The other.
    Second,
}

impl Place {
    /// What the names of its runs end with.
    const fn ending(self) -> &'static str {
        match self {
            Place::First => "",
            Place::Second => "~",
        }
    }

    /// The one that is not this.
    pub const fn other(self) -> Place {
        match self {
            Place::First => Place::Second,
            Place::Second => Place::First,
        }
    }

    /// The name of a run that lies here, as the table spells it.
    fn run(self, run: TrackKind) -> String {
        format!("{}{}", run.name(), self.ending())
    }
}

/// Which place of a session's is shown; the first of one that is not there.
pub async fn shown(db: impl Executor<'_>, session_id: Uuid) -> Result<Place, StoreError> {
    let query =
        sqlx::query_scalar("select shown_result from sessions where id = $1").bind(session_id.to_string());
    let ending: Option<String> = query.fetch_optional(db).await?;
    Ok(if ending.as_deref() == Some(Place::Second.ending()) { Place::Second } else { Place::First })
}

/// Shows what lies in this place from now on.
pub async fn show(db: impl Executor<'_>, session_id: Uuid, place: Place) -> Result<(), StoreError> {
    sqlx::query("update sessions set shown_result = $2 where id = $1")
        .bind(session_id.to_string())
        .bind(place.ending())
        .execute(db)
        .await?;
    Ok(())
}

/// The shown points of session `$1` and run `$2`, as a condition.
macro_rules! shown_run {
    () => {
        "session_id = $1 and run = $2 || coalesce((select shown_result from sessions where id = $1), '')"
    };
}

/// The columns of a point beside `session_id` and `run`, in the order in which they are bound.
const POINT_COLUMNS: [&str; 22] = [
    "t_ns",
    "e_m",
    "n_m",
    "u_m",
    "heading_rad",
    "sigma_heading_rad",
    "sigma_e_m",
    "sigma_n_m",
    "sigma_u_m",
    "covariance_en_m2",
    "part_0_e_m",
    "part_0_n_m",
    "part_0_u_m",
    "part_1_e_m",
    "part_1_n_m",
    "part_1_u_m",
    "part_0_stance",
    "part_1_stance",
    "roll_rad",
    "pitch_rad",
    "sigma_roll_rad",
    "sigma_pitch_rad",
];

/// Points in one statement. One statement a row costs seven times as much; more rows than this gain
/// nothing and come near the 32,766 parameters that SQLite allows.
const POINTS_PER_STATEMENT: usize = 500;

/// A point as `query_as` reads it.
struct Stored(TrackPoint);

/// Of the row of a point, `run` as the table spells it.
fn checksum(session_id: &str, run: &str, point: &TrackPoint) -> Checksum {
    let [first, second] = point.parts;
    let mut sum = Checksum::default().text(session_id).text(run).integer(point.t_ns);
    for value in point.position_n_m.into_iter().chain([point.heading_rad, point.sigma_heading_rad]) {
        sum = sum.real(Some(value));
    }
    for value in point.sigma_n_m.into_iter().chain([point.covariance_en_m2]) {
        sum = sum.real(Some(value));
    }
    for part in [first, second] {
        for axis in 0..3 {
            sum = sum.real(part.map(|part| part.position_n_m[axis]));
        }
        sum = sum.integer(part.map_or(-1, |part| i64::from(part.stance)));
    }
    let tilt = |value: fn(Tilt) -> f64| point.tilt.map(value);
    sum.real(tilt(|tilt| tilt.roll_rad))
        .real(tilt(|tilt| tilt.pitch_rad))
        .real(tilt(|tilt| f64::from(tilt.sigma_roll_rad)))
        .real(tilt(|tilt| f64::from(tilt.sigma_pitch_rad)))
}

impl FromRow<'_, Row> for Stored {
    fn from_row(row: &Row) -> sqlx::Result<Self> {
        checked(row).map(Stored).map_err(|damaged| sqlx::Error::Decode(Box::new(damaged)))
    }
}

/// Whether a row is as it was written.
pub(super) fn check(row: &Row) -> Result<(), StoreError> {
    checked(row).map(|_| ())
}

fn checked(row: &Row) -> Result<TrackPoint, StoreError> {
    let point = point_of(row)?;
    let (session_id, run): (&str, &str) = (row.try_get("session_id")?, row.try_get("run")?);
    let what =
        || format!("track of session {session_id} ({}, at {} ns)", run.trim_end_matches('~'), point.t_ns);
    // A bit in the row's head can make one column of two that are empty: all behind it move up, and none is left for the checksum,
    // as if the row were from before there were checksums. Then it stands in the last column.
    if point.tilt.is_none() && !matches!(row.try_get::<Option<f64>, _>("sigma_pitch_rad"), Ok(None)) {
        let why = "it has a sigma of the pitch and no pitch: the disk has changed it; everything else can be read. Bring it back from a backup";
        return Err(StoreError::Damaged { what: what(), why: why.to_owned() });
    }
    checksum(session_id, run, &point).agrees(row, what)?;
    Ok(point)
}

fn point_of(row: &Row) -> sqlx::Result<TrackPoint> {
    let part = |position: [&str; 3], stance: &str| -> sqlx::Result<Option<Part>> {
        let Some(position_n_m) = columns::optional_enu(row, position)? else { return Ok(None) };
        Ok(Some(Part { position_n_m, stance: row.try_get(stance)? }))
    };
    Ok(TrackPoint {
        t_ns: row.try_get("t_ns")?,
        position_n_m: columns::enu(row, ["e_m", "n_m", "u_m"])?,
        heading_rad: row.try_get("heading_rad")?,
        sigma_heading_rad: row.try_get("sigma_heading_rad")?,
        sigma_n_m: columns::enu(row, ["sigma_e_m", "sigma_n_m", "sigma_u_m"])?,
        covariance_en_m2: row.try_get("covariance_en_m2")?,
        tilt: tilt(row)?,
        parts: [
            part(["part_0_e_m", "part_0_n_m", "part_0_u_m"], "part_0_stance")?,
            part(["part_1_e_m", "part_1_n_m", "part_1_u_m"], "part_1_stance")?,
        ],
    })
}

/// Roll and pitch, where the system knows them.
fn tilt(row: &Row) -> sqlx::Result<Option<Tilt>> {
    let roll_rad: Option<f64> = row.try_get("roll_rad")?;
    let Some(roll_rad) = roll_rad else { return Ok(None) };
    let sigma = |column| -> sqlx::Result<f32> { Ok(row.try_get::<f64, _>(column)? as f32) };
    Ok(Some(Tilt {
        roll_rad,
        pitch_rad: row.try_get("pitch_rad")?,
        sigma_roll_rad: sigma("sigma_roll_rad")?,
        sigma_pitch_rad: sigma("sigma_pitch_rad")?,
    }))
}

/// A run's points by time, as they come from the disk: a long walk is never held whole.
pub fn points<'a>(
    db: impl Executor<'a> + 'a,
    session_id: Uuid,
    run: TrackKind,
) -> impl Stream<Item = Result<TrackPoint, StoreError>> + 'a {
    sqlx::query_as(concat!("select * from track_points where ", shown_run!(), " order by t_ns"))
        .bind(session_id.to_string())
        .bind(run.name())
        .fetch(db)
        .map_ok(|Stored(point)| point)
        .map_err(StoreError::from)
}

/// A run's points of a stretch of time, of each cell of a grid the first: the statement leaves the others out,
/// as reading a point costs more than passing over it. A time belongs to the cell that it reaches with `slack_ns`
/// more.
pub async fn thinned(
    db: impl Executor<'_>,
    session_id: Uuid,
    run: TrackKind,
    (from_ns, to_ns): (i64, i64),
    (cell_ns, slack_ns): (i64, i64),
) -> Result<Vec<TrackPoint>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select * from track_points where ",
        shown_run!(),
        " and t_ns in (select min(t_ns) from track_points where ",
        shown_run!(),
        " and t_ns >= $3 and t_ns <= $4 group by (t_ns + $6) / $5) order by t_ns"
    ))
    .bind(session_id.to_string())
    .bind(run.name())
    .bind(from_ns)
    .bind(to_ns)
    .bind(cell_ns)
    .bind(slack_ns);
    let rows: Vec<Stored> = query.fetch_all(db).await?;
    Ok(rows.into_iter().map(|Stored(point)| point).collect())
}

/// A run's newest points from `since_ns` on, by time.
pub async fn since(
    db: impl Executor<'_>,
    session_id: Uuid,
    run: TrackKind,
    since_ns: i64,
) -> Result<Vec<TrackPoint>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select * from track_points where ",
        shown_run!(),
        " and t_ns >= $3 order by t_ns"
    ))
    .bind(session_id.to_string())
    .bind(run.name())
    .bind(since_ns);
    let rows: Vec<Stored> = query.fetch_all(db).await?;
    Ok(rows.into_iter().map(|Stored(point)| point).collect())
}

/// A run's trail for the map: `(t_ns, e_m, n_m)` of the first point of each second, by time.
pub async fn trail(
    db: impl Executor<'_>,
    session_id: Uuid,
    run: TrackKind,
) -> Result<Vec<(i64, f64, f64)>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select * from track_points where ",
        shown_run!(),
        " and t_ns in (select min(t_ns) from track_points where ",
        shown_run!(),
        " group by t_ns / 1000000000) order by t_ns"
    ))
    .bind(session_id.to_string())
    .bind(run.name());
    let rows: Vec<Stored> = query.fetch_all(db).await?;
    let vertex = |Stored(point): Stored| (point.t_ns, point.position_n_m[0], point.position_n_m[1]);
    Ok(rows.into_iter().map(vertex).collect())
}

/// The main run's last point at or before `t_ns`.
pub async fn last_at(
    db: impl Executor<'_>,
    session_id: Uuid,
    t_ns: i64,
) -> Result<Option<TrackPoint>, StoreError> {
    let query = sqlx::query_as(concat!(
        "select * from track_points where ",
        shown_run!(),
        " and t_ns <= $3 order by t_ns desc limit 1"
    ))
    .bind(session_id.to_string())
    .bind(TrackKind::Main.name())
    .bind(t_ns);
    let row: Option<Stored> = query.fetch_optional(db).await?;
    Ok(row.map(|Stored(point)| point))
}

/// When the main run begins and ends, ns.
pub async fn span(db: impl Executor<'_>, session_id: Uuid) -> Result<Option<(i64, i64)>, StoreError> {
    let query = sqlx::query_as(concat!("select min(t_ns), max(t_ns) from track_points where ", shown_run!()))
        .bind(session_id.to_string())
        .bind(TrackKind::Main.name());
    let (first, last): (Option<i64>, Option<i64>) = query.fetch_one(db).await?;
    Ok(first.zip(last))
}

/// The main run's first point.
pub async fn first(db: impl Executor<'_>, session_id: Uuid) -> Result<Option<TrackPoint>, StoreError> {
    let query =
        sqlx::query_as(concat!("select * from track_points where ", shown_run!(), " order by t_ns limit 1"))
            .bind(session_id.to_string())
            .bind(TrackKind::Main.name());
    let row: Option<Stored> = query.fetch_optional(db).await?;
    Ok(row.map(|Stored(point)| point))
}

/// Adds points to a place, or puts them in the place of those of the same times.
pub async fn upsert(
    db: &mut Connection,
    session_id: Uuid,
    (run, place): (TrackKind, Place),
    points: &[TrackPoint],
) -> Result<(), StoreError> {
    let session_id = session_id.to_string();
    let points: Vec<_> = points.iter().map(|point| (session_id.as_str(), place, point)).collect();
    upsert_of(db, run, &points).await
}

/// The same of several sessions, each point with its session's id and place.
pub(super) async fn upsert_of(
    db: &mut Connection,
    run: TrackKind,
    points: &[(&str, Place, &TrackPoint)],
) -> Result<(), StoreError> {
    let runs = [Place::First, Place::Second].map(|place| place.run(run));
    for rows in shapes(points, POINTS_PER_STATEMENT) {
        let kept = POINT_COLUMNS[1..].iter().chain(&["checksum"]);
        let kept = kept.map(|c| format!("{c} = excluded.{c}")).collect::<Vec<_>>().join(", ");
        let sql = format!(
            "insert into track_points (session_id, run, {}, checksum) values {} on conflict (session_id, run, t_ns) do update set {kept}",
            POINT_COLUMNS.join(", "),
            placeholders(rows.len(), 3 + POINT_COLUMNS.len()),
        );
        let query = rows.iter().fold(shaped(sql), |query, (session_id, place, point)| {
            let run = &runs[usize::from(*place == Place::Second)];
            let sum = checksum(session_id, run, point).column();
            bind_point(query.bind((*session_id).to_owned()).bind(run.clone()), point).bind(sum)
        });
        query.execute(&mut *db).await?;
    }
    Ok(())
}

/// Corrects those of these points that are stored (a track keeps fewer points than there are epochs).
pub async fn revise(
    db: &mut Connection,
    session_id: Uuid,
    (run, place): (TrackKind, Place),
    points: &[TrackPoint],
) -> Result<(), StoreError> {
    let (session_id, run) = (session_id.to_string(), place.run(run));
    for rows in shapes(points, POINTS_PER_STATEMENT) {
        let columns = POINT_COLUMNS.join(", ");
        let kept = POINT_COLUMNS[1..].iter().chain(&["checksum"]);
        let kept = kept.map(|c| format!("{c} = revised.{c}")).collect::<Vec<_>>().join(", ");
        let sql = format!(
            "with revised ({columns}, checksum) as (values {})
             update track_points set {kept} from revised
             where track_points.session_id = {} and track_points.run = {} and track_points.t_ns = revised.t_ns",
            placeholders(rows.len(), 1 + POINT_COLUMNS.len()),
            placeholder(rows.len() * (1 + POINT_COLUMNS.len()) + 1),
            placeholder(rows.len() * (1 + POINT_COLUMNS.len()) + 2),
        );
        let query = rows.iter().fold(shaped(sql), |query, point| {
            bind_point(query, point).bind(checksum(&session_id, &run, point).column())
        });
        query.bind(session_id.clone()).bind(run.clone()).execute(&mut *db).await?;
    }
    Ok(())
}

#[cfg(not(feature = "cluster"))]
const CLEAR_SOME: &str = "delete from track_points where session_id = $1 and (run, t_ns) in (
    select run, t_ns from track_points where session_id = $1 and run in ($2, $3, $4) limit $5)";
/// By where the rows lie: joined by their keys, PostgreSQL may go through all of them for each.
#[cfg(feature = "cluster")]
const CLEAR_SOME: &str = "delete from track_points where ctid = any (array(
    select ctid from track_points where session_id = $1 and run in ($2, $3, $4) limit $5))";

/// Removes so many points of a place, of whatever run; whether there were any.
pub async fn clear_some(
    db: impl Executor<'_>,
    session_id: Uuid,
    place: Place,
    at_most: u32,
) -> Result<bool, StoreError> {
    let [main, filtered, without_markers] =
        [TrackKind::Main, TrackKind::Filtered, TrackKind::WithoutMarkers].map(|run| place.run(run));
    let query = sqlx::query(CLEAR_SOME)
        .bind(session_id.to_string())
        .bind(main)
        .bind(filtered)
        .bind(without_markers)
        .bind(i64::from(at_most));
    Ok(query.execute(db).await?.rows_affected() > 0)
}

fn bind_point(query: Statement, point: &TrackPoint) -> Statement {
    let [e, n, u] = point.position_n_m;
    let [sigma_e, sigma_n, sigma_u] = point.sigma_n_m;
    let mut query = query
        .bind(point.t_ns)
        .bind(e)
        .bind(n)
        .bind(u)
        .bind(point.heading_rad)
        .bind(point.sigma_heading_rad)
        .bind(sigma_e)
        .bind(sigma_n)
        .bind(sigma_u)
        .bind(point.covariance_en_m2);
    for part in point.parts {
        for axis in 0..3 {
            query = query.bind(part.map(|part| part.position_n_m[axis]));
        }
    }
    for part in point.parts {
        query = query.bind(part.map(|part| part.stance));
    }
    query
        .bind(point.tilt.map(|tilt| tilt.roll_rad))
        .bind(point.tilt.map(|tilt| tilt.pitch_rad))
        .bind(point.tilt.map(|tilt| f64::from(tilt.sigma_roll_rad)))
        .bind(point.tilt.map(|tilt| f64::from(tilt.sigma_pitch_rad)))
}
