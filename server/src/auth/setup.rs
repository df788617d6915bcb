//! The first account: made with what the server printed when it started.

use std::net::SocketAddr;
use std::time::Instant;

use uuid::Uuid;

use super::caller::Caller;
use super::sign_in::remember;
use super::{Password, Secret};
use crate::error::{Error, Result};
use crate::rights::Role;
use crate::state::App;
use crate::store::accounts::{self, Account};
use crate::store::audit;
use crate::utc;

/// Letters in the name of an account.
const NAME_LETTERS: usize = 80;

/// Says, once at the start, that there is no account yet and how the first is made.
pub(crate) fn tell_how(app: &App, address: SocketAddr) {
    if app.auth.has_accounts() {
        return;
    }
    // One that was chosen is known to its chooser; one that was made by chance is good until it is used.
    let which = match app.config.setup_token {
        Some(_) => "the setup token that this server was started with".to_owned(),
        None => format!("this setup token: {}", app.auth.setup_token()),
    };
    tracing::warn!(
        "nobody has an account yet: everybody at this machine may do everything, nobody else anything. To make the first account open http://{address}/#/account and show {which}"
    );
}

/// A name that an account can have.
pub(crate) fn checked_name(name: &str) -> Result<String> {
    let name = name.trim();
    let letters = name.chars().count();
    if letters == 0 || letters > NAME_LETTERS || name.chars().any(char::is_control) {
        return Err(Error::invalid(
            "wrong_name",
            format!("expected a name of 1 to {NAME_LETTERS} letters without line breaks, found {name:?}"),
        ));
    }
    Ok(name.to_owned())
}

/// Makes the first account, an administrator's, for who shows the setup token, and signs its owner in.
pub(crate) async fn set_up(
    app: &App,
    setup_token: &str,
    name: &str,
    password: Password,
    caller: &Caller,
    agent: &str,
) -> Result<(Account, Secret)> {
    if app.auth.has_accounts() {
        return Err(Error::conflict("set_up_already", "there is an account already: sign in"));
    }
    app.auth.guesses.count_try("setup token", (&caller.address, false), Instant::now())?;
    if !app.auth.is_setup_token(setup_token) {
        return Err(Error::http(
            axum::http::StatusCode::UNAUTHORIZED,
            "wrong_setup_token",
            "expected the setup token that the server printed when it started, found another: look at its log, or start it again for a new one",
        ));
    }
    let name = checked_name(name)?;
    password.checked(&name)?;
    let now = utc::now();
    let account = Account {
        id: Uuid::now_v7(),
        name,
        role: Role::Admin,
        password_hash: password.hash().await?,
        inspector_id: None,
        disabled: false,
        expires_at: None,
        created_at: now,
        updated_at: now,
    };
    let row = account.clone();
    let entry = caller.did("account.added", account.id, None, serde_json::to_value(&account).ok());
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                // Two who set up at the same time: the second comes too late.
                if accounts::any(&mut *db).await? {
                    return Err(Error::conflict("set_up_already", "there is an account already: sign in"));
                }
                accounts::insert(&mut *db, &row).await?;
                audit::insert(db, &entry).await?;
                Ok(())
            })
        })
        .await?;
    app.auth.guesses.right("setup token", (&caller.address, false));
    app.auth.has_one_now();
    tracing::info!("the first account was made: from now on everybody signs in");
    let secret = remember(app, &account, &caller.address, agent).await?;
    Ok((account, secret))
}
