//! Mappings of columns to channels, kept under a name for logs whose format nobody knows.

use axum::extract::State;
use lodestep_engine::parse::mapping::Mapping;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Created, Json, Needs, NoContent, Path, Routes};
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
        .about("list_mappings", "Mappings of columns, kept under a name")
        .post("/mappings", Right::Walk, create)
        .about("create_mapping", "Keeps a mapping of columns under a name")
        .get("/mappings/{id}", Right::Read, show)
        .about("get_mapping", "One mapping")
        .put("/mappings/{id}", Needs::OwnMapping, change)
        .about("replace_mapping", "Changes a mapping")
        .delete("/mappings/{id}", Needs::OwnMapping, remove)
        .about("delete_mapping", "Removes a mapping")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewMapping {
    #[schemars(example = &"the blue loggers")]
    name: String,
    mapping: Mapping,
}

impl NewMapping {
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

async fn list(State(app): State<App>) -> Result<Json<Vec<NamedMapping>>> {
    Ok(Json(mappings::list(app.store.read()).await?))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<NamedMapping>> {
    let named = mappings::get(app.store.read(), id).await?;
    Ok(Json(named.ok_or_else(|| Error::not_found("mapping", id))?))
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(given): Json<NewMapping>,
) -> Result<Created<Json<NamedMapping>>> {
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
    Ok(Created(Json(named)))
}

async fn change(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Json(given): Json<NewMapping>,
) -> Result<Json<NamedMapping>> {
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
    if found { Ok(Json(named)) } else { Err(Error::not_found("mapping", id)) }
}

async fn remove(State(app): State<App>, Path(id): Path<Uuid>) -> Result<NoContent> {
    let found =
        app.store.writer().run(move |db| Box::pin(async move { mappings::delete(db, id).await })).await?;
    if found { Ok(NoContent) } else { Err(Error::not_found("mapping", id)) }
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
