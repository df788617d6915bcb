//! Walks are looked for: by who, when, how they came and how they went, and what was said of them.

use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};
use lodestep_tests::hand_in::{ask, log};
use lodestep_tests::server::TestServer;
use lodestep_tests::staff::server_with_staff;
use reqwest::Method;
use serde_json::{Value, json};

/// The titles of what is found, in order.
async fn titles(server: &TestServer, query: &str) -> Vec<String> {
    let answer = server.look(&format!("/sessions/search?{query}")).await;
    assert_eq!(answer.status, 200, "{query}: {answer:?}");
    let sessions = answer.body["sessions"].as_array().unwrap().clone();
    sessions.iter().map(|session| session["title"].as_str().unwrap().to_owned()).collect()
}

async fn session(server: &TestServer, inspector_id: &str, title: &str, day: u32, more: Value) -> String {
    let mut body = json!({ "inspector_id": inspector_id, "title": title, "started_at": format!("2026-05-{day:02}T04:00:00Z") });
    body.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let made = ask(server.client.post(server.api("/sessions")).json(&body)).await;
    assert_eq!(made.status, 201, "{made:?}");
    made.id().to_owned()
}

#[tokio::test]
async fn walks_are_narrowed_by_words_people_days_and_states_a_page_at_a_time() {
    let server = TestServer::start().await;
    let (li, wang) = (server.inspector().await, server.inspector().await);
    session(&server, &li, "spiral 100%", 1, json!({})).await;
    session(&server, &li, "spiral_east", 2, json!({ "automatic_visits": true })).await;
    let third = session(&server, &wang, "ring", 3, json!({})).await;

    assert_eq!(titles(&server, "").await, ["ring", "spiral_east", "spiral 100%"]);
    assert_eq!(titles(&server, "ascending=true").await, ["spiral 100%", "spiral_east", "ring"]);
    assert_eq!(titles(&server, &format!("inspector_id={li}")).await, ["spiral_east", "spiral 100%"]);
    assert_eq!(titles(&server, "text=SPIRAL").await, ["spiral_east", "spiral 100%"]);
    // What means anything in a pattern means itself.
    assert_eq!(titles(&server, "text=100%25").await, ["spiral 100%"]);
    assert_eq!(titles(&server, "text=l_e").await, ["spiral_east"]);
    assert_eq!(titles(&server, "text=%25").await, ["spiral 100%"]);
    assert_eq!(titles(&server, &format!("text={}", &third[..18])).await, ["ring"]);
    assert_eq!(titles(&server, "text=inspector%201").await, ["ring"]);
    assert_eq!(titles(&server, "from=2026-05-02T00:00:00Z&to=2026-05-03T00:00:00Z").await, ["spiral_east"]);
    assert_eq!(titles(&server, "from=2026-05-02T12:00:00%2B08:00").await, ["ring", "spiral_east"]);
    assert_eq!(titles(&server, "mode=automatic").await, ["spiral_east"]);
    assert_eq!(titles(&server, "state=finished").await, [""; 0]);
    assert_eq!(titles(&server, "sort=inspector").await[0], "ring");

    let page = server.look("/sessions/search?limit=2&offset=2").await.body;
    assert_eq!((page["total"].as_u64(), page["sessions"].as_array().unwrap().len()), (Some(3), 1));
    let beyond = server.look("/sessions/search?offset=9").await.body;
    assert_eq!((beyond["total"].as_u64(), &beyond["sessions"]), (Some(3), &json!([])));
    assert_eq!(server.look("/sessions/search?flags=odd").await.code(), "wrong_flags");
    assert_eq!(server.look("/sessions/search?state=odd").await.code(), "wrong_query");
    assert_eq!(server.look("/sessions/search?from=yesterday").await.code(), "wrong_query");
}

#[tokio::test]
async fn walks_are_found_by_how_they_went_and_tell_what_they_take() {
    let server = TestServer::start().await;
    let inspector_id = server.inspector().await;
    let walk = simulate(&WalkKind::Line { metres: 20.0 }, 9, &Site::fast(), &SensorModel::cmp10a());
    let [e, n, u] = walk.start_n_m();
    let start = json!({ "start": { "position_m": [e, n, u] } });
    let (good, bad) = (
        session(&server, &inspector_id, "good", 1, start.clone()).await,
        session(&server, &inspector_id, "bad", 2, start).await,
    );
    session(&server, &inspector_id, "empty", 3, json!({})).await;
    for id in [&good, &bad] {
        server.hand_in(id, "left", log(&walk.left)).await;
    }
    // A second of samples is missing, and a marker is said that is far away.
    let middle = walk.right.len() / 2;
    let holed = [&walk.right[..middle], &walk.right[middle + 100..]].concat();
    server.hand_in(&good, "right", log(&walk.right)).await;
    server.hand_in(&bad, "right", log(&holed)).await;
    let marker = json!({ "name": "Z9", "e_m": e + 300.0, "n_m": n, "u_m": u });
    assert_eq!(ask(server.client.post(server.api("/markers")).json(&marker)).await.status, 201);
    let visit = json!({ "marker": "Z9", "t_start_s": 3, "t_end_s": 6 });
    ask(server.client.post(server.api(&format!("/sessions/{bad}/visits"))).json(&visit)).await;
    for id in [&good, &bad] {
        assert_eq!(server.process(id).await["state"], "finished");
    }

    assert_eq!(titles(&server, "mode=log").await, ["bad", "good"]);
    assert_eq!(titles(&server, "mode=stream").await, [""; 0]);
    assert_eq!(titles(&server, "flags=gap").await, ["bad"]);
    assert_eq!(titles(&server, "flags=rejected,anomalies").await, ["bad"]);
    // Twenty metres away is no closed walk.
    assert_eq!(titles(&server, "flags=closure").await, [""; 0]);
    assert_eq!(titles(&server, "sort=stored").await, ["good", "bad", "empty"]);
    assert_eq!(titles(&server, "sort=distance&ascending=true").await[0], "empty");
    let found = server.look("/sessions/search").await.body;
    let stored = |title: &str| {
        let all = found["sessions"].as_array().unwrap();
        all.iter().find(|session| session["title"] == title).unwrap()["stored_bytes"].as_u64().unwrap()
    };
    assert!(stored("good") > stored("bad") && stored("bad") > 10_000 && stored("empty") == 0, "{found}");
    assert_eq!(found["stored_bytes"].as_u64(), Some(stored("good") + stored("bad")));
}

#[tokio::test]
async fn staff_mark_a_walk_and_write_a_note_and_others_read_it() {
    let (server, staff) = server_with_staff().await;
    let person = |name: &str| staff.iter().find(|person| person.name == name).unwrap();
    let (viewer, engineer, admin) = (person("viewer"), person("engineer"), person("admin"));
    let made = admin.ask(&server, Method::POST, "/inspectors", &json!({ "name": "Li Na" })).await;
    let body = json!({ "inspector_id": made.id(), "title": "spiral" });
    let session = admin.ask(&server, Method::POST, "/sessions", &body).await;
    let path = format!("/sessions/{}/note", session.id());
    let note = json!({ "starred": true, "note": "  look at <the> magnetometer " });
    assert_eq!(viewer.ask(&server, Method::PUT, &path, &note).await.status, 403);
    let kept = engineer.ask(&server, Method::PUT, &path, &note).await;
    assert_eq!(kept.body, json!({ "starred": true, "note": "look at <the> magnetometer" }));
    // Said again, nothing is written down again.
    engineer.ask(&server, Method::PUT, &path, &note).await;
    assert_eq!(viewer.get(&server, &path).await.body, kept.body);
    let found = viewer.get(&server, "/sessions/search?flags=starred,noted&text=magnet").await.body;
    assert_eq!(
        (found["total"].as_u64(), found["sessions"][0]["noted_by"].as_str()),
        (Some(1), Some("engineer"))
    );
    let log = admin.get(&server, "/audit?action=session.noted").await.body;
    assert_eq!(log.as_array().unwrap().len(), 1, "{log}");
    assert_eq!((&log[0]["before"]["starred"], &log[0]["after"]["starred"]), (&json!(false), &json!(true)));
    let long = json!({ "starred": false, "note": "x".repeat(501) });
    assert_eq!(engineer.ask(&server, Method::PUT, &path, &long).await.code(), "wrong_note");
}
