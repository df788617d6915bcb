//! Alarms: raised by the server once for everybody, over restarts, told to dashboards and webhooks; and where everybody was before.

use lodestep_engine::geo::Site;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::device::TestDevice;
use lodestep_tests::feed::TestFeed;
use lodestep_tests::hand_in::{ask, log};
use lodestep_tests::receiver::TestReceiver;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

fn of_kind<'a>(kind: &'a str, key: &'a str) -> impl Fn(&Value) -> bool + 'a {
    move |change| change["kind"] == kind && change.to_string().contains(key)
}

async fn standing(server: &TestServer) -> Vec<String> {
    let alarms = server.look("/alarms").await.body;
    alarms["alarms"]
        .as_array()
        .unwrap()
        .iter()
        .map(|alarm| alarm["key"].as_str().unwrap().to_owned())
        .collect()
}

/// Seconds of a foot at rest, from a time on.
fn at_rest(from_s: i64, seconds: i64) -> Vec<ImuSample> {
    let sample = |k: i64| ImuSample {
        t_ns: from_s * 1_000_000_000 + k * 10_000_000,
        w_ib_b_rad_s: [0.001 * (k % 3) as f64, 0.0, 0.001],
        f_b_m_s2: [0.0, 0.01 * (k % 5) as f64, 9.79],
        mag_b_ut: None,
        pressure_hpa: None,
    };
    (0..100 * seconds).map(sample).collect()
}

async fn send(device: &mut TestDevice, sequence: u64, samples: &[ImuSample]) {
    for foot in Side::BOTH {
        device.send_frame(foot, sequence, samples).await;
        device.acknowledged(foot, sequence).await;
    }
}

#[tokio::test]
async fn a_fault_of_high_severity_is_an_alarm_until_somebody_takes_it_on() {
    let (server, receiver) = (TestServer::start().await, TestReceiver::start().await);
    let events = ["alarm.raised", "alarm.acknowledged"];
    let hook = json!({ "name": "pager", "url": receiver.url, "events": events });
    assert_eq!(ask(server.client.post(server.api("/webhooks")).json(&hook)).await.status, 201);
    let (mut feed, _) = TestFeed::open(&server).await;
    let inspector_id = server.inspector().await;
    let fault = json!({ "inspector_id": inspector_id, "kind": "hydraulic_leak", "severity": "high" });
    let fault = ask(server.client.post(server.api("/faults")).json(&fault)).await;
    let key = format!("fault:{}", fault.id());
    let raised = feed.change(of_kind("alarm_raised", &key)).await;
    assert_eq!(
        (&raised["alarm"]["kind"], &raised["alarm"]["fault_id"]),
        (&json!("fault"), &fault.body["id"])
    );
    assert_eq!(standing(&server).await, std::slice::from_ref(&key));

    let acknowledged =
        ask(server.client.post(server.api("/alarms/acknowledged")).json(&json!({ "key": key }))).await;
    assert_eq!(acknowledged.status, 200, "{acknowledged:?}");
    let posted = receiver.wait_for(2).await;
    let told: Vec<Value> = posted.iter().map(|posted| serde_json::from_str(&posted.body).unwrap()).collect();
    assert_eq!([&told[0]["event"], &told[1]["event"]], events);
    assert_eq!(told[0]["data"]["alarm"]["key"], json!(key));
    assert!(told[0]["data"]["inspector"].as_str().unwrap().starts_with("Inspector"), "{}", told[0]);
    assert_eq!(told[1]["data"]["key"], json!(key));

    let taken = json!({ "state": "acknowledged" });
    let taken = ask(server.client.patch(server.api(&format!("/faults/{}", fault.id()))).json(&taken)).await;
    assert_eq!(taken.status, 200, "{taken:?}");
    feed.change(of_kind("alarm_ended", &key)).await;
    assert_eq!(standing(&server).await, Vec::<String>::new());
}

#[tokio::test]
async fn who_is_lost_is_told_once_over_a_restart_and_no_longer_once_heard_of() {
    let receiver = TestReceiver::start().await;
    let server = TestServer::start_with(|config| config.lost_after_s = 1).await;
    let hook = json!({ "name": "pager", "url": receiver.url, "events": ["alarm.raised"] });
    let hook = ask(server.client.post(server.api("/webhooks")).json(&hook)).await;
    assert_eq!(hook.status, 201, "{hook:?}");
    let (mut feed, _) = TestFeed::open(&server).await;
    let (mut device, session_id) = TestDevice::begin(&server, &server.inspector().await).await;
    // It stands for a while before it knows where it is.
    for (number, from_s) in (0..20).step_by(5).enumerate() {
        send(&mut device, number as u64, &at_rest(from_s, 5)).await;
    }
    let raised = feed.change(of_kind("alarm_raised", &session_id)).await;
    let key = raised["alarm"]["key"].as_str().unwrap().to_owned();
    assert!(key.starts_with(&format!("lost:{session_id}:")), "{key}");
    receiver.wait_for(1).await;
    // A server that stops before it has noted the answer sends it again.
    let deliveries = format!("/webhooks/{}/deliveries", hook.id());
    while server.look(&deliveries).await.body[0]["state"] != "delivered" {
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    }
    drop(device);

    let server = server.restart_with(|config| config.lost_after_s = 1).await;
    let (mut feed, snapshot) = TestFeed::open(&server).await;
    assert_eq!(snapshot["alarms"][0]["key"], json!(key), "the picture has those that stand");
    let (mut device, _) = TestDevice::go_on(&server, &session_id).await;
    send(&mut device, 4, &at_rest(20, 5)).await;
    // Silent once more, that is another one: the second that the webhook is told of, not the third. Both may be in one message.
    let mut seen = Vec::new();
    while !seen.iter().any(of_kind("alarm_raised", &session_id)) {
        seen.extend(feed.next().await["changes"].as_array().cloned().unwrap_or_default());
    }
    assert!(seen.iter().any(of_kind("alarm_ended", &key)), "{seen:?}");
    assert!(!seen.iter().any(of_kind("alarm_raised", &key)), "{seen:?}");
    let told = receiver.wait_for(2).await;
    assert!(told[0].body.contains(&key) && !told[1].body.contains(&key), "{told:?}");
}

#[tokio::test]
async fn who_stands_for_long_is_an_alarm() {
    let server = TestServer::start_with(|config| config.standing_after_s = 30).await;
    let (mut feed, _) = TestFeed::open(&server).await;
    let (mut device, session_id) = TestDevice::begin(&server, &server.inspector().await).await;
    for (number, from_s) in (0..35).step_by(5).enumerate() {
        send(&mut device, number as u64, &at_rest(from_s, 5)).await;
    }
    let raised = feed.change(of_kind("alarm_raised", &session_id)).await;
    assert_eq!(raised["alarm"]["kind"], "standing", "{raised}");
}

#[tokio::test]
async fn where_everybody_was_at_a_moment_is_what_their_tracks_say() {
    let server = TestServer::start().await;
    let walk = simulate(&WalkKind::Line { metres: 30.0 }, 4, &Site::fast(), &SensorModel::cmp10a());
    let started_at = "2026-03-04T08:00:00Z";
    let more = json!({ "started_at": started_at, "start": { "position_m": walk.start_n_m() } });
    let session_id = server.session(more).await;
    for (foot, samples) in [("left", &walk.left), ("right", &walk.right)] {
        server.hand_in(&session_id, foot, log(samples)).await;
    }
    server.process(&session_id).await;
    let moment = async |at: &str| server.look(&format!("/moment?at={at}")).await.body;
    let then = moment("2026-03-04T08:00:20.05Z").await;
    let walks = then["walks"].as_array().unwrap();
    assert_eq!(walks.len(), 1, "{then}");
    let position = &walks[0]["position"];
    let (t_ns, age_s) = (position["t_ns"].as_i64().unwrap(), position["age_s"].as_f64().unwrap());
    assert!((0.0..0.2).contains(&age_s) && (t_ns as f64 / 1e9 + age_s - 20.05).abs() < 1e-6, "{position}");
    let trail = walks[0]["trail"].as_array().unwrap();
    assert!((19..=21).contains(&trail.len()), "a vertex a second: {}", trail.len());
    let track =
        server.look(&format!("/sessions/{session_id}/track?rate_hz=full&from_s=19.9&to_s=20.06")).await.body;
    let columns: Vec<&str> =
        track["columns"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    let column = |name: &str| columns.iter().position(|found| *found == name).unwrap();
    let rows = track["rows"].as_array().unwrap();
    let at_s = |row: &&Value| (row[column("t_s")].as_f64().unwrap() - t_ns as f64 / 1e9).abs() < 1e-6;
    let row = rows.iter().find(at_s).unwrap();
    // A table of a track has millimetres.
    let off_m = row[column("e_m")].as_f64().unwrap() - position["position_m"][0].as_f64().unwrap();
    assert!(off_m.abs() < 1e-3, "{row} {position}");

    assert_eq!(moment("2026-03-04T07:59:59Z").await["walks"], json!([]), "nobody had begun");
    assert_eq!(moment("2026-03-05T07:00:00Z").await["walks"], json!([]), "it had ended");
    assert_eq!(server.look("/moment?at=2026-03-04T08:00:20Z&trail_s=1e9").await.code(), "wrong_trail");
}
