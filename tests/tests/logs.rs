//! What the server writes into its log: whom and what a line is about, and never a secret.
//!
//! A process of its own, for a process has one log.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::io::Write;
use std::sync::{Arc, Mutex};

use futures_util::{SinkExt, StreamExt};
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::server::TestServer;
use lodestep_tests::staff::{PASSWORD, Person, SETUP_TOKEN, server_with_staff, sign_in};
use reqwest::Method;
use serde_json::{Value, json};
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Message;
use tracing_subscriber::EnvFilter;

/// Collects the log.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// What a scenario has used that nobody may read in a log.
type Secrets = Vec<(&'static str, String)>;

fn value(person: &Person) -> String {
    person.cookie.split_once('=').unwrap().1.to_owned()
}

/// Signs in and out, well and badly, makes tokens and uses them everywhere, streams a little.
async fn scenario(server: &TestServer, staff: &[Person]) -> (Secrets, String) {
    let admin = &staff[5];
    let mut secrets: Secrets =
        vec![("the password", PASSWORD.to_owned()), ("the setup token", SETUP_TOKEN.to_owned())];
    secrets.extend(staff.iter().map(|person| ("a cookie", value(person))));

    let guess = "the password of another place";
    server.post("/account/sign-in", &json!({"name": "viewer", "password": guess})).await;
    server.post("/account/sign-in", &json!({"name": "viewer", "password": guess, "more": 1})).await;
    server.post("/account/sign-in", &json!({"password": guess})).await;
    secrets.push(("a wrong password", guess.to_owned()));

    let new = "a sentence that is new";
    let viewer = &staff[0];
    let change = json!({"old": PASSWORD, "new": new});
    assert_eq!(viewer.ask(server, Method::POST, "/account/password", &change).await.status, 204);
    secrets.push(("a new password", new.to_owned()));
    let dispatcher = sign_in(server, "dispatcher").await;
    secrets.push(("a cookie", value(&dispatcher)));
    dispatcher.request(server, Method::POST, "/account/sign-out").send().await.unwrap();

    let made = admin.ask(server, Method::POST, "/inspectors", &json!({"name": "Li Na"})).await;
    let inspector_id = made.id().to_owned();
    let token = json!({"name": "device", "rights": ["read", "walk"], "inspector_id": inspector_id});
    let token = admin.ask(server, Method::POST, "/tokens", &token).await;
    let secret = token.body["secret"].as_str().unwrap().to_owned();
    secrets.push(("a token", secret.clone()));
    let forged = "ab".repeat(32);
    for bearer in [&secret, &forged] {
        for path in ["/sessions", "/metrics", "/markers", "/nothing"] {
            let request =
                server.client.get(server.api(path)).header("authorization", format!("Bearer {bearer}"));
            let _ = request.send().await.unwrap().bytes().await;
        }
    }
    secrets.push(("a forged token", forged.clone()));

    // In a hello, well and badly.
    for (token, first) in [(&forged, "error"), (&secret, "welcome")] {
        let (mut socket, _) = connect_async(server.socket("/live")).await.unwrap();
        let hello = json!({"type": "hello", "inspector_id": inspector_id, "token": token});
        socket.send(Message::text(hello.to_string())).await.unwrap();
        // A ping may come first.
        let answer = loop {
            if let Message::Text(text) = socket.next().await.unwrap().unwrap() {
                break text;
            }
        };
        assert!(answer.contains(first), "{answer}");
        let sample = ImuSample {
            t_ns: 0,
            w_ib_b_rad_s: [0.0; 3],
            f_b_m_s2: [0.0, 0.0, 9.8],
            mag_b_ut: None,
            pressure_hpa: None,
        };
        let mut bytes = Vec::new();
        frame::encode(0, &Batch::imu(Side::Left.stream(), 0, vec![sample]), &mut bytes).unwrap();
        let _ = socket.send(Message::binary(bytes)).await;
        let _ = socket.send(Message::text(format!("{{\"type\":\"wrong {token}"))).await;
        let _ = socket.next().await;
    }
    let path = format!("/tokens/{}", token.id());
    assert_eq!(admin.ask(server, Method::DELETE, &path, &Value::Null).await.status, 204);
    (secrets, inspector_id)
}

#[tokio::test]
async fn the_log_names_requests_and_never_shows_a_secret() {
    let log = Log::default();
    let writer = log.clone();
    tracing_subscriber::fmt()
        .json()
        .flatten_event(true)
        .with_current_span(false)
        .with_span_list(true)
        .with_env_filter(EnvFilter::new("debug,lodestep_server=trace,tower_http=trace,sqlx=trace"))
        .with_writer(move || writer.clone())
        .init();
    let (server, staff) = server_with_staff().await;
    let (secrets, _) = scenario(&server, &staff).await;
    let asked = server.client.get(server.api("/site?who=Wang-Fang-in-the-query")).send().await.unwrap();
    let request_id = asked.headers()["x-request-id"].to_str().unwrap().to_owned();
    server.stop().await;

    let bytes = log.0.lock().unwrap().clone();
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.lines().count() > 100, "{} lines are no log of all this", text.lines().count());
    for (what, secret) in &secrets {
        let line = text.lines().find(|line| line.contains(secret.as_str()));
        assert!(line.is_none(), "{what} is in the log: {line:?}");
    }
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    // A request's lines bear the id that its sender was given; what it asked for is there, its query is not.
    let of_request = lines.iter().find(|line| {
        line["spans"]
            .as_array()
            .is_some_and(|spans| spans.iter().any(|span| span["id"] == request_id.as_str()))
    });
    let of_request = of_request.expect("a line of the request");
    assert_eq!(of_request["spans"][0]["path"], "/api/v1/site", "{of_request}");
    assert!(!text.contains("Wang-Fang-in-the-query"), "a query is in the log");
    assert!(text.contains("a sign-in was refused"), "guesses are in the log");
}
