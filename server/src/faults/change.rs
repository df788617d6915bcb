//! A fault on its way: acknowledged, assigned, in work, fixed, verified; each step with who took it and why.

use axum::http::StatusCode;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use uuid::Uuid;

use super::report::{KIND_LENGTH, TEXT_LENGTH, checked};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::state::App;
use crate::store::dialect::Connection;
use crate::store::fault_changes::{self, FaultChange, What};
use crate::store::faults::{self, Fault, FaultState, Severity};
use crate::store::webhooks::EventKind;
use crate::store::{audit, columns_word, inspectors, markers, webhook_deliveries};
use crate::utc;
use crate::wire::Change;

/// What is to change; what is left out stays.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FaultPatch {
    /// How far it has come.
    pub(crate) state: Option<FaultState>,
    /// How bad it is.
    pub(crate) severity: Option<Severity>,
    /// What is wrong.
    #[schemars(example = &"leak")]
    pub(crate) kind: Option<String>,
    /// What is to be said of it.
    #[schemars(example = &"Oil on the rail")]
    pub(crate) text: Option<String>,
    /// The actuator; null: not known any more.
    #[serde(default, deserialize_with = "given")]
    #[schemars(example = &"A17")]
    pub(crate) marker: Option<Option<String>>,
    /// Who is to see to it; null: nobody.
    #[serde(default, deserialize_with = "given")]
    pub(crate) assignee_id: Option<Option<Uuid>>,
    /// What is said with it, or nothing but that.
    #[schemars(example = &"Spare part ordered")]
    pub(crate) comment: Option<String>,
    /// The version that was seen.
    pub(crate) version: Option<i64>,
}

/// A field that is null was given; one that is missing was not.
fn given<'de, T: Deserialize<'de>, D: Deserializer<'de>>(field: D) -> Result<Option<Option<T>>, D::Error> {
    Option::<T>::deserialize(field).map(Some)
}

/// Changes a fault and tells the feed; what changes nothing leaves no trace.
pub(crate) async fn change(app: &App, caller: Caller, id: Uuid, patch: FaultPatch) -> Result<Fault> {
    let patch = FaultPatch {
        kind: patch.kind.map(|kind| checked("kind", &kind, 1, KIND_LENGTH)).transpose()?,
        text: patch.text.map(|text| checked("text", &text, 0, TEXT_LENGTH)).transpose()?,
        comment: patch.comment.map(|comment| checked("comment", &comment, 0, TEXT_LENGTH)).transpose()?,
        ..patch
    };
    // Who walks says what is done about a fault; to send somebody else, or to say that it is done with, is the
    // dispatcher's.
    let takes_it = patch.assignee_id.is_some_and(|id| id.is_some() && id == caller.inspector);
    if patch.state == Some(FaultState::Verified) || (patch.assignee_id.is_some() && !takes_it) {
        caller.needs(Right::Dispatch)?;
    }
    let by = caller.clone();
    write(app, &caller, id, move |db, fault| Box::pin(step(db, fault, by, patch))).await
}

/// Takes a fault for done, wherever it stands: the one step that older clients know.
pub(crate) async fn close(app: &App, caller: Caller, id: Uuid) -> Result<Fault> {
    let by = caller.clone();
    write(app, &caller, id, move |_, fault| {
        Box::pin(async move {
            let mut changes = Changes::new(&fault, by, String::new());
            let mut next = fault.clone();
            if fault.state != FaultState::Verified {
                next.state = FaultState::Verified;
                changes.add(What::State, Some(columns_word(fault.state)), Some(columns_word(next.state)));
            }
            Ok((next, changes.all))
        })
    })
    .await
}

/// The rows of history that one request makes.
struct Changes {
    fault_id: Uuid,
    who: String,
    comment: String,
    at: time::OffsetDateTime,
    all: Vec<FaultChange>,
}

impl Changes {
    fn new(fault: &Fault, caller: Caller, comment: String) -> Changes {
        Changes { fault_id: fault.id, who: caller.who, comment, at: utc::now(), all: Vec::new() }
    }

    fn add(&mut self, what: What, before: Option<String>, after: Option<String>) {
        self.all.push(FaultChange {
            fault_id: self.fault_id,
            changed_at: self.at,
            changed_by: Some(self.who.clone()),
            what,
            before,
            after,
            // Said once, with the first thing that changes.
            comment: std::mem::take(&mut self.comment),
        });
    }
}

async fn step(
    db: &mut Connection,
    fault: Fault,
    caller: Caller,
    patch: FaultPatch,
) -> Result<(Fault, Vec<FaultChange>)> {
    if patch.version.is_some_and(|version| version != fault.version) {
        return Err(Error::changed(
            StatusCode::CONFLICT,
            "fault_changed",
            format!(
                "expected the fault in version {}, found {}: somebody has changed it meanwhile; look at it, then send the change again with its version",
                patch.version.unwrap_or_default(),
                fault.version
            ),
            &fault,
        ));
    }
    if let Some(Some(name)) = &patch.marker
        && markers::get(&mut *db, name).await?.is_none()
    {
        return Err(Error::invalid(
            "unknown_marker",
            format!(
                "expected the name of a marker, found {name:?}: correct it, or send null where it is not known"
            ),
        ));
    }
    if let Some(Some(id)) = patch.assignee_id
        && inspectors::get(&mut *db, id).await?.is_none()
    {
        return Err(Error::invalid(
            "unknown_inspector",
            format!("expected the id of an inspector, found {id}: see GET /inspectors"),
        ));
    }
    let mut next = fault.clone();
    let mut changes = Changes::new(&fault, caller, patch.comment.unwrap_or_default());
    if let Some(state) = patch.state.filter(|state| *state != fault.state) {
        if !fault.state.may_become(state) {
            return Err(Error::changed(
                StatusCode::CONFLICT,
                "wrong_step",
                format!(
                    "expected a step that follows on {}, found {}: a fault is verified once it is fixed, and one that is verified can only be opened again",
                    columns_word(fault.state),
                    columns_word(state)
                ),
                &fault,
            ));
        }
        changes.add(What::State, Some(columns_word(fault.state)), Some(columns_word(state)));
        next.state = state;
    }
    if let Some(assignee_id) = patch.assignee_id.filter(|id| *id != fault.assignee_id) {
        let id = |id: Option<Uuid>| id.map(|id| id.to_string());
        changes.add(What::Assignee, id(fault.assignee_id), id(assignee_id));
        next.assignee_id = assignee_id;
    }
    if let Some(severity) = patch.severity.filter(|severity| *severity != fault.severity) {
        changes.add(What::Severity, Some(columns_word(fault.severity)), Some(columns_word(severity)));
        next.severity = severity;
    }
    if let Some(kind) = patch.kind.filter(|kind| *kind != fault.kind) {
        changes.add(What::Kind, Some(fault.kind.clone()), Some(kind.clone()));
        next.kind = kind;
    }
    if let Some(text) = patch.text.filter(|text| *text != fault.text) {
        changes.add(What::Text, Some(fault.text.clone()), Some(text.clone()));
        next.text = text;
    }
    if let Some(marker) = patch.marker.filter(|marker| *marker != fault.marker) {
        changes.add(What::Marker, fault.marker.clone(), marker.clone());
        next.marker = marker;
    }
    if !changes.comment.is_empty() {
        changes.add(What::Comment, None, None);
    }
    Ok((next, changes.all))
}

type Step<'c> = futures_util::future::BoxFuture<'c, Result<(Fault, Vec<FaultChange>)>>;

/// Runs a step in a transaction, writes what it changed, and tells the feed.
pub(super) async fn write(
    app: &App,
    caller: &Caller,
    id: Uuid,
    step: impl for<'c> FnOnce(&'c mut Connection, Fault) -> Step<'c> + Send + 'static,
) -> Result<Fault> {
    let caller = caller.clone();
    let (fault, changed) = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let fault = faults::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("fault", id))?;
                let (mut next, changes) = step(&mut *db, fault.clone()).await?;
                let Some(first) = changes.first() else { return Ok((fault, false)) };
                let verified = next.state == FaultState::Verified;
                next.closed_at = match (verified, fault.closed_at) {
                    (true, Some(at)) => Some(at),
                    (true, None) => Some(first.changed_at),
                    (false, _) => None,
                };
                next.version = fault.version + 1;
                next.updated_at = first.changed_at;
                faults::update(&mut *db, &next).await?;
                let (mut before, mut after) = (serde_json::Map::new(), serde_json::Map::new());
                for change in &changes {
                    fault_changes::insert(&mut *db, change).await?;
                    before.insert(columns_word(change.what), change.before.clone().into());
                    after.insert(columns_word(change.what), change.after.clone().into());
                }
                let entry = caller.did("fault.changed", id, Some(before.into()), Some(after.into()));
                audit::insert(&mut *db, &entry).await?;
                let changed = serde_json::json!({ "before": entry.before, "after": entry.after });
                // Read again: how many photos there are is counted by the store.
                let now = faults::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("fault", id))?;
                let told = serde_json::json!({ "fault": now, "changed": changed, "by": entry.who });
                webhook_deliveries::announce(&mut *db, EventKind::FaultChanged, &told).await?;
                Ok::<_, Error>((now, true))
            })
        })
        .await?;
    if changed {
        app.hub.publish(Change::Fault { fault: fault.clone() });
    }
    Ok(fault)
}
