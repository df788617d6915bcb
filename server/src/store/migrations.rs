//! The steps from an empty file to the database of this version, embedded.

use std::borrow::Cow;
use std::time::Duration;

use sqlx::migrate::{MigrateError, Migration, MigrationType, Migrator};
use sqlx::{AssertSqlSafe, SqlSafeStr};
#[cfg(not(feature = "cluster"))]
use sqlx::{Connection as _, Row as _};

use super::StoreError;
use super::codes::is_damage;
use super::dialect::Connection;
#[cfg(not(feature = "cluster"))]
use super::schema;

/// How often it is said that a step goes on.
const STILL_GOING_ON: Duration = Duration::from_secs(5);

/// Where the migrator keeps count of the steps.
#[cfg(not(feature = "cluster"))]
const COUNTED_IN: &str = "_sqlx_migrations";

/// Number, name and text of every step, in order. A new file in `migrations/` is a new line here; an
/// applied one is never edited (its checksum would no longer match).
#[cfg(not(feature = "cluster"))]
const STEPS: &[(i64, &str, &str)] = &[
    (1, "walks and findings", include_str!("../../../migrations/0001_walks_and_findings.sql")),
    (2, "visits in the stream", include_str!("../../../migrations/0002_visits_in_the_stream.sql")),
    (3, "filtered and smoothed", include_str!("../../../migrations/0003_filtered_and_smoothed.sql")),
    (4, "stands", include_str!("../../../migrations/0004_stands.sql")),
    (5, "session_reports", include_str!("../../../migrations/0005_session_reports.sql")),
    (6, "people and rights", include_str!("../../../migrations/0006_people_and_rights.sql")),
    (7, "marker history", include_str!("../../../migrations/0007_marker_history.sql")),
    (8, "session charts", include_str!("../../../migrations/0008_session_charts.sql")),
    (9, "fault life cycle", include_str!("../../../migrations/0009_fault_life_cycle.sql")),
    (10, "how logs are read", include_str!("../../../migrations/0010_how_logs_are_read.sql")),
    (11, "lab", include_str!("../../../migrations/0011_lab.sql")),
    (12, "webhooks and notes", include_str!("../../../migrations/0012_webhooks_and_notes.sql")),
    (14, "streams side by side", include_str!("../../../migrations/0014_streams_side_by_side.sql")),
    (
        15,
        "figures and site parameters",
        include_str!("../../../migrations/0015_figures_and_site_parameters.sql"),
    ),
    (16, "streams by stretches", include_str!("../../../migrations/0016_streams_by_stretches.sql")),
    (17, "live states", include_str!("../../../migrations/0017_live_states.sql")),
    (18, "streams and systems", include_str!("../../../migrations/0018_streams_and_systems.sql")),
    (19, "instruments", include_str!("../../../migrations/0019_instruments.sql")),
    (20, "pieces and checksums", include_str!("../../../migrations/0020_pieces_and_checksums.sql")),
    (21, "from gate to dock", include_str!("../../../migrations/0021_from_gate_to_dock.sql")),
    (22, "alarms", include_str!("../../../migrations/0022_alarms.sql")),
    (23, "raised alarms", include_str!("../../../migrations/0023_raised_alarms.sql")),
];

/// The same for PostgreSQL: the first brings all that the steps of SQLite up to its number make together.
#[cfg(feature = "cluster")]
const STEPS: &[(i64, &str, &str)] = &[
    (22, "all of it", include_str!("../../../migrations/postgres/0022_all_of_it.sql")),
    (23, "raised alarms", include_str!("../../../migrations/postgres/0023_raised_alarms.sql")),
];

/// The tables, each after those that it names: in the order in which the steps make them. But those that a file has not.
#[cfg(feature = "cluster")]
pub(super) fn tables() -> impl Iterator<Item = &'static str> {
    let made = STEPS.iter().flat_map(|(_, _, sql)| sql.lines());
    let made = made.filter_map(|line| line.strip_prefix("create table ")?.strip_suffix(" ("));
    made.filter(|name| !matches!(*name, "database_owner" | "upload_pieces"))
}

/// The version of the tables that this program reads and writes: the number of the last step.
pub const VERSION: i64 = STEPS[STEPS.len() - 1].0;

/// The version of a database.
pub async fn version(connection: &mut Connection) -> Result<i64, StoreError> {
    let query = sqlx::query_scalar("select coalesce(max(version), 0) from _sqlx_migrations where success");
    Ok(query.fetch_one(connection).await?)
}

/// Makes sure that a file of unknown origin is a database of Lodestep, of this version or an earlier one, and nothing besides;
/// its version. Of what came with the file nothing is run.
#[cfg(not(feature = "cluster"))]
pub(super) async fn check(db: &mut Connection) -> Result<i64, StoreError> {
    let found = schema::of(db).await?;
    let count = schema::has_as(&found, &made_up_to(0).await?, COUNTED_IN);
    if !count {
        return Err(StoreError::Open(match found.is_empty() {
            true => "it is empty".to_owned(),
            false => "it is not a database of Lodestep".to_owned(),
        }));
    }
    let version = steps_gone(db).await?;
    match schema::difference(&made_up_to(version).await?, &found) {
        None => Ok(version),
        Some(told) => Err(StoreError::Open(format!(
            "expected what step {version} of the database is made of and nothing else, found otherwise: {told}; put that right in a copy (what is not Lodestep's can be dropped there), or take another backup"
        ))),
    }
}

/// The last step that a database has gone; an error, where they are not the first ones of this program.
#[cfg(not(feature = "cluster"))]
async fn steps_gone(db: &mut Connection) -> Result<i64, StoreError> {
    let query = "select version, checksum, success from _sqlx_migrations order by version";
    let rows = sqlx::query(query).fetch_all(db).await?;
    let known = up_to(i64::MAX);
    let mut steps = known.iter();
    let mut last = 0;
    for row in &rows {
        let (version, checksum, success): (i64, Vec<u8>, bool) =
            (row.try_get(0)?, row.try_get(1)?, row.try_get(2)?);
        if version > VERSION {
            return Err(StoreError::Open(newer(rows.last().map_or(Ok(version), |row| row.try_get(0))?)));
        }
        match steps.next() {
            Some(step) if step.version == version && *step.checksum == *checksum && success => last = version,
            _ => return Err(StoreError::Open(different_build(version))),
        }
    }
    Ok(last)
}

/// What the steps up to this one make.
#[cfg(not(feature = "cluster"))]
async fn made_up_to(last: i64) -> Result<Vec<schema::Item>, StoreError> {
    let mut db = Connection::connect("sqlite::memory:").await?;
    up_to(last).run_direct(None, &mut db, false).await.map_err(told)?;
    schema::of(&mut db).await
}

/// Brings the database up to this version. A large one takes a minute: each step is told, and that it is still going on.
pub(super) async fn run(connection: &mut Connection) -> Result<(), StoreError> {
    // A new database has no table of steps yet.
    let from = version(&mut *connection).await.unwrap_or(0);
    if from > 0 {
        let steps: Vec<_> = STEPS.iter().filter(|(number, _, _)| *number > from).collect();
        for (done, (number, name, _)) in steps.iter().enumerate() {
            let (nth, of) = (done + 1, steps.len());
            tracing::info!("bringing the database up to this version: step {number}, {name} ({nth} of {of})");
            let step = up_to(*number);
            let running = step.run_direct(None, &mut *connection, false);
            said_while(running, &format!("step {number}, {name}")).await.map_err(told)?;
        }
    }
    up_to(i64::MAX).run_direct(None, connection, false).await.map_err(told)
}

/// Waits for something that may be long, and says every five seconds that it goes on.
async fn said_while<T>(running: impl Future<Output = T>, what: &str) -> T {
    let begun = tokio::time::Instant::now();
    let mut ticks = tokio::time::interval_at(begun + STILL_GOING_ON, STILL_GOING_ON);
    let mut running = std::pin::pin!(running);
    loop {
        tokio::select! {
            done = &mut running => return done,
            _ = ticks.tick() => {
                tracing::info!("still at {what}, for {} s; what is stored is kept", begun.elapsed().as_secs());
            }
        }
    }
}

fn told(error: MigrateError) -> StoreError {
    StoreError::Open(match error {
        MigrateError::Execute(error) | MigrateError::ExecuteMigration(error, _) if is_damage(&error) => {
            return error.into();
        }
        MigrateError::VersionMissing(version) if version > VERSION => newer(version),
        MigrateError::VersionMissing(version) | MigrateError::VersionMismatch(version) => {
            different_build(version)
        }
        other => format!("the database could not be brought up to this version: {other}"),
    })
}

fn newer(version: i64) -> String {
    format!(
        "the database was written by a newer Lodestep (it has step {version}, this one knows {VERSION}): use that version or a newer one, or restore an older backup"
    )
}

fn different_build(version: i64) -> String {
    format!(
        "step {version} of the database is not the one this Lodestep knows: it was made by a different build; use that one, or restore a backup of this one"
    )
}

/// The steps up to this one.
fn up_to(last: i64) -> Migrator {
    let steps = STEPS
        .iter()
        .filter(|(version, _, _)| *version <= last)
        .map(|&(version, name, sql)| {
            let sql = AssertSqlSafe(sql).into_sql_str();
            Migration::new(version, Cow::Borrowed(name), MigrationType::Simple, sql, false)
        })
        .collect();
    Migrator::with_migrations(steps)
}

#[cfg(test)]
#[cfg(not(feature = "cluster"))]
mod tests {
    use super::*;

    /// A database of before accounts of changes were kept: its markers and faults are all there after it.
    #[tokio::test]
    async fn what_an_older_database_holds_is_kept() {
        let mut db = Connection::connect("sqlite::memory:").await.unwrap();
        up_to(6).run_direct(None, &mut db, false).await.unwrap();
        for sql in [
            "insert into inspectors (id, name, created_at) values ('i', 'Li Na', 0)",
            "insert into markers (name, e_m, n_m, u_m, created_at, updated_at) values ('A17', 1, 2, null, 5, 5)",
            "update marker_revision set revision = 4",
            "insert into faults (id, inspector_id, reported_at, kind, severity, state, closed_at, created_at)
             values ('f1', 'i', 7, 'drainage', 'low', 'open', null, 8)",
            "insert into faults (id, inspector_id, reported_at, kind, severity, state, closed_at, created_at)
             values ('f2', 'i', 7, 'drainage', 'low', 'closed', 9, 8)",
        ] {
            sqlx::query(sql).execute(&mut db).await.unwrap();
        }
        run(&mut db).await.unwrap();
        let marker =
            sqlx::query("select version from markers where name = 'A17'").fetch_one(&mut db).await.unwrap();
        assert_eq!(marker.get::<i64, _>("version"), 4);
        let faults = sqlx::query("select state, closed_at, version, updated_at from faults order by id");
        let told: Vec<(String, Option<i64>, i64, i64)> = faults
            .fetch_all(&mut db)
            .await
            .unwrap()
            .iter()
            .map(|row| (row.get(0), row.get(1), row.get(2), row.get(3)))
            .collect();
        assert_eq!(told, [("open".into(), None, 1, 8), ("verified".into(), Some(9), 1, 9)]);
        assert!(sqlx::query("pragma foreign_key_check").fetch_all(&mut db).await.unwrap().is_empty());
    }
}
