//! Everybody's accounts, for administrators.

use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use time::OffsetDateTime;
use uuid::Uuid;

use crate::auth::{Caller, Password, checked_name};
use crate::error::{Error, Result};
use crate::http::{Created, Json, Needs, NoContent, Path, Routes};
use crate::rights::{Right, Role};
use crate::state::App;
use crate::store::accounts::{self, Account};
use crate::store::dialect::Connection;
use crate::store::{StoreError, audit, inspectors, sign_ins};
use crate::utc;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/accounts", Right::Administer, list)
        .about("list_accounts", "All accounts")
        .post("/accounts", Needs::SignedIn(Right::Administer), create)
        .about("create_account", "Adds an account")
        .get("/accounts/{id}", Right::Administer, show)
        .about("get_account", "One account")
        .patch("/accounts/{id}", Needs::SignedIn(Right::Administer), change)
        .about("update_account", "Changes an account; what is left out stays, null takes away")
        .delete("/accounts/{id}", Needs::SignedIn(Right::Administer), remove)
        .about("delete_account", "Removes an account with its tokens")
}

async fn list(State(app): State<App>) -> Result<Json<Vec<Account>>> {
    Ok(Json(accounts::list(app.store.read()).await?))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Account>> {
    let account = accounts::get(app.store.read(), id).await?;
    Ok(Json(account.ok_or_else(|| Error::not_found("account", id))?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewAccount {
    #[schemars(example = &"li wei")]
    name: String,
    password: Password,
    role: Role,
    inspector_id: Option<Uuid>,
    #[serde(default, with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    expires_at: Option<OffsetDateTime>,
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewAccount>,
) -> Result<Created<Json<Account>>> {
    if !app.auth.has_accounts() {
        return Err(Error::conflict(
            "not_set_up",
            "nobody has an account yet: make the first one with the setup token that the server printed when it started",
        ));
    }
    let name = checked_name(&new.name)?;
    new.password.checked(&name)?;
    let now = utc::now();
    let account = Account {
        id: Uuid::now_v7(),
        name,
        role: new.role,
        password_hash: new.password.hash().await?,
        inspector_id: new.inspector_id,
        disabled: false,
        expires_at: new.expires_at,
        created_at: now,
        updated_at: now,
    };
    let row = account.clone();
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                inspector_exists(&mut *db, row.inspector_id).await?;
                no_look_alike(&mut *db, &row).await?;
                accounts::insert(&mut *db, &row).await.map_err(|error| taken(error, &row.name))?;
                let entry = caller.did("account.added", row.id, None, serde_json::to_value(&row).ok());
                audit::insert(db, &entry).await?;
                Ok::<_, Error>(())
            })
        })
        .await?;
    Ok(Created(Json(account)))
}

/// What is to be different; what is left out stays, a null takes away.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct AccountChange {
    #[schemars(example = &"li wei")]
    name: Option<String>,
    password: Option<Password>,
    role: Option<Role>,
    disabled: Option<bool>,
    #[serde(default, deserialize_with = "told")]
    #[schemars(with = "Option<Uuid>")]
    inspector_id: Option<Option<Uuid>>,
    #[serde(default, deserialize_with = "told_instant")]
    #[schemars(with = "Option<utc::Instant>")]
    expires_at: Option<Option<OffsetDateTime>>,
}

/// A field that was told, be it as null.
fn told<'de, D: Deserializer<'de>>(field: D) -> Result<Option<Option<Uuid>>, D::Error> {
    Option::deserialize(field).map(Some)
}

fn told_instant<'de, D: Deserializer<'de>>(field: D) -> Result<Option<Option<OffsetDateTime>>, D::Error> {
    time::serde::rfc3339::option::deserialize(field).map(Some)
}

async fn change(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(change): Json<AccountChange>,
) -> Result<Json<Account>> {
    let name = change.name.as_deref().map(checked_name).transpose()?;
    let new_password = match change.password {
        Some(password) => {
            let known = accounts::get(app.store.read(), id).await?;
            let known = known.ok_or_else(|| Error::not_found("account", id))?;
            password.checked(name.as_deref().unwrap_or(&known.name))?;
            Some(password.hash().await?)
        }
        None => None,
    };
    let account = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let old =
                    accounts::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("account", id))?;
                let is_new_password = new_password.is_some();
                let account = Account {
                    name: name.unwrap_or_else(|| old.name.clone()),
                    role: change.role.unwrap_or(old.role),
                    password_hash: new_password.unwrap_or_else(|| old.password_hash.clone()),
                    inspector_id: change.inspector_id.unwrap_or(old.inspector_id),
                    disabled: change.disabled.unwrap_or(old.disabled),
                    expires_at: change.expires_at.unwrap_or(old.expires_at),
                    updated_at: utc::now(),
                    ..old.clone()
                };
                inspector_exists(&mut *db, account.inspector_id).await?;
                if account.name != old.name {
                    no_look_alike(&mut *db, &account).await?;
                }
                accounts::update(&mut *db, &account).await.map_err(|error| taken(error, &account.name))?;
                an_administrator_is_left(&mut *db).await?;
                if is_new_password {
                    // All who knew the old one are out.
                    sign_ins::delete_others(&mut *db, id, None).await?;
                }
                let (before, after) = (serde_json::to_value(&old).ok(), serde_json::to_value(&account).ok());
                let action = if is_new_password { "account.password_set" } else { "account.changed" };
                audit::insert(db, &caller.did(action, id, before, after)).await?;
                Ok::<_, Error>(account)
            })
        })
        .await?;
    app.auth.changed();
    Ok(Json(account))
}

async fn remove(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let old =
                    accounts::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("account", id))?;
                accounts::delete(&mut *db, id).await?;
                an_administrator_is_left(&mut *db).await?;
                let entry = caller.did("account.removed", id, serde_json::to_value(&old).ok(), None);
                audit::insert(db, &entry).await?;
                Ok::<_, Error>(())
            })
        })
        .await?;
    app.auth.changed();
    Ok(NoContent)
}

/// Two names that people cannot tell from each other are one.
async fn no_look_alike(db: &mut Connection, account: &Account) -> Result<()> {
    match accounts::look_alike(db, &account.name, Some(account.id)).await? {
        Some(alike) if accounts::name_key(&alike.name) != accounts::name_key(&account.name) => {
            Err(Error::conflict(
                "name_looks_taken",
                format!(
                    "there is already an account {:?}, which looks like {:?}: choose a name that people can tell from it",
                    alike.name, account.name
                ),
            ))
        }
        _ => Ok(()),
    }
}

/// The last administrator stays one: nobody could give rights any more.
async fn an_administrator_is_left(db: &mut Connection) -> Result<()> {
    if accounts::administrators(db).await? == 0 {
        return Err(Error::conflict(
            "last_administrator",
            "expected an administrator who can sign in to be left, found none then: make another one first",
        ));
    }
    Ok(())
}

async fn inspector_exists(db: &mut Connection, id: Option<Uuid>) -> Result<()> {
    match id {
        Some(id) if inspectors::get(db, id).await?.is_none() => Err(Error::not_found("inspector", id)),
        _ => Ok(()),
    }
}

fn taken(error: StoreError, name: &str) -> Error {
    if error.is_duplicate() {
        return Error::conflict(
            "name_taken",
            format!("there is already an account {name:?}: choose another name"),
        );
    }
    error.into()
}
