//! Mappings of columns to channels, kept under a name for logs whose format nobody knows.

use axum::extract::State;
use axum::http::StatusCode;
use lodestep_engine::parse::mapping::Mapping;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::extract::{Json, Path};
use super::{Needs, Routes};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::state::App;
use crate::store::StoreError;
use crate::store::mappings::{self, NamedMapping};
use crate::utc;

/// Letters in a name.
const NAME_LENGTH: usize = 80;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/mappings", Right::Read, list)
        .about("Mappings of columns, kept under a name")
        .gives::<Vec<serde_json::Value>>()
        .post("/mappings", Right::Walk, create)
        .about("Keeps a mapping of columns under a name")
        .takes::<Given>()
        .gives::<serde_json::Value>()
        .get("/mappings/{id}", Right::Read, show)
        .about("One mapping")
        .gives::<serde_json::Value>()
        .put("/mappings/{id}", Needs::OwnMapping, change)
        .about("Changes a mapping")
        .takes::<Given>()
        .gives::<serde_json::Value>()
        .delete("/mappings/{id}", Needs::OwnMapping, remove)
        .about("Removes a mapping")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Given {
    name: String,
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    mapping: Mapping,
}

impl Given {
    /// The name without spaces around it, and a mapping that holds together.
    fn checked(self) -> Result<(String, Mapping)> {
        let name = self.name.trim();
        let length = name.chars().count();
        if length == 0 || length > NAME_LENGTH || name.chars().any(char::is_control) {
            return Err(Error::invalid(
                "wrong_name",
                format!(
                    "expected a name of 1 to {NAME_LENGTH} letters without line breaks, found {length}: give it one by which you will know the logs that it belongs to"
                ),
            ));
        }
        self.mapping.check()?;
        Ok((name.to_owned(), self.mapping))
    }
}

async fn list(State(app): State<App>) -> Result<axum::Json<Vec<NamedMapping>>> {
    Ok(axum::Json(mappings::list(app.store.read()).await?))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<axum::Json<NamedMapping>> {
    let named = mappings::get(app.store.read(), id).await?;
    Ok(axum::Json(named.ok_or_else(|| Error::not_found("mapping", id))?))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(given): Json<Given>,
) -> Result<(StatusCode, axum::Json<NamedMapping>)> {
    let (name, mapping) = given.checked()?;
    let now = utc::now();
    let created_by = caller.account;
    let named =
        NamedMapping { id: Uuid::now_v7(), name, mapping, created_by, created_at: now, updated_at: now };
    let row = named.clone();
    app.store
        .writer()
        .run(move |db| Box::pin(async move { mappings::insert(db, &row).await }))
        .await
        .map_err(|error| taken(error, &named.name))?;
    Ok((StatusCode::CREATED, axum::Json(named)))
}

async fn change(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Json(given): Json<Given>,
) -> Result<axum::Json<NamedMapping>> {
    let (name, mapping) = given.checked()?;
    let former = mappings::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("mapping", id))?;
    let named = NamedMapping { name, mapping, updated_at: utc::now(), ..former };
    let row = named.clone();
    let found = app
        .store
        .writer()
        .run(move |db| Box::pin(async move { mappings::update(db, &row).await }))
        .await
        .map_err(|error| taken(error, &named.name))?;
    if found { Ok(axum::Json(named)) } else { Err(Error::not_found("mapping", id)) }
}

async fn remove(State(app): State<App>, Path(id): Path<Uuid>) -> Result<StatusCode> {
    let found =
        app.store.writer().run(move |db| Box::pin(async move { mappings::delete(db, id).await })).await?;
    if found { Ok(StatusCode::NO_CONTENT) } else { Err(Error::not_found("mapping", id)) }
}

/// A name that another has is the client's affair; anything else is ours.
fn taken(error: StoreError, name: &str) -> Error {
    if error.is_duplicate() {
        return Error::conflict(
            "name_taken",
            format!("there is already a mapping {name:?}: choose another name, or change that one"),
        );
    }
    error.into()
}
