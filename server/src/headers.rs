//! What every answer carries for the browser's sake, and the one shape of every error.

use axum::extract::Request;
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::error::Error;

/// Only what this server itself serves, no frames around it, no plug-ins. `data:` is for the map
/// library's one-pixel image. (HSTS comes with TLS; over plain HTTP browsers ignore it.)
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; img-src 'self' data:; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// The headers of every answer.
const ALWAYS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("permissions-policy"), "camera=(), geolocation=(), microphone=()"),
];

/// Layer: sets them.
pub(crate) async fn secure(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    for (name, value) in ALWAYS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    // What the API tells is true only now; files carry their own rule.
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

/// Layer: an error that a library answered in its own words (a body too large, a timeout, a panic)
/// becomes a problem document like every other.
pub(crate) async fn problems(request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    let status = response.status();
    let ours = response
        .headers()
        .get(header::CONTENT_TYPE)
        .is_some_and(|kind| kind.as_bytes().starts_with(b"application/problem+json"));
    // An answer to HEAD has no body to say more in.
    if ours || !(status.is_client_error() || status.is_server_error()) {
        return response;
    }
    let mut problem = match status {
        StatusCode::PAYLOAD_TOO_LARGE => too_large(),
        StatusCode::SERVICE_UNAVAILABLE => too_late(),
        StatusCode::INTERNAL_SERVER_ERROR => failed(),
        StatusCode::METHOD_NOT_ALLOWED | StatusCode::NOT_FOUND => no_route(status),
        _ => Error::http(
            status,
            "bad_request",
            "the request is not as this route expects it: see docs/wire.md",
        ),
    }
    .into_response();
    for name in [header::ALLOW, header::UPGRADE, header::CONNECTION, header::SEC_WEBSOCKET_VERSION] {
        if let Some(value) = response.headers().get(&name) {
            problem.headers_mut().insert(name, value.clone());
        }
    }
    problem
}

/// A layer has refused a body before its handler could.
pub(crate) fn too_large() -> Error {
    Error::http(
        StatusCode::PAYLOAD_TOO_LARGE,
        "body_too_large",
        "the body is larger than this route takes: send less at once",
    )
}

/// The time that a request may take is over.
fn too_late() -> Error {
    Error::http(StatusCode::SERVICE_UNAVAILABLE, "timeout", "the server could not answer in time: try again")
}

/// A handler panicked, or a layer failed.
fn failed() -> Error {
    Error::http(
        StatusCode::INTERNAL_SERVER_ERROR,
        "internal",
        "the server failed at this; its log tells why: try again, or tell the server's administrator",
    )
}

/// The router knows no such path, or no such method of it.
fn no_route(status: StatusCode) -> Error {
    if status == StatusCode::METHOD_NOT_ALLOWED {
        return Error::http(
            status,
            "method_not_allowed",
            "this path exists, but not with this method: see the Allow header",
        );
    }
    Error::http(status, "no_such_path", "there is nothing at this path: see docs/wire.md for the routes")
}
