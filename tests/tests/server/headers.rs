//! What every answer of every route carries for the browser's sake, and what every cookie is bound by.

use lodestep_tests::every_route::Route;
use lodestep_tests::server::TestServer;
use lodestep_tests::staff::{PASSWORD, Person, SETUP_TOKEN, server_with_staff};
use reqwest::Response;
use serde_json::json;

/// What is wrong with an answer's headers.
fn complaints(what: &str, answer: &Response) -> Vec<String> {
    let header = |name: &str| {
        answer.headers().get(name).and_then(|value| value.to_str().ok()).unwrap_or_default().to_owned()
    };
    let policy = header("content-security-policy");
    let rules = [
        "default-src 'self'",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    ];
    let mut wrong: Vec<String> = rules
        .into_iter()
        .filter(|rule| !policy.split("; ").any(|part| part == *rule))
        .map(|rule| format!("{what}: no {rule} in {policy:?}"))
        .collect();
    if policy.contains("unsafe") || policy.contains("http") || policy.contains('*') {
        wrong.push(format!("{what}: {policy}"));
    }
    for (name, value) in [
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-resource-policy", "same-origin"),
        ("permissions-policy", "camera=(), geolocation=(), microphone=()"),
    ] {
        if header(name) != value {
            wrong.push(format!("{what}: {name} is {:?}, not {value:?}", header(name)));
        }
    }
    if header("x-request-id").is_empty() || header("cache-control").is_empty() {
        wrong.push(format!("{what}: no x-request-id or no cache-control"));
    }
    // Nothing here is for the pages of others.
    for name in answer.headers().keys().filter(|name| name.as_str().starts_with("access-control")) {
        wrong.push(format!("{what}: {name}"));
    }
    let status = answer.status();
    if (status.is_client_error() || status.is_server_error())
        && header("content-type") != "application/problem+json"
    {
        wrong.push(format!("{what}: {status} as {:?}", header("content-type")));
    }
    wrong
}

async fn asked(server: &TestServer, route: &Route, person: &Person) -> Response {
    let request = server.client.request(route.method.clone(), server.url(&route.path));
    let request = if person.cookie.is_empty() { request } else { request.header("cookie", &person.cookie) };
    request.json(&json!(["nothing"])).send().await.unwrap()
}

#[tokio::test]
async fn every_route_answers_with_the_headers_that_keep_browsers_safe_to_whoever_asks() {
    let (server, staff) = server_with_staff().await;
    let mut wrong = Vec::new();
    for person in [&Person::nobody(), &staff[0], &staff[5]] {
        for route in server.every_route().await {
            if route.path.ends_with("sign-out") {
                // It would end the sign-in that the others are asked with.
                continue;
            }
            let answer = asked(&server, &route, person).await;
            wrong.extend(complaints(
                &format!("{} {} for {:?}", route.method, route.template, person.name),
                &answer,
            ));
        }
    }
    for path in ["/", "/index.html", "/js/main.js", "/nothing.html", "/api/v1/nothing", "/sw.js"] {
        let answer = server.client.get(server.url(path)).send().await.unwrap();
        wrong.extend(complaints(path, &answer));
    }
    let preflight = server
        .client
        .request(reqwest::Method::OPTIONS, server.api("/sessions"))
        .header("origin", "http://evil.example")
        .header("access-control-request-method", "DELETE");
    wrong.extend(complaints("a preflight", &preflight.send().await.unwrap()));
    assert!(wrong.is_empty(), "{} headers are not as they should be:\n{}", wrong.len(), wrong.join("\n"));
}

#[tokio::test]
async fn every_cookie_that_is_set_is_for_this_host_secure_and_out_of_reach_of_scripts() {
    let server = TestServer::start_with(|config| config.setup_token = Some(SETUP_TOKEN.to_owned())).await;
    let post = |path: &str, body: serde_json::Value| server.client.post(server.api(path)).json(&body).send();
    let set_up = json!({"setup_token": SETUP_TOKEN, "name": "admin", "password": PASSWORD});
    let set_up = post("/account/set-up", set_up).await.unwrap();
    let sign_in = post("/account/sign-in", json!({"name": "admin", "password": PASSWORD})).await.unwrap();
    let refused = post("/account/sign-in", json!({"name": "admin", "password": "another"})).await.unwrap();
    assert!(!refused.headers().contains_key("set-cookie"), "a refused sign-in sets no cookie");
    let cookie = sign_in.headers()["set-cookie"].to_str().unwrap().split(';').next().unwrap().to_owned();
    let sign_out = server.client.post(server.api("/account/sign-out")).header("cookie", cookie).send();
    for answer in [set_up, sign_in, sign_out.await.unwrap()] {
        assert!(answer.status().is_success(), "{answer:?}");
        let cookies: Vec<_> = answer.headers().get_all("set-cookie").iter().collect();
        assert_eq!(cookies.len(), 1, "{cookies:?}");
        let parts: Vec<String> =
            cookies[0].to_str().unwrap().split(';').map(|part| part.trim().to_ascii_lowercase()).collect();
        assert!(parts[0].starts_with("__host-lodestep="), "{parts:?}");
        for part in ["path=/", "secure", "httponly", "samesite=strict"] {
            assert!(parts.iter().any(|found| found == part), "no {part} in {parts:?}");
        }
        assert!(!parts.iter().any(|part| part.starts_with("domain")), "{parts:?}");
    }
}

#[test]
fn both_proxies_send_browsers_to_tls_for_a_year() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy");
    for file in ["nginx.conf", "Caddyfile"] {
        let text = std::fs::read_to_string(root.join(file)).unwrap();
        let seconds = text
            .split("max-age=")
            .nth(1)
            .map(|rest| rest.chars().take_while(char::is_ascii_digit).collect::<String>());
        let seconds: u64 = seconds.unwrap_or_default().parse().unwrap_or(0);
        assert!(seconds >= 31_536_000, "{file}: Strict-Transport-Security of {seconds} s");
    }
}
