//! Findings on equipment.

use lodestep_tests::server::TestServer;
use lodestep_tests::staff::server_with_staff;
use reqwest::Method;
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
async fn a_report_is_written_to_the_audit_log_with_who_reported_it() {
    let (server, people) = server_with_staff().await;
    let admin = people.iter().find(|person| person.name == "admin").unwrap();
    let made = admin.ask(&server, Method::POST, "/inspectors", &json!({ "name": "Li Na" })).await;
    let dispatcher = people.iter().find(|person| person.name == "dispatcher").unwrap();
    let body = json!({ "id": uuid::Uuid::now_v7(), "inspector_id": made.id(), "kind": "drainage", "severity": "low" });
    let fault = dispatcher.ask(&server, Method::POST, "/faults", &body).await;
    assert_eq!(fault.status, 201, "{fault:?}");
    // Sent again it makes nothing new, and nothing is written.
    assert_eq!(dispatcher.ask(&server, Method::POST, "/faults", &body).await.status, 200);
    let log = admin.get(&server, &format!("/audit?action=fault&subject={}", fault.id())).await.body;
    let rows = log.as_array().unwrap();
    assert_eq!(rows.len(), 1, "{log}");
    assert_eq!((&rows[0]["action"], &rows[0]["before"]), (&json!("fault.reported"), &Value::Null));
    assert!(rows[0]["who"].as_str().unwrap().contains("dispatcher"), "{log}");
    assert_eq!(rows[0]["after"]["kind"], "drainage");
    // What is refused leaves no row.
    let refused =
        json!({ "inspector_id": made.id(), "kind": "drainage", "severity": "low", "marker": "nowhere" });
    assert_eq!(dispatcher.ask(&server, Method::POST, "/faults", &refused).await.status, 422);
    assert_eq!(admin.get(&server, "/audit?action=fault").await.body.as_array().unwrap().len(), 1);
}

/// A fault of the scene, and its path.
async fn fault(server: &TestServer, session: &str) -> (Value, String) {
    let body = json!({ "session_id": session, "kind": "anchor_bolt", "severity": "medium", "text": "lockere Mutter" });
    let (status, fault) = server.post("/faults", &body).await;
    assert_eq!(status, 201, "{fault}");
    let path = format!("/faults/{}", fault["id"].as_str().unwrap());
    (fault, path)
}

async fn patch(server: &TestServer, path: &str, body: Value) -> (u16, Value) {
    let answer = server.client.patch(server.api(path)).json(&body).send().await.unwrap();
    (answer.status().as_u16(), answer.json().await.unwrap())
}

#[tokio::test]
async fn what_older_clients_close_is_verified_and_stays_so_after_a_restart() {
    let (server, _, session) = scene().await;
    let (_, path) = fault(&server, &session).await;
    let (status, closed) = server.post(&format!("{path}/close"), &json!({})).await;
    assert_eq!((status, &closed["state"]), (200, &json!("verified")));
    assert!(closed["closed_at"].is_string());
    let (_, again) = server.post(&format!("{path}/close"), &json!({})).await;
    assert_eq!(again, closed, "closing twice changes nothing");

    let server = server.restart().await;
    assert_eq!(server.get("/faults?state=standing").await.1, json!([]));
    assert_eq!(server.get("/faults?state=closed").await.1, json!([closed]));
    assert_eq!(server.get("/faults?state=verified").await.1, json!([closed]));
}

#[tokio::test]
async fn a_fault_goes_its_way_and_every_step_is_kept() {
    let (server, inspector, session) = scene().await;
    let (reported, path) = fault(&server, &session).await;
    assert_eq!(
        (&reported["state"], &reported["version"], &reported["photos"]),
        (&json!("open"), &json!(1), &json!(0))
    );
    let (status, told) = patch(&server, &path, json!({ "state": "acknowledged", "comment": "seen" })).await;
    assert_eq!((status, &told["state"], &told["version"]), (200, &json!("acknowledged"), &json!(2)));
    let body = json!({ "assignee_id": inspector, "state": "in_work", "severity": "high", "marker": "A3" });
    let (_, told) = patch(&server, &path, body).await;
    assert_eq!(
        (&told["assignee_id"], &told["marker"], &told["severity"]),
        (&json!(inspector), &json!("A3"), &json!("high"))
    );
    for part in ["position_m", "sigma_m", "covariance_en_m2", "candidates", "reported_at"] {
        assert_eq!(told[part], reported[part], "{part} is that of the report");
    }

    // Only what is fixed is verified; only opened again is what was verified.
    let (status, problem) = patch(&server, &path, json!({ "state": "verified" })).await;
    assert_eq!(
        (status, problem["code"].as_str(), &problem["current"]["state"]),
        (409, Some("wrong_step"), &json!("in_work"))
    );
    patch(&server, &path, json!({ "state": "fixed" })).await;
    let (_, verified) = patch(&server, &path, json!({ "state": "verified" })).await;
    assert!(verified["closed_at"].is_string());
    assert_eq!(server.get("/faults?state=standing").await.1, json!([]));
    assert_eq!(patch(&server, &path, json!({ "state": "fixed" })).await.0, 409);
    let (_, reopened) =
        patch(&server, &path, json!({ "state": "open", "assignee_id": null, "comment": "leaks again" }))
            .await;
    assert_eq!((&reopened["closed_at"], &reopened["assignee_id"]), (&Value::Null, &Value::Null));

    let (_, nothing) = patch(&server, &path, json!({ "state": "open" })).await;
    assert_eq!(nothing["version"], reopened["version"], "what changes nothing leaves no trace");
    patch(&server, &path, json!({ "comment": "only said" })).await;
    let (_, history) = server.get(&format!("{path}/history")).await;
    let told: Vec<_> = history
        .as_array()
        .unwrap()
        .iter()
        .map(|change| {
            (
                change["what"].as_str().unwrap(),
                change["after"].as_str().unwrap_or("-"),
                change["comment"].as_str().unwrap(),
            )
        })
        .collect();
    let expected = [
        ("state", "acknowledged", "seen"),
        ("state", "in_work", ""),
        ("assignee", inspector.as_str(), ""),
        ("severity", "high", ""),
        ("marker", "A3", ""),
        ("state", "fixed", ""),
        ("state", "verified", ""),
        ("state", "open", "leaks again"),
        ("assignee", "-", ""),
        ("comment", "-", "only said"),
    ];
    assert_eq!(told, expected);
}

#[tokio::test]
async fn two_who_change_the_same_fault_do_not_overwrite_each_other() {
    let (server, _, session) = scene().await;
    let (_, path) = fault(&server, &session).await;
    assert_eq!(patch(&server, &path, json!({ "text": "mine", "version": 1 })).await.0, 200);
    let (status, problem) = patch(&server, &path, json!({ "text": "theirs", "version": 1 })).await;
    assert_eq!((status, problem["code"].as_str()), (409, Some("fault_changed")));
    assert_eq!(problem["current"]["text"], "mine");
    for (body, code) in [
        (json!({ "marker": "Z9" }), "unknown_marker"),
        (json!({ "assignee_id": "01890000-0000-7000-8000-000000000000" }), "unknown_inspector"),
        (json!({ "state": "lost" }), "wrong_field"),
        (json!({ "kind": "" }), "wrong_field"),
    ] {
        let (status, problem) = patch(&server, &path, body.clone()).await;
        assert_eq!((status, problem["code"].as_str()), (422, Some(code)), "{body}");
    }
    assert_eq!(server.get(&path).await.1["text"], "mine");
}

#[tokio::test]
async fn who_walks_repairs_and_who_dispatches_sends_and_verifies() {
    let (server, staff) = server_with_staff().await;
    let (inspector, dispatcher) = (&staff[1], &staff[2]);
    let made = dispatcher.ask(&server, Method::POST, "/inspectors", &json!({ "name": "Li Na" })).await;
    let body = json!({ "inspector_id": made.body["id"], "kind": "other", "severity": "low" });
    let fault = dispatcher.ask(&server, Method::POST, "/faults", &body).await;
    let path = format!("/faults/{}", fault.body["id"].as_str().unwrap());
    let step = async |person: &lodestep_tests::staff::Person, body: Value| {
        person.ask(&server, Method::PATCH, &path, &body).await.status
    };
    assert_eq!(step(inspector, json!({ "assignee_id": made.body["id"] })).await, 403);
    assert_eq!(step(dispatcher, json!({ "assignee_id": made.body["id"] })).await, 200);
    // Whose account is that of the one who sees to it.
    let tied = json!({ "inspector_id": made.body["id"] });
    let account = format!("/accounts/{}", inspector.id);
    assert_eq!(staff[5].ask(&server, Method::PATCH, &account, &tied).await.status, 200);
    assert_eq!(step(inspector, json!({ "state": "fixed", "comment": "done" })).await, 200);
    assert_eq!(step(inspector, json!({ "state": "verified" })).await, 403);
    assert_eq!(step(dispatcher, json!({ "state": "verified" })).await, 200);
    let history = dispatcher.get(&server, &format!("{path}/history")).await.body;
    let who: Vec<_> =
        history.as_array().unwrap().iter().map(|change| change["changed_by"].as_str().unwrap()).collect();
    assert_eq!(who, ["dispatcher", "inspector", "dispatcher"]);
}

#[tokio::test]
async fn photos_are_kept_for_what_they_are() {
    let (server, _, session) = scene().await;
    let (_, path) = fault(&server, &session).await;
    let photos = format!("{path}/photos");
    let send = async |bytes: Vec<u8>| {
        let post = server.client.post(server.api(&photos)).header("content-type", "text/html");
        let answer = post.body(bytes).send().await.unwrap();
        (answer.status().as_u16(), answer.json::<Value>().await.unwrap())
    };
    // Larger than other bodies may be, and called something else by its sender.
    let mut jpeg = b"\xFF\xD8\xFF\xE0".to_vec();
    jpeg.resize(6 << 20, 7);
    let (status, photo) = send(jpeg.clone()).await;
    assert_eq!(
        (status, &photo["content_type"], &photo["size_bytes"]),
        (201, &json!("image/jpeg"), &json!(6 << 20))
    );
    let (status, again) = send(jpeg.clone()).await;
    assert_eq!((status, &again["id"]), (200, &photo["id"]), "the same photo is kept once");
    assert_eq!(send(b"RIFF\x04\0\0\0WEBPVP8 ".to_vec()).await.1["content_type"], "image/webp");
    let (status, problem) = send(b"<svg xmlns='http://www.w3.org/2000/svg'/>".to_vec()).await;
    assert_eq!((status, problem["code"].as_str()), (422, Some("not_a_photo")));
    jpeg.resize((8 << 20) + 1, 7);
    assert_eq!(send(jpeg.clone()).await.0, 413);

    let one = format!("{photos}/{}", photo["id"].as_str().unwrap());
    let answer = server.client.get(server.api(&one)).send().await.unwrap();
    for (header, expected) in [("content-type", "image/jpeg"), ("x-content-type-options", "nosniff")] {
        assert_eq!(answer.headers()[header], expected);
    }
    assert_eq!(answer.bytes().await.unwrap(), &jpeg[..6 << 20]);
    assert_eq!(server.get(&path).await.1["photos"], 2);
    assert_eq!(server.delete(&one).await.0, 204);
    assert_eq!(server.get(&one).await.1["code"], "photo_not_found");
    assert_eq!(server.get(&photos).await.1.as_array().unwrap().len(), 1);
    let (_, history) = server.get(&format!("{path}/history")).await;
    assert_eq!(history.as_array().unwrap().len(), 3, "{history}");
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
