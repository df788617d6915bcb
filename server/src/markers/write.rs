//! The one way into the marker table: every change leaves a row of history, and all changes that belong
//! together have one revision.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use uuid::Uuid;

use crate::auth::Caller;
use crate::store::StoreError;
use crate::store::audit;
use crate::store::dialect::Connection;
use crate::store::marker_changes::{self, MarkerChange};
use crate::store::markers::{self, Marker, Place};
use crate::utc;

/// One marker's step from what it is to what it becomes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "MarkerStep")]
pub(crate) struct MarkerEdit {
    /// The marker's name.
    #[schemars(example = &"A17")]
    pub(crate) name: String,
    /// Where it stands; `None`: there is none.
    pub(crate) before: Option<Place>,
    /// Where it will stand; `None`: it is removed.
    pub(crate) after: Option<Place>,
}

/// Who changes something, and why.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cause {
    /// Who.
    pub(crate) caller: Caller,
    /// Why; may be empty.
    pub(crate) reason: String,
    /// The file that it comes with, and whether this takes back what the file changed.
    pub(crate) import: Option<(Uuid, bool)>,
}

/// Makes these steps and gives the table's new revision; `None` when there are none. What stands before
/// each is for the caller to have read in the same transaction.
pub(super) async fn write(
    db: &mut Connection,
    steps: &[MarkerEdit],
    cause: &Cause,
) -> Result<Option<i64>, StoreError> {
    if steps.is_empty() {
        return Ok(None);
    }
    let now = utc::now();
    let revision = markers::bump_revision(&mut *db).await?;
    for MarkerEdit { name, before, after } in steps {
        match (before, after) {
            (None, Some(Place { e_m, n_m, u_m })) => {
                let marker = Marker {
                    name: name.clone(),
                    e_m: *e_m,
                    n_m: *n_m,
                    u_m: *u_m,
                    version: revision,
                    created_at: now,
                    updated_at: now,
                };
                markers::insert(&mut *db, &marker).await?;
            }
            (Some(_), Some(place)) => {
                markers::update(&mut *db, name, place, revision, now).await?;
            }
            (_, None) => {
                markers::delete(&mut *db, name).await?;
            }
        }
        let change = MarkerChange {
            marker: name.clone(),
            revision,
            changed_at: now,
            changed_by: Some(cause.caller.who.clone()),
            reason: cause.reason.clone(),
            import_id: cause.import.map(|(id, _)| id),
            is_revert: cause.import.is_some_and(|(_, is_revert)| is_revert),
            before: *before,
            after: *after,
        };
        marker_changes::insert(&mut *db, &change).await?;
    }
    let entry = match (steps, cause.import) {
        ([step], None) => entry_of_one(step, cause),
        _ => entry(steps.len(), cause),
    };
    audit::insert(&mut *db, &entry).await?;
    Ok(Some(revision))
}

/// What the audit log says of one marker: all.
fn entry_of_one(MarkerEdit { name, before, after }: &MarkerEdit, cause: &Cause) -> audit::Entry {
    let told = |place: &Option<Place>| place.map(|place| json!(place));
    let action = match (before, after) {
        (None, _) => "marker.added",
        (_, None) => "marker.removed",
        _ => "marker.moved",
    };
    let after = told(after).map(|mut after| {
        after["reason"] = json!(cause.reason);
        after
    });
    cause.caller.did(action, name, told(before), after)
}

/// Of a file: how many; the history has each of them.
pub(super) fn entry(steps: usize, cause: &Cause) -> audit::Entry {
    let caller = &cause.caller;
    match cause.import {
        None => caller.did("markers.seeded", "", None, Some(json!({ "markers": steps }))),
        Some((id, is_revert)) => {
            let action = if is_revert { "markers.reverted" } else { "markers.imported" };
            caller.did(action, id, None, Some(json!({ "markers": steps, "reason": cause.reason })))
        }
    }
}
