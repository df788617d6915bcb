//! A walk with the rover goes through every door: command line, upload and device socket.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::gnss::{self, GnssQuality};
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello};
use lodestep_engine::parse::{ReadOptions, StreamReader, frame};
use lodestep_engine::stream::{Readings, StreamId};
use lodestep_engine::systems::rover::DECLARATION;
use lodestep_server::cli;
use lodestep_tests::device::TestDevice;
use lodestep_tests::hand_in::{Answer as Told, ask, sha256};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use tempfile::TempDir;

/// The streams with their files.
const STREAMS: [(&str, &str); 4] =
    [("rover", "rover.obs"), ("base", "base.obs"), ("navigation_1", "base.nav"), ("ranges", "uwb.csv")];

async fn run(arguments: Vec<String>) -> ExitCode {
    let line: Vec<OsString> =
        std::iter::once("lodestep".to_owned()).chain(arguments).map(Into::into).collect();
    tokio::task::spawn_blocking(move || cli::run(line)).await.unwrap()
}

/// A walk into a hall that never was.
struct Walk {
    folder: TempDir,
}

impl Walk {
    async fn simulated() -> Walk {
        let walk = Walk { folder: tempfile::tempdir().unwrap() };
        let out = walk.folder.path().to_str().unwrap().to_owned();
        let line = ["simulate", "rover", "--scene", "doorway", "--out", &out].map(str::to_owned);
        assert_eq!(run(line.to_vec()).await, ExitCode::SUCCESS);
        walk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    fn instrument(&self) -> String {
        String::from_utf8(self.bytes("rover.toml")).unwrap()
    }

    /// The report of the command line.
    async fn by_command_line(&self) -> Value {
        self.processed_into("track.csv").await
    }

    /// The report of the command line, which writes the track into such a file.
    async fn processed_into(&self, track: &str) -> Value {
        let of = |name: &str| self.path(name).to_str().unwrap().to_owned();
        let files = [
            ("--rover", "rover.obs"),
            ("--base", "base.obs"),
            ("--nav", "base.nav"),
            ("--uwb", "uwb.csv"),
            ("--instrument", "rover.toml"),
            ("--out", track),
            ("--report", "report.json"),
        ];
        let mut line = ["process", "rover", "--solution", "smoothed"].map(str::to_owned).to_vec();
        line.extend(files.iter().flat_map(|(key, name)| [(*key).to_owned(), of(name)]));
        assert_eq!(run(line).await, ExitCode::SUCCESS);
        serde_json::from_slice(&self.bytes("report.json")).unwrap()
    }

    /// The readings of a stream, as its file has them.
    fn readings(&self, stream: &str, file: &str) -> Readings {
        let stream = DECLARATION.stream(StreamId::read(stream).unwrap()).unwrap();
        let mut reader =
            StreamReader::new(DECLARATION.rule_of(&stream).unwrap(), ReadOptions::default()).unwrap();
        let mut readings = reader.none();
        reader.push(&self.bytes(file), &mut readings).unwrap();
        reader.finish(&mut readings).unwrap();
        readings
    }

    async fn server(&self) -> TestServer {
        let site = self.path("site.toml");
        TestServer::start_with(|config| config.site = Some(site)).await
    }

    async fn upload(&self, server: &TestServer, instrument: &str) -> String {
        let names: Vec<&str> = STREAMS.iter().map(|(name, _)| *name).collect();
        let session = json!({ "system": "rover", "streams": names, "instrument": instrument });
        let session_id = server.session(session).await;
        for (stream, file) in STREAMS {
            let accepted = hand_in(server, &session_id, stream, self.bytes(file)).await;
            assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
        }
        session_id
    }

    /// The readings of all streams in batches as they would come: orbits first, then second by second.
    fn batches(&self) -> Vec<Batch> {
        let mut batches = Vec::new();
        for (order, (stream, file)) in [2, 1, 0, 3].map(|k: usize| (k, STREAMS[k])) {
            let mut left = self.readings(stream, file);
            let mut sequence = 0;
            while !left.is_empty() {
                let second = |reading: lodestep_engine::stream::Reading<'_>| {
                    if order == 2 { i64::MIN } else { reading.t_ns().div_euclid(1_000_000_000) }
                };
                let first = second(left.get(0).unwrap());
                let same = left.iter().take_while(|reading| second(*reading) == first).count();
                let rest = left.split_off(same.min(Batch::MOST_SAMPLES));
                let of = StreamId::read(stream).unwrap();
                batches.push((first, Batch { stream: StreamKey::Id(of), sequence, readings: left }));
                sequence += 1;
                left = rest;
            }
        }
        batches.sort_by_key(|(second, _)| *second);
        batches.into_iter().map(|(_, batch)| batch).collect()
    }
}

async fn hand_in(server: &TestServer, session_id: &str, stream: &str, bytes: Vec<u8>) -> Told {
    let begun = server.begin_log(session_id, json!({ "stream": stream })).await;
    assert_eq!(begun.status, 201, "{begun:?}");
    let hash = sha256(&bytes);
    assert_eq!(server.append(begun.id(), 0, bytes).await.status, 204);
    server.finish_log(begun.id(), &hash).await
}

async fn send(device: &mut TestDevice, batches: &[Batch]) {
    for batch in batches {
        let StreamKey::Id(id) = batch.stream else { panic!("{batch:?}") };
        let mut bytes = Vec::new();
        frame::encode(DECLARATION.stream(id).unwrap().number, batch, &mut bytes).unwrap();
        device.send_bytes(bytes).await;
        match device.next().await {
            Answer::Ack { stream, sequence } => assert_eq!((stream, sequence), (id, batch.sequence)),
            other => panic!("expected an acknowledgement, found {other:?}"),
        }
    }
}

async fn finished(server: &TestServer, session_id: &str) -> String {
    loop {
        let session = server.look(&format!("/sessions/{session_id}")).await.body;
        if session["state"] == "finished" {
            return session["track_sha256"].as_str().unwrap().to_owned();
        }
        assert_ne!(session["state"], "failed", "{session}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Where the live trail ends: time, s, east, north and sigma, m.
async fn newest(server: &TestServer, session_id: &str) -> Vec<f64> {
    let track = server.url(&format!("/api/v1/sessions/{session_id}/track.csv"));
    let text = server.client.get(track).send().await.unwrap().text().await.unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let last: Vec<&str> = text.lines().last().unwrap().split(',').collect();
    let of = |name: &str| {
        let at =
            head.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name} in {head:?}"));
        last[at].parse().unwrap_or(f64::NAN)
    };
    ["t_s", "e_m", "n_m", "sigma_e_m"].map(of).to_vec()
}

fn truth_at(walk: &Walk, t_s: f64) -> [f64; 2] {
    let text = String::from_utf8(walk.bytes("truth.csv")).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let numbers: Vec<f64> = line.split(',').take(3).map(|cell| cell.parse().unwrap()).collect();
        (numbers[0], [numbers[1], numbers[2]])
    });
    rows.min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs())).unwrap().1
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_walk_into_a_hall_is_the_same_by_every_door_also_when_the_server_starts_anew_in_the_middle() {
    let walk = Walk::simulated().await;
    let report = walk.by_command_line().await;
    let line = report["track_sha256"].as_str().unwrap();
    assert!(report["fixed"].as_u64().unwrap() > 50, "{report}");

    let server = walk.server().await;
    let uploaded = walk.upload(&server, &walk.instrument()).await;
    let job = server.process(&uploaded).await;
    assert_eq!(job["state"], "finished", "{job}");
    assert_eq!(finished(&server, &uploaded).await, line, "upload");
    let charts =
        server.look(&format!("/sessions/{uploaded}/charts?from_s=0&to_s=10000&buckets=2000")).await.body;
    let names: Vec<&str> =
        charts["series"].as_array().unwrap().iter().filter_map(|line| line["chart"].as_str()).collect();
    for chart in ["quality", "satellites", "ratio", "base_age", "elevation", "azimuth", "anchor_bias"] {
        assert!(names.contains(&chart), "{chart} in {names:?}");
    }

    let mut device = TestDevice::connect(&server).await;
    let hello = Hello::Begin {
        inspector_id: server.inspector().await,
        start: None,
        system: Some("rover".to_owned()),
        streams: Some(STREAMS.iter().filter_map(|(name, _)| StreamId::read(name)).collect()),
        initial_heading_deg: None,
        instrument: Some(walk.instrument()),
    };
    device.send(&DeviceMessage::Hello(hello)).await;
    let Answer::Welcome { session_id, .. } = device.next().await else { panic!("no welcome") };
    let batches = walk.batches();
    let (before, after) = batches.split_at(batches.len() / 2);
    send(&mut device, before).await;
    let site = walk.path("site.toml");
    let server = server.restart_with(|config| config.site = Some(site)).await;
    let (mut device, _) = TestDevice::go_on(&server, &session_id).await;
    send(&mut device, after).await;
    // Where the rover is is known while the device is still there.
    let mut told = newest(&server, &session_id).await;
    for _ in 0..400 {
        if told[0] > 60.0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
        told = newest(&server, &session_id).await;
    }
    let truth = truth_at(&walk, truth_first_s(&walk) + told[0]);
    let off_m = (told[1] - truth[0]).hypot(told[2] - truth[1]);
    assert!(told[0] > 60.0 && off_m < 0.5 && told[3] < 0.5, "{told:?} {truth:?}");
    device.finish().await;
    assert_eq!(finished(&server, &session_id).await, line, "stream");
}

fn truth_first_s(walk: &Walk) -> f64 {
    let text = String::from_utf8(walk.bytes("truth.csv")).unwrap();
    text.lines().nth(1).unwrap().split(',').next().unwrap().parse().unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_cannot_be_a_rover_is_refused_in_a_sentence_and_gives_no_point() {
    let walk = Walk::simulated().await;
    let server = walk.server().await;
    for (streams, instrument, code, said) in [
        (json!(["base"]), json!(walk.instrument()), "wrong_instrument", "neither rover nor ranges"),
        (json!(["ranges"]), json!("[uwb]\n"), "wrong_instrument", "[[anchors]]"),
        (json!(["ranges"]), json!("[[anchors]]\nname = \"A\"\ne_m = 0\n"), "wrong_instrument", "n_m"),
    ] {
        let new = json!({
            "inspector_id": server.inspector().await,
            "system": "rover",
            "streams": streams,
            "instrument": instrument,
        });
        let refused = ask(server.client.post(server.api("/sessions")).json(&new)).await;
        assert_eq!((refused.status, refused.code()), (422, code), "{refused:?}");
        assert!(refused.detail().contains(said), "{refused:?}");
    }
    let names: Vec<&str> = STREAMS.iter().map(|(name, _)| *name).collect();
    let session = json!({ "system": "rover", "streams": names, "instrument": walk.instrument() });
    let session_id = server.session(session).await;
    // The base's file in the place of the orbits is none, and says so with its line.
    let refused = hand_in(&server, &session_id, "navigation_1", walk.bytes("base.obs")).await;
    assert_eq!((refused.status, refused.code()), (422, "unknown_format"), "{refused:?}");
    for (stream, file) in STREAMS.into_iter().filter(|(stream, _)| *stream != "base") {
        let accepted = hand_in(&server, &session_id, stream, walk.bytes(file)).await;
        assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
    }
    let job = server.process(&session_id).await;
    assert_eq!(job["state"], "failed", "{job}");
    assert!(job.to_string().contains("nothing is stored of the stream base"), "{job}");
}

#[tokio::test(flavor = "multi_thread")]
async fn other_programs_get_the_same_places_with_their_quality() {
    let walk = Walk::simulated().await;
    let report = walk.processed_into("track.pos").await;
    walk.processed_into("track.nmea").await;
    walk.processed_into("track.csv").await;
    let csv = String::from_utf8(walk.bytes("track.csv")).unwrap();
    let (head, rows) = csv.split_once('\n').unwrap();
    let column = |name: &str| head.split(',').position(|column| column == name).unwrap();
    let pos = gnss::read(&walk.bytes("track.pos")).unwrap().rows;
    let nmea = gnss::read(&walk.bytes("track.nmea")).unwrap().rows;
    let by_satellites: Vec<Vec<&str>> = rows
        .lines()
        .map(|row| row.split(',').collect())
        .filter(|row: &Vec<&str>| ["fixed", "float", "single"].contains(&row[column("quality")]))
        .collect();
    // In the hall there are rows that rest on no satellite: readers of positions pass them over.
    assert!(by_satellites.len() < rows.lines().count());
    assert_eq!((pos.len(), nmea.len()), (by_satellites.len(), by_satellites.len()));
    for ((row, pos), nmea) in by_satellites.iter().zip(&pos).zip(&nmea) {
        assert_eq!((pos.t_ns, pos.quality), (nmea.t_ns, nmea.quality));
        for (name, of_pos, of_nmea, slack) in [
            ("lat_deg", pos.place.latitude_deg, nmea.place.latitude_deg, 2e-9),
            ("lon_deg", pos.place.longitude_deg, nmea.place.longitude_deg, 2e-9),
            ("height_m", pos.place.height_m, nmea.place.height_m, 1e-4),
        ] {
            let expected: f64 = row[column(name)].parse().unwrap();
            assert!(
                (of_pos - expected).abs() < slack && (of_nmea - expected).abs() < slack,
                "{name}: {row:?}"
            );
        }
    }
    let fixed = pos.iter().filter(|row| row.quality == GnssQuality::Fixed).count();
    assert_eq!(report["quality"]["fixed"], fixed);
}
