//! How walks went: one report a finished session.

use lodestep_engine::evaluate::SessionReport;
use sqlx::Row as _;
use uuid::Uuid;

use super::dialect::{Executor, Row};
use super::lab_runs::{Figures, Provenance};
use super::{StoreError, columns};

/// Puts a session's report in the place of the former one.
pub async fn set(
    db: impl Executor<'_>,
    session_id: Uuid,
    report: &SessionReport,
    (figures, provenance): (&Figures, &Provenance),
) -> Result<(), StoreError> {
    let report = serde_json::to_string(report)
        .map_err(|error| StoreError::NotCommitted(format!("the report could not be written: {error}")))?;
    sqlx::query(
        "insert into session_reports (session_id, report, figures, provenance) values ($1, $2, $3, $4)
         on conflict (session_id) do update set report = excluded.report, figures = excluded.figures,
            provenance = excluded.provenance",
    )
    .bind(session_id.to_string())
    .bind(report)
    .bind(columns::to_json(figures)?)
    .bind(columns::to_json(provenance)?)
    .execute(db)
    .await?;
    Ok(())
}

/// A session's report as JSON, if it has been processed.
pub async fn get(db: impl Executor<'_>, session_id: Uuid) -> Result<Option<String>, StoreError> {
    let query = sqlx::query_scalar("select report from session_reports where session_id = $1")
        .bind(session_id.to_string());
    Ok(query.fetch_optional(db).await?)
}

/// What a session's main run came to and where it comes from; `None` before its first processing, and for one from
/// before this was kept.
pub async fn figures(
    db: impl Executor<'_>,
    session_id: Uuid,
) -> Result<Option<(Figures, Provenance)>, StoreError> {
    let query = sqlx::query("select figures, provenance from session_reports where session_id = $1")
        .bind(session_id.to_string())
        .try_map(|row: Row| {
            let kept: Option<&str> = row.try_get("figures")?;
            kept.map(|_| Ok((columns::json(&row, "figures")?, columns::json(&row, "provenance")?)))
                .transpose()
        });
    Ok(query.fetch_optional(db).await?.flatten())
}
