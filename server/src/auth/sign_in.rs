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
    let from = (address, accounts::knows_address(app.store.read(), name, address).await?);
    app.auth.guesses.count_try(&name_key, from, Instant::now())?;
    let account = accounts::by_name(app.store.read(), name).await?;
    let now = utc::now();
    let good =
        account.as_ref().filter(|account| !account.disabled && account.expires_at.is_none_or(|at| at > now));
    let kept = good.map(|account| account.password_hash.clone());
    let right = app.auth.is_password(password, kept).await?;
    let Some(account) = account.filter(|_| right) else {
        tracing::warn!(address, "a sign-in was refused");
        metrics::counter!("lodestep_sign_ins_refused_total").increment(1);
        return Err(Error::http(
            axum::http::StatusCode::UNAUTHORIZED,
            "wrong_name_or_password",
            "expected the name and the password of an account, found at least one of them wrong: check both; an administrator can set a new password",
        ));
    };
    app.auth.guesses.right(&name_key, from);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::rights::Role;
    use crate::serve;

    const PASSWORD: &str = "ein guter Satz";

    fn typed(text: &str) -> Password {
        serde_json::from_value(text.into()).unwrap()
    }

    async fn account(app: &App, name: &str, change: impl FnOnce(&mut Account)) {
        let now = utc::now();
        let mut account = Account {
            id: Uuid::now_v7(),
            name: name.to_owned(),
            role: Role::Viewer,
            password_hash: typed(PASSWORD).hash().await.unwrap(),
            inspector_id: None,
            disabled: false,
            expires_at: None,
            created_at: now,
            updated_at: now,
        };
        change(&mut account);
        let insert =
            app.store.writer().run(move |db| Box::pin(async move { accounts::insert(db, &account).await }));
        insert.await.map_err(|error: StoreError| error).unwrap();
    }

    /// The work that an answer takes tells as little as its words: the same hash is worked out whatever is wrong.
    #[tokio::test]
    async fn each_refusal_costs_one_hash_and_says_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let app = serve::open(Config::for_testing(folder.path())).await.unwrap();
        account(&app, "there", |_| ()).await;
        account(&app, "disabled", |account| account.disabled = true).await;
        account(&app, "expired", |account| account.expires_at = Some(utc::now() - Duration::days(1))).await;
        account(&app, "damaged", |account| account.password_hash = "damaged".to_owned()).await;
        let long = "x".repeat(5_000);
        let mut answers = Vec::new();
        for (n, (name, password)) in [
            ("there", "another sentence"),
            ("there", ""),
            ("there", long.as_str()),
            ("nobody", PASSWORD),
            ("", PASSWORD),
            ("disabled", PASSWORD),
            ("expired", PASSWORD),
            ("damaged", PASSWORD),
        ]
        .into_iter()
        .enumerate()
        {
            let before = app.auth.passwords_checked();
            let refused = sign_in(&app, name, typed(password), &format!("10.0.0.{n}"), "").await;
            let problem = refused.err().unwrap_or_else(|| panic!("{name} got in")).into_problem();
            assert_eq!(app.auth.passwords_checked() - before, 1, "{name}");
            answers.push(problem);
        }
        assert!(answers.windows(2).all(|two| two[0] == two[1]), "{answers:?}");
        let before = app.auth.passwords_checked();
        assert!(sign_in(&app, "there", typed(PASSWORD), "10.0.0.99", "").await.is_ok());
        assert_eq!(app.auth.passwords_checked() - before, 1);
    }
}
