//! The steps from an empty file to the database of this version, embedded.

use std::borrow::Cow;

use sqlx::migrate::{MigrateError, Migration, MigrationType, Migrator};
use sqlx::{AssertSqlSafe, SqlSafeStr, SqliteConnection};

use super::StoreError;

/// Number, name and text of every step, in order. A new file in `migrations/` is a new line here; an
/// applied one is never edited (its checksum would no longer match).
const STEPS: &[(i64, &str, &str)] = &[
    (1, "walks and findings", include_str!("../../../migrations/0001_walks_and_findings.sql")),
    (2, "visits in the stream", include_str!("../../../migrations/0002_visits_in_the_stream.sql")),
    (3, "filtered and smoothed", include_str!("../../../migrations/0003_filtered_and_smoothed.sql")),
    (4, "stands", include_str!("../../../migrations/0004_stands.sql")),
    (5, "session_reports", include_str!("../../../migrations/0005_session_reports.sql")),
    (6, "people and rights", include_str!("../../../migrations/0006_people_and_rights.sql")),
    (8, "session charts", include_str!("../../../migrations/0008_session_charts.sql")),
    (10, "how logs are read", include_str!("../../../migrations/0010_how_logs_are_read.sql")),
];

/// Brings the database up to this version.
pub(super) async fn run(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    let steps = STEPS
        .iter()
        .map(|&(version, name, sql)| {
            let sql = AssertSqlSafe(sql).into_sql_str();
            Migration::new(version, Cow::Borrowed(name), MigrationType::Simple, sql, false)
        })
        .collect();
    Migrator::with_migrations(steps).run_direct(None, connection, false).await.map_err(|error| {
        StoreError::Open(match error {
            MigrateError::VersionMissing(version) => format!(
                "the database was written by a newer Lodestep (it has step {version}, this one knows {}): start that version or a newer one, or restore a backup",
                STEPS.len()
            ),
            MigrateError::VersionMismatch(version) => format!(
                "step {version} of the database is not the one this Lodestep knows: it was made by a different build; start that one, or restore a backup"
            ),
            other => format!("the database could not be brought up to this version: {other}"),
        })
    })
}
