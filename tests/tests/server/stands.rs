//! Where an inspector stood: told with the markers that it may have been, chosen, made automatically, and
//! taken back.

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

/// Samples in a batch of these tests.
const BATCH: usize = 100;

/// The first two stops on the spiral road.
struct Walk {
    start_m: [f64; 3],
    visits: Vec<MarkerVisit>,
    /// Where the feet stood at each of them, m.
    stood_m: Vec<[f64; 3]>,
    logs: [Vec<ImuSample>; 2],
}

static WALK: LazyLock<Walk> = LazyLock::new(|| {
    const END_NS: i64 = 290_000_000_000;
    let mut model = SensorModel::cmp10a();
    model.field_anomalies.strength_ut = 0.0;
    let mut simulator = Simulator::new(&WalkKind::Spiral, 1, &Site::fast(), &model);
    let (start_m, mut visits) = (simulator.start_n_m(), simulator.visits().to_vec());
    visits.retain(|visit| visit.t_end_ns < END_NS);
    let mut logs = [Vec::new(), Vec::new()];
    let mut stood_m = Vec::new();
    while let Some(epoch) = simulator.next_epoch().filter(|epoch| epoch.t_ns < END_NS) {
        if visits.get(stood_m.len()).is_some_and(|visit| epoch.t_ns >= visit.t_start_ns + 2_000_000_000) {
            let [left, right] = epoch.truth.map(|foot| foot.position_n_m);
            stood_m.push(std::array::from_fn(|axis| 0.5 * (left[axis] + right[axis])));
        }
        let [left, right] = epoch.samples;
        logs[0].push(left);
        logs[1].push(right);
    }
    Walk { start_m, visits, stood_m, logs }
});

/// A server that knows every anchor, and a session on it.
async fn server_with_markers() -> TestServer {
    let server = TestServer::start().await;
    let mut csv = "name,e_m,n_m,u_m\n".to_owned();
    for anchor in terrain::anchors(&Site::fast()) {
        // Those that are visited stand where the inspector does: two stops into a walk the others are not certain enough.
        let visited = WALK.visits.iter().position(|visit| visit.marker == anchor.name);
        let [e, n, u] = visited.map_or(anchor.position_n_m, |stop| WALK.stood_m[stop]);
        csv += &format!("{},{e},{n},{u}\n", anchor.name);
    }
    let post = server.client.post(server.api("/markers/import")).header("content-type", "text/csv");
    let imported = ask(post.body(csv)).await;
    assert_eq!(imported.status, 200, "{imported:?}");
    // Where the field is quiet, and known to be, the first stops are nearly certain already.
    let quiet = json!({ "slow_errors.first_deflection_rad": 0.003, "slow_errors.deflection_rad": 0.003 });
    server.choose_parameters(&quiet).await;
    server
}

async fn session(server: &TestServer, automatic: bool) -> String {
    let more = json!({ "start": { "position_m": WALK.start_m }, "automatic_visits": automatic });
    server.session(more).await
}

/// Streams the whole walk; it stays live.
async fn streamed(server: &TestServer, automatic: bool) -> (TestDevice, String) {
    let session_id = session(server, automatic).await;
    let (mut device, _) = TestDevice::go_on(server, &session_id).await;
    let mut last = 0;
    for (number, (left, right)) in WALK.logs[0].chunks(BATCH).zip(WALK.logs[1].chunks(BATCH)).enumerate() {
        last = number as u64;
        device.send_frame(Side::Left, last, left).await;
        device.send_frame(Side::Right, last, right).await;
    }
    device.acknowledged(Side::Left, last).await;
    device.acknowledged(Side::Right, last).await;
    (device, session_id)
}

async fn stands(server: &TestServer, session_id: &str) -> Vec<Value> {
    server.look(&format!("/sessions/{session_id}/stands")).await.body.as_array().unwrap().clone()
}

async fn visits(server: &TestServer, session_id: &str) -> Vec<Value> {
    server.look(&format!("/sessions/{session_id}/visits")).await.body.as_array().unwrap().clone()
}

async fn track(server: &TestServer, session_id: &str) -> Value {
    server.look(&format!("/sessions/{session_id}/track")).await.body["rows"].clone()
}

/// Waits until a question is answered so.
async fn until<T>(mut asked: impl AsyncFnMut() -> Option<T>) -> T {
    loop {
        if let Some(answer) = asked().await {
            return answer;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

async fn finished(server: &TestServer, session_id: &str) -> Value {
    until(async || {
        let jobs = server.look("/jobs").await.body;
        let done = |job: &Value| job["state"] == "finished" || job["session_id"] != session_id;
        let session = server.look(&format!("/sessions/{session_id}")).await.body;
        (jobs.as_array().unwrap().iter().all(done) && session["state"] == "finished").then_some(session)
    })
    .await
}

fn sum(stand: &Value) -> f64 {
    stand["candidates"].as_array().unwrap().iter().map(|c| c["probability"].as_f64().unwrap()).sum()
}

#[tokio::test]
async fn a_live_stand_is_told_chosen_and_taken_back_and_the_track_is_as_if_nothing_had_been_chosen() {
    let server = server_with_markers().await;
    let (mut feed, _) = TestFeed::open(&server).await;
    // Read while it comes: who reads too late is sent the picture instead.
    let ((_device, session_id), told) =
        tokio::join!(streamed(&server, false), feed.change(|change| change["kind"] == "stands"));
    assert_eq!((&told["session_id"], &told["all"]), (&json!(session_id), &json!(false)));
    let stands = stands(&server, &session_id).await;
    assert_eq!(stands.len(), WALK.visits.len(), "{stands:?}");
    for (stand, visit) in stands.iter().zip(&WALK.visits) {
        assert!((sum(stand) - 1.0).abs() < 1e-9, "{stand}");
        assert!(stand["candidates"].as_array().unwrap().last().unwrap()["marker"].is_null(), "{stand}");
        assert_eq!(stand["candidates"][0]["marker"], visit.marker, "{stand}");
        assert_eq!(stand["lasts"], false);
    }
    let mut feed = until(async || {
        let (feed, snapshot) = TestFeed::open(&server).await;
        (snapshot["sessions"][0]["stands"] == json!(stands)).then_some(feed)
    })
    .await;

    let before = track(&server, &session_id).await;
    let last = stands.last().unwrap();
    let choice = format!("/sessions/{session_id}/stands/{}/choice", last["number"]);
    let marker = &last["candidates"][0]["marker"];
    let (status, visit) = server.put(&choice, &json!({ "marker": marker })).await;
    assert_eq!((status, &visit["origin"], &visit["marker"]), (200, &json!("chosen"), marker), "{visit}");
    until(async || (visits(&server, &session_id).await[0]["accepted"] == true).then_some(())).await;
    assert_ne!(track(&server, &session_id).await, before, "it has corrected the track");

    assert_eq!(server.delete(&choice).await.0, 204);
    let removed = feed.change(|change| change["kind"] == "visit_removed").await;
    assert_eq!(removed["id"], visit["id"]);
    until(async || (track(&server, &session_id).await == before).then_some(())).await;
    assert!(visits(&server, &session_id).await.is_empty());
    assert_eq!(server.delete(&choice).await.0, 404, "there is nothing to take back any more");
}

#[tokio::test]
async fn automatic_mode_makes_visits_of_what_is_nearly_certain_and_each_can_be_undone() {
    let server = server_with_markers().await;
    let (_plain_device, plain) = streamed(&server, false).await;
    assert!(visits(&server, &plain).await.is_empty(), "off by default");
    let (mut device, session_id) = streamed(&server, true).await;
    let made = visits(&server, &session_id).await;
    assert!(!made.is_empty(), "{:?}", stands(&server, &session_id).await);
    for visit in &made {
        assert_eq!((&visit["origin"], &visit["accepted"]), (&json!("automatic"), &json!(true)), "{visit}");
        assert!(WALK.visits.iter().any(|true_one| visit["marker"] == true_one.marker), "{visit}");
    }
    assert_ne!(track(&server, &session_id).await, track(&server, &plain).await);

    for stand in stands(&server, &session_id).await {
        let choice = format!("/sessions/{session_id}/stands/{}/choice", stand["number"]);
        server.delete(&choice).await;
    }
    let plain_track = track(&server, &plain).await;
    until(async || (track(&server, &session_id).await == plain_track).then_some(())).await;
    assert!(visits(&server, &session_id).await.is_empty());

    device.finish().await;
    let session = finished(&server, &session_id).await;
    assert_eq!(session["automatic_visits"], true);
    assert!(visits(&server, &session_id).await.is_empty(), "what was undone is not made again");
}

#[tokio::test]
async fn what_is_keyed_in_takes_the_place_of_what_automatic_mode_thought() {
    let server = server_with_markers().await;
    let (_device, session_id) = streamed(&server, true).await;
    let made = visits(&server, &session_id).await[0].clone();
    let from_s = made["t_start_ns"].as_f64().unwrap() / 1e9 + 1.0;
    let keyed = json!({ "marker": "A1", "t_start_s": from_s, "t_end_s": from_s + 2.0 });
    assert_eq!(server.post(&format!("/sessions/{session_id}/visits"), &keyed).await.0, 201);
    until(async || {
        let now = visits(&server, &session_id).await;
        let gone = now.iter().all(|visit| visit["id"] != made["id"]);
        (gone && now.iter().any(|visit| visit["origin"] == "keyed")).then_some(())
    })
    .await;
}

#[tokio::test]
async fn a_processed_session_has_stands_and_automatic_mode_can_be_switched() {
    let server = server_with_markers().await;
    let session_id = session(&server, false).await;
    let early = ask(server.client.get(server.api(&format!("/sessions/{session_id}/report")))).await;
    assert_eq!((early.status, &early.body["code"]), (409, &json!("no_report")), "{early:?}");
    for (foot, samples) in [("left", &WALK.logs[0]), ("right", &WALK.logs[1])] {
        let accepted = server.hand_in(&session_id, foot, log(samples)).await;
        assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
    }
    server.process(&session_id).await;
    let before = finished(&server, &session_id).await;
    let report = server.look(&format!("/sessions/{session_id}/report")).await.body;
    let zupt = &report["aids"][0];
    assert!(zupt["aid"] == "zupt" && zupt["accepted"].as_u64() > Some(1_000), "{report}");
    assert!(
        report["closure"]["path_m"] == before["distance_m"] && report["stance_share"][1].is_f64(),
        "{report}"
    );
    let told = stands(&server, &session_id).await;
    assert_eq!(told.len(), WALK.visits.len(), "{told:?}");

    let patch = server.client.patch(server.api(&format!("/sessions/{session_id}")));
    let switched = ask(patch.json(&json!({ "automatic_visits": true }))).await;
    assert_eq!((switched.status, &switched.body["automatic_visits"]), (200, &json!(true)), "{switched:?}");
    let with = finished(&server, &session_id).await;
    let made = visits(&server, &session_id).await;
    assert!(!made.is_empty() && made.iter().all(|visit| visit["origin"] == "automatic"), "{made:?}");
    assert_ne!(with["track_sha256"], before["track_sha256"]);

    // The person who keyed a marker in has the last word.
    let first = &told[0];
    let from_s = first["t_start_ns"].as_f64().unwrap() / 1e9 + 1.0;
    let marker = &first["candidates"][0]["marker"];
    let keyed = json!({ "marker": marker, "t_start_s": from_s, "t_end_s": from_s + 5.0 });
    assert!(server.post(&format!("/sessions/{session_id}/visits"), &keyed).await.0 < 300);
    let choice = format!("/sessions/{session_id}/stands/1/choice");
    let (status, problem) = server.put(&choice, &json!({ "marker": "B112" })).await;
    assert_eq!((status, &problem["code"]), (409, &json!("stand_keyed")), "{problem}");
    let (status, problem) = server.put(&choice, &json!({ "marker": "no such" })).await;
    assert_eq!((status, &problem["code"]), (404, &json!("marker_not_found")), "{problem}");
    assert_eq!(server.delete(&format!("/sessions/{session_id}/stands/99/choice")).await.0, 404);
}
