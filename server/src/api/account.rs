//! One's own account: who one is, signing in and out, the first account of all.

use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use cookie::{Cookie, SameSite};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::extract::{Json, Path};
use super::{Needs, Routes};
use crate::auth::{self, By, COOKIE, Caller, Password, SIGNED_IN_FOR, Secret, not_signed_in};
use crate::error::{Error, Result};
use crate::rights::{Right, Role};
use crate::state::App;
use crate::store::accounts::{self, Account};
use crate::store::audit;
use crate::store::sign_ins::{self, SignIn};
use crate::utc;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/account", Right::Open, show)
        .about("Who asks, and what they may")
        .gives::<Me>()
        .post("/account/set-up", Right::Open, set_up)
        .about("Makes the first account, an administrator's, with the setup token")
        .takes::<SetUp>()
        .gives::<Account>()
        .post("/account/sign-in", Right::Open, sign_in)
        .about("Signs in: the answer sets the cookie")
        .takes::<NameAndPassword>()
        .gives::<Account>()
        .post("/account/sign-out", Right::Open, sign_out)
        .about("Signs this browser out")
        .post("/account/password", Needs::SignedIn(Right::Known), change_password)
        .about("Changes one's own password; other browsers are signed out")
        .takes::<PasswordChange>()
        .get("/account/sign-ins", Right::Known, list_sign_ins)
        .about("The browsers in which one is signed in")
        .gives::<Vec<SignIn>>()
        .delete("/account/sign-ins/{id}", Needs::SignedIn(Right::Known), end_sign_in)
        .about("Signs one of one's browsers out")
}

/// Who asks, and whether there is anything to sign in to.
#[derive(Debug, Serialize, JsonSchema)]
struct Me {
    /// Whether there is an account; until then nobody signs in.
    has_accounts: bool,
    /// Whether who asks may do anything without signing in.
    known: bool,
    id: Option<Uuid>,
    name: Option<String>,
    role: Option<Role>,
    rights: Vec<Right>,
    inspector_id: Option<Uuid>,
}

async fn show(State(app): State<App>, caller: Caller) -> Result<axum::Json<Me>> {
    let account = match caller.account {
        Some(id) => accounts::get(app.store.read(), id).await?,
        None => None,
    };
    Ok(axum::Json(Me {
        has_accounts: app.auth.has_accounts(),
        known: caller.may(Right::Known),
        id: caller.account,
        name: account.as_ref().map(|account| account.name.clone()),
        role: account.map(|account| account.role),
        rights: caller.rights().to_vec(),
        inspector_id: caller.inspector,
    }))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SetUp {
    setup_token: String,
    name: String,
    password: Password,
}

async fn set_up(
    State(app): State<App>,
    caller: Caller,
    headers: HeaderMap,
    Json(asked): Json<SetUp>,
) -> Result<Response> {
    let (account, secret) =
        auth::set_up(&app, &asked.setup_token, &asked.name, asked.password, &caller, agent(&headers)).await?;
    Ok((StatusCode::CREATED, [(header::SET_COOKIE, set(&secret))], axum::Json(account)).into_response())
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NameAndPassword {
    name: String,
    password: Password,
}

async fn sign_in(
    State(app): State<App>,
    caller: Caller,
    headers: HeaderMap,
    Json(asked): Json<NameAndPassword>,
) -> Result<Response> {
    let (account, secret) =
        auth::sign_in(&app, &asked.name, asked.password, &caller.address, agent(&headers)).await?;
    Ok(([(header::SET_COOKIE, set(&secret))], axum::Json(account)).into_response())
}

async fn sign_out(State(app): State<App>, caller: Caller) -> Result<Response> {
    auth::sign_out(&app, &caller).await?;
    Ok((StatusCode::NO_CONTENT, [(header::SET_COOKIE, unset())]).into_response())
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PasswordChange {
    old: Password,
    new: Password,
}

/// A new password for the one who knows the old; all other browsers are signed out.
async fn change_password(
    State(app): State<App>,
    caller: Caller,
    Json(change): Json<PasswordChange>,
) -> Result<StatusCode> {
    let By::SignIn(own) = caller.by else { return Err(not_signed_in()) };
    let account = own_account(&app, &caller).await?;
    let key = accounts::name_key(&account.name);
    app.auth.guesses.begin(&key, (&caller.address, true), std::time::Instant::now())?;
    if !app.auth.is_password(change.old, Some(account.password_hash.clone())).await? {
        return Err(Error::invalid(
            "wrong_password",
            "expected the password that is in use now, found another: check it; an administrator can set a new one",
        ));
    }
    app.auth.guesses.right(&key, (&caller.address, true));
    change.new.checked(&account.name)?;
    let account = Account { password_hash: change.new.hash().await?, updated_at: utc::now(), ..account };
    let entry = caller.did("account.password_changed", account.id, None, None);
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                accounts::update(&mut *db, &account).await?;
                sign_ins::delete_others(&mut *db, account.id, Some(own)).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    app.auth.changed();
    Ok(StatusCode::NO_CONTENT)
}

async fn list_sign_ins(State(app): State<App>, caller: Caller) -> Result<axum::Json<Vec<SignIn>>> {
    let Some(account) = caller.account else { return Ok(axum::Json(Vec::new())) };
    Ok(axum::Json(sign_ins::of_account(app.store.read(), account).await?))
}

/// Signs another browser of one's own out.
async fn end_sign_in(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<StatusCode> {
    let found = sign_ins::get(app.store.read(), id).await?;
    let own = found.filter(|(sign_in, _)| Some(sign_in.account_id) == caller.account);
    if own.is_none() {
        return Err(Error::not_found("sign-in", id));
    }
    app.store.writer().run(move |db| Box::pin(async move { sign_ins::delete(db, id).await })).await?;
    app.auth.changed();
    Ok(StatusCode::NO_CONTENT)
}

async fn own_account(app: &App, caller: &Caller) -> Result<Account> {
    let id = caller.account.ok_or_else(not_signed_in)?;
    accounts::get(app.store.read(), id).await?.ok_or_else(not_signed_in)
}

fn agent(headers: &HeaderMap) -> &str {
    headers.get(header::USER_AGENT).and_then(|agent| agent.to_str().ok()).unwrap_or_default()
}

/// The cookie that a browser keeps: for this host only, never shown to scripts, sent by our own pages only.
fn set(secret: &Secret) -> HeaderValue {
    header_of(Cookie::build((COOKIE, secret.text().to_owned())).max_age(SIGNED_IN_FOR))
}

fn unset() -> HeaderValue {
    header_of(Cookie::build((COOKIE, String::new())).max_age(time::Duration::ZERO))
}

fn header_of(cookie: cookie::CookieBuilder<'static>) -> HeaderValue {
    let cookie = cookie.path("/").secure(true).http_only(true).same_site(SameSite::Strict).build();
    HeaderValue::try_from(cookie.to_string()).expect("a cookie of ours is plain text")
}
