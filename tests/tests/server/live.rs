//! The device socket: what an acknowledgement promises, and what becomes of a link that is cut.

use futures_util::TryStreamExt;
use lodestep_engine::event::TrackPoint;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, FaultMessage, NextSequence, VisitMessage};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_server::store::track::{self, TrackKind};
use lodestep_server::store::{IS_SHARED, Store, stream_chunks, visits};
use lodestep_tests::device::TestDevice;
use lodestep_tests::feed::TestFeed;
use lodestep_tests::hand_in::{ask, log};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use uuid::Uuid;

/// Samples in a batch of these tests: a quarter of a second.
const BATCH: usize = 25;

/// A short walk: 12 s of standing, then some steps north. The same for all tests.
fn walk() -> Walk {
    simulate(&WalkKind::Line { metres: 20.0 }, 7, &Site::fast(), &SensorModel::cmp10a())
}

/// The batches of both feet in the order in which a device sends them, from these numbers on.
fn batches(walk: &Walk, from: NextSequence) -> impl Iterator<Item = (Side, u64, &[ImuSample])> {
    let feet = walk.left.chunks(BATCH).zip(walk.right.chunks(BATCH)).enumerate();
    feet.flat_map(move |(number, (left, right))| {
        let number = number as u64;
        [
            (number >= next_of(&from, Side::Left)).then_some((Side::Left, number, left)),
            (number >= next_of(&from, Side::Right)).then_some((Side::Right, number, right)),
        ]
    })
    .flatten()
}

async fn stored_samples(store: &Store, session_id: &str, foot: Side) -> Vec<ImuSample> {
    let id = Uuid::parse_str(session_id).unwrap();
    let chunks: Vec<_> =
        stream_chunks::of_stream(store.read(), id, foot.stream()).try_collect().await.unwrap();
    let samples = chunks.into_iter().flat_map(|chunk| match chunk.readings {
        Readings::Imu(samples) => samples,
        Readings::Values(_) => Vec::new(),
    });
    samples.collect()
}

/// The batch that the server wants next of a foot.
fn next_of(next: &NextSequence, foot: Side) -> u64 {
    next.get(&foot.stream()).copied().unwrap_or(0)
}

async fn open_store(server: &TestServer) -> Store {
    Store::open(&server.folder().join("lodestep.db"), 1).await.unwrap()
}

#[tokio::test]
async fn an_acknowledged_batch_is_on_disk_even_if_the_server_never_stops_in_good_order() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;
    let (mut device, session_id) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    for (foot, number, samples) in batches(&walk, NextSequence::default()).take(20) {
        device.send_frame(foot, number, samples).await;
    }
    device.acknowledged(Side::Left, 9).await;
    device.acknowledged(Side::Right, 9).await;

    // What a power cut would leave: the files as they are at this moment, the server still running.
    let copy = tempfile::TempDir::new().unwrap();
    for file in ["lodestep.db", "lodestep.db-wal"].iter().filter(|_| !IS_SHARED) {
        std::fs::copy(server.folder().join(file), copy.path().join(file)).unwrap();
    }
    // PostgreSQL has what it has committed.
    let left = if IS_SHARED { server.folder() } else { copy.path() };
    let store = Store::open(&left.join("lodestep.db"), 1).await.unwrap();
    assert_eq!(stored_samples(&store, &session_id, Side::Left).await, walk.left[..10 * BATCH]);
    assert_eq!(stored_samples(&store, &session_id, Side::Right).await, walk.right[..10 * BATCH]);
    store.close().await;
}

#[tokio::test]
async fn a_repeated_batch_is_acknowledged_again_and_changes_nothing() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;
    let (mut device, session_id) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    device.send_frame(Side::Left, 0, &walk.left[..BATCH]).await;
    device.acknowledged(Side::Left, 0).await;
    // Even with other samples in it: what is on disk stands.
    device.send_frame(Side::Left, 0, &walk.right[..BATCH]).await;
    assert_eq!(device.next().await, Answer::Ack { stream: Side::Left.stream(), sequence: 0 });
    device.send_frame(Side::Left, 1, &walk.left[BATCH..2 * BATCH]).await;
    device.acknowledged(Side::Left, 1).await;
    let store = open_store(&server).await;
    assert_eq!(stored_samples(&store, &session_id, Side::Left).await, walk.left[..2 * BATCH]);
    store.close().await;
}

#[tokio::test]
async fn a_hole_is_told_with_the_batch_that_is_expected_and_the_stream_goes_on_from_there() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;
    let (mut device, _) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    device.send_frame(Side::Right, 0, &walk.right[..BATCH]).await;
    device.acknowledged(Side::Right, 0).await;
    device.send_frame(Side::Right, 2, &walk.right[2 * BATCH..3 * BATCH]).await;
    let Answer::Error(problem) = device.next().await else { panic!("an error") };
    assert_eq!(problem["code"], "sequence_gap");
    assert_eq!(problem["foot"], "right");
    assert_eq!(problem["expected_sequence"], 1);
    assert_eq!(problem["status"], 409);
    device.send_frame(Side::Right, 1, &walk.right[BATCH..2 * BATCH]).await;
    device.acknowledged(Side::Right, 1).await;
}

#[tokio::test]
async fn a_frame_of_a_wrong_length_is_told_what_was_expected_and_the_link_holds() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;
    let (mut device, _) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    let mut frame = Vec::new();
    let batch = Batch::imu(Side::Left.stream(), 0, walk.left[..BATCH].to_vec());
    frame::encode(0, &batch, &mut frame).unwrap();
    device.send_bytes(frame[..frame.len() - 3].to_vec()).await;
    let Answer::Error(problem) = device.next().await else { panic!("an error") };
    assert_eq!(problem["code"], "frame_length");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("2216 bytes") && detail.contains("2213 bytes"), "{detail}");
    device.send_bytes(frame).await;
    device.acknowledged(Side::Left, 0).await;
}

#[tokio::test]
async fn what_is_said_wrongly_is_answered_with_what_was_expected() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;

    let mut silent = TestDevice::connect(&server).await;
    silent.send_bytes(vec![1, 2, 3]).await;
    assert_eq!(silent.next_error().await, "hello_missing");
    assert_eq!(silent.try_next().await, None);

    let mut stranger = TestDevice::connect(&server).await;
    stranger.send_text(json!({"type": "hello", "session_id": Uuid::nil().to_string()}).to_string()).await;
    assert_eq!(stranger.next_error().await, "session_not_found");

    let mut nobody = TestDevice::connect(&server).await;
    nobody.send_text(json!({"type": "hello", "inspector_id": "x", "feet": ["left"]}).to_string()).await;
    assert_eq!(nobody.next_error().await, "inspector_not_found");

    let (mut device, _) = TestDevice::begin(&server, &inspector).await;
    device.send_text("{".into()).await;
    assert_eq!(device.next_error().await, "not_json");
    device.send_text(r#"{"type":"batch","foot":"left","sequence":0,"samples":[]}"#.into()).await;
    assert_eq!(device.next_error().await, "batch_size");
    let nowhere = VisitMessage { marker: "Z9".into(), t_start_ns: 0, t_end_ns: 1 };
    device.send(&DeviceMessage::Visit(nowhere)).await;
    assert_eq!(device.next_error().await, "marker_not_found");
    device.send_bytes(vec![0; (1 << 20) + 1]).await;
    assert_eq!(device.next_error().await, "message_too_large");
    assert_eq!(device.try_next().await, None);
}

/// Where in the stream (counted in batches of both feet) the marker is told.
const VISIT_AFTER: usize = 88;

/// The marker beside which the walk stands at its start, a little off from where it is said to begin.
async fn add_marker(server: &TestServer) {
    let marker = json!({"name": "A1", "e_m": 0.6, "n_m": -0.4, "u_m": 0.1});
    let answer = server.client.post(server.api("/markers")).json(&marker).send().await.unwrap();
    assert!(answer.status().is_success(), "{answer:?}");
}

fn visit() -> VisitMessage {
    VisitMessage { marker: "A1".into(), t_start_ns: 4_000_000_000, t_end_ns: 11_000_000_000 }
}

/// What a live session has on disk before its final run.
#[derive(Debug, PartialEq)]
struct Outcome {
    track: Vec<TrackPoint>,
    visits: Vec<Option<visits::Outcome>>,
}

/// Streams the whole walk with a visit in it. After `cut_after` batches the link is cut, and with
/// `restart` the server is stopped and started as well.
async fn stream_whole_walk(cut_after: Option<usize>, restart: bool) -> Outcome {
    stream_with_parameters([&json!({}); 2], cut_after, restart).await
}

/// The same, begun with the first parameters as the site's; the second are chosen before the server is stopped.
async fn stream_with_parameters(
    [first, second]: [&Value; 2],
    cut_after: Option<usize>,
    restart: bool,
) -> Outcome {
    let mut server = TestServer::start().await;
    if *first != json!({}) {
        server.choose_parameters(first).await;
    }
    add_marker(&server).await;
    let inspector = server.inspector().await;
    let (mut device, session_id) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    let whole: Vec<_> = batches(&walk, NextSequence::default()).collect();
    let mut sent = 0;
    let mut ends = vec![whole.len()];
    if let Some(cut) = cut_after {
        ends.insert(0, cut);
    }
    for end in ends {
        while sent < end {
            let (foot, number, samples) = whole[sent];
            device.send_frame(foot, number, samples).await;
            sent += 1;
            if sent == VISIT_AFTER {
                device.send(&DeviceMessage::Visit(visit())).await;
            }
        }
        let (_, last, _) = whole[end - 1];
        if end < whole.len() {
            // Not all of it is acknowledged when the link goes.
            device.acknowledged(Side::Left, last - 5).await;
            device.cut();
            if first != second {
                server.choose_parameters(second).await;
            }
            if restart {
                server = server.restart().await;
            }
            let next;
            (device, next) = TestDevice::go_on(&server, &session_id).await;
            assert!(
                next_of(&next, Side::Left) > last - 5,
                "acknowledged batches are not asked for again: {next:?}"
            );
            let wanted = |(foot, number, _): &(Side, u64, &[ImuSample])| *number >= next_of(&next, *foot);
            sent = whole.iter().position(wanted).unwrap();
        } else {
            device.acknowledged(Side::Left, last).await;
            device.acknowledged(Side::Right, last).await;
        }
    }
    // However often it was sent.
    let log = server.get("/audit?action=visit").await.1;
    assert_eq!((log.as_array().unwrap().len(), &log[0]["subject"]), (1, &json!(session_id)), "{log}");
    assert_eq!(log[0]["after"][0]["marker"], "A1", "{log}");
    let store = open_store(&server).await;
    let id = Uuid::parse_str(&session_id).unwrap();
    let track: Vec<_> = track::points(store.read(), id, TrackKind::Main).try_collect().await.unwrap();
    let visits = visits::of_session(store.read(), id).await.unwrap();
    store.close().await;
    assert!(track.len() > 100, "only {} points", track.len());
    assert_eq!(visits.len(), 1);
    assert!(visits[0].outcome.as_ref().is_some_and(|outcome| outcome.accepted), "{visits:?}");
    Outcome { track, visits: visits.into_iter().map(|visit| visit.outcome).collect() }
}

#[tokio::test]
async fn a_link_that_was_cut_leaves_no_trace_in_the_track() {
    let uninterrupted = stream_whole_walk(None, false).await;
    assert_eq!(stream_whole_walk(Some(61), false).await, uninterrupted);
}

#[tokio::test]
async fn a_server_that_was_started_again_goes_on_to_the_very_same_track() {
    let uninterrupted = stream_whole_walk(None, false).await;
    // Before and after the visit was told.
    assert_eq!(stream_whole_walk(Some(61), true).await, uninterrupted);
    assert_eq!(stream_whole_walk(Some(105), true).await, uninterrupted);
}

#[tokio::test]
async fn a_stream_keeps_the_parameters_that_were_the_site_s_when_it_began() {
    let (firm, soft) =
        (json!({ "marker_sigma_m": 0.3, "stance.threshold": 12.5 }), json!({ "marker_sigma_m": 4.0 }));
    let uninterrupted = stream_with_parameters([&firm, &firm], None, false).await;
    assert_ne!(uninterrupted, stream_whole_walk(None, false).await, "they make a difference");
    for cut in [61, 105] {
        assert_eq!(stream_with_parameters([&firm, &soft], Some(cut), true).await, uninterrupted);
    }
}

#[tokio::test]
async fn a_visit_that_is_told_by_rest_moves_the_live_track_like_one_from_the_device() {
    let server = TestServer::start().await;
    add_marker(&server).await;
    let inspector = server.inspector().await;
    let (mut feed, _) = TestFeed::open(&server).await;
    let (mut device, session_id) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    for (foot, number, samples) in batches(&walk, NextSequence::default()).take(VISIT_AFTER) {
        device.send_frame(foot, number, samples).await;
    }
    let told = json!([{"marker": "A1", "t_start_s": 4.0, "t_end_s": 11.0}]);
    let path = format!("/sessions/{session_id}/visits");
    let answer = server.client.post(server.api(&path)).json(&told).send().await.unwrap();
    assert!(answer.status().is_success(), "{answer:?}");
    let weighed = feed.change(|change| change["kind"] == "visit" && change["accepted"] == true).await;
    assert_eq!(weighed["marker"], "A1");
    // The device tells it as well, and hears that it is known.
    device.send(&DeviceMessage::Visit(visit())).await;
    let event = loop {
        if let Answer::Event(event) = device.next().await {
            break event;
        }
    };
    assert_eq!(event["id"], weighed["id"]);
    assert_eq!(event["accepted"], true);
}

#[tokio::test]
async fn a_fault_from_the_device_is_placed_by_where_the_inspector_was() {
    let server = TestServer::start().await;
    add_marker(&server).await;
    let inspector = server.inspector().await;
    let (mut device, session_id) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    for (foot, number, samples) in batches(&walk, NextSequence::default()).take(VISIT_AFTER) {
        device.send_frame(foot, number, samples).await;
    }
    let fault = FaultMessage {
        kind: "anchor_bolt".into(),
        severity: "low".into(),
        text: None,
        marker: None,
        t_ns: 10_000_000_000,
    };
    device.send(&DeviceMessage::Fault(fault)).await;
    let event = loop {
        if let Answer::Event(event) = device.next().await {
            break event;
        }
    };
    assert_eq!(event["kind"], "fault");
    let fault = &event["fault"];
    assert_eq!(fault["session_id"], session_id.as_str());
    assert_eq!(fault["candidates"][0]["marker"], "A1");
    let east_m = fault["position_m"][0].as_f64().unwrap();
    assert!(east_m.abs() < 0.5, "standing at the start, {east_m} m east of it");
    let log = server.get("/audit?action=fault").await.1;
    assert_eq!((log.as_array().unwrap().len(), &log[0]["action"]), (1, &json!("fault.reported")), "{log}");
    assert_eq!((&log[0]["subject"], &log[0]["who"]), (&fault["id"], &json!("somebody at this machine")));
}

#[tokio::test]
async fn the_feed_tells_first_the_picture_and_then_every_change_without_a_hole() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;
    let (mut device, session_id) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    let mut all = batches(&walk, NextSequence::default());
    for (foot, number, samples) in all.by_ref().take(120) {
        device.send_frame(foot, number, samples).await;
    }
    device.acknowledged(Side::Right, 59).await;

    // What is on disk reaches the feed a moment later: ask until the session is in the picture.
    let (mut feed, snapshot) = loop {
        let (feed, snapshot) = TestFeed::open(&server).await;
        if snapshot["sessions"][0]["id"] == session_id.as_str() {
            break (feed, snapshot);
        }
    };
    let shown = &snapshot["sessions"][0];
    assert_eq!(shown["state"], "live");
    assert_eq!(snapshot["inspectors"][0]["name"], "Inspector 0");
    for (foot, number, samples) in all {
        device.send_frame(foot, number, samples).await;
    }
    let mut seq = snapshot["seq"].as_u64().unwrap();
    let end_ns = walk.left.last().unwrap().t_ns;
    let mut newest_ns = shown["position"]["t_ns"].as_i64().unwrap_or(i64::MIN);
    while newest_ns < end_ns - 2_000_000_000 {
        let message = feed.next().await;
        if message["type"] == "heartbeat" {
            continue;
        }
        assert_eq!(message["seq"].as_u64().unwrap(), seq + 1, "a hole in the feed");
        seq += 1;
        for change in message["changes"].as_array().unwrap() {
            if change["kind"] == "position" {
                assert_eq!(change["session_id"], session_id.as_str());
                let t_ns = change["t_ns"].as_i64().unwrap();
                assert!(t_ns > newest_ns, "positions go forward: {t_ns} after {newest_ns}");
                newest_ns = t_ns;
            }
        }
    }
}

#[tokio::test]
async fn a_dashboard_that_comes_back_is_told_what_it_missed_and_a_stranger_gets_the_picture() {
    let server = TestServer::start().await;
    let (feed, snapshot) = TestFeed::open(&server).await;
    let (boot, since) = (snapshot["boot"].clone(), snapshot["seq"].as_u64().unwrap());
    drop(feed);
    server.inspector().await;
    // A second client has seen it, so it has been sent.
    let (mut witness, picture) = TestFeed::open(&server).await;
    if picture["seq"].as_u64().unwrap() == since {
        witness.change(|change| change["kind"] == "inspectors").await;
    }

    let mut back = TestFeed::connect(&server).await;
    back.say(json!({"type": "hello", "since": since, "boot": boot})).await;
    assert_eq!(back.next().await["type"], "heartbeat");
    let missed = back.next().await;
    assert_eq!(missed["type"], "changes");
    assert_eq!(missed["seq"].as_u64().unwrap(), since + 1);
    assert_eq!(missed["changes"][0]["inspectors"][0]["name"], "Inspector 0");

    let mut stranger = TestFeed::connect(&server).await;
    stranger.say(json!({"type": "hello", "since": since, "boot": "another run"})).await;
    assert_eq!(stranger.next().await["type"], "snapshot");
}

#[tokio::test]
async fn pages_of_other_sites_get_no_socket() {
    let server = TestServer::start().await;
    for path in ["/feed", "/live"] {
        let mut request = server.socket(path).into_client_request().unwrap();
        request.headers_mut().insert("origin", "https://elsewhere.example".parse().unwrap());
        let refused = tokio_tungstenite::connect_async(request).await.unwrap_err();
        let tokio_tungstenite::tungstenite::Error::Http(answer) = refused else { panic!("{refused}") };
        assert_eq!(answer.status(), 403, "{path}");
    }
}

#[tokio::test]
async fn the_newest_connection_of_a_session_takes_over() {
    let server = TestServer::start().await;
    let inspector = server.inspector().await;
    let (mut first, session_id) = TestDevice::begin(&server, &inspector).await;
    let (mut second, _) = TestDevice::go_on(&server, &session_id).await;
    assert_eq!(first.next_error().await, "taken_over");
    let walk = walk();
    second.send_frame(Side::Left, 0, &walk.left[..BATCH]).await;
    second.acknowledged(Side::Left, 0).await;
}

#[tokio::test]
async fn a_finished_stream_has_the_track_of_an_upload_of_the_same_logs_to_the_last_bit() {
    let server = TestServer::start().await;
    add_marker(&server).await;
    let inspector = server.inspector().await;
    let (mut feed, _) = TestFeed::open(&server).await;
    let (mut device, session_id) = TestDevice::begin(&server, &inspector).await;
    let walk = walk();
    for (foot, number, samples) in batches(&walk, NextSequence::default()) {
        device.send_frame(foot, number, samples).await;
    }
    device.send(&DeviceMessage::Visit(visit())).await;
    device.finish().await;
    feed.change(|change| change["kind"] == "session" && change["session"]["state"] == "finished").await;
    let streamed = server.look(&format!("/sessions/{session_id}")).await.body;
    assert_eq!(streamed["samples"].as_u64().unwrap(), (walk.left.len() + walk.right.len()) as u64);

    let uploaded_id = server.session(json!({})).await;
    assert_eq!(server.hand_in(&uploaded_id, "left", log(&walk.left)).await.status, 200);
    assert_eq!(server.hand_in(&uploaded_id, "right", log(&walk.right)).await.status, 200);
    let told = json!([{"marker": "A1", "t_start_s": 4.0, "t_end_s": 11.0}]);
    let path = format!("/sessions/{uploaded_id}/visits");
    ask(server.client.post(server.api(&path)).json(&told)).await;
    assert_eq!(server.process(&uploaded_id).await["state"], "finished");
    let uploaded = server.look(&format!("/sessions/{uploaded_id}")).await.body;
    for same in ["track_sha256", "samples", "epochs", "distance_m", "duration_s", "since_marker_m"] {
        assert_eq!(streamed[same], uploaded[same], "{same}");
    }
    assert_eq!(streamed["track_sha256"].as_str().unwrap().len(), 64);

    // A device that missed the last word asks once more.
    let mut again = TestDevice::connect(&server).await;
    again.send_text(json!({"type": "hello", "session_id": session_id}).to_string()).await;
    let Answer::Welcome { next_sequence, .. } = again.next().await else { panic!("a welcome") };
    assert_eq!(next_of(&next_sequence, Side::Left), walk.left.len().div_ceil(BATCH) as u64);
    assert_eq!(again.next().await, Answer::Finished);
}
