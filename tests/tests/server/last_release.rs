//! A device and a dashboard of the release before streams (`tests/data/last_release`), byte by byte as they spoke then, and
//! whether they are still answered what they were answered.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

use flate2::read::GzDecoder;
use futures_util::{SinkExt, StreamExt};
use lodestep_tests::feed::TestFeed;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Message;

struct Line {
    link: String,
    from: String,
    /// The first line of the request that opened the socket.
    request: Option<String>,
    text: Option<String>,
    /// A binary frame.
    hex: Option<String>,
}

fn recorded() -> Vec<Line> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/last_release/talk.jsonl.gz");
    let mut text = String::new();
    GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_string(&mut text).unwrap();
    let line = |line: &str| {
        let line: Value = serde_json::from_str(line).unwrap();
        let of = |key: &str| line[key].as_str().map(str::to_owned);
        Line {
            link: of("link").unwrap(),
            from: of("from").unwrap(),
            request: of("request"),
            text: of("text"),
            hex: of("hex"),
        }
    };
    text.lines().map(line).collect()
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

/// What a client that reads `former` would miss in `now`: a key that is gone, or a value of another type. A null may be
/// anything in either.
fn missed(former: &Value, now: &Value, place: &str, to: &mut Vec<String>) {
    match (former, now) {
        (Value::Object(former), Value::Object(now)) => {
            for (key, value) in former {
                match now.get(key) {
                    Some(found) => missed(value, found, &format!("{place}.{key}"), to),
                    None => to.push(format!("{place}.{key} is gone")),
                }
            }
        }
        (Value::Array(former), Value::Array(now)) => {
            for (value, found) in former.iter().zip(now) {
                missed(value, found, &format!("{place}[]"), to);
            }
        }
        (Value::Null, _) | (_, Value::Null) => {}
        _ if std::mem::discriminant(former) == std::mem::discriminant(now) => {}
        _ => to.push(format!("{place}: {former} is {now} now")),
    }
}

/// The first change of each kind among the messages of a dashboard.
fn changes(messages: &[Value]) -> BTreeMap<String, Value> {
    let mut by_kind = BTreeMap::new();
    for change in messages.iter().filter_map(|message| message["changes"].as_array()).flatten() {
        by_kind.entry(change["kind"].as_str().unwrap().to_owned()).or_insert_with(|| change.clone());
    }
    by_kind
}

fn parsed<'a>(lines: impl Iterator<Item = &'a Line>) -> Vec<Value> {
    lines.filter_map(|line| line.text.as_ref()).map(|text| serde_json::from_str(text).unwrap()).collect()
}

#[tokio::test]
async fn a_device_and_a_dashboard_of_the_release_before_streams_work_unchanged() {
    let lines = recorded();
    let server = TestServer::start().await;
    let on = |link: &'static str, from: &'static str| {
        lines.iter().filter(move |line| line.link == link && line.from == from)
    };
    let mut wrong = Vec::new();
    let mut feed = TestFeed::connect(&server).await;
    for hello in parsed(on("feed", "device")) {
        feed.say(hello).await;
    }
    let mut now = vec![feed.next().await];

    let (_, who) = server.post("/inspectors", &json!({ "name": "Li Na" })).await;
    server.post("/markers", &json!({ "name": "A17", "e_m": 0.0, "n_m": 0.0, "u_m": 0.0 })).await;
    let session = json!({
        "inspector_id": who["id"], "feet": ["left", "right"], "start": { "marker": "A17" }, "initial_heading_deg": 0,
    });
    let (status, session) = server.post("/sessions", &session).await;
    assert_eq!(status, 201, "{session}");
    let id = session["id"].as_str().unwrap().to_owned();

    let path = on("live", "device").find_map(|line| line.request.as_ref()).unwrap();
    assert_eq!(path, "GET /api/v1/live HTTP/1.1");
    let (mut device, _) = connect_async(server.socket("/live")).await.unwrap();
    let answers = parsed(on("live", "server"));
    let former_id = answers[0]["session_id"].as_str().unwrap().to_owned();
    let mut answers = answers.into_iter();
    let said: Vec<&Line> = on("live", "device").filter(|line| line.request.is_none()).collect();
    assert!(said.len() > 160, "{} messages", said.len());
    for line in said {
        let message = match (&line.text, &line.hex) {
            (Some(text), _) => Message::text(text.replace(&former_id, &id)),
            (None, Some(hex)) => Message::binary(bytes(hex)),
            (None, None) => panic!("a message is text or binary"),
        };
        device.send(message).await.unwrap();
        // The device waited for each answer.
        let former = answers.next().unwrap();
        let now = loop {
            if let Message::Text(text) = device.next().await.unwrap().unwrap() {
                break serde_json::from_str::<Value>(text.as_str()).unwrap();
            }
        };
        for key in ["type", "kind", "foot", "sequence", "next_sequence", "marker", "t_start_ns", "t_end_ns"] {
            assert_eq!(now[key], former[key], "{key} of {now}, as {former}");
        }
        missed(&former, &now, &format!("answer {}", former["type"]), &mut wrong);
    }
    assert!(answers.next().is_none(), "as many answers as there were");

    let told = parsed(on("feed", "server"));
    let former = changes(&told);
    assert!(former.len() >= 5, "{:?}", former.keys());
    missed(&told[0], &now[0], "snapshot", &mut wrong);
    assert_eq!(now[0]["type"], told[0]["type"]);
    while former.keys().any(|kind| !changes(&now).contains_key(kind)) {
        let message = feed.next().await;
        assert!(["changes", "heartbeat"].contains(&message["type"].as_str().unwrap()), "{message}");
        now.push(message);
        assert!(now.len() < 100, "{:?} of {:?} came", changes(&now).keys(), former.keys());
    }
    let now = changes(&now);
    for (kind, change) in &former {
        missed(change, &now[kind], &format!("change {kind}"), &mut wrong);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn what_an_older_client_would_miss_is_found() {
    let former = json!({ "a": [{ "b": 1, "c": "x" }], "d": null });
    let mut wrong = Vec::new();
    missed(&former, &json!({ "a": [{ "b": "1" }], "d": 5, "e": 6 }), "", &mut wrong);
    assert_eq!(wrong, [".a[].b: 1 is \"1\" now", ".a[].c is gone"]);
    wrong.clear();
    missed(&former, &json!({ "a": [{ "b": 2, "c": "", "f": 1 }], "d": [] }), "", &mut wrong);
    assert_eq!(wrong, Vec::<String>::new());
}
