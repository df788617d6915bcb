//! What holds for every route: who may ask, what every answer carries, where the server may listen.

use lodestep_server::config::Config;
use lodestep_server::serve;
use lodestep_server::store::IS_SHARED;
use lodestep_tests::server::TestServer;
use serde_json::json;
use tokio::net::TcpListener;

#[tokio::test]
async fn an_address_that_others_can_reach_is_refused_with_the_reason() {
    let folder = tempfile::TempDir::new().unwrap();
    let listener = TcpListener::bind("0.0.0.0:0").await.unwrap();
    let refused = serve::serve(Config::for_testing(folder.path()), listener, async {}).await.unwrap_err();
    let sentence = refused.to_string();
    assert!(sentence.contains("nobody has an account yet"), "{sentence}");
    assert!(!folder.path().join("lodestep.db").exists(), "nothing is begun before the refusal");

    // Whether PostgreSQL has an account is known when it has been asked.
    if IS_SHARED {
        return;
    }
    let mut config = Config::for_testing(folder.path());
    config.listen = "192.0.2.1:8080".parse().unwrap();
    let sentence = serve::bind(&config).await.unwrap_err().to_string();
    assert!(sentence.contains("192.0.2.1:8080") && sentence.contains("SSH tunnel"), "{sentence}");
}

#[tokio::test]
async fn a_well_server_says_ok() {
    let server = TestServer::start().await;
    let answer = server.client.get(server.url("/healthz")).send().await.unwrap();
    assert_eq!(answer.status(), 200);
    assert_eq!(answer.text().await.unwrap(), "ok");
}

/// Every path that a browser may ask for, each kind of answer among them.
const PATHS: [(&str, u16); 12] = [
    ("/healthz", 200),
    ("/metrics", 200),
    ("/api/v1/site", 200),
    ("/api/v1/site/plan", 200),
    ("/api/v1/inspectors", 200),
    ("/api/v1/sessions", 200),
    ("/api/v1/markers", 200),
    ("/api/v1/markers.csv", 200),
    ("/api/v1/faults", 200),
    ("/api/v1/sessions/01890000-0000-7000-8000-000000000000", 404),
    ("/api/v1/nothing", 404),
    ("/nothing.html", 404),
];

#[tokio::test]
async fn every_answer_carries_the_headers_that_keep_browsers_safe() {
    let server = TestServer::start().await;
    for (path, status) in PATHS {
        let answer = server.client.get(server.url(path)).send().await.unwrap();
        assert_eq!(answer.status(), status, "{path}");
        let header = |name: &str| {
            let value = answer.headers().get(name).unwrap_or_else(|| panic!("{path} has no {name}"));
            value.to_str().unwrap().to_owned()
        };
        let policy = header("content-security-policy");
        for rule in ["default-src 'self'", "object-src 'none'", "base-uri 'none'", "frame-ancestors 'none'"] {
            assert!(policy.contains(rule), "{path}: {policy}");
        }
        assert!(!policy.contains("unsafe"), "{path}: {policy}");
        assert_eq!(header("x-content-type-options"), "nosniff");
        assert_eq!(header("referrer-policy"), "no-referrer");
        assert!(!header("x-request-id").is_empty());
        if status >= 400 {
            assert_eq!(header("content-type"), "application/problem+json", "{path}");
        }
    }
}

#[tokio::test]
async fn a_body_that_does_not_fit_is_told_what_was_expected_what_was_found_and_where() {
    let server = TestServer::start().await;
    let (_, inspector) = server.post("/inspectors", &json!({ "name": "Li Na" })).await;
    let (_, session) = server.post("/sessions", &json!({ "inspector_id": inspector["id"] })).await;
    let visits = format!("/sessions/{}/visits", session["id"].as_str().unwrap());
    let json = "application/json";
    for (path, kind, body, status, code, place, words) in [
        // A field that is missing, one of the wrong type, one that nobody knows.
        (
            "/inspectors",
            json,
            "{}",
            422,
            "wrong_field",
            json!("name"),
            "expected text, found none in name: add it",
        ),
        (
            "/inspectors",
            json,
            "{\n \"name\": 17}",
            422,
            "wrong_field",
            json!("name"),
            "expected text, found 17 in name",
        ),
        (
            "/inspectors",
            json,
            "{\"name\": \"a\", \"nmae\": \"b\"}",
            422,
            "wrong_field",
            json!("nmae"),
            "expected only the fields kind, name, found \"nmae\" in nmae: leave it out",
        ),
        // A word that is none of those there are, an id that is none, a time that is none.
        (
            "/faults",
            json,
            "{\"kind\": \"leak\", \"severity\": \"awful\"}",
            422,
            "wrong_field",
            json!("severity"),
            "expected one of low, medium, high, found \"awful\" in severity",
        ),
        (
            "/sessions",
            json,
            "{\"inspector_id\": \"Li Na\"}",
            422,
            "wrong_field",
            json!("inspector_id"),
            "expected an id (a UUID), found \"Li Na\" in inspector_id",
        ),
        (
            "/faults",
            json,
            "{\"kind\": \"leak\", \"severity\": \"low\", \"reported_at\": \"yesterday\"}",
            422,
            "wrong_field",
            json!("reported_at"),
            "expected a time such as 2026-11-28T08:15:00Z",
        ),
        // Deep inside, and where one of several shapes is meant.
        (
            &visits,
            json,
            "[{\"marker\": \"A1\", \"t_start_s\": 1, \"t_end_s\": 2}, {\"marker\": \"A1\", \"t_start_s\": 3}]",
            422,
            "wrong_field",
            json!("[1].t_end_s"),
            "expected a number, found none in [1].t_end_s: add it",
        ),
        (
            "/inspectors",
            json,
            "[]",
            422,
            "wrong_field",
            json!(null),
            "expected an object with name, found a list of 0",
        ),
        // What only reading finds.
        (
            "/inspectors",
            json,
            "{\"name\": \"a\", \"name\": \"b\"}",
            422,
            "wrong_field",
            json!(null),
            "breaks a rule (duplicate field `name`) at line 1, character 20",
        ),
        // What is no JSON.
        (
            "/inspectors",
            json,
            "{\"name\": ",
            400,
            "not_json",
            json!(null),
            "expected JSON that is complete, found its end",
        ),
        (
            "/inspectors",
            json,
            "{\"name\":\n \"名\",}",
            400,
            "not_json",
            json!(null),
            "found \"}\" at line 2, character 6",
        ),
        (
            "/inspectors",
            json,
            " \n",
            400,
            "not_json",
            json!(null),
            "expected a JSON body, found an empty one",
        ),
        (
            "/inspectors",
            "application/xml",
            "{}",
            415,
            "json_expected",
            json!(null),
            "expected a body of content type application/json, found \"application/xml\"",
        ),
    ] {
        let request = server.client.post(server.api(path)).header("content-type", kind).body(body.to_owned());
        let answer = request.send().await.unwrap();
        let (found, problem) = (answer.status().as_u16(), answer.json::<serde_json::Value>().await.unwrap());
        assert_eq!((found, problem["code"].as_str()), (status, Some(code)), "{body}: {problem}");
        assert_eq!(problem["where"]["field"], place, "{body}: {problem}");
        assert!(problem["detail"].as_str().unwrap().contains(words), "{body}: {words}: {problem}");
        if code != "json_expected" && !body.trim().is_empty() {
            let (line, character) = (&problem["where"]["line"], &problem["where"]["character"]);
            assert!(line.as_u64() > Some(0) && character.as_u64() > Some(0), "{body}: {problem}");
        }
    }
    // What is secret is not repeated.
    let body = json!({ "name": "Li Na", "password": 123_456_789 });
    let (_, problem) = server.post("/account/sign-in", &body).await;
    assert_eq!(problem["where"]["field"], "password", "{problem}");
    assert!(!problem["detail"].as_str().unwrap().contains("123456789"), "{problem}");
}

#[tokio::test]
async fn whatever_goes_wrong_is_told_as_a_problem_document() {
    let server = TestServer::start_with(|config| config.body_bytes = 1_000).await;
    let client = &server.client;
    let url = server.api("/inspectors");
    let json = |body: String| client.post(&url).header("content-type", "application/json").body(body);
    for (request, status, code) in [
        (json("{\"name\":".into()), 400, "not_json"),
        (json("{\"colour\":\"red\"".into()), 400, "not_json"),
        (json("{\"name\":17}".into()), 422, "wrong_field"),
        (json(format!("{{\"name\":\"{}\"}}", "x".repeat(2_000))), 413, "body_too_large"),
        (client.post(&url).body("name=x"), 415, "json_expected"),
        (client.put(&url), 405, "method_not_allowed"),
        (client.get(server.api("/inspectors/not-an-id")), 404, "not_an_id"),
        (client.get(server.api("/sessions?state=asleep")), 400, "wrong_query"),
        (client.get(server.api("/sessions?colour=red")), 400, "wrong_query"),
        (client.get(server.api("/no/such/thing")), 404, "no_such_path"),
    ] {
        let answer = request.send().await.unwrap();
        let (found, kind) = (answer.status().as_u16(), answer.headers()["content-type"].clone());
        let problem: serde_json::Value = answer.json().await.unwrap();
        assert_eq!((found, problem["code"].as_str()), (status, Some(code)), "{problem}");
        assert_eq!(kind, "application/problem+json");
        assert_eq!(
            (problem["type"].as_str(), problem["status"].as_u64()),
            (Some("about:blank"), Some(status.into()))
        );
        assert!(problem["title"].is_string() && !problem["detail"].as_str().unwrap().is_empty());
    }
}

#[tokio::test]
async fn a_page_of_another_site_can_neither_write_nor_read_through_a_rebound_name() {
    let server = TestServer::start().await;
    let url = server.api("/inspectors");
    let post = || server.client.post(&url).json(&serde_json::json!({ "name": "x" }));
    let foreign = post().header("origin", "http://evil.example").send().await.unwrap();
    assert_eq!(foreign.status(), 403);
    let form = server.client.post(&url).header("content-type", "text/plain").body("{\"name\":\"x\"}");
    assert_eq!(form.send().await.unwrap().status(), 403);
    let rebound = server.client.get(&url).header("host", "evil.example").send().await.unwrap();
    assert_eq!(rebound.status(), 421);
    assert_eq!(server.get("/inspectors").await.1, serde_json::json!([]));
    let own = post().header("origin", format!("http://{}", server.address)).send().await.unwrap();
    assert_eq!(own.status(), 201);
    for socket in ["/feed", "/live"] {
        let refused = server.client.get(server.api(socket)).header("origin", "http://evil.example");
        let refused =
            refused.header("upgrade", "websocket").header("connection", "upgrade").send().await.unwrap();
        assert_eq!(refused.status(), 403, "{socket}");
    }
}

#[tokio::test]
async fn the_plan_is_fasts_reflector() {
    let server = TestServer::start().await;
    let (_, plan) = server.get("/site/plan").await;
    assert_eq!(plan["nodes"].as_array().unwrap().len(), 2226);
    assert_eq!(
        plan["nodes"][0],
        serde_json::json!({ "name": "A0", "sector": "A", "e_m": 0.0, "n_m": 0.0, "u_m": 0.0 })
    );
    assert_eq!(plan["sectors"].as_array().unwrap().len(), 5);
    assert_eq!(plan["sectors"][0], serde_json::json!({ "name": "A", "azimuth_deg": 324.0 }));
    assert!(plan["road"].as_array().unwrap().len() > 500);
}

#[tokio::test]
async fn the_page_is_served_and_asked_for_again_only_when_it_changed() {
    let server = TestServer::start().await;
    let page = server.client.get(server.url("/")).send().await.unwrap();
    assert_eq!(
        (page.status().as_u16(), &page.headers()["content-type"]),
        (200, &"text/html; charset=utf-8".parse().unwrap())
    );
    let tag = page.headers()["etag"].clone();
    let again =
        server.client.get(server.url("/index.html")).header("if-none-match", tag).send().await.unwrap();
    assert_eq!((again.status().as_u16(), again.bytes().await.unwrap().len()), (304, 0));
    for kept_back in ["/package.json", "/js/../../Cargo.toml", "/%2e%2e/Cargo.toml"] {
        assert_eq!(
            server.client.get(server.url(kept_back)).send().await.unwrap().status(),
            404,
            "{kept_back}"
        );
    }
}

#[tokio::test]
async fn a_second_server_on_the_same_data_folder_is_refused_and_the_first_goes_on() {
    let server = TestServer::start().await;
    let (status, _) = server.get("/site").await;
    assert_eq!(status, 200, "the first has its folder by now");
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let second = serve::serve(Config::for_testing(server.folder()), listener, async {}).await;
    let sentence = second.unwrap_err().to_string();
    assert!(sentence.contains("in use by another server"), "{sentence}");
    assert_eq!(server.get("/site").await.0, 200);
    let again = server.restart().await;
    assert_eq!(again.get("/site").await.0, 200, "a folder that was let go can be served again");
}
