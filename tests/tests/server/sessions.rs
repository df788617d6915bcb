//! Walks: made, listed, removed.

use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

async fn inspector(server: &TestServer) -> String {
    let body = json!({ "name": "Li Na" });
    let answer = server.post("/inspectors", &body).await;
    answer.1["id"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn a_session_starts_at_a_marker_or_at_coordinates() {
    let server = TestServer::start().await;
    let inspector_id = inspector(&server).await;
    server.post("/markers", &json!({ "name": "A17", "e_m": 10.5, "n_m": -3.25 })).await;

    let body = json!({
        "inspector_id": inspector_id, "title": "morning round", "started_at": "2026-07-01T08:00:00.25+08:00",
        "feet": ["right", "left"], "start": { "marker": "A17" }, "initial_heading_deg": 90.0,
    });
    let (status, made) = server.post("/sessions", &body).await;
    assert_eq!(status, 201, "{made}");
    assert_eq!(made["start"], json!({ "marker": "A17", "position_m": [10.5, -3.25, 0.0], "known": true }));
    assert_eq!(made["started_at"], "2026-07-01T00:00:00.25Z");
    assert_eq!((&made["state"], &made["feet"]), (&json!("created"), &json!(["left", "right"])));

    let (_, there) = server
        .post("/sessions", &json!({ "inspector_id": inspector_id, "start": { "position_m": [1, 2, 3] } }))
        .await;
    assert_eq!(there["start"], json!({ "marker": null, "position_m": [1.0, 2.0, 3.0], "known": true }));

    let (_, one) = server.get(&format!("/sessions/{}", made["id"].as_str().unwrap())).await;
    assert_eq!(one, made, "what the creation answered is what is stored");
    assert_eq!((&one["logs"], &one["visits"]), (&json!([]), &json!(0)));
    let (_, created) = server.get("/sessions?state=created").await;
    assert_eq!(created.as_array().unwrap().len(), 2);
    let (_, finished) = server.get(&format!("/sessions?state=finished&inspector_id={inspector_id}")).await;
    assert_eq!(finished, json!([]));
}

#[tokio::test]
async fn a_session_that_cannot_be_is_refused_with_the_field() {
    let server = TestServer::start().await;
    let id = inspector(&server).await;
    let nobody = "01890000-0000-7000-8000-000000000000";
    for (body, status, code) in [
        (json!({ "inspector_id": nobody }), 404, "inspector_not_found"),
        (json!({ "inspector_id": id, "start": { "marker": "Z1" } }), 404, "marker_not_found"),
        (json!({ "inspector_id": id, "start": { "position_m": [1e7, 0, 0] } }), 422, "wrong_start"),
        (json!({ "inspector_id": id, "feet": [] }), 422, "wrong_feet"),
        (json!({ "inspector_id": id, "feet": ["hand"] }), 422, "wrong_feet"),
        (json!({ "inspector_id": id, "initial_heading_deg": 1e9 }), 422, "wrong_heading"),
        (json!({ "inspector_id": id, "started_at": "yesterday" }), 422, "wrong_field"),
        (json!({ "inspector_id": id, "colour": "red" }), 422, "wrong_field"),
        (json!({ "inspector_id": "x" }), 422, "wrong_field"),
    ] {
        let (found, problem) = server.post("/sessions", &body).await;
        assert_eq!((found, problem["code"].as_str()), (status, Some(code)), "{body}: {problem}");
    }
    assert_eq!(server.get("/sessions").await.1, json!([]));
}

#[tokio::test]
async fn a_session_is_removed_and_its_inspector_only_after_it() {
    let server = TestServer::start().await;
    let id = inspector(&server).await;
    let inspector = format!("/inspectors/{id}");
    // Many, so that the rows of some are still there when the inspector goes.
    let mut walks = Vec::new();
    for _ in 0..40 {
        let (_, made) = server.post("/sessions", &json!({ "inspector_id": id })).await;
        walks.push(format!("/sessions/{}", made["id"].as_str().unwrap()));
    }
    assert_eq!(server.delete(&inspector).await.1["code"], "inspector_has_sessions");
    let removed = futures_util::future::join_all(walks.iter().map(|walk| server.delete(walk))).await;
    assert!(removed.iter().all(|(status, _)| *status == 204));
    assert_eq!(server.delete(&inspector).await, (204, Value::Null));
    assert_eq!(server.delete(&walks[0]).await.1["code"], "session_not_found");
}

#[tokio::test]
async fn a_walk_of_another_age_or_with_a_title_that_is_no_text_is_refused() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;
    for (more, code) in [
        (json!({"started_at": "9999-12-31T00:00:00Z"}), "wrong_time"),
        (json!({"started_at": "0001-01-01T00:00:00Z"}), "wrong_time"),
        (json!({"title": "night\u{fffe}round"}), "wrong_title"),
        (json!({"title": "night\u{1b}[2Jround"}), "wrong_title"),
    ] {
        let mut new = json!({"inspector_id": inspector});
        new.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        let (status, problem) = server.post("/sessions", &new).await;
        assert_eq!((status, problem["code"].as_str()), (422, Some(code)), "{problem}");
    }
    let fault = |kind: &str| json!({"inspector_id": inspector, "kind": kind, "severity": "low"});
    for kind in ["leak\u{0}", "\u{1b}[31mleak", "two\nlines"] {
        let (status, problem) = server.post("/faults", &fault(kind)).await;
        assert_eq!((status, problem["code"].as_str()), (422, Some("wrong_field")), "{problem}");
    }
    let lines = json!({"inspector_id": inspector, "kind": "leak", "severity": "low", "text": "two\nlines"});
    assert_eq!(server.post("/faults", &lines).await.0, 201);
}
