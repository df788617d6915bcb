//! One person's mistake, or malice, is nobody else's outage.

use std::time::{Duration, Instant};

use futures_util::StreamExt;
use lodestep_engine::geo::Site;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::device::TestDevice;
use lodestep_tests::hand_in::{UPLOAD_OFFSET, ask, log};
use lodestep_tests::server::TestServer;
use reqwest::Method;
use serde_json::json;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;

fn walk(metres: f64) -> Walk {
    simulate(&WalkKind::Line { metres }, 3, &Site::fast(), &SensorModel::cmp10a())
}

/// The same with a hole after every second: as often as people have seen it from a bad cable.
fn with_holes(samples: &[ImuSample]) -> Vec<ImuSample> {
    let is_there =
        |sample: &&ImuSample| sample.t_ns % 1_000_000_000 < 700_000_000 || sample.t_ns < 8_000_000_000;
    samples.iter().filter(is_there).copied().collect()
}

#[tokio::test]
async fn anomalies_without_end_are_told_in_few_rows_that_count_them_all() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let walk = walk(60.0);
    for (foot, samples) in [("left", &walk.left), ("right", &walk.right)] {
        let accepted = server.hand_in(&session_id, foot, log(&with_holes(samples))).await;
        assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
    }
    // Twice: the second result is held against the first.
    for _ in 0..2 {
        let job = server.process(&session_id).await;
        assert_eq!(job["state"], "finished", "{job}");
    }
    let told = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
    let rows = told.as_array().unwrap();
    let of = |stream: &str| {
        let gaps = rows.iter().filter(|row| row["anomaly"] == "gap" && row["foot"] == stream);
        gaps.map(|row| row["times"].as_u64().unwrap()).collect::<Vec<_>>()
    };
    for stream in ["left", "right"] {
        let gaps = of(stream);
        assert!(gaps.len() <= 20 && gaps.iter().sum::<u64>() > 40, "{stream}: {gaps:?}");
    }
    let all: u64 = rows.iter().map(|row| row["times"].as_u64().unwrap()).sum();
    let session = server.look(&format!("/sessions/{session_id}")).await.body;
    assert_eq!(session["anomalies"], all, "{session}");
}

#[tokio::test]
async fn a_live_stream_with_anomalies_without_end_has_as_few_rows() {
    let server = TestServer::start().await;
    let (mut device, session_id) = TestDevice::begin(&server, &server.inspector().await).await;
    let walk = walk(60.0);
    let feet = [(Side::Left, with_holes(&walk.left)), (Side::Right, with_holes(&walk.right))];
    let batches = feet.each_ref().map(|(_, samples)| samples.chunks(50).count());
    for sequence in 0..batches[0].min(batches[1]) {
        for (side, samples) in &feet {
            let batch = samples.chunks(50).nth(sequence).unwrap();
            device.send_frame(*side, sequence as u64, batch).await;
        }
        for (side, _) in &feet {
            device.acknowledged(*side, sequence as u64).await;
        }
    }
    let told = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
    let gaps: Vec<u64> = told
        .as_array()
        .unwrap()
        .iter()
        .filter(|row| row["anomaly"] == "gap" && row["foot"] == "left")
        .map(|row| row["times"].as_u64().unwrap())
        .collect();
    assert!(gaps.len() <= 20 && gaps.iter().sum::<u64>() > 40, "{gaps:?}");
}

#[tokio::test]
async fn connections_that_do_nothing_make_room_for_those_who_come() {
    let server = TestServer::start_with(|config| config.connections = Some(24)).await;
    let (mut device, _) = TestDevice::begin(&server, &server.inspector().await).await;
    let mut silent = Vec::new();
    for n in 0..60 {
        let mut stream = TcpStream::connect(server.address).await.unwrap();
        if n % 2 == 0 {
            // Half a header, and no more.
            stream.write_all(b"GET / HTTP/1.1\r\nHost: ").await.unwrap();
        }
        silent.push(stream);
    }
    let begun = Instant::now();
    let asked = reqwest::Client::new().post(server.api("/inspectors")).json(&json!({"name": "Li Na"}));
    assert_eq!(asked.send().await.unwrap().status(), 201);
    assert!(begun.elapsed() < Duration::from_secs(5), "it took {:?}", begun.elapsed());
    // The device was let in before all of them, and is left alone.
    let samples: Vec<ImuSample> = walk(5.0).left[..100].to_vec();
    device.send_frame(Side::Left, 0, &samples).await;
    device.acknowledged(Side::Left, 0).await;
    drop(silent);
}

#[tokio::test]
async fn an_upload_is_cut_when_its_token_is_revoked_and_what_had_arrived_is_kept() {
    let (server, staff) = lodestep_tests::staff::server_with_staff().await;
    let admin = &staff[5];
    let inspector = admin.ask(&server, Method::POST, "/inspectors", &json!({"name": "Li Na"})).await;
    let session =
        admin.ask(&server, Method::POST, "/sessions", &json!({"inspector_id": inspector.id()})).await;
    let log = admin
        .ask(&server, Method::POST, &format!("/sessions/{}/logs", session.id()), &json!({"foot": "left"}))
        .await;
    let new = json!({"name": "a script", "rights": ["read", "walk", "walk_for_others"]});
    let token = admin.ask(&server, Method::POST, "/tokens", &new).await;
    let secret = token.body["secret"].as_str().unwrap().to_owned();
    // A sender who never comes to an end.
    let pieces = futures_util::stream::unfold((), async |()| {
        tokio::time::sleep(Duration::from_millis(20)).await;
        Some((Ok::<_, std::io::Error>("t_s,foot\n".repeat(10)), ()))
    });
    let patch = server
        .client
        .patch(server.api(&format!("/logs/{}", log.id())))
        .bearer_auth(&secret)
        .header(UPLOAD_OFFSET, 0)
        .body(reqwest::Body::wrap_stream(pieces.boxed()));
    let sending = tokio::spawn(async move { patch.send().await.map(|answer| answer.status().as_u16()) });
    tokio::time::sleep(Duration::from_millis(300)).await;
    let begun = Instant::now();
    let gone = admin.ask(&server, Method::DELETE, &format!("/tokens/{}", token.id()), &json!(null)).await;
    assert_eq!(gone.status, 204, "{gone:?}");
    let ended = tokio::time::timeout(Duration::from_secs(5), sending).await;
    assert!(ended.is_ok(), "it went on for {:?}", begun.elapsed());
    // An answer before the end of a body may be lost with the connection; if it comes, it says why.
    if let Ok(Ok(Ok(status))) = ended {
        assert_eq!(status, 401);
    }
    let kept = admin.get(&server, &format!("/logs/{}", log.id())).await;
    assert!(kept.offset.is_some_and(|offset| offset > 0), "{kept:?}");
    let more = server.client.patch(server.api(&format!("/logs/{}", log.id()))).bearer_auth(&secret);
    assert_eq!(ask(more.header(UPLOAD_OFFSET, 0).body("more")).await.status, 401);
}
