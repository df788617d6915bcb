//! Every route × every role: who may, in a table that is written by hand beside the one that the server declares.

use lodestep_server::api;
use lodestep_server::config::Config;
use lodestep_tests::staff::{Person, ROLES, server_with_staff};
use reqwest::Method;
use serde_json::json;

/// Anybody, or those of these roles by their first letters: viewer, inspector, dispatcher, surveyor, engineer, admin.
/// A question mark is a socket that opens for who shows nothing yet, and wants a token in the hello; `people` says it.
const MATRIX: &[(&str, &str, &str)] = &[
    ("GET", "/healthz", "anybody"),
    ("GET", "/readyz", "anybody"),
    ("GET", "/metrics", "videsa"),
    ("GET", "/api/v1/openapi.json", "anybody"),
    ("GET", "/api/v1/account", "anybody"),
    ("POST", "/api/v1/account/set-up", "anybody"),
    ("POST", "/api/v1/account/sign-in", "anybody"),
    ("POST", "/api/v1/account/sign-out", "anybody"),
    ("POST", "/api/v1/account/password", "videsa"),
    ("GET", "/api/v1/account/sign-ins", "videsa"),
    ("DELETE", "/api/v1/account/sign-ins/{id}", "videsa"),
    ("GET", "/api/v1/accounts", "a"),
    ("POST", "/api/v1/accounts", "a"),
    ("GET", "/api/v1/accounts/{id}", "a"),
    ("PATCH", "/api/v1/accounts/{id}", "a"),
    ("DELETE", "/api/v1/accounts/{id}", "a"),
    ("GET", "/api/v1/tokens", "videsa"),
    ("POST", "/api/v1/tokens", "videsa"),
    ("DELETE", "/api/v1/tokens/{id}", "videsa"),
    ("GET", "/api/v1/audit", "a"),
    ("GET", "/api/v1/audit.csv", "a"),
    ("GET", "/api/v1/webhooks", "a"),
    ("POST", "/api/v1/webhooks", "a"),
    ("GET", "/api/v1/webhooks/{id}", "a"),
    ("PATCH", "/api/v1/webhooks/{id}", "a"),
    ("DELETE", "/api/v1/webhooks/{id}", "a"),
    ("POST", "/api/v1/webhooks/{id}/secret", "a"),
    ("POST", "/api/v1/webhooks/{id}/test", "a"),
    ("GET", "/api/v1/webhooks/{id}/deliveries", "a"),
    ("POST", "/api/v1/webhooks/{id}/deliveries/{number}/again", "a"),
    ("GET", "/api/v1/server", "a"),
    ("POST", "/api/v1/backups", "a"),
    ("GET", "/api/v1/site", "videsa"),
    ("GET", "/api/v1/site/plan", "videsa"),
    ("GET", "/api/v1/systems", "videsa"),
    ("GET", "/api/v1/inspectors", "videsa"),
    ("POST", "/api/v1/inspectors", "da"),
    ("GET", "/api/v1/inspectors/{id}", "videsa"),
    ("PATCH", "/api/v1/inspectors/{id}", "da"),
    ("DELETE", "/api/v1/inspectors/{id}", "da"),
    ("GET", "/api/v1/sessions", "videsa"),
    ("POST", "/api/v1/sessions", "idea"),
    ("GET", "/api/v1/sessions/search", "videsa"),
    ("GET", "/api/v1/sessions/waiting", "videsa"),
    ("GET", "/api/v1/known-logs", "videsa"),
    ("POST", "/api/v1/sessions/{id}/end", "idea"),
    ("GET", "/api/v1/moment", "videsa"),
    ("GET", "/api/v1/alarms", "videsa"),
    ("GET", "/api/v1/alarms/acknowledged", "videsa"),
    ("POST", "/api/v1/alarms/acknowledged", "da"),
    ("GET", "/api/v1/sessions/{id}/note", "videsa"),
    ("PUT", "/api/v1/sessions/{id}/note", "dea"),
    ("GET", "/api/v1/sessions/{id}", "videsa"),
    ("PATCH", "/api/v1/sessions/{id}", "idea"),
    ("DELETE", "/api/v1/sessions/{id}", "idea"),
    ("POST", "/api/v1/sessions/{id}/logs", "idea"),
    ("GET", "/api/v1/logs/{id}", "videsa"),
    ("PATCH", "/api/v1/logs/{id}", "idea"),
    ("DELETE", "/api/v1/logs/{id}", "idea"),
    ("POST", "/api/v1/logs/{id}/finish", "idea"),
    ("POST", "/api/v1/logs/{id}/preview", "idea"),
    ("POST", "/api/v1/logs/preview", "idea"),
    ("GET", "/api/v1/mappings", "videsa"),
    ("POST", "/api/v1/mappings", "idea"),
    ("GET", "/api/v1/mappings/{id}", "videsa"),
    ("PUT", "/api/v1/mappings/{id}", "idea"),
    ("DELETE", "/api/v1/mappings/{id}", "idea"),
    ("GET", "/api/v1/sessions/{id}/visits", "videsa"),
    ("POST", "/api/v1/sessions/{id}/visits", "idea"),
    ("DELETE", "/api/v1/sessions/{id}/visits/{visit_id}", "idea"),
    ("GET", "/api/v1/sessions/{id}/stands", "videsa"),
    ("PUT", "/api/v1/sessions/{id}/stands/{number}/choice", "idea"),
    ("DELETE", "/api/v1/sessions/{id}/stands/{number}/choice", "idea"),
    ("GET", "/api/v1/sessions/{id}/report", "videsa"),
    ("GET", "/api/v1/sessions/{id}/charts", "videsa"),
    ("GET", "/api/v1/sessions/{id}/samples", "videsa"),
    ("POST", "/api/v1/sessions/{id}/process", "idea"),
    ("GET", "/api/v1/sessions/{id}/track", "videsa"),
    ("GET", "/api/v1/sessions/{id}/track.csv", "videsa"),
    ("GET", "/api/v1/sessions/{id}/track.geojson", "videsa"),
    ("GET", "/api/v1/sessions/{id}/track.gpx", "videsa"),
    ("GET", "/api/v1/sessions/{id}/track.kml", "videsa"),
    ("GET", "/api/v1/sessions/{id}/surveyed-points", "videsa"),
    ("GET", "/api/v1/sessions/{id}/surveyed-points.csv", "videsa"),
    ("GET", "/api/v1/sessions/{id}/surveyed-points.txt", "videsa"),
    ("GET", "/api/v1/sessions/{id}/surveyed-points.xml", "videsa"),
    ("POST", "/api/v1/sessions/{id}/marker-import", "sa"),
    ("GET", "/api/v1/sessions/{id}/anomalies", "videsa"),
    ("GET", "/api/v1/jobs", "videsa"),
    ("GET", "/api/v1/jobs/{id}", "videsa"),
    ("GET", "/api/v1/lab/parameters", "videsa"),
    ("GET", "/api/v1/lab/parameter-sets", "videsa"),
    ("POST", "/api/v1/lab/parameter-sets", "ea"),
    ("GET", "/api/v1/lab/parameter-sets/{id}", "videsa"),
    ("PUT", "/api/v1/lab/parameter-sets/{id}", "ea"),
    ("DELETE", "/api/v1/lab/parameter-sets/{id}", "ea"),
    ("GET", "/api/v1/lab/site-parameters", "videsa"),
    ("PUT", "/api/v1/lab/site-parameters", "ea"),
    ("GET", "/api/v1/lab/site-parameters.json", "videsa"),
    ("GET", "/api/v1/lab/runs", "videsa"),
    ("POST", "/api/v1/lab/runs", "ea"),
    ("GET", "/api/v1/lab/runs/{id}", "videsa"),
    ("DELETE", "/api/v1/lab/runs/{id}", "ea"),
    ("POST", "/api/v1/lab/runs/{id}/cancel", "ea"),
    ("GET", "/api/v1/lab/comparison", "videsa"),
    ("GET", "/api/v1/lab/comparison.csv", "videsa"),
    ("GET", "/api/v1/markers", "videsa"),
    ("POST", "/api/v1/markers", "sa"),
    ("GET", "/api/v1/markers.csv", "videsa"),
    ("POST", "/api/v1/markers/import", "sa"),
    ("GET", "/api/v1/markers/{name}", "videsa"),
    ("PUT", "/api/v1/markers/{name}", "sa"),
    ("DELETE", "/api/v1/markers/{name}", "sa"),
    ("GET", "/api/v1/markers/{name}/history", "videsa"),
    ("GET", "/api/v1/markers/{name}/residuals", "videsa"),
    ("GET", "/api/v1/markers/residuals", "videsa"),
    ("GET", "/api/v1/markers/imports", "videsa"),
    ("POST", "/api/v1/markers/imports", "sa"),
    ("GET", "/api/v1/markers/imports/{id}", "videsa"),
    ("DELETE", "/api/v1/markers/imports/{id}", "sa"),
    ("PUT", "/api/v1/markers/imports/{id}/reading", "sa"),
    ("POST", "/api/v1/markers/imports/{id}/apply", "sa"),
    ("POST", "/api/v1/markers/imports/{id}/revert", "sa"),
    ("GET", "/api/v1/faults", "videsa"),
    ("POST", "/api/v1/faults", "idea"),
    ("GET", "/api/v1/faults/{id}", "videsa"),
    ("PATCH", "/api/v1/faults/{id}", "idea"),
    ("GET", "/api/v1/faults/{id}/history", "videsa"),
    ("GET", "/api/v1/faults/{id}/nearest", "videsa"),
    ("GET", "/api/v1/faults/{id}/photos", "videsa"),
    ("POST", "/api/v1/faults/{id}/photos", "idea"),
    ("GET", "/api/v1/faults/{id}/photos/{photo_id}", "videsa"),
    ("DELETE", "/api/v1/faults/{id}/photos/{photo_id}", "idea"),
    ("POST", "/api/v1/faults/{id}/close", "da"),
    ("GET", "/api/v1/live", "?idea"),
    ("GET", "/api/v1/feed", "?videsa"),
    ("GET", "/api/v1/sessions/{id}/poses", "videsa"),
];

#[test]
fn every_route_has_a_row_in_the_matrix_and_every_row_a_route() {
    let folder = std::env::temp_dir();
    let routes = api::routes(&Config::for_testing(&folder));
    let mut declared: Vec<(String, String)> =
        routes.declared().iter().map(|route| (route.method.to_string(), route.path.clone())).collect();
    let mut rows: Vec<(String, String)> =
        MATRIX.iter().map(|(method, path, _)| ((*method).to_owned(), (*path).to_owned())).collect();
    declared.sort();
    rows.sort();
    let without_row: Vec<_> = declared.iter().filter(|route| !rows.contains(route)).collect();
    let without_route: Vec<_> = rows.iter().filter(|row| !declared.contains(row)).collect();
    assert!(
        without_row.is_empty() && without_route.is_empty(),
        "say in MATRIX who may ask for {without_row:?}; there is no route for {without_route:?}"
    );
}

/// Whether the table lets this role in; `None` is somebody who has not signed in.
fn may(who: &str, role: Option<&str>) -> bool {
    match role {
        _ if who == "anybody" => true,
        Some(role) => who.contains(&role[..1]),
        None => who.starts_with('?'),
    }
}

#[tokio::test]
async fn every_route_lets_in_whom_the_matrix_names_and_nobody_else() {
    let (server, staff) = server_with_staff().await;
    let mut wrong = Vec::new();
    let nobody = Person::nobody();
    let people = std::iter::once((None, &nobody)).chain(ROLES.iter().copied().map(Some).zip(&staff));
    for (role, person) in people {
        for (method, path, who) in MATRIX {
            if path.ends_with("sign-out") {
                // It would end the sign-in that the rest of the rows is asked with.
                continue;
            }
            // Ids of nothing: a caller that is let in finds nothing to break.
            let path = path
                .replace("{id}", "01900000-0000-7000-8000-000000000000")
                .replace("{photo_id}", "01900000-0000-7000-8000-000000000000")
                .replace("{number}", "1")
                .replace("{name}", "nothing");
            let method: Method = method.parse().unwrap();
            let request = server.client.request(method.clone(), server.url(&path));
            let request =
                if person.cookie.is_empty() { request } else { request.header("cookie", &person.cookie) };
            // A list, which no route takes: what gets through to a handler is refused there.
            let answer = request.json(&json!(["nothing"])).send().await.unwrap();
            let (status, let_in) = (answer.status().as_u16(), !matches!(answer.status().as_u16(), 401 | 403));
            assert!(status < 500, "{method} {path} for {role:?}: {status}");
            let refused_rightly = status == if role.is_none() { 401 } else { 403 };
            if let_in != may(who, role) || (!let_in && !refused_rightly) {
                wrong.push(format!("{method} {path} for {}: {status}", role.unwrap_or("nobody")));
            }
        }
    }
    assert!(wrong.is_empty(), "{} answers are not as the matrix says:\n{}", wrong.len(), wrong.join("\n"));
}
