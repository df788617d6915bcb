//! Who or what is positioned: the people who walk, and the instruments.

use axum::extract::State;
use lodestep_engine::systems::catalogue;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::json;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Created, Json, NoContent, Path, Routes};
use crate::rights::Right;
use crate::sessions::removal;
use crate::state::App;
use crate::store::audit;
use crate::store::inspectors::{self, Inspector};
use crate::utc;
use crate::wire::Change;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/inspectors", Right::Read, list)
        .about("list_inspectors", "Everybody who walks, and every instrument that is positioned")
        .post("/inspectors", Right::Dispatch, create)
        .about("create_inspector", "Adds an inspector, or another carrier by its kind")
        .get("/inspectors/{id}", Right::Read, show)
        .about("get_inspector", "One inspector")
        .patch("/inspectors/{id}", Right::Dispatch, rename)
        .about("rename_inspector", "Renames an inspector")
        .delete("/inspectors/{id}", Right::Dispatch, remove)
        .about("delete_inspector", "Removes an inspector who never walked")
}

/// Letters in a name.
const NAME_LENGTH: usize = 80;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct InspectorName {
    #[schemars(example = &"Li Na")]
    name: String,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewInspector {
    #[schemars(example = &"Li Na")]
    name: String,
    /// A person where it is left out.
    #[serde(default = "inspectors::person")]
    #[schemars(example = &inspectors::PERSON)]
    kind: String,
}

/// The kind, when a system positions such a carrier.
fn checked_kind(kind: String) -> Result<String> {
    let known = catalogue::carrier_kinds();
    if known.contains(&kind.as_str()) {
        return Ok(kind);
    }
    Err(Error::invalid(
        "wrong_kind",
        format!("expected one of the kinds {}, found {kind:?}: name one of these", known.join(", ")),
    ))
}

impl InspectorName {
    /// The name without spaces around it, when it is one.
    fn checked(self) -> Result<String> {
        let name = self.name.trim();
        let length = name.chars().count();
        if length == 0 || length > NAME_LENGTH || name.chars().any(char::is_control) {
            return Err(Error::invalid(
                "wrong_name",
                format!("expected a name of 1 to {NAME_LENGTH} letters without line breaks, found {name:?}"),
            ));
        }
        Ok(name.to_owned())
    }
}

async fn list(State(app): State<App>) -> Result<Json<Vec<Inspector>>> {
    Ok(Json(inspectors::list(app.store.read()).await?))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewInspector>,
) -> Result<Created<Json<Inspector>>> {
    let inspector = Inspector {
        id: Uuid::now_v7(),
        name: InspectorName { name: new.name }.checked()?,
        kind: checked_kind(new.kind)?,
        created_at: utc::now(),
    };
    let row = inspector.clone();
    let entry = caller.did("inspector.added", inspector.id, None, serde_json::to_value(&inspector).ok());
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                inspectors::insert(&mut *db, &row).await?;
                audit::insert(db, &entry).await
            })
        })
        .await
        .map_err(|error| taken(error, &inspector.name))?;
    tell(&app).await?;
    Ok(Created(Json(inspector)))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Inspector>> {
    let inspector = inspectors::get(app.store.read(), id).await?;
    Ok(Json(inspector.ok_or_else(|| Error::not_found("inspector", id))?))
}

async fn rename(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(named): Json<InspectorName>,
) -> Result<Json<Inspector>> {
    let name = named.checked()?;
    let new = name.clone();
    let found = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let Some(old) = inspectors::get(&mut *db, id).await? else { return Ok(false) };
                let (before, after) = (json!({"name": old.name}), json!({"name": new}));
                audit::insert(&mut *db, &caller.did("inspector.renamed", id, Some(before), Some(after)))
                    .await?;
                inspectors::rename(db, id, &new).await
            })
        })
        .await
        .map_err(|error| taken(error, &name))?;
    if !found {
        return Err(Error::not_found("inspector", id));
    }
    tell(&app).await?;
    show(State(app), Path(id)).await
}

async fn remove(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    // Its sessions may have been removed a moment ago and have rows left, which refer to it.
    removal::finish_of(&app, id).await?;
    let deleted = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let Some(old) = inspectors::get(&mut *db, id).await? else { return Ok(false) };
                let entry = caller.did("inspector.removed", id, serde_json::to_value(&old).ok(), None);
                audit::insert(&mut *db, &entry).await?;
                inspectors::delete(db, id).await
            })
        })
        .await;
    match deleted {
        Ok(true) => {
            tell(&app).await?;
            Ok(NoContent)
        }
        Ok(false) => Err(Error::not_found("inspector", id)),
        Err(error) if error.is_dangling() => Err(Error::conflict(
            "inspector_has_sessions",
            "this inspector has sessions or faults, which say who it was: delete those first, or rename the inspector",
        )),
        Err(error) => Err(error.into()),
    }
}

/// Tells the feed who there is now.
async fn tell(app: &App) -> Result<()> {
    let inspectors = inspectors::list(app.store.read()).await?;
    app.hub.publish(Change::Inspectors { inspectors });
    Ok(())
}

/// A name that another has is the client's affair; anything else is ours.
fn taken(error: crate::store::StoreError, name: &str) -> Error {
    if error.is_duplicate() {
        return Error::conflict(
            "name_taken",
            format!("there is already an inspector {name:?}: choose another name"),
        );
    }
    error.into()
}
