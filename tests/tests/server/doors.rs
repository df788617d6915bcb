//! Three doors into one engine: the same samples by upload, by stream and by the command line give
//! the same track, to the last bit.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use lodestep_engine::geo::Site;
use lodestep_engine::parse::imu_csv::ImuCsv;
use lodestep_engine::parse::live_message::{DeviceMessage, Hello, Start, VisitMessage};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_server::cli;
use lodestep_tests::device::TestDevice;
use lodestep_tests::hand_in::{ask, log};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// Samples in one message of the stream: a second.
const SAMPLES_A_BATCH: usize = 100;

/// What comes in by every door.
struct Input {
    feet: Vec<(Side, Vec<u8>)>,
    /// Marker, its position, from, to in whole seconds.
    visits: Vec<(&'static str, [f64; 3], i64, i64)>,
    start: [f64; 3],
}

/// What comes out: hash over every epoch, and the track at 10 Hz as text, which is exact.
#[derive(Debug, PartialEq)]
struct Output {
    sha256: String,
    csv: String,
}

impl Input {
    fn feet_json(&self) -> Vec<&'static str> {
        self.feet.iter().map(|(foot, _)| foot.name()).collect()
    }

    fn samples(&self) -> Vec<(Side, Vec<ImuSample>)> {
        let parse = |bytes: &[u8]| {
            let (mut parser, mut samples) = (ImuCsv::new(), Vec::new());
            parser.push(bytes, &mut samples).unwrap();
            parser.finish(&mut samples).unwrap();
            samples
        };
        self.feet.iter().map(|(foot, bytes)| (*foot, parse(bytes))).collect()
    }
}

/// By the command line's own `process`.
async fn by_command_line(server: &TestServer, input: &Input, folder: &Path) -> Output {
    let site = server.look("/site").await.body;
    let file = |name: &str, bytes: &[u8]| -> PathBuf {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let (track, report) = (folder.join("track.csv"), folder.join("report.json"));
    let mut arguments: Vec<OsString> = vec!["lodestep".into(), "process".into()];
    let mut add = |flag: &str, value: OsString| arguments.extend([flag.into(), value]);
    for (foot, bytes) in &input.feet {
        add(&format!("--{}", foot.name()), file(&format!("{}.csv", foot.name()), bytes).into());
    }
    let [e, n, u] = input.start;
    add("--initial-position", format!("{e},{n},{u}").into());
    let fast = Site::fast();
    let text = format!(
        "name = \"FAST\"\nlatitude_deg = {:?}\nlongitude_deg = {:?}\nheight_m = {:?}\ngravity_m_s2 = {}\n\
         declination_deg = {}\ninclination_deg = {:?}\nfield_ut = {:?}\n",
        fast.latitude_deg,
        fast.longitude_deg,
        fast.height_m,
        site["gravity_m_s2"],
        site["declination_deg"],
        fast.inclination_deg,
        fast.field_ut,
    );
    add("--site", file("site.toml", text.as_bytes()).into());
    if !input.visits.is_empty() {
        let markers = String::from_utf8(markers_csv(input)).unwrap();
        let visits: String =
            input.visits.iter().map(|(marker, _, from, to)| format!("{from},{to},{marker}\n")).collect();
        add("--markers", file("markers.csv", markers.as_bytes()).into());
        add("--visits", file("visits.csv", format!("t_start_s,t_end_s,marker\n{visits}").as_bytes()).into());
    }
    // A finished session is smoothed.
    add("--solution", "smoothed".into());
    add("--rate-hz", "10".into());
    add("--out", track.clone().into());
    add("--report", report.clone().into());
    let code = tokio::task::spawn_blocking(move || cli::run(arguments)).await.unwrap();
    assert_eq!(code, std::process::ExitCode::SUCCESS);
    let report: Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
    Output {
        sha256: report["track_sha256"].as_str().unwrap().to_owned(),
        csv: std::fs::read_to_string(track).unwrap(),
    }
}

fn markers_csv(input: &Input) -> Vec<u8> {
    let rows: String =
        input.visits.iter().map(|(name, [e, n, u], ..)| format!("{name},{e},{n},{u}\n")).collect();
    format!("name,e_m,n_m,u_m\n{rows}").into_bytes()
}

/// By files handed in, the right foot first and packed.
async fn by_upload(server: &TestServer, input: &Input) -> Output {
    let new = json!({ "feet": input.feet_json(), "start": { "position_m": input.start } });
    let session_id = server.session(new).await;
    for (foot, bytes) in input.feet.iter().rev() {
        let bytes = zstd::encode_all(&bytes[..], 1).unwrap();
        assert_eq!(server.hand_in(&session_id, foot.name(), bytes).await.body["state"], "accepted");
    }
    for (marker, _, from, to) in &input.visits {
        let visit = json!({ "marker": marker, "t_start_s": from, "t_end_s": to });
        let post = server.client.post(server.api(&format!("/sessions/{session_id}/visits")));
        assert_eq!(ask(post.json(&visit)).await.status, 201);
    }
    let job = server.process(&session_id).await;
    assert_eq!(job["state"], "finished", "{job}");
    output(server, &session_id).await
}

/// By the device socket, the feet by turns, one in frames and one in JSON.
async fn by_stream(server: &TestServer, input: &Input) -> Output {
    let mut device = TestDevice::connect(server).await;
    let hello = Hello::Begin {
        inspector_id: server.inspector().await,
        start: Some(Start::PositionM(input.start)),
        system: None,
        streams: Some(input.feet.iter().map(|(foot, _)| foot.stream()).collect()),
        initial_heading_deg: None,
        instrument: None,
    };
    device.send(&DeviceMessage::Hello(hello)).await;
    let welcome = serde_json::to_value(device.next().await).unwrap();
    let session_id = welcome["session_id"].as_str().unwrap().to_owned();
    let samples = input.samples();
    let batches = samples.iter().map(|(_, samples)| samples.chunks(SAMPLES_A_BATCH).len()).max().unwrap();
    for sequence in 0..batches {
        for (foot, samples) in &samples {
            if let Some(batch) = samples.chunks(SAMPLES_A_BATCH).nth(sequence) {
                device.send_frame(*foot, sequence as u64, batch).await;
            }
        }
        for (marker, _, from, to) in &input.visits {
            if *to == sequence as i64 {
                device
                    .send(&DeviceMessage::Visit(VisitMessage {
                        marker: (*marker).to_owned(),
                        t_start_ns: from * 1_000_000_000,
                        t_end_ns: to * 1_000_000_000,
                    }))
                    .await;
            }
        }
    }
    device.finish().await;
    loop {
        let session = server.look(&format!("/sessions/{session_id}")).await.body;
        match session["state"].as_str() {
            Some("finished") => return output(server, &session_id).await,
            Some("failed") => panic!("{session}"),
            _ => tokio::time::sleep(std::time::Duration::from_millis(5)).await,
        }
    }
}

async fn output(server: &TestServer, session_id: &str) -> Output {
    let session = server.look(&format!("/sessions/{session_id}")).await.body;
    let csv = server.client.get(server.api(&format!("/sessions/{session_id}/track.csv")));
    Output {
        sha256: session["track_sha256"].as_str().unwrap().to_owned(),
        csv: csv.send().await.unwrap().text().await.unwrap(),
    }
}

async fn every_door_agrees(input: &Input) -> Output {
    let server = TestServer::start().await;
    if !input.visits.is_empty() {
        let import = server.client.post(server.api("/markers/import")).header("content-type", "text/csv");
        let imported = ask(import.body(markers_csv(input))).await;
        assert!(imported.status < 300, "{imported:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    let line = by_command_line(&server, input, folder.path()).await;
    assert!(line.csv.lines().count() > 100, "{}", line.csv);
    assert_same("upload", by_upload(&server, input).await, &line);
    assert_same("stream", by_stream(&server, input).await, &line);
    line
}

/// Like `assert_eq`, without a megabyte of numbers.
fn assert_same(door: &str, found: Output, line: &Output) {
    for (row, (found, expected)) in found.csv.lines().zip(line.csv.lines()).enumerate() {
        assert_eq!(found, expected, "{door}, row {row}");
    }
    assert_eq!(found.csv.len(), line.csv.len(), "{door}");
    assert_eq!(found.sha256, line.sha256, "{door}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_simulated_walk_with_visits_is_the_same_by_every_door() {
    let walk = simulate(&WalkKind::Line { metres: 60.0 }, 7, &Site::fast(), &SensorModel::cmp10a());
    let last_s = walk.left.last().unwrap().t_ns / 1_000_000_000;
    let [e, n, u] = walk.start_n_m();
    let feet = walk.truth.last().unwrap();
    let end: [f64; 3] = std::array::from_fn(|i| (feet[0].position_n_m[i] + feet[1].position_n_m[i]) / 2.0);
    // Half a metre beside the truth, so that a visit moves something.
    let input = Input {
        feet: vec![(Side::Left, log(&walk.left)), (Side::Right, log(&walk.right))],
        visits: vec![
            ("A1", [e + 0.3, n, u], 5, 8),
            ("A2", [end[0], end[1] + 0.5, end[2]], last_s - 2, last_s),
        ],
        start: [e, n, u],
    };
    let with = every_door_agrees(&input).await;
    let without = every_door_agrees(&Input { visits: Vec::new(), ..input }).await;
    assert_ne!(with.sha256, without.sha256, "the visits changed nothing");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recorded_walk_of_one_foot_is_the_same_by_every_door() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/openshoe-gx2/loop_02.csv.gz");
    let mut text = Vec::new();
    let mut packed = flate2::read::GzDecoder::new(std::fs::File::open(path).unwrap());
    std::io::Read::read_to_end(&mut packed, &mut text).unwrap();
    let input = Input { feet: vec![(Side::Right, text)], visits: Vec::new(), start: [100.0, -50.0, 2.5] };
    every_door_agrees(&input).await;
}
