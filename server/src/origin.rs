//! Which pages may ask: protects the server from the pages of other sites in the same browser.

use axum::extract::{Request, State};
use axum::http::{HeaderMap, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::error::{Error, Result};
use crate::state::App;

/// Layer: refuses requests under a foreign host name, and changes or sockets asked for by a foreign page.
pub(crate) async fn guard(State(app): State<App>, request: Request, next: Next) -> Response {
    let authority = request.uri().authority().map(|host| host.as_str());
    match check(request.method(), request.headers(), authority, app.auth.has_accounts()) {
        Ok(()) => next.run(request).await,
        Err(error) => error.into_response(),
    }
}

/// Whether this request may be answered at all. `authority` is the host of an absolute request line. With accounts
/// any name will do: what a name that was pointed here by somebody else asks for comes without the cookie.
fn check(method: &Method, headers: &HeaderMap, authority: Option<&str>, has_accounts: bool) -> Result<()> {
    let host = match authority {
        Some(host) => host,
        None => headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default(),
    };
    // A name that an attacker points at 127.0.0.1 (DNS rebinding) would be an origin of its own here.
    if !has_accounts && !is_loopback_name(host) {
        return Err(Error::http(
            StatusCode::MISDIRECTED_REQUEST,
            "wrong_host",
            format!(
                "expected the Host localhost, 127.0.0.1 or [::1], found {host:?}: until the first account is made, this server answers only under the names of the machine itself"
            ),
        ));
    }
    let socket = headers.contains_key(header::UPGRADE);
    if method.is_safe() && !socket {
        return Ok(());
    }
    match headers.get(header::ORIGIN) {
        Some(origin) => same_origin(origin.to_str().unwrap_or_default(), host),
        // Browsers send an Origin with every change asked for by another site's page; programs send
        // none. What a bare HTML form can send is refused all the same.
        None if is_form(headers) && !socket => Err(Error::http(
            StatusCode::FORBIDDEN,
            "form_not_accepted",
            "found the content type of an HTML form and no Origin: send application/json or text/csv",
        )),
        None => Ok(()),
    }
}

/// Whether an Origin is the page of this very server.
fn same_origin(origin: &str, host: &str) -> Result<()> {
    let page = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
    if page.is_some_and(|page| page.eq_ignore_ascii_case(host)) {
        return Ok(());
    }
    Err(Error::http(
        StatusCode::FORBIDDEN,
        "foreign_origin",
        format!(
            "expected a request by a page of {host}, found Origin {origin:?}: open the page from this server"
        ),
    ))
}

/// Whether a Host, with or without a port, names this machine itself.
fn is_loopback_name(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(v6) => v6.split_once(']').map_or("", |(name, _)| name),
        None => host.split(':').next().unwrap_or_default(),
    };
    name.eq_ignore_ascii_case("localhost")
        || name.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback())
}

/// Whether the body has one of the three types that a form can send without being asked first.
fn is_form(headers: &HeaderMap) -> bool {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    let kind = kind.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    matches!(kind.as_str(), "application/x-www-form-urlencoded" | "multipart/form-data" | "text/plain")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(method: Method, headers: &[(&'static str, &'static str)]) -> Option<String> {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.insert(*name, value.parse().unwrap());
        }
        check(&method, &map, None, false).err().map(|error| error.into_problem().code)
    }

    #[test]
    fn a_rebound_name_is_refused_even_for_reading() {
        assert_eq!(code(Method::GET, &[("host", "evil.example:8080")]).as_deref(), Some("wrong_host"));
        assert_eq!(code(Method::GET, &[("host", "127.0.0.1.evil.example")]).as_deref(), Some("wrong_host"));
        assert_eq!(code(Method::GET, &[]).as_deref(), Some("wrong_host"));
    }

    #[test]
    fn with_accounts_any_name_will_do_but_no_foreign_page() {
        let mut map = HeaderMap::new();
        map.insert("host", "positions.site.example".parse().unwrap());
        assert!(check(&Method::GET, &map, None, true).is_ok());
        map.insert("origin", "https://positions.site.example".parse().unwrap());
        assert!(check(&Method::POST, &map, None, true).is_ok());
        map.insert("origin", "https://evil.example".parse().unwrap());
        assert!(check(&Method::POST, &map, None, true).is_err());
    }

    #[test]
    fn every_name_of_the_machine_itself_is_accepted() {
        for host in ["localhost", "LOCALHOST:8080", "127.0.0.1:1", "127.9.9.9", "[::1]:8080", "[::1]"] {
            assert_eq!(code(Method::GET, &[("host", host)]), None, "{host}");
        }
    }

    #[test]
    fn a_foreign_page_may_neither_change_anything_nor_open_a_socket() {
        let foreign = [("host", "localhost:8080"), ("origin", "http://evil.example")];
        assert_eq!(code(Method::POST, &foreign).as_deref(), Some("foreign_origin"));
        assert_eq!(code(Method::DELETE, &foreign).as_deref(), Some("foreign_origin"));
        let other_port = [("host", "localhost:8080"), ("origin", "http://localhost:9090")];
        assert_eq!(code(Method::POST, &other_port).as_deref(), Some("foreign_origin"));
        let sandboxed = [("host", "localhost:8080"), ("origin", "null")];
        assert_eq!(code(Method::POST, &sandboxed).as_deref(), Some("foreign_origin"));
        let socket =
            [("host", "localhost:8080"), ("origin", "http://evil.example"), ("upgrade", "websocket")];
        assert_eq!(code(Method::GET, &socket).as_deref(), Some("foreign_origin"));
    }

    #[test]
    fn our_own_page_and_programs_may() {
        let own = [("host", "localhost:8080"), ("origin", "http://localhost:8080")];
        assert_eq!(code(Method::POST, &own), None);
        assert_eq!(code(Method::GET, &[("host", "localhost:8080"), ("upgrade", "websocket")]), None);
        let program = [("host", "localhost:8080"), ("content-type", "application/json; charset=utf-8")];
        assert_eq!(code(Method::POST, &program), None);
    }

    #[test]
    fn a_bare_form_may_not() {
        for kind in ["text/plain", "application/x-www-form-urlencoded", "Multipart/Form-Data; boundary=x"] {
            let form = [("host", "localhost:8080"), ("content-type", kind)];
            assert_eq!(code(Method::POST, &form).as_deref(), Some("form_not_accepted"), "{kind}");
        }
    }
}
