//! A file of markers on its way: compared with the table, looked at, applied against the very table that it
//! was compared with, and taken back where it was wrong.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use axum::http::StatusCode;
use lodestep_engine::parse::any_table;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::difference::Difference;
use super::edit::checked_reason;
use super::finding::Level;
use super::mapping::Mapping;
use super::plan::{Plan, plan};
use super::staged;
use super::write::{Cause, MarkerEdit};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::dialect::Connection;
use crate::store::marker_changes::MarkerChange;
use crate::store::marker_imports::{ImportState, MarkerImport};
use crate::store::markers::{self, Marker};
use crate::store::{StoreError, marker_changes, marker_imports};
use crate::utc;
use crate::wire::Change;

/// What was compared and not applied is forgotten after this time.
const FORGOTTEN_AFTER: Duration = Duration::from_hours(7 * 24);
/// Letters in a file's name.
const FILE_NAME_LENGTH: usize = 200;
/// Markers that are named in a refusal.
const NAMED: usize = 20;

/// A file with what it would do, or did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "MarkerImportView")]
pub(crate) struct ImportView {
    /// The file.
    #[serde(flatten)]
    pub(crate) import: MarkerImport,
    /// What it would do.
    #[serde(flatten)]
    pub(crate) plan: Plan,
}

/// How a file is to be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "MarkerImportReading")]
pub(crate) struct ReadOptions {
    /// Which column is what; guessed where it is left out.
    pub(crate) mapping: Option<Mapping>,
    /// Whether markers that the file does not name are removed.
    #[serde(default)]
    pub(crate) whole_table: bool,
}

/// The go-ahead to apply a file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ApplyMarkerImport")]
pub(crate) struct Apply {
    /// Why.
    #[schemars(example = &"survey of November")]
    pub(crate) reason: Option<String>,
    /// Whether the warnings were seen.
    #[serde(default)]
    pub(crate) accept_warnings: bool,
}

/// The go-ahead to take a file back.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "RevertMarkerImport")]
pub(crate) struct Revert {
    /// Why.
    #[schemars(example = &"the wrong file")]
    pub(crate) reason: Option<String>,
    /// Whether markers that were changed since stay as they are now.
    #[serde(default)]
    pub(crate) skip_changed: bool,
}

/// Takes a file in, compares it and stores the plan; the table stays as it is.
pub(crate) async fn create(
    app: &App,
    caller: Caller,
    file_name: Option<String>,
    file: Vec<u8>,
) -> Result<ImportView> {
    let file_name =
        file_name.map(|name| name.chars().filter(|c| !c.is_control()).take(FILE_NAME_LENGTH).collect());
    let now = utc::now();
    let (plan, mut import) = compare(app, &file, ReadOptions::default()).await?;
    (import.file_name, import.created_at, import.created_by) = (file_name, now, Some(caller.who));
    let (row, text) = (import.clone(), to_json(&plan)?);
    let forgotten = now - FORGOTTEN_AFTER;
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                marker_imports::delete_forgotten(&mut *db, forgotten).await?;
                marker_imports::insert(&mut *db, &row, &file, &text).await
            })
        })
        .await?;
    Ok(ImportView { import, plan })
}

/// Reads a file once more, by another mapping or against the table as it is now.
pub(crate) async fn read_again(app: &App, id: Uuid, reading: ReadOptions) -> Result<ImportView> {
    let db = app.store.read();
    let known = find(app, id).await?;
    expect(&known, ImportState::Compared)?;
    let (plan, compared) = compare(app, &marker_imports::file(db, id).await?, reading).await?;
    let import = MarkerImport {
        whole_table: compared.whole_table,
        counts: compared.counts,
        compared_revision: compared.compared_revision,
        ..known
    };
    let (row, text) = (import.clone(), to_json(&plan)?);
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                expect(&standing(&mut *db, id).await?, ImportState::Compared)?;
                marker_imports::set_plan(&mut *db, &row, &text).await?;
                Ok::<_, Error>(())
            })
        })
        .await?;
    Ok(ImportView { import, plan })
}

/// A file with its plan.
pub(crate) async fn view(app: &App, id: Uuid) -> Result<ImportView> {
    let import = find(app, id).await?;
    let plan = from_json(id, &marker_imports::plan(app.store.read(), id).await?)?;
    Ok(ImportView { import, plan })
}

/// Gives a file up that was not applied.
pub(crate) async fn give_up(app: &App, id: Uuid) -> Result<()> {
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                expect(&standing(&mut *db, id).await?, ImportState::Compared)?;
                marker_imports::delete_compared(&mut *db, id).await?;
                Ok::<_, Error>(())
            })
        })
        .await
}

/// Makes the file's difference, at once for every reader, against the table that it was compared with.
pub(crate) async fn apply(app: &App, caller: Caller, id: Uuid, asked: Apply) -> Result<MarkerImport> {
    let reason = checked_reason(asked.reason.as_deref())?;
    let _turn = app.import_turns.lock().await;
    let import = find(app, id).await?;
    expect(&import, ImportState::Compared)?;
    let plan: Plan = from_json(id, &marker_imports::plan(app.store.read(), id).await?)?;
    check(&plan, asked.accept_warnings)?;
    let steps: Vec<MarkerEdit> = plan.differences.into_iter().map(|difference| difference.step).collect();
    make(app, import.compared_revision, steps, Cause { caller, reason, import: Some((id, false)) }).await
}

/// Makes the steps of a file, or those that take it back, for a table in this revision; what is left of them when that is not to be
/// goes again.
pub(super) async fn make(
    app: &App,
    compared: i64,
    steps: Vec<MarkerEdit>,
    cause: Cause,
) -> Result<MarkerImport> {
    let Some((id, is_revert)) = cause.import else {
        return Err(Error::Internal(anyhow::anyhow!("steps of no file")));
    };
    staged::expect_revision(&mut *app.store.read().acquire().await.map_err(StoreError::from)?, compared)
        .await?;
    staged::stage(app, &steps, &cause, compared).await?;
    let made = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let mut import = standing(&mut *db, id).await?;
                expect(&import, if is_revert { ImportState::Applied } else { ImportState::Compared })?;
                staged::expect_revision(&mut *db, compared).await?;
                let revision = staged::make(&mut *db, steps.len(), &cause).await?;
                let (now, who) = (Some(utc::now()), Some(cause.caller.who));
                if is_revert {
                    (import.state, import.reverted_revision) = (ImportState::Reverted, revision);
                    (import.reverted_at, import.reverted_by) = (now, who);
                } else {
                    (import.state, import.applied_revision) = (ImportState::Applied, revision);
                    (import.applied_at, import.applied_by, import.reason) = (now, who, cause.reason);
                }
                marker_imports::set_state(&mut *db, &import).await?;
                Ok::<_, Error>((import, revision))
            })
        })
        .await;
    let (import, revision) = match made {
        Ok(made) => made,
        Err(error) => {
            staged::clear(app, id, is_revert).await?;
            return Err(error);
        }
    };
    if let Some(revision) = revision {
        app.hub.publish(Change::Markers { revision });
    }
    Ok(import)
}

/// Refuses a file with errors, and one with warnings of which nobody has said that they were seen.
fn check(plan: &Plan, accept_warnings: bool) -> Result<()> {
    if plan.findings.has(Level::Error) {
        return Err(Error::conflict(
            "import_has_errors",
            "expected a file without errors, found some: look at its findings, correct the file or the columns, and send it again",
        ));
    }
    if plan.findings.has(Level::Warning) && !accept_warnings {
        let codes: Vec<_> = plan.findings.finding_counts.keys().map(String::as_str).collect();
        return Err(Error::conflict(
            "warnings_not_accepted",
            format!(
                "expected accept_warnings, for the file has warnings ({}), found none: look at its findings first",
                codes.join(", ")
            ),
        ));
    }
    Ok(())
}

/// Takes back what a file changed, exactly: each marker becomes what it was, unless somebody has changed it
/// since, which is told.
pub(crate) async fn revert(app: &App, caller: Caller, id: Uuid, asked: Revert) -> Result<MarkerImport> {
    let reason = checked_reason(asked.reason.as_deref())?;
    let _turn = app.import_turns.lock().await;
    let db = app.store.read();
    expect(&find(app, id).await?, ImportState::Applied)?;
    // The revision first: a change in between is seen at the end.
    let revision = markers::revision(db).await?;
    let made = marker_changes::of_import(db, id).await?;
    let now: HashMap<String, Marker> =
        markers::list(db).await?.into_iter().map(|marker| (marker.name.clone(), marker)).collect();
    let (back, changed): (Vec<_>, Vec<_>) =
        made.into_iter().partition(|change| now.get(&change.marker).map(Marker::place) == change.after);
    if !changed.is_empty() && !asked.skip_changed {
        return Err(changed_since(&changed, &now));
    }
    let steps: Vec<MarkerEdit> = back
        .into_iter()
        .map(|MarkerChange { marker, before, after, .. }| MarkerEdit {
            name: marker,
            before: after,
            after: before,
        })
        .collect();
    make(app, revision, steps, Cause { caller, reason, import: Some((id, true)) }).await
}

/// What stands in the way of a revert.
fn changed_since(changed: &[MarkerChange], now: &HashMap<String, Marker>) -> Error {
    let names: Vec<&str> = changed.iter().take(NAMED).map(|change| change.marker.as_str()).collect();
    let current: Vec<_> = changed
        .iter()
        .take(NAMED)
        .map(|change| serde_json::json!({ "name": change.marker, "made": change.after, "now": now.get(&change.marker) }))
        .collect();
    Error::changed(
        StatusCode::CONFLICT,
        "changed_since",
        format!(
            "expected the markers as the file made them, found {} changed since ({}): send skip_changed:true to leave those as they are now and take the others back",
            changed.len(),
            names.join(", ")
        ),
        current,
    )
}

/// Takes a file that was read as it has to be and applies it at once: the way of programs that send no more
/// than the file.
pub(super) async fn apply_at_once(
    app: &App,
    caller: Caller,
    file: Vec<u8>,
    plan: Plan,
    import: MarkerImport,
) -> Result<MarkerImport> {
    let (id, compared) = (import.id, import.compared_revision);
    let import = MarkerImport { created_by: Some(caller.who.clone()), ..import };
    let text = to_json(&plan)?;
    // The row comes first, for the history names it.
    let insert = app
        .store
        .writer()
        .run(move |db| Box::pin(async move { marker_imports::insert(db, &import, &file, &text).await }));
    insert.await?;
    let steps: Vec<MarkerEdit> = plan.differences.into_iter().map(|Difference { step, .. }| step).collect();
    let cause = Cause { caller, reason: String::new(), import: Some((id, false)) };
    let made = make(app, compared, steps, cause).await;
    if made.is_err() {
        // Nobody has been told of it.
        let gone = app
            .store
            .writer()
            .run(move |db| Box::pin(async move { marker_imports::delete_compared(db, id).await }));
        gone.await?;
    }
    made
}

/// The plan of a file against the table as it is, on a thread for such work, with a row that says so.
async fn compare(app: &App, file: &[u8], reading: ReadOptions) -> Result<(Plan, MarkerImport)> {
    let table = any_table::read(file)?;
    if let Some(mapping) = reading.mapping
        && !mapping.fits(table.columns.len())
    {
        return Err(Error::invalid(
            "wrong_mapping",
            format!(
                "expected every column once and by a number from 0 to {}, found {mapping:?}: correct the mapping",
                table.columns.len().saturating_sub(1)
            ),
        ));
    }
    let db = app.store.read();
    // The revision first: a change in between makes the plan stale, never wrong.
    let compared_revision = markers::revision(db).await?;
    let standing = markers::list(db).await?;
    let here = Arc::clone(app);
    let (plan, counts) = tokio::task::spawn_blocking(move || {
        plan(&table, reading.mapping, reading.whole_table, &standing, &here.site.local_frame(), &here.plan)
    })
    .await
    .map_err(anyhow::Error::from)?;
    Ok((plan, new_row(reading.whole_table, counts, compared_revision)))
}

/// The row of a file that has just been compared.
pub(super) fn new_row(
    whole_table: bool,
    counts: marker_imports::Counts,
    compared_revision: i64,
) -> MarkerImport {
    MarkerImport {
        id: Uuid::now_v7(),
        state: ImportState::Compared,
        file_name: None,
        whole_table,
        counts,
        compared_revision,
        applied_revision: None,
        reverted_revision: None,
        reason: String::new(),
        created_at: utc::now(),
        created_by: None,
        applied_at: None,
        applied_by: None,
        reverted_at: None,
        reverted_by: None,
    }
}

async fn find(app: &App, id: Uuid) -> Result<MarkerImport> {
    marker_imports::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("import", id))
}

/// The same, in the transaction that changes it.
async fn standing(db: &mut Connection, id: Uuid) -> Result<MarkerImport> {
    marker_imports::get(db, id).await?.ok_or_else(|| Error::not_found("import", id))
}

fn expect(import: &MarkerImport, state: ImportState) -> Result<()> {
    if import.state == state {
        return Ok(());
    }
    let (code, advice) = match import.state {
        ImportState::Compared => ("import_not_applied", "apply it first"),
        ImportState::Applied => ("import_applied", "revert it, or send the file again"),
        ImportState::Reverted => ("import_reverted", "send the file again"),
    };
    Err(Error::conflict(
        code,
        format!("expected an import that is {state:?}, found one that is {:?}: {advice}", import.state)
            .to_lowercase(),
    ))
}

fn to_json(plan: &Plan) -> Result<String> {
    Ok(serde_json::to_string(plan).map_err(anyhow::Error::from)?)
}

fn from_json(id: Uuid, text: &str) -> Result<Plan> {
    let plan = serde_json::from_str(text).map_err(|error| StoreError::Damaged {
        what: format!("plan of import {id}"),
        why: error.to_string(),
    })?;
    Ok(plan)
}
