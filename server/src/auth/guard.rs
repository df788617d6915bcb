//! The layer before every route: who asks, and may they.

use std::net::SocketAddr;

use axum::extract::{ConnectInfo, MatchedPath, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::caller::{By, Caller};
use super::credentials;
use crate::error::{Error, Result};
use crate::http::Needs;
use crate::rights::Right;
use crate::state::App;
use crate::store::{faults, logs, mappings, sessions};

/// Layer: finds out who asks, refuses who may not, and hands the [`Caller`] on. A route that declares no right is
/// refused to everybody.
pub(crate) async fn guard(State(app): State<App>, request: Request, next: Next) -> Response {
    let (mut asked, body) = request.into_parts();
    match check(&app, &asked).await {
        Ok(caller) => {
            asked.extensions.insert(caller);
            next.run(Request::from_parts(asked, body)).await
        }
        Err(error) => error.into_response(),
    }
}

async fn check(app: &App, asked: &Parts) -> Result<Caller> {
    let needs = declared(app, asked)?;
    let caller = match asked.extensions.get::<Caller>() {
        // From inside this program: no header becomes an extension.
        Some(caller) => caller.clone(),
        None => who(app, asked).await?,
    };
    match needs {
        Needs::Right(right) => caller.needs(right)?,
        // A device may show its token in its first message. What is shown here must be good.
        Needs::Socket(right) if caller.by != By::Nothing => caller.needs(right)?,
        Needs::Socket(_) => {}
        Needs::OwnSession => own_session(app, asked, &caller).await?,
        Needs::OwnLog => own_log(app, asked, &caller).await?,
        Needs::OwnFault => own_fault(app, asked, &caller, true).await?,
        Needs::ReportedFault => own_fault(app, asked, &caller, false).await?,
        Needs::OwnMapping => own_mapping(app, asked, &caller).await?,
        Needs::SignedIn(right) => {
            caller.needs(right)?;
            signed_in(&caller)?;
        }
    }
    Ok(caller)
}

/// It is another's.
fn not_yours(expected: &str) -> Error {
    Error::http(
        StatusCode::FORBIDDEN,
        "not_yours",
        format!("expected {expected}, found another's: ask a dispatcher, or its maker"),
    )
}

/// Refuses who may not write the session that the path names.
async fn own_session(app: &App, asked: &Parts, caller: &Caller) -> Result<()> {
    caller.needs(Right::Walk)?;
    caller.writes_for(inspector_of_session(app, id(asked)?).await?)
}

/// Refuses who may not write the session of the log that the path names.
async fn own_log(app: &App, asked: &Parts, caller: &Caller) -> Result<()> {
    caller.needs(Right::Walk)?;
    let log = logs::get(app.store.read(), id(asked)?).await?;
    let log = log.ok_or_else(|| Error::not_found("log", part(asked)))?;
    caller.writes_for(inspector_of_session(app, log.session_id).await?)
}

/// Refuses who neither reported the fault that the path names nor, where that is enough, sees to it.
async fn own_fault(app: &App, asked: &Parts, caller: &Caller, is_seen_to: bool) -> Result<()> {
    caller.needs(Right::Walk)?;
    let fault = faults::get(app.store.read(), id(asked)?).await?;
    let fault = fault.ok_or_else(|| Error::not_found("fault", part(asked)))?;
    let own = [Some(fault.inspector_id), fault.assignee_id.filter(|_| is_seen_to)];
    if own.into_iter().flatten().any(|inspector| caller.writes_for(inspector).is_ok()) {
        return Ok(());
    }
    Err(not_yours("a fault that this account's inspector reported or sees to"))
}

/// Refuses who did not make the mapping that the path names.
async fn own_mapping(app: &App, asked: &Parts, caller: &Caller) -> Result<()> {
    caller.needs(Right::Walk)?;
    let mapping = mappings::get(app.store.read(), id(asked)?).await?;
    let mapping = mapping.ok_or_else(|| Error::not_found("mapping", part(asked)))?;
    let own = mapping.created_by.is_some() && mapping.created_by == caller.account;
    if own || caller.may(Right::WalkForOthers) {
        return Ok(());
    }
    Err(not_yours("a mapping that this account made"))
}

/// Refuses a token.
fn signed_in(caller: &Caller) -> Result<()> {
    if let By::Token(_) = caller.by {
        return Err(Error::http(
            StatusCode::FORBIDDEN,
            "not_by_token",
            "expected somebody who has signed in, found a token: accounts, sign-ins and tokens are changed in the page, signed in",
        ));
    }
    Ok(())
}

/// What the route that matched asks for.
fn declared(app: &App, asked: &Parts) -> Result<Needs> {
    let path = asked.extensions.get::<MatchedPath>().map(MatchedPath::as_str);
    let method = if asked.method == Method::HEAD { &Method::GET } else { &asked.method };
    let Some(path) = path else { return Ok(Needs::Right(Right::Open)) };
    match app.routes.needs(method, path) {
        Some(needs) => Ok(needs),
        // A method that the path does not know is refused by the router.
        None if app.routes.has(path) => Ok(Needs::Right(Right::Open)),
        None => Err(Error::http(
            StatusCode::FORBIDDEN,
            "not_allowed",
            format!("{method} {path} declares no right, so nobody has it: declare one where the route is"),
        )),
    }
}

async fn who(app: &App, asked: &Parts) -> Result<Caller> {
    let address = address(asked);
    if app.auth.has_accounts() {
        let known = credentials::of(app, &asked.headers, &address).await?;
        return Ok(known.unwrap_or_else(|| Caller::unknown(address)));
    }
    if let Some(part) = credentials::of_ourselves(app, &asked.headers) {
        return Ok(part);
    }
    if is_handed_on(&asked.headers) {
        // From elsewhere, by a proxy at this machine: only people at this machine may do what needs no account.
        return Ok(Caller::unknown(address));
    }
    Ok(Caller::working_at_the_machine(address))
}

/// Where a request comes from: the peer or, where that is a proxy at this machine, whom the proxy names last.
fn address(asked: &Parts) -> String {
    let peer = asked.extensions.get::<ConnectInfo<SocketAddr>>().map(|info| info.0.ip());
    let named = || {
        let headers = asked.headers.get_all("x-forwarded-for");
        let last = headers.iter().next_back()?.to_str().ok()?.rsplit(',').next()?.trim();
        last.parse::<std::net::IpAddr>().ok()
    };
    match peer {
        Some(peer) if peer.is_loopback() => named().unwrap_or(peer).to_string(),
        Some(peer) => peer.to_string(),
        None => String::new(),
    }
}

/// Whether a proxy says that it hands a request on.
fn is_handed_on(headers: &HeaderMap) -> bool {
    ["x-forwarded-for", "x-forwarded-host", "x-forwarded-proto", "x-real-ip", "forwarded", "via"]
        .iter()
        .any(|name| headers.contains_key(*name))
}

/// The part of the path after the noun: `/api/v1/sessions/{id}/…`.
fn part(asked: &Parts) -> &str {
    asked.uri.path().split('/').nth(4).unwrap_or_default()
}

fn id(asked: &Parts) -> Result<Uuid> {
    Uuid::parse_str(part(asked)).map_err(|_| {
        let detail = format!("expected an id (a UUID), found {:?} in the path: check the id", part(asked));
        Error::http(StatusCode::NOT_FOUND, "not_an_id", detail)
    })
}

async fn inspector_of_session(app: &App, id: Uuid) -> Result<Uuid> {
    let session = sessions::get(app.store.read(), id).await?;
    Ok(session.ok_or_else(|| Error::not_found("session", id))?.inspector_id)
}
