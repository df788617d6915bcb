//! The steps of a file, which may be a hundred thousand: their history is written in pieces, between which others write, and is seen
//! by nobody until one short write makes the steps and says that the file was applied, or reverted.

use futures_util::FutureExt;
use uuid::Uuid;

use super::write::{Cause, MarkerEdit, entry};
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::dialect::Connection;
use crate::store::marker_changes::{self, MarkerChange};
use crate::store::{StoreError, audit, markers};
use crate::utc;

/// Steps in a piece: some tens of milliseconds.
const STEPS: usize = 2_000;
/// Rows that are removed at once.
const REMOVED: u32 = 5_000;

/// Writes the history of these steps, as it will be after the revision of the table that they were made for.
pub(super) async fn stage(app: &App, steps: &[MarkerEdit], cause: &Cause, revision: i64) -> Result<()> {
    let Some((id, is_revert)) = cause.import else { return Ok(()) };
    clear(app, id, is_revert).await?;
    let now = utc::now();
    for piece in steps.chunks(STEPS) {
        let change = |step: &MarkerEdit| MarkerChange {
            marker: step.name.clone(),
            revision: revision + 1,
            changed_at: now,
            changed_by: Some(cause.caller.who.clone()),
            reason: cause.reason.clone(),
            import_id: Some(id),
            is_revert,
            before: step.before,
            after: step.after,
        };
        let changes: Vec<_> = piece.iter().map(change).collect();
        app.store
            .writer()
            .run(move |db| async move { marker_changes::insert_all(db, &changes).await }.boxed())
            .await?;
    }
    Ok(())
}

/// Removes the history of steps that were not made.
pub(super) async fn clear(app: &App, id: Uuid, is_revert: bool) -> Result<(), StoreError> {
    loop {
        if !app
            .store
            .writer()
            .run(move |db| {
                async move { marker_changes::clear_some(db, id, is_revert, REMOVED).await }.boxed()
            })
            .await?
        {
            return Ok(());
        }
    }
}

/// Makes the steps whose history was written, all of them at once; the table's new revision, `None` when there are none. That the
/// table is still in the revision that they were made for is for the caller to have seen in the same transaction.
pub(super) async fn make(
    db: &mut Connection,
    steps: usize,
    cause: &Cause,
) -> Result<Option<i64>, StoreError> {
    let Some((id, is_revert)) = cause.import.filter(|_| steps > 0) else { return Ok(None) };
    let revision = markers::bump_revision(&mut *db).await?;
    markers::make_staged(db, id, is_revert, revision).await?;
    audit::insert(db, &entry(steps, cause)).await?;
    Ok(Some(revision))
}

/// Refuses steps that were made for another revision of the table than it is in.
pub(super) async fn expect_revision(db: &mut Connection, compared: i64) -> Result<()> {
    let now = markers::revision(db).await?;
    if now == compared {
        return Ok(());
    }
    Err(Error::conflict(
        "table_moved_on",
        format!(
            "expected the table in revision {compared}, with which the file was compared, found {now}: compare it again and look at the difference"
        ),
    ))
}
