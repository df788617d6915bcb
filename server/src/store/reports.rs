//! How walks went: one report a finished session.

use lodestep_engine::evaluate::SessionReport;
use sqlx::SqliteExecutor;
use uuid::Uuid;

use super::StoreError;

/// Puts a session's report in the place of the former one.
pub async fn set(
    db: impl SqliteExecutor<'_>,
    session_id: Uuid,
    report: &SessionReport,
) -> Result<(), StoreError> {
    let report = serde_json::to_string(report)
        .map_err(|error| StoreError::NotCommitted(format!("the report could not be written: {error}")))?;
    sqlx::query(
        "insert into session_reports (session_id, report) values (?1, ?2)
         on conflict (session_id) do update set report = excluded.report",
    )
    .bind(session_id.to_string())
    .bind(report)
    .execute(db)
    .await?;
    Ok(())
}

/// A session's report as JSON, if it has been processed.
pub async fn get(db: impl SqliteExecutor<'_>, session_id: Uuid) -> Result<Option<String>, StoreError> {
    let query = sqlx::query_scalar("select report from session_reports where session_id = ?1")
        .bind(session_id.to_string());
    Ok(query.fetch_optional(db).await?)
}
