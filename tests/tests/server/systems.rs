//! A system of one stream of numbers goes through every door by what it declares: command line, upload and device socket.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello};
use lodestep_engine::parse::{frame, values_csv};
use lodestep_engine::stream::{Kind, Readings, Rows, StreamId};
use lodestep_engine::systems::catalogue;
use lodestep_server::cli;
use lodestep_tests::device::TestDevice;
use lodestep_tests::hand_in::{ask, sha256};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

const FIX: StreamId = StreamId::named("fix");
/// The columns of its rows.
const NAMES: &[&str] = &["e_m", "n_m", "u_m", "sigma_m"];
/// Rows of a track of a quarter of an hour, so that a server that starts anew has a saved state to go on from.
const ROWS: i64 = 900;
/// Rows in a batch.
const BATCH: usize = 10;

/// Around a circle that rises, a fix a second; every seventh does not say how sure it is.
fn rows() -> Rows {
    let mut rows = Rows::new(NAMES.len());
    for second in 0..ROWS {
        let turn_rad = second as f64 / 300.0 * std::f64::consts::TAU;
        let sigma_m = if second % 7 == 0 { f64::NAN } else { 0.5 };
        rows.push(
            second * 1_000_000_000,
            [50.0 * turn_rad.cos(), 50.0 * turn_rad.sin(), 0.01 * second as f64, sigma_m],
        );
    }
    rows
}

fn log() -> Vec<u8> {
    let mut text = String::new();
    values_csv::write(NAMES, rows().iter(), &mut text);
    text.into_bytes()
}

fn batch(number: usize) -> Batch {
    let mut some = Rows::new(NAMES.len());
    for row in BATCH * number..BATCH * (number + 1) {
        let all = rows();
        let (t_ns, values) = all.get(row).unwrap();
        some.push(t_ns, values.iter().copied());
    }
    Batch { stream: StreamKey::Id(FIX), sequence: number as u64, readings: Readings::Values(some) }
}

async fn run(arguments: &[&str]) -> ExitCode {
    let line: Vec<OsString> =
        std::iter::once("lodestep").chain(arguments.iter().copied()).map(Into::into).collect();
    tokio::task::spawn_blocking(move || cli::run(line)).await.unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The hash over every epoch, by the command line's own `process`; its track lies beside the log.
async fn by_command_line(log: &Path, folder: &Path) -> String {
    let (track, report) = (folder.join("track.csv"), folder.join("report.json"));
    let stream = format!("fix={}", text(log));
    let done = run(&[
        "process",
        "fixes",
        "--stream",
        &stream,
        "--solution",
        "smoothed",
        "--rate-hz",
        "10",
        "--out",
        text(&track),
        "--report",
        text(&report),
    ])
    .await;
    assert_eq!(done, ExitCode::SUCCESS);
    let report: Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    assert_eq!(report["config"]["system"], "fixes");
    report["track_sha256"].as_str().unwrap().to_owned()
}

/// Begins, sends and finishes a log of the stream; the answer to the finish.
async fn hand_in(server: &TestServer, session_id: &str, bytes: Vec<u8>) -> lodestep_tests::hand_in::Answer {
    let begun = server.begin_log(session_id, json!({ "stream": "fix" })).await;
    assert_eq!((begun.status, &begun.body["stream"]), (201, &json!("fix")), "{begun:?}");
    assert!(begun.body.get("foot").is_none(), "{begun:?}");
    let hash = sha256(&bytes);
    assert_eq!(server.append(begun.id(), 0, bytes).await.status, 204);
    server.finish_log(begun.id(), &hash).await
}

async fn begin(server: &TestServer) -> (TestDevice, String) {
    let mut device = TestDevice::connect(server).await;
    let hello = Hello::Begin {
        inspector_id: server.inspector().await,
        start: None,
        system: Some("fixes".to_owned()),
        streams: None,
        initial_heading_deg: None,
        instrument: None,
    };
    device.send(&DeviceMessage::Hello(hello)).await;
    match device.next().await {
        Answer::Welcome { session_id, .. } => (device, session_id),
        other => panic!("expected a welcome, found {other:?}"),
    }
}

/// Sends these batches, frames and JSON by turns, and waits until all are on disk.
async fn send(device: &mut TestDevice, numbers: std::ops::Range<usize>) {
    let last = numbers.end as u64 - 1;
    for number in numbers {
        let batch = batch(number);
        if number % 2 == 0 {
            let mut bytes = Vec::new();
            frame::encode(0, &batch, &mut bytes).unwrap();
            device.send_bytes(bytes).await;
        } else {
            device.send(&DeviceMessage::Batch(batch)).await;
        }
    }
    loop {
        match device.next().await {
            Answer::Ack { stream, sequence } => {
                assert_eq!(stream, FIX);
                if sequence == last {
                    return;
                }
            }
            other => panic!("expected acknowledgements, found {other:?}"),
        }
    }
}

async fn look_at(server: &TestServer, path: &str) -> String {
    server.client.get(server.url(path)).send().await.unwrap().text().await.unwrap()
}

/// The session's hash once it is finished.
async fn finished(server: &TestServer, session_id: &str) -> String {
    loop {
        let session = server.look(&format!("/sessions/{session_id}")).await.body;
        if session["state"] == "finished" {
            assert_eq!(
                (&session["system"], &session["streams"]),
                (&json!("fixes"), &json!(["fix"])),
                "{session}"
            );
            return session["track_sha256"].as_str().unwrap().to_owned();
        }
        assert_ne!(session["state"], "failed", "{session}");
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn fixes_are_the_same_by_every_door_also_when_the_server_starts_anew_in_the_middle() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fix.csv");
    std::fs::write(&path, log()).unwrap();
    let line = by_command_line(&path, folder.path()).await;
    let track = std::fs::read_to_string(folder.path().join("track.csv")).unwrap();
    assert_eq!(track.lines().count() as i64, ROWS + 1);

    let server = TestServer::start().await;
    let uploaded = server.session(json!({ "system": "fixes" })).await;
    let accepted = hand_in(&server, &uploaded, log()).await;
    assert_eq!((&accepted.body["state"], &accepted.body["samples"]), (&json!("accepted"), &json!(ROWS)));
    let job = server.process(&uploaded).await;
    assert_eq!(job["state"], "finished", "{job}");
    assert_eq!(finished(&server, &uploaded).await, line, "upload");
    assert_eq!(look_at(&server, &format!("/api/v1/sessions/{uploaded}/track.csv")).await, track);

    let (mut device, streamed) = begin(&server).await;
    let batches = ROWS as usize / BATCH;
    // By and by, so that states are saved on the way.
    for from in (0..batches - 10).step_by(5) {
        send(&mut device, from..from + 5).await;
    }
    let server = server.restart().await;
    let (mut device, next) = TestDevice::go_on(&server, &streamed).await;
    assert_eq!(next.get(&FIX), Some(&(batches as u64 - 10)));
    send(&mut device, batches - 10..batches).await;
    let metrics = look_at(&server, "/metrics").await;
    let taken_up = metrics.lines().find(|line| line.starts_with("lodestep_live_states_taken_up_total"));
    assert_eq!(taken_up, Some("lodestep_live_states_taken_up_total 1"), "a saved state was taken up");
    device.finish().await;
    assert_eq!(finished(&server, &streamed).await, line, "stream");

    for session_id in [&uploaded, &streamed] {
        for (ending, holds) in [("geojson", "FeatureCollection"), ("gpx", "<trkpt"), ("kml", "<gx:coord>")] {
            let export = look_at(&server, &format!("/api/v1/sessions/{session_id}/track.{ending}")).await;
            assert!(export.contains(holds), "{ending}: {}", export.chars().take(300).collect::<String>());
        }
        let charts = server.look(&format!("/sessions/{session_id}/charts")).await.body;
        assert!(!charts["series"].as_array().unwrap().is_empty(), "{charts}");
    }
}

#[tokio::test]
async fn what_is_no_reading_of_the_stream_is_refused_with_what_was_expected() {
    let server = TestServer::start().await;
    let new = json!({ "inspector_id": server.inspector().await, "system": "ski" });
    let unknown = ask(server.client.post(server.api("/sessions")).json(&new)).await;
    assert_eq!((unknown.status, unknown.code()), (422, "unknown_system"));

    let session_id = server.session(json!({ "system": "fixes" })).await;
    let refused = hand_in(&server, &session_id, b"t_s,e_m,u_m\n0,1,2\n".to_vec()).await;
    assert_eq!((refused.status, refused.code()), (422, "missing_column"));
    let place = &refused.body["where"];
    assert_eq!((&place["line"], &place["column"]), (&json!(1), &json!("n_m")), "{refused:?}");
    let imu = b"t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n0,0,0,0,0,0,9.8\n";
    assert_eq!(hand_in(&server, &session_id, imu.to_vec()).await.code(), "missing_column");
    let foot = server.begin_log(&session_id, json!({ "stream": "left" })).await;
    assert_eq!(foot.code(), "foot_not_worn");

    let (mut device, _) = begin(&server).await;
    for (wrong, code) in [
        (r#"{"type":"batch","stream":"fix","sequence":0,"rows":[[0,[1,2,3]]]}"#, "wrong_readings"),
        (
            r#"{"type":"batch","stream":"fix","sequence":0,"samples":[[0,0,0,0,0,0,9.8,null,null,null,null]]}"#,
            "wrong_readings",
        ),
        (r#"{"type":"batch","stream":"left","sequence":0,"rows":[[0,[1,2,3,4]]]}"#, "wrong_foot"),
    ] {
        device.send_text(wrong.to_owned()).await;
        assert_eq!(device.next_error().await, code, "{wrong}");
    }
    device.send(&DeviceMessage::Batch(batch(0))).await;
    assert_eq!(device.next().await, Answer::Ack { stream: FIX, sequence: 0 });
}

#[tokio::test]
async fn every_system_is_listed_as_it_declares_itself() {
    let server = TestServer::start().await;
    let listed = server.look("/systems").await.body;
    let systems = listed["systems"].as_array().unwrap();
    assert_eq!(systems.len(), catalogue::SYSTEMS.len());
    for (view, system) in systems.iter().zip(catalogue::SYSTEMS) {
        assert_eq!(view["name"], system.name);
        for rule in view["streams"].as_array().unwrap() {
            let kind = Kind::named(rule["kind"].as_str().unwrap()).unwrap();
            let name = rule["name"].as_str().unwrap();
            let first = if rule["most"] == 1 { name.to_owned() } else { format!("{name}_1") };
            let stream = system.stream(StreamId::read(&first).unwrap()).unwrap();
            assert_eq!((stream.kind, json!(stream.number)), (kind, rule["number"].clone()), "{rule}");
        }
    }
    let fixes = systems.iter().find(|system| system["name"] == "fixes").unwrap();
    let columns: Vec<_> =
        fixes["streams"][0]["columns"].as_array().unwrap().iter().map(|c| &c["name"]).collect();
    assert_eq!(columns, NAMES);
    assert_eq!(fixes["anomalies"], json!(["not_finite", "backward_time"]));
}

#[tokio::test]
async fn a_simulated_session_is_processed_scored_and_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("session");
    assert_eq!(run(&["simulate", "fixes", "--seed", "3", "--out", text(&out)]).await, ExitCode::SUCCESS);
    let names: Vec<PathBuf> = ["fix.csv", "truth.csv", "site.toml"].map(|name| out.join(name)).to_vec();
    assert!(names.iter().all(|path| path.exists()), "{names:?}");
    assert_eq!(by_command_line(&names[0], folder.path()).await.len(), 64);
    assert_eq!(run(&["evaluate", "--system", "fixes", text(&out)]).await, ExitCode::SUCCESS);
    assert_eq!(run(&["simulate", "fixes", "--out", text(&out)]).await, ExitCode::from(2));

    let stream = format!("fix={}", text(&names[0]));
    let track = folder.path().join("track.csv");
    for (more, code) in [
        (&["--aid", "zupt"][..], 2),
        (&["--set", "marker_sigma_m=1"], 2),
        (&["--stream", "left=a.csv"], 2),
        (&["--help"], 0),
    ] {
        let usual = ["process", "fixes", "--stream", &stream, "--out", text(&track)];
        let line = [&usual[..], more].concat();
        assert_eq!(run(&line).await, ExitCode::from(code), "{more:?}");
    }
    assert_eq!(run(&["process", "pedestrian", "--help"]).await, ExitCode::SUCCESS);
    assert_eq!(run(&["process", "ski", "--help"]).await, ExitCode::from(2));
    std::fs::write(&names[0], "t_s,e_m,n_m\n0,1,2\n").unwrap();
    let wrong = run(&["process", "fixes", "--stream", &stream, "--out", text(&track)]).await;
    assert_eq!(wrong, ExitCode::from(3));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_instrument_is_refused_by_a_system_that_is_told_of_none() {
    let server = TestServer::start().await;
    let body = json!({
        "inspector_id": server.inspector().await,
        "system": "fixes",
        "instrument": "[fixes]",
    });
    let told = ask(server.client.post(server.api("/sessions")).json(&body)).await;
    assert_eq!((told.status, &told.body["code"]), (422, &json!("wrong_instrument")), "{told:?}");
    let systems = server.look("/systems").await.body;
    let systems = systems["systems"].as_array().unwrap();
    for system in catalogue::SYSTEMS {
        let shown = systems.iter().find(|shown| shown["name"] == system.name).unwrap();
        assert_eq!(shown["instrument"].is_null(), system.instrument.is_none(), "{shown}");
    }
}
