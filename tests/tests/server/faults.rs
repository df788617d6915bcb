//! Findings on equipment.

use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// A server with an inspector, three markers and a session that starts at the middle one.
async fn scene() -> (TestServer, String, String) {
    let server = TestServer::start().await;
    let (_, inspector) = server.post("/inspectors", &json!({ "name": "Li Na" })).await;
    for (name, e_m) in [("A1", -10.0), ("A2", 0.0), ("A3", 10.0)] {
        server.post("/markers", &json!({ "name": name, "e_m": e_m, "n_m": 0.0 })).await;
    }
    let body = json!({
        "inspector_id": inspector["id"], "started_at": "2026-07-01T00:00:00Z", "start": { "marker": "A2" },
    });
    let (_, session) = server.post("/sessions", &body).await;
    let id = |value: &Value| value["id"].as_str().unwrap().to_owned();
    let (inspector, session) = (id(&inspector), id(&session));
    (server, inspector, session)
}

fn sum(fault: &Value) -> f64 {
    let candidates = fault["candidates"].as_array().unwrap();
    candidates.iter().map(|candidate| candidate["probability"].as_f64().unwrap()).sum()
}

#[tokio::test]
async fn a_fault_is_placed_by_where_its_inspector_was() {
    let (server, inspector, session) = scene().await;
    let body = json!({ "session_id": session, "t_s": 0.5, "kind": "hydraulic_leak", "severity": "high" });
    let (status, fault) = server.post("/faults", &body).await;
    assert_eq!(status, 201, "{fault}");
    assert_eq!(fault["inspector_id"], json!(inspector));
    assert_eq!(fault["reported_at"], "2026-07-01T00:00:00.5Z");
    assert_eq!(fault["position_m"], json!([0.0, 0.0, 0.0]));
    assert_eq!(fault["candidates"][0]["marker"], "A2");
    assert!((sum(&fault) - 1.0).abs() < 1e-9, "{fault}");

    // Ten seconds without a point: 14 m either way, and no certainty any more.
    let body = json!({
        "inspector_id": inspector, "reported_at": "2026-07-01T00:00:10Z", "kind": "drainage", "severity": "low",
    });
    let (_, later) = server.post("/faults", &body).await;
    assert_eq!(later["session_id"], json!(session), "the inspector's walk at that time");
    assert!(later["sigma_m"][0].as_f64().unwrap() > 10.0);
    let most = later["candidates"][0]["probability"].as_f64().unwrap();
    assert!(most < 0.5 && later["candidates"].as_array().unwrap().len() == 4, "{later}");
    assert!((sum(&later) - 1.0).abs() < 1e-9, "{later}");
}

#[tokio::test]
async fn a_fault_long_after_the_last_known_position_has_none() {
    let (server, inspector, _) = scene().await;
    let body = json!({
        "inspector_id": inspector, "reported_at": "2026-07-01T09:00:00Z", "kind": "other", "severity": "low",
        "marker": "A3",
    });
    let (status, fault) = server.post("/faults", &body).await;
    assert_eq!((status, &fault["position_m"], &fault["marker"]), (201, &Value::Null, &json!("A3")));
    assert_eq!(fault["candidates"], json!([]));
}

#[tokio::test]
async fn a_fault_is_closed_once_and_stays_closed_after_a_restart() {
    let (server, _, session) = scene().await;
    let body = json!({ "session_id": session, "kind": "anchor_bolt", "severity": "medium", "text": "lockere Mutter" });
    let (_, fault) = server.post("/faults", &body).await;
    let path = format!("/faults/{}", fault["id"].as_str().unwrap());
    let (status, closed) = server.post(&format!("{path}/close"), &json!({})).await;
    assert_eq!((status, &closed["state"]), (200, &json!("closed")));
    let (_, again) = server.post(&format!("{path}/close"), &json!({})).await;
    assert_eq!(again, closed, "closing twice changes nothing");

    let server = server.restart().await;
    assert_eq!(server.get("/faults?state=open").await.1, json!([]));
    assert_eq!(server.get("/faults?state=closed").await.1, json!([closed]));
}

#[tokio::test]
async fn a_fault_that_cannot_be_is_refused() {
    let (server, inspector, session) = scene().await;
    let other = server.post("/inspectors", &json!({ "name": "Chen Wei" })).await.1["id"].clone();
    for (body, code) in [
        (json!({ "kind": "x", "severity": "low" }), "who_is_missing"),
        (json!({ "session_id": session, "kind": " ", "severity": "low" }), "wrong_field"),
        (json!({ "session_id": session, "kind": "x", "severity": "awful" }), "wrong_field"),
        (json!({ "session_id": session, "kind": "x", "severity": "low", "t_s": -1 }), "wrong_time"),
        (json!({ "inspector_id": inspector, "kind": "x", "severity": "low", "t_s": 1 }), "wrong_time"),
        (json!({ "session_id": session, "kind": "x", "severity": "low", "marker": "Z9" }), "unknown_marker"),
        (
            json!({ "session_id": session, "inspector_id": other, "kind": "x", "severity": "low" }),
            "wrong_inspector",
        ),
    ] {
        let (status, problem) = server.post("/faults", &body).await;
        assert_eq!((status, problem["code"].as_str()), (422, Some(code)), "{body}: {problem}");
    }
    assert_eq!(server.get("/faults").await.1, json!([]));
}
