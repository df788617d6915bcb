//! Sets of parameters, kept under a name for the laboratory.

use std::collections::BTreeMap;

use axum::extract::State;
use axum::http::StatusCode;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::lab::{checked, name_of};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Created, Json, NoContent, Path, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::parameter_sets::{self, ParameterSet};
use crate::store::{StoreError, audit};
use crate::utc;

/// Letters in what a set is for.
const ABOUT_LENGTH: usize = 1_000;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/lab/parameter-sets", Right::Read, list)
        .about("list_parameter_sets", "Sets of parameters, by name")
        .post("/lab/parameter-sets", Right::Engineer, create)
        .about("create_parameter_set", "Keeps a set of parameters under a name")
        .get("/lab/parameter-sets/{id}", Right::Read, show)
        .about("get_parameter_set", "One set of parameters")
        .put("/lab/parameter-sets/{id}", Right::Engineer, change)
        .about(
            "replace_parameter_set",
            "Changes a set of parameters; runs that were made with it keep their values",
        )
        .delete("/lab/parameter-sets/{id}", Right::Engineer, remove)
        .about("delete_parameter_set", "Removes a set of parameters; runs that were made with it stay")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewParameterSet {
    /// As it is to be shown.
    #[schemars(example = &"less noise")]
    name: String,
    /// What it is for.
    #[serde(default)]
    #[schemars(example = &"for the new soles")]
    about: String,
    /// Values by key; what is left out is the default.
    parameters: BTreeMap<String, f64>,
    /// The version that was seen, for a change.
    version: Option<i64>,
}

impl NewParameterSet {
    fn checked(self) -> Result<NewParameterSet> {
        let about = self.about.trim().to_owned();
        if about.chars().count() > ABOUT_LENGTH {
            return Err(Error::invalid(
                "wrong_about",
                format!("expected at most {ABOUT_LENGTH} letters in about: shorten it"),
            ));
        }
        Ok(NewParameterSet {
            name: name_of(&self.name)?,
            about,
            parameters: checked(self.parameters)?,
            ..self
        })
    }
}

async fn list(State(app): State<App>) -> Result<Json<Vec<ParameterSet>>> {
    Ok(Json(parameter_sets::list(app.store.read()).await?))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<ParameterSet>> {
    let set = parameter_sets::get(app.store.read(), id).await?;
    Ok(Json(set.ok_or_else(|| Error::not_found("parameter set", id))?))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(given): Json<NewParameterSet>,
) -> Result<Created<Json<ParameterSet>>> {
    let NewParameterSet { name, about, parameters, .. } = given.checked()?;
    let now = utc::now();
    let set = ParameterSet {
        id: Uuid::now_v7(),
        name,
        about,
        parameters,
        version: 1,
        created_at: now,
        created_by: caller.account.map(|_| caller.who.clone()),
        updated_at: now,
    };
    let row = set.clone();
    let entry = caller.did("parameter_set.added", set.id, None, serde_json::to_value(&set).ok());
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                parameter_sets::insert(&mut *db, &row).await?;
                audit::insert(db, &entry).await
            })
        })
        .await
        .map_err(|error| taken(error, &set.name))?;
    Ok(Created(Json(set)))
}

async fn change(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(given): Json<NewParameterSet>,
) -> Result<Json<ParameterSet>> {
    let given = given.checked()?;
    let set = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let former = parameter_sets::get(&mut *db, id).await?;
                let former = former.ok_or_else(|| Error::not_found("parameter set", id))?;
                if given.version != Some(former.version) {
                    return Err(Error::changed(
                        StatusCode::CONFLICT,
                        "set_changed",
                        format!(
                            "expected version {} of this set of parameters, found {:?}: somebody else has changed it meanwhile; look at it and change that",
                            former.version, given.version
                        ),
                        former,
                    ));
                }
                let set = ParameterSet {
                    name: given.name,
                    about: given.about,
                    parameters: given.parameters,
                    version: former.version + 1,
                    updated_at: utc::now(),
                    ..former.clone()
                };
                parameter_sets::update(&mut *db, &set).await.map_err(|error| taken(error, &set.name))?;
                let (before, after) = (serde_json::to_value(&former).ok(), serde_json::to_value(&set).ok());
                audit::insert(db, &caller.did("parameter_set.changed", id, before, after)).await?;
                Ok::<_, Error>(set)
            })
        })
        .await?;
    Ok(Json(set))
}

async fn remove(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let former = parameter_sets::get(&mut *db, id).await?;
                let former = former.ok_or_else(|| Error::not_found("parameter set", id))?;
                parameter_sets::delete(&mut *db, id).await?;
                let before = serde_json::to_value(&former).ok();
                audit::insert(db, &caller.did("parameter_set.removed", id, before, None)).await?;
                Ok::<_, Error>(())
            })
        })
        .await?;
    Ok(NoContent)
}

/// A name that another has is the client's affair; anything else is ours.
fn taken(error: StoreError, name: &str) -> Error {
    if error.is_duplicate() {
        return Error::conflict(
            "name_taken",
            format!("there is already a set of parameters {name:?}: choose another name, or change that one"),
        );
    }
    error.into()
}
