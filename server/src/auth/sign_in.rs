//! Signing in and out of a browser.

use std::time::Instant;

use time::Duration;
use uuid::Uuid;

use super::caller::{By, Caller};
use super::{Password, Secret};
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::accounts::{self, Account};
use crate::store::sign_ins::{self, SignIn};
use crate::store::{StoreError, audit};
use crate::utc;

/// How long a sign-in lasts; a control room's screen is signed in anew once a month.
pub(crate) const SIGNED_IN_FOR: Duration = Duration::days(30);
/// Letters that are kept of what a browser calls itself.
const AGENT_LETTERS: usize = 200;

/// Checks name and password; the secret for the browser's cookie. Whatever is wrong, the answer is the same.
pub(crate) async fn sign_in(
    app: &App,
    name: &str,
    password: Password,
    address: &str,
    agent: &str,
) -> Result<(Account, Secret)> {
    let name_key = accounts::name_key(name);
    app.auth.guesses.begin(&name_key, address, Instant::now())?;
    let account = accounts::by_name(app.store.read(), name).await?;
    let now = utc::now();
    let good =
        account.as_ref().filter(|account| !account.disabled && account.expires_at.is_none_or(|at| at > now));
    let right = password.is(good.map(|account| account.password_hash.clone())).await?;
    let Some(account) = account.filter(|_| right) else {
        tracing::warn!(address, "a sign-in was refused");
        return Err(Error::http(
            axum::http::StatusCode::UNAUTHORIZED,
            "wrong_name_or_password",
            "expected the name and the password of an account, found at least one of them wrong: check both; an administrator can set a new password",
        ));
    };
    app.auth.guesses.right(&name_key, address);
    let secret = remember(app, &account, address, agent).await?;
    Ok((account, secret))
}

/// Keeps that somebody has signed in.
pub(super) async fn remember(app: &App, account: &Account, address: &str, agent: &str) -> Result<Secret> {
    let secret = Secret::random();
    let now = utc::now();
    let sign_in = SignIn {
        id: Uuid::now_v7(),
        account_id: account.id,
        address: address.to_owned(),
        agent: agent.chars().filter(|letter| !letter.is_control()).take(AGENT_LETTERS).collect(),
        created_at: now,
        seen_at: now,
        expires_at: now + SIGNED_IN_FOR,
    };
    let hash = secret.sha256();
    let entry = Caller::known(
        By::SignIn(sign_in.id),
        account.id,
        account.name.clone(),
        address.to_owned(),
        Vec::new(),
        None,
        None,
    )
    .did("account.signed_in", account.id, None, None);
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                sign_ins::insert(&mut *db, &sign_in, hash).await?;
                audit::insert(db, &entry).await
            })
        })
        .await?;
    Ok(secret)
}

/// Ends the sign-in that a caller was known by; what it has open is cut.
pub(crate) async fn sign_out(app: &App, caller: &Caller) -> Result<()> {
    let By::SignIn(id) = caller.by else { return Ok(()) };
    app.store
        .writer()
        .run(move |db| Box::pin(async move { sign_ins::delete(db, id).await }))
        .await
        .map_err(|error: StoreError| Error::from(error))?;
    app.auth.changed();
    Ok(())
}
