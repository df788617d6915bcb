//! One's own account: who one is, signing in and out, the first account of all.

use axum::extract::State;
use axum::http::HeaderValue;
use cookie::{Cookie, SameSite};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::auth::{self, By, COOKIE, Caller, Password, SIGNED_IN_FOR, Secret, not_signed_in};
use crate::error::{Error, Result};
use crate::http::{AnswerHeader, Created, Json, Needs, NoContent, Path, Routes, UserAgent, With};
use crate::rights::{Right, Role};
use crate::state::App;
use crate::store::accounts::{self, Account};
use crate::store::audit;
use crate::store::sign_ins::{self, SignIn};
use crate::utc;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/account", Right::Open, show)
        .about("get_own_account", "Who asks, and what they may")
        .post("/account/set-up", Right::Open, set_up)
        .about("set_up_first_account", "Makes the first account, an administrator's, with the setup token")
        .post("/account/sign-in", Right::Open, sign_in)
        .about("sign_in", "Signs in: the answer sets the cookie")
        .post("/account/sign-out", Right::Open, sign_out)
        .about("sign_out", "Signs this browser out")
        .post("/account/password", Needs::SignedIn(Right::Known), change_password)
        .about("change_own_password", "Changes one's own password; other browsers are signed out")
        .get("/account/sign-ins", Right::Known, list_sign_ins)
        .about("list_own_sign_ins", "The browsers in which one is signed in")
        .delete("/account/sign-ins/{id}", Needs::SignedIn(Right::Known), end_sign_in)
        .about("end_own_sign_in", "Signs one of one's browsers out")
}

/// Who asks, and whether there is anything to sign in to.
#[derive(Debug, Serialize, JsonSchema)]
struct OwnAccount {
    /// Whether there is an account; until then nobody signs in.
    has_accounts: bool,
    /// Whether who asks may do anything without signing in.
    known: bool,
    id: Option<Uuid>,
    #[schemars(example = &"li wei")]
    name: Option<String>,
    role: Option<Role>,
    rights: Vec<Right>,
    inspector_id: Option<Uuid>,
}

async fn show(State(app): State<App>, caller: Caller) -> Result<Json<OwnAccount>> {
    let account = match caller.account {
        Some(id) => accounts::get(app.store.read(), id).await?,
        None => None,
    };
    Ok(Json(OwnAccount {
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
struct FirstAccount {
    #[schemars(example = &"the token that the server printed")]
    setup_token: String,
    #[schemars(example = &"li wei")]
    name: String,
    password: Password,
}

async fn set_up(
    State(app): State<App>,
    caller: Caller,
    UserAgent(agent): UserAgent,
    Json(asked): Json<FirstAccount>,
) -> Result<With<SessionCookie, Created<Json<Account>>>> {
    let (account, secret) =
        auth::set_up(&app, &asked.setup_token, &asked.name, asked.password, &caller, &agent).await?;
    Ok(With(SessionCookie::of(&secret), Created(Json(account))))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Credentials {
    #[schemars(example = &"li wei")]
    name: String,
    password: Password,
}

async fn sign_in(
    State(app): State<App>,
    caller: Caller,
    UserAgent(agent): UserAgent,
    Json(asked): Json<Credentials>,
) -> Result<With<SessionCookie, Json<Account>>> {
    let (account, secret) = auth::sign_in(&app, &asked.name, asked.password, &caller.address, &agent).await?;
    Ok(With(SessionCookie::of(&secret), Json(account)))
}

async fn sign_out(State(app): State<App>, caller: Caller) -> Result<With<SessionCookie, NoContent>> {
    auth::sign_out(&app, &caller).await?;
    Ok(With(SessionCookie::none(), NoContent))
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
) -> Result<NoContent> {
    let By::SignIn(own) = caller.by else { return Err(not_signed_in()) };
    let account = own_account(&app, &caller).await?;
    let key = accounts::name_key(&account.name);
    app.auth.guesses.count_try(&key, (&caller.address, true), std::time::Instant::now())?;
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
    Ok(NoContent)
}

async fn list_sign_ins(State(app): State<App>, caller: Caller) -> Result<Json<Vec<SignIn>>> {
    let Some(account) = caller.account else { return Ok(Json(Vec::new())) };
    Ok(Json(sign_ins::of_account(app.store.read(), account).await?))
}

/// Signs another browser of one's own out.
async fn end_sign_in(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    let found = sign_ins::get(app.store.read(), id).await?;
    let own = found.filter(|(sign_in, _)| Some(sign_in.account_id) == caller.account);
    if own.is_none() {
        return Err(Error::not_found("sign-in", id));
    }
    app.store.writer().run(move |db| Box::pin(async move { sign_ins::delete(db, id).await })).await?;
    app.auth.changed();
    Ok(NoContent)
}

async fn own_account(app: &App, caller: &Caller) -> Result<Account> {
    let id = caller.account.ok_or_else(not_signed_in)?;
    accounts::get(app.store.read(), id).await?.ok_or_else(not_signed_in)
}

/// The cookie that a browser keeps: for this host only, never shown to scripts, sent by our own pages only.
struct SessionCookie(HeaderValue);

impl SessionCookie {
    fn of(secret: &Secret) -> SessionCookie {
        SessionCookie::new(Cookie::build((COOKIE, secret.text().to_owned())).max_age(SIGNED_IN_FOR))
    }

    /// Takes it away again.
    fn none() -> SessionCookie {
        SessionCookie::new(Cookie::build((COOKIE, String::new())).max_age(time::Duration::ZERO))
    }

    fn new(cookie: cookie::CookieBuilder<'static>) -> SessionCookie {
        let cookie = cookie.path("/").secure(true).http_only(true).same_site(SameSite::Strict).build();
        SessionCookie(HeaderValue::try_from(cookie.to_string()).expect("a cookie of ours is plain text"))
    }
}

impl AnswerHeader for SessionCookie {
    const NAME: &'static str = "Set-Cookie";
    const ABOUT: &'static str = "The cookie that shows who is signed in";

    fn value(self) -> HeaderValue {
        self.0
    }
}
