//! From a cookie or a bearer token to who it is.

use axum::http::{HeaderMap, header};
use time::{Duration, OffsetDateTime};
use uuid::Uuid;

use super::Secret;
use super::caller::{By, Caller, not_signed_in};
use crate::error::Result;
use crate::rights::Right;
use crate::state::App;
use crate::store::StoreError;
use crate::store::accounts::{self, Account};
use crate::store::{sign_ins, tokens};
use crate::utc;

/// The cookie of a browser that has signed in: `__Host-` binds it to this host, whole, and to a secure context.
pub(crate) const COOKIE: &str = "__Host-lodestep";
/// The last use is written down at most this often: not each request is a write.
const SEEN_EVERY: Duration = Duration::minutes(1);

/// Who sends these headers: by a bearer token, else by a cookie. Something that is not good is refused, it does not
/// make its sender nobody.
pub(super) async fn of(app: &App, headers: &HeaderMap, address: &str) -> Result<Option<Caller>> {
    if let Some(authorization) = headers.get(header::AUTHORIZATION) {
        let text = authorization.to_str().unwrap_or_default();
        let token = text.split_once(' ').filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
        return by_token(app, token.map_or("", |(_, token)| token.trim()), address).await.map(Some);
    }
    match cookie(headers) {
        Some(secret) => by_cookie(app, &secret, address).await,
        None => Ok(None),
    }
}

/// A part of this program that shows its token, whether there are accounts or not: what it opens stays open when the
/// first one is made.
pub(super) fn of_ourselves(app: &App, headers: &HeaderMap) -> Option<Caller> {
    let text = headers.get(header::AUTHORIZATION)?.to_str().ok()?;
    let secret = Secret::sent(text.strip_prefix("Bearer ")?)?;
    (secret.sha256() == app.auth.own_token.sha256()).then(|| Caller::itself("demo"))
}

/// The secret of our cookie.
pub(super) fn cookie(headers: &HeaderMap) -> Option<Secret> {
    let sent = headers.get_all(header::COOKIE).iter().filter_map(|sent| sent.to_str().ok());
    sent.flat_map(cookie::Cookie::split_parse)
        .filter_map(Result::ok)
        .find(|cookie| cookie.name() == COOKIE)
        .and_then(|cookie| Secret::sent(cookie.value()))
}

/// Who holds this token.
pub(crate) async fn by_token(app: &App, text: &str, address: &str) -> Result<Caller> {
    let secret = Secret::sent(text).ok_or_else(not_signed_in)?;
    if secret.sha256() == app.auth.own_token.sha256() {
        return Ok(Caller::itself("demo"));
    }
    let found = tokens::by_secret(app.store.read(), secret.sha256()).await?;
    let (token, account) = found.ok_or_else(not_signed_in)?;
    if token.used_at.is_none_or(|at| utc::now() - at > SEEN_EVERY) {
        let id = token.id;
        let noted = app
            .store
            .writer()
            .run(move |db| Box::pin(async move { tokens::used(db, id, utc::now()).await }))
            .await;
        unless_passing(noted)?;
    }
    of_token(&token, &account, address).ok_or_else(not_signed_in)
}

async fn by_cookie(app: &App, secret: &Secret, address: &str) -> Result<Option<Caller>> {
    // A browser keeps its cookie longer than we do: it is nobody then, and may sign in again.
    let Some((sign_in, account)) = sign_ins::by_secret(app.store.read(), secret.sha256()).await? else {
        return Ok(None);
    };
    if utc::now() - sign_in.seen_at > SEEN_EVERY {
        let id = sign_in.id;
        let noted = app
            .store
            .writer()
            .run(move |db| Box::pin(async move { sign_ins::seen(db, id, utc::now()).await }))
            .await;
        unless_passing(noted)?;
    }
    Ok(of_sign_in(&sign_in, &account, address))
}

/// When somebody was seen is worth no refusal: on a full disk they may still read.
fn unless_passing(noted: Result<(), StoreError>) -> Result<(), StoreError> {
    match noted {
        Err(error) if error.is_passing() => Ok(()),
        other => other,
    }
}

/// The same caller, as it would be known now; `None` when it is known no longer.
pub(super) async fn again(app: &App, caller: &Caller) -> Result<Option<Caller>> {
    let db = app.store.read();
    Ok(match caller.by {
        By::Itself => Some(caller.clone()),
        By::WorkingAtTheMachine => (!app.auth.has_accounts()).then(|| caller.clone()),
        By::Nothing => None,
        By::SignIn(id) => sign_ins::get(db, id)
            .await?
            .and_then(|(sign_in, account)| of_sign_in(&sign_in, &account, &caller.address)),
        By::Token(id) => tokens::with_account(db, id)
            .await?
            .and_then(|(token, account)| of_token(&token, &account, &caller.address)),
    })
}

fn of_sign_in(sign_in: &sign_ins::SignIn, account: &Account, address: &str) -> Option<Caller> {
    if !is_good(account) || sign_in.expires_at <= utc::now() {
        return None;
    }
    let rights = account.role.rights().to_vec();
    Some(Caller::known(
        By::SignIn(sign_in.id),
        account.id,
        account.name.clone(),
        address.to_owned(),
        rights.clone(),
        own(account, &rights),
        earlier(Some(sign_in.expires_at), account.expires_at),
    ))
}

fn of_token(token: &tokens::Token, account: &Account, address: &str) -> Option<Caller> {
    let now = utc::now();
    if !is_good(account) || token.revoked_at.is_some() || token.expires_at.is_some_and(|at| at <= now) {
        return None;
    }
    // Never more than its owner may today.
    let rights: Vec<Right> = token.rights.iter().copied().filter(|right| account.role.may(*right)).collect();
    Some(Caller::known(
        By::Token(token.id),
        account.id,
        format!("{} by token {}", account.name, token.name),
        address.to_owned(),
        rights.clone(),
        token.inspector_id.or_else(|| own(account, &rights)),
        earlier(token.expires_at, account.expires_at),
    ))
}

/// The one inspector whose walks an account may write; `None` for who may write all.
fn own(account: &Account, rights: &[Right]) -> Option<Uuid> {
    account.inspector_id.filter(|_| !rights.contains(&Right::WalkForOthers))
}

fn is_good(account: &accounts::Account) -> bool {
    !account.disabled && account.expires_at.is_none_or(|at| at > utc::now())
}

fn earlier(one: Option<OffsetDateTime>, other: Option<OffsetDateTime>) -> Option<OffsetDateTime> {
    [one, other].into_iter().flatten().min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn our_cookie_is_found_among_others_and_nothing_else_is_taken_for_it() {
        let secret = Secret::random();
        let mut headers = HeaderMap::new();
        headers
            .insert(header::COOKIE, format!("theme=dark; {COOKIE}={}; a=b", secret.text()).parse().unwrap());
        assert_eq!(cookie(&headers), Some(secret.clone()));
        headers.insert(header::COOKIE, format!("lodestep={}", secret.text()).parse().unwrap());
        assert_eq!(cookie(&headers), None);
        headers.insert(header::COOKIE, format!("{COOKIE}=short").parse().unwrap());
        assert_eq!(cookie(&headers), None);
    }
}
