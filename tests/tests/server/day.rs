//! A day where radio is banned: three people, markers and faults keyed in at a kiosk or written on paper, logs handed in
//! in the evening. Everything falls into place by itself.

use std::sync::LazyLock;
use std::time::Duration;

use lodestep_engine::geo::{Site, terrain};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{MarkerVisit, SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::device::TestDevice;
use lodestep_tests::feed::TestFeed;
use lodestep_tests::hand_in::{ask, log};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// One inspector's walk: five stops on the spiral road.
struct Walk {
    start_m: [f64; 3],
    stops: Vec<MarkerVisit>,
    logs: [Vec<ImuSample>; 2],
    /// Where the inspector is at the middle of each stop, east and north, m.
    stood_m: Vec<[f64; 2]>,
}

const STOPS: usize = 5;

fn walk(seed: u64) -> Walk {
    let mut simulator = Simulator::new(&WalkKind::Spiral, seed, &Site::fast(), &SensorModel::cmp10a());
    let (start_m, mut stops) = (simulator.start_n_m(), simulator.visits().to_vec());
    stops.truncate(STOPS);
    let end_ns = stops[STOPS - 1].t_end_ns + 5_000_000_000;
    let (mut logs, mut stood_m) = ([Vec::new(), Vec::new()], Vec::new());
    while let Some(epoch) = simulator.next_epoch().filter(|epoch| epoch.t_ns < end_ns) {
        let next = stops.get(stood_m.len()).filter(|stop| epoch.t_ns >= middle_ns(stop));
        if next.is_some() {
            let middle =
                |axis: usize| 0.5 * (epoch.truth[0].position_n_m[axis] + epoch.truth[1].position_n_m[axis]);
            stood_m.push([middle(0), middle(1)]);
        }
        let [left, right] = epoch.samples;
        logs[0].push(left);
        logs[1].push(right);
    }
    Walk { start_m, stops, logs, stood_m }
}

fn middle_ns(stop: &MarkerVisit) -> i64 {
    (stop.t_start_ns + stop.t_end_ns) / 2
}

static WALKS: LazyLock<[Walk; 3]> = LazyLock::new(|| [walk(0), walk(1), walk(2)]);

/// The stop at which a fault is seen and no marker is keyed in.
const UNKEYED: usize = 2;

async fn server_with_markers() -> TestServer {
    let server = TestServer::start().await;
    let mut csv = "name,e_m,n_m,u_m\n".to_owned();
    for anchor in terrain::anchors(&Site::fast()) {
        let [e, n, u] = anchor.position_n_m;
        csv += &format!("{},{e},{n},{u}\n", anchor.name);
    }
    let post = server.client.post(server.api("/markers/import")).header("content-type", "text/csv");
    let imported = ask(post.body(csv)).await;
    assert_eq!(imported.status, 200, "{imported:?}");
    server
}

/// What the kiosk's clock shows beyond the log's, s, for each walk.
const AHEAD_S: [f64; 3] = [240.0, 0.0, 37.0];

fn keyed(walk: &Walk, ahead_s: f64) -> Vec<Value> {
    let stops = walk.stops.iter().enumerate().filter(|(number, _)| *number != UNKEYED);
    stops
        .map(|(_, stop)| {
            let t_end_s = middle_ns(stop) as f64 / 1e9 + ahead_s;
            json!({ "marker": stop.marker, "t_start_s": t_end_s - 4.0, "t_end_s": t_end_s })
        })
        .collect()
}

async fn hand_in_both(server: &TestServer, session_id: &str, walk: &Walk) {
    for (foot, samples) in [("left", &walk.logs[0]), ("right", &walk.logs[1])] {
        let accepted = server.hand_in(session_id, foot, log(samples)).await;
        assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
    }
}

async fn report(server: &TestServer, session_id: &str, walk: &Walk, stop: usize, ahead_s: f64) -> Value {
    let t_s = middle_ns(&walk.stops[stop]) as f64 / 1e9 + ahead_s;
    let body = json!({ "session_id": session_id, "t_s": t_s, "kind": "anchor_bolt", "severity": "medium" });
    let (status, fault) = server.post("/faults", &body).await;
    assert_eq!(status, 201, "{fault}");
    fault
}

async fn session(server: &TestServer, session_id: &str) -> Value {
    server.look(&format!("/sessions/{session_id}")).await.body
}

/// Until every job has ended.
async fn until_idle(server: &TestServer) {
    loop {
        let jobs = server.look("/jobs").await.body;
        if jobs.as_array().unwrap().iter().all(|job| job["state"] == "finished") {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

async fn visits(server: &TestServer, session_id: &str) -> Vec<Value> {
    server.look(&format!("/sessions/{session_id}/visits")).await.body.as_array().unwrap().clone()
}

/// The squared distance from the truth in the fault's own ellipse.
fn squared_distance(fault: &Value, truth_m: [f64; 2]) -> f64 {
    let number = |field: &str, axis: usize| fault[field][axis].as_f64().unwrap();
    let (de, dn) = (number("position_m", 0) - truth_m[0], number("position_m", 1) - truth_m[1]);
    let (var_e, var_n) = (number("sigma_m", 0).powi(2), number("sigma_m", 1).powi(2));
    let cov = fault["covariance_en_m2"].as_f64().unwrap();
    (var_n * de * de - 2.0 * cov * de * dn + var_e * dn * dn) / (var_e * var_n - cov * cov)
}

#[tokio::test]
async fn a_day_falls_into_place_in_the_evening() {
    let server = server_with_markers().await;
    let (mut feed, _) = TestFeed::open(&server).await;
    // In the morning each signs out at the gate, at the marker where the walk begins.
    let mut sessions = Vec::new();
    for walk in &*WALKS {
        sessions.push(server.session(json!({ "start": { "position_m": walk.start_m } })).await);
    }
    let waiting = server.look("/sessions?state=created").await.body;
    assert_eq!(waiting.as_array().unwrap().len(), 3);
    // Two key in at the kiosks, the third writes on paper.
    let mut faults = Vec::new();
    for (person, walk) in WALKS.iter().enumerate().take(2) {
        let path = format!("/sessions/{}/visits", sessions[person]);
        assert_eq!(server.post(&path, &json!(keyed(walk, AHEAD_S[person]))).await.0, 201);
        faults.push((
            person,
            UNKEYED,
            report(&server, &sessions[person], walk, UNKEYED, AHEAD_S[person]).await,
        ));
    }
    faults.push((0, 3, report(&server, &sessions[0], &WALKS[0], 3, AHEAD_S[0]).await));
    // In the evening the logs come in, and then the paper.
    for (session_id, walk) in sessions.iter().zip(&*WALKS) {
        hand_in_both(&server, session_id, walk).await;
    }
    let csv: String = keyed(&WALKS[2], AHEAD_S[2])
        .iter()
        .map(|visit| {
            format!("{},{},{}\n", visit["t_start_s"], visit["t_end_s"], visit["marker"].as_str().unwrap())
        })
        .collect();
    let post = server.client.post(server.api(&format!("/sessions/{}/visits", sessions[2])));
    let paper =
        ask(post.header("content-type", "text/csv").body(format!("t_start_s,t_end_s,marker\n{csv}"))).await;
    assert_eq!(paper.status, 201, "{paper:?}");
    faults.push((2, UNKEYED, report(&server, &sessions[2], &WALKS[2], UNKEYED, AHEAD_S[2]).await));

    for (person, session_id) in sessions.iter().enumerate() {
        let job = server.process(session_id).await;
        assert_eq!(job["state"], "finished", "{job}");
        let tie = session(&server, session_id).await["clock_tie"].clone();
        let state = if AHEAD_S[person] == 0.0 { "same" } else { "tied" };
        assert_eq!(
            (&tie["state"], &tie["keyed"], &tie["matched"]),
            (&json!(state), &json!(4), &json!(4)),
            "{tie}"
        );
        let offset_s = tie["offset_s"].as_f64().unwrap();
        assert!((offset_s + AHEAD_S[person]).abs() < 3.0 * tie["sigma_s"].as_f64().unwrap(), "{tie}");
        let visits = visits(&server, session_id).await;
        assert!(visits.iter().all(|visit| visit["accepted"] == true), "{visits:?}");
    }
    for (person, stop, fault) in faults {
        let walk = &WALKS[person];
        let path = format!("/faults/{}", fault["id"].as_str().unwrap());
        let placed = server.look(&path).await.body;
        let squared = squared_distance(&placed, walk.stood_m[stop]);
        assert!(squared < 5.99, "{squared} of walk {person}, stop {stop}: {placed}");
        assert_eq!(placed["candidates"][0]["marker"], walk.stops[stop].marker, "{placed}");
        let history = server.look(&format!("{path}/history")).await.body;
        let told: Vec<&Value> =
            history.as_array().unwrap().iter().filter(|change| change["what"] == "place").collect();
        assert_eq!(told.len(), 1, "{history}");
        assert!(told[0]["after"].is_string(), "{history}");
    }
    // All dashboards are told.
    let told = feed.change(|change| change["kind"] == "fault" && change["fault"]["version"] == 2).await;
    assert!(told["fault"]["position_m"].is_array(), "{told}");

    // Again: nothing moves any more.
    let before = visits(&server, &sessions[0]).await;
    let sha256 = session(&server, &sessions[0]).await["track_sha256"].clone();
    server.process(&sessions[0]).await;
    assert_eq!(visits(&server, &sessions[0]).await, before);
    assert_eq!(session(&server, &sessions[0]).await["track_sha256"], sha256);
    // The same list handed in again is known, though its times have moved.
    let path = format!("/sessions/{}/visits", sessions[0]);
    let (status, again) = server.post(&path, &json!(keyed(&WALKS[0], AHEAD_S[0]))).await;
    assert_eq!((status, &again["added"]), (200, &json!(0)), "{again}");

    // Somebody knows better: the offset that is given holds, until it is measured again.
    let patch = async |body: Value| {
        let patch = server.client.patch(server.api(&format!("/sessions/{}", sessions[0])));
        let answer = ask(patch.json(&body)).await;
        assert_eq!(answer.status, 200, "{answer:?}");
        until_idle(&server).await;
        session(&server, &sessions[0]).await["clock_tie"].clone()
    };
    let given = patch(json!({ "clock_offset_s": 100.0 })).await;
    assert_eq!((&given["state"], &given["offset_s"]), (&json!("given"), &json!(100.0)), "{given}");
    let moved = visits(&server, &sessions[0]).await;
    assert!(moved.iter().all(|visit| visit["keyed_shift_ns"] == 100_000_000_000_i64), "{moved:?}");
    let measured = patch(json!({ "clock_offset_s": null })).await;
    assert_eq!(measured["state"], "tied", "{measured}");
    let away = |visit: &Value| (visit["marker"].clone(), visit["t_start_ns"].clone());
    let now = visits(&server, &sessions[0]).await;
    assert!(now.iter().map(away).eq(before.iter().map(away)), "{now:?}");
}

#[tokio::test]
async fn a_walk_without_a_start_is_nowhere_until_a_marker_says_where() {
    let server = server_with_markers().await;
    let walk = &WALKS[1];
    let session_id = server.session(json!({ "start": null })).await;
    // Keyed in at the kiosk before anybody knows the log: the last marker places the fault, the origin never does.
    let lost = report(&server, &session_id, walk, 0, 0.0).await;
    assert_eq!((&lost["position_m"], &lost["candidates"]), (&Value::Null, &json!([])), "{lost}");
    let path = format!("/sessions/{session_id}/visits");
    assert_eq!(server.post(&path, &json!(keyed(walk, 0.0))).await.0, 201);
    let by_marker = report(&server, &session_id, walk, 3, 0.0).await;
    assert_eq!(by_marker["candidates"][0]["marker"], walk.stops[3].marker, "{by_marker}");

    hand_in_both(&server, &session_id, walk).await;
    assert_eq!(server.process(&session_id).await["state"], "finished");
    let visits = visits(&server, &session_id).await;
    assert!(visits.iter().all(|visit| visit["accepted"] == true), "{visits:?}");
    for (fault, stop) in [(lost, 0), (by_marker, 3)] {
        let placed = server.look(&format!("/faults/{}", fault["id"].as_str().unwrap())).await.body;
        assert!(squared_distance(&placed, walk.stood_m[stop]) < 5.99, "{placed}");
        assert_eq!(placed["candidates"][0]["marker"], walk.stops[stop].marker, "{placed}");
    }

    // Without any marker there is a track, and no place on the map.
    let nowhere = server.session(json!({ "start": null })).await;
    hand_in_both(&server, &nowhere, walk).await;
    server.process(&nowhere).await;
    let (_, picture) = TestFeed::open(&server).await;
    let shown = picture["sessions"].as_array().unwrap().iter().find(|shown| shown["id"] == nowhere).unwrap();
    assert_eq!((&shown["position"], &shown["trail"]), (&Value::Null, &json!([])), "{shown}");
    let fault = report(&server, &nowhere, walk, 3, 0.0).await;
    assert_eq!(fault["position_m"], Value::Null, "{fault}");
}

#[tokio::test]
async fn what_was_said_of_a_walk_is_put_right() {
    let server = TestServer::start().await;
    for (name, e_m) in [("A1", -10.0), ("A2", 0.0)] {
        server.post("/markers", &json!({ "name": name, "e_m": e_m, "n_m": 0.0 })).await;
    }
    let session_id = server.session(json!({ "title": "night" })).await;
    let other = server.inspector().await;
    let (_, fault) =
        server.post("/faults", &json!({ "session_id": session_id, "kind": "leak", "severity": "low" })).await;
    let patch = async |body: Value| {
        ask(server.client.patch(server.api(&format!("/sessions/{session_id}"))).json(&body)).await
    };
    let changed = patch(json!({
        "title": " day ", "inspector_id": other, "start": { "marker": "A1" }, "excluded": true,
    }))
    .await;
    assert_eq!(changed.status, 200, "{changed:?}");
    let row = session(&server, &session_id).await;
    assert_eq!(
        (&row["title"], &row["inspector_id"], &row["excluded"]),
        (&json!("day"), &json!(other), &json!(true))
    );
    assert_eq!(row["start"], json!({ "marker": "A1", "position_m": [-10.0, 0.0, 0.0], "known": true }));
    // What was found on the walk was found by who walked.
    let fault = server.look(&format!("/faults/{}", fault["id"].as_str().unwrap())).await.body;
    assert_eq!(fault["inspector_id"], json!(other));
    let audit = server.look(&format!("/audit?action=session&subject={session_id}")).await.body;
    let entry = audit.as_array().unwrap().iter().find(|entry| entry["action"] == "session.changed").unwrap();
    assert_eq!(
        (&entry["before"]["title"], &entry["after"]["title"]),
        (&json!("night"), &json!("day")),
        "{entry}"
    );
    // Nothing else was said.
    assert!(entry["after"].get("started_at").is_none(), "{entry}");

    let unknown = patch(json!({ "start": null })).await;
    assert_eq!(
        unknown.body["start"],
        json!({ "marker": null, "position_m": [0.0, 0.0, 0.0], "known": false })
    );
    assert_eq!(patch(json!({ "start": { "marker": "Z9" } })).await.code(), "marker_not_found");
    assert_eq!(patch(json!({ "clock_offset_s": 1e9 })).await.code(), "wrong_offset");
    assert_eq!(patch(json!({ "title": "a\nb" })).await.code(), "wrong_title");
    assert_eq!(patch(json!({ "state": "finished" })).await.code(), "wrong_field");
}

#[tokio::test]
async fn the_dock_lists_the_walks_that_wait_and_knows_a_log_that_is_here() {
    let server = TestServer::start().await;
    for name in ["A1", "A2"] {
        server.post("/markers", &json!({ "name": name, "e_m": 1.0, "n_m": 2.0 })).await;
    }
    let morning = server.session(json!({ "started_at": "2026-07-01T01:00:00Z", "title": "ring" })).await;
    let noon = server.session(json!({ "started_at": "2026-07-01T04:00:00Z" })).await;
    for (marker, t_s) in [("A1", 10.0), ("A2", 1_810.0)] {
        let visit = json!({ "marker": marker, "t_start_s": t_s, "t_end_s": t_s + 4.0 });
        assert_eq!(server.post(&format!("/sessions/{noon}/visits"), &visit).await.0, 201);
    }
    server
        .post("/faults", &json!({ "session_id": noon, "t_s": 5.0, "kind": "leak", "severity": "low" }))
        .await;
    let order = async |query: &str| {
        let list = server.look(&format!("/sessions/waiting{query}")).await.body;
        list.as_array()
            .unwrap()
            .iter()
            .map(|walk| walk["id"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(order("").await, [noon.clone(), morning.clone()], "the newest first");
    assert_eq!(order("?began_at=2026-07-01T01:20:00Z").await, [morning.clone(), noon.clone()]);
    assert_eq!(order("?duration_s=600").await, [morning.clone(), noon.clone()], "too short for the other");
    let walker = session(&server, &morning).await["inspector_id"].clone();
    let query = format!("?inspector_id={}", walker.as_str().unwrap());
    assert_eq!(order(&query).await, [morning.clone(), noon.clone()]);
    let list = server.look("/sessions/waiting?duration_s=600").await.body;
    assert_eq!((&list[0]["title"], &list[0]["fits"]), (&json!("ring"), &json!(true)), "{list}");
    let told = json!([list[1]["keyed"], list[1]["keyed_span_s"], list[1]["faults"], list[1]["fits"]]);
    assert_eq!(told, json!([2, 1_800.0, 1, false]));
    assert!(list[1]["inspector"].as_str().unwrap().starts_with("Inspector"), "{list}");

    // A log that is here is known when it comes again; and its walk waits no longer.
    let bytes = log(&WALKS[0].logs[0][..2_000]);
    let path = format!("/known-logs?sha256={}", lodestep_tests::hand_in::sha256(&bytes));
    assert_eq!(server.look(&path).await.body, json!([]));
    server.hand_in(&noon, "left", bytes).await;
    let known = server.look(&path).await.body;
    assert_eq!((&known[0]["session"]["id"], &known[0]["stream"]), (&json!(noon), &json!("left")), "{known}");
    assert_eq!(order("").await, [morning]);
    assert_eq!(server.look("/known-logs?sha256=abc").await.code(), "not_a_sha256");
}

#[tokio::test]
async fn an_alarm_is_acknowledged_once_by_name_for_everybody() {
    let (server, people) = lodestep_tests::staff::server_with_staff().await;
    let person = |name: &str| people.iter().find(|person| person.name == name).unwrap();
    let body = json!({ "key": "fault:0199f1c8-0000-7000-8000-000000000000" });
    let post = reqwest::Method::POST;
    let path = "/alarms/acknowledged";
    let first = person("dispatcher").ask(&server, post.clone(), path, &body).await;
    assert_eq!(first.status, 200, "{first:?}");
    assert!(first.body["acknowledged_by"].as_str().unwrap().contains("dispatcher"), "{first:?}");
    let second = person("admin").ask(&server, post.clone(), path, &body).await;
    assert_eq!(second.body, first.body, "the first stays");
    assert_eq!(person("viewer").get(&server, path).await.body, json!([first.body]));
    assert_eq!(person("viewer").ask(&server, post.clone(), path, &body).await.status, 403);
    assert_eq!(
        person("admin").ask(&server, post, path, &json!({ "key": "a key" })).await.code(),
        "wrong_key"
    );
    let log = person("admin").get(&server, "/audit?action=alarm").await.body;
    assert_eq!(log.as_array().unwrap().len(), 1, "{log}");
    assert_eq!(log[0]["subject"], body["key"]);
}

#[tokio::test]
async fn a_walk_whose_device_never_says_finish_is_ended_by_hand() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({ "start": { "position_m": WALKS[0].start_m } })).await;
    let end = async || ask(server.client.post(server.api(&format!("/sessions/{session_id}/end")))).await;
    assert_eq!(end().await.code(), "session_not_live");
    let (mut device, _) = TestDevice::go_on(&server, &session_id).await;
    for (number, (left, right)) in
        WALKS[0].logs[0].chunks(100).zip(WALKS[0].logs[1].chunks(100)).take(25).enumerate()
    {
        device.send_frame(Side::Left, number as u64, left).await;
        device.send_frame(Side::Right, number as u64, right).await;
    }
    device.acknowledged(Side::Left, 24).await;
    device.acknowledged(Side::Right, 24).await;
    drop(device);
    let ended = end().await;
    assert_eq!(ended.status, 200, "{ended:?}");
    loop {
        let row = session(&server, &session_id).await;
        assert_ne!(row["state"], "failed", "{row}");
        if row["state"] == "finished" {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}
