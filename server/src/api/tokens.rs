//! Bearer tokens of devices and scripts: one's own, and everybody's for administrators.

use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use time::OffsetDateTime;
use uuid::Uuid;

use crate::auth::{By, Caller, Secret};
use crate::error::{Error, Result};
use crate::http::{Created, Json, Needs, NoContent, Path, Query, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::tokens::{self, Token};
use crate::store::{audit, inspectors};
use crate::utc;

/// Letters in a token's name.
const NAME_LETTERS: usize = 80;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/tokens", Right::Known, list)
        .about("list_tokens", "One's own tokens, or everybody's")
        .post("/tokens", Needs::SignedIn(Right::Known), create)
        .about("create_token", "Makes a token; its secret is shown this once")
        .delete("/tokens/{id}", Needs::SignedIn(Right::Known), revoke)
        .about("revoke_token", "Revokes a token")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ListQuery {
    /// Everybody's, for administrators.
    #[serde(default)]
    all: bool,
}

async fn list(
    State(app): State<App>,
    caller: Caller,
    Query(query): Query<ListQuery>,
) -> Result<Json<Vec<Token>>> {
    if query.all {
        caller.needs(Right::Administer)?;
        return Ok(Json(tokens::list(app.store.read(), None).await?));
    }
    let Some(account) = caller.account else { return Ok(Json(Vec::new())) };
    Ok(Json(tokens::list(app.store.read(), Some(account)).await?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewToken {
    #[schemars(example = &"gateway 3")]
    name: String,
    rights: Vec<Right>,
    inspector_id: Option<Uuid>,
    #[serde(default, with = "time::serde::rfc3339::option")]
    #[schemars(with = "Option<utc::Instant>")]
    expires_at: Option<OffsetDateTime>,
}

/// A token that has just been made: the only time that its secret is shown.
#[derive(Serialize, JsonSchema)]
struct IssuedToken {
    #[serde(flatten)]
    token: Token,
    #[schemars(example = crate::examples::SECRET)]
    secret: String,
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewToken>,
) -> Result<Created<Json<IssuedToken>>> {
    // A token that makes tokens could not be taken back.
    let (By::SignIn(_), Some(account_id)) = (caller.by, caller.account) else {
        return Err(Error::conflict(
            "sign_in_first",
            "expected somebody who has signed in, found somebody without an account, or a token: make tokens in the page, signed in",
        ));
    };
    let name = new.name.trim();
    let letters = name.chars().count();
    if letters == 0 || letters > NAME_LETTERS || name.chars().any(char::is_control) {
        return Err(Error::invalid(
            "wrong_name",
            format!(
                "expected a name of 1 to {NAME_LETTERS} letters without line breaks, found {name:?}: say what the token is for"
            ),
        ));
    }
    let given = |right: &Right| *right != Right::Open && *right != Right::Known;
    if new.rights.is_empty() || !new.rights.iter().all(given) {
        return Err(Error::invalid(
            "wrong_rights",
            "expected one or more of read, walk, walk_for_others, dispatch, survey, engineer and administer in rights",
        ));
    }
    for right in &new.rights {
        caller.needs(*right)?;
    }
    if new.expires_at.is_some_and(|at| at <= utc::now()) {
        return Err(Error::invalid(
            "wrong_expiry",
            "expected expires_at in the future, found a time that is over: leave it out for a token without an end",
        ));
    }
    if let Some(id) = new.inspector_id {
        if inspectors::get(app.store.read(), id).await?.is_none() {
            return Err(Error::not_found("inspector", id));
        }
        caller.writes_for(id)?;
    }
    let secret = Secret::random();
    let token = Token {
        id: Uuid::now_v7(),
        account_id,
        name: name.to_owned(),
        rights: new.rights,
        inspector_id: new.inspector_id,
        created_at: utc::now(),
        expires_at: new.expires_at,
        used_at: None,
        revoked_at: None,
    };
    let (row, hash) = (token.clone(), secret.sha256());
    let entry = caller.did("token.added", token.id, None, serde_json::to_value(&token).ok());
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                tokens::insert(&mut *db, &row, hash).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    Ok(Created(Json(IssuedToken { token, secret: secret.text().to_owned() })))
}

/// Takes one back; what was opened with it is cut.
async fn revoke(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    let token = tokens::get(app.store.read(), id).await?;
    let token =
        token.filter(|token| Some(token.account_id) == caller.account || caller.may(Right::Administer));
    let token = token.ok_or_else(|| Error::not_found("token", id))?;
    let entry = caller.did("token.revoked", id, serde_json::to_value(&token).ok(), None);
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                tokens::revoke(&mut *db, id, utc::now()).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    app.auth.changed();
    Ok(NoContent)
}
