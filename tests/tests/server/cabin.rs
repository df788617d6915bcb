//! A run of the feed cabin goes through every door: command line, upload and device socket.

use std::ffi::OsString;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::Duration;

use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello};
use lodestep_engine::parse::{ReadOptions, StreamReader, frame};
use lodestep_engine::stream::{Readings, StreamId};
use lodestep_engine::systems::cabin::DECLARATION;
use lodestep_server::cli;
use lodestep_tests::device::TestDevice;
use lodestep_tests::hand_in::{Answer as Told, ask, sha256};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use tempfile::TempDir;

/// The streams with their files.
const STREAMS: [(&str, &str); 6] = [
    ("imu", "imu.csv"),
    ("platform_imu", "platform_imu.csv"),
    ("gnss", "antennas.csv"),
    ("stations", "stations.csv"),
    ("encoders", "encoders.csv"),
    ("plan", "plan.csv"),
];

async fn run(arguments: &[&str]) -> ExitCode {
    let line: Vec<OsString> =
        std::iter::once("lodestep").chain(arguments.iter().copied()).map(Into::into).collect();
    tokio::task::spawn_blocking(move || cli::run(line)).await.unwrap()
}

/// A run that never was.
struct Run {
    folder: TempDir,
}

impl Run {
    async fn simulated() -> Run {
        Run::of("8").await
    }

    /// One that tracks for so long, s.
    async fn of(track_s: &str) -> Run {
        let run = Run { folder: tempfile::tempdir().unwrap() };
        let out = run.folder.path().to_str().unwrap().to_owned();
        let line = [
            "simulate",
            "cabin",
            "--hold-s",
            "6",
            "--slew-s",
            "4",
            "--track-s",
            track_s,
            "--fault",
            "wrong_fix.2@12..16",
            "--out",
            &out,
        ];
        assert_eq!(self::run(&line).await, ExitCode::SUCCESS);
        run
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    fn instrument(&self) -> String {
        String::from_utf8(self.bytes("cabin.toml")).unwrap()
    }

    /// The report of the command line.
    async fn by_command_line(&self) -> Value {
        let of = |name: &str| self.path(name).to_str().unwrap().to_owned();
        let given = [
            ("--imu", "imu.csv"),
            ("--platform-imu", "platform_imu.csv"),
            ("--gnss", "antennas.csv"),
            ("--stations", "stations.csv"),
            ("--encoders", "encoders.csv"),
            ("--instrument", "cabin.toml"),
            ("--out", "cabin.csv"),
            ("--platform-out", "platform.csv"),
            ("--report", "report.json"),
        ];
        let given: Vec<String> =
            given.iter().flat_map(|(option, file)| [(*option).to_owned(), of(file)]).collect();
        let mut line = vec!["process", "cabin", "--solution", "smoothed"];
        line.extend(given.iter().map(String::as_str));
        assert_eq!(run(&line).await, ExitCode::SUCCESS);
        serde_json::from_slice(&self.bytes("report.json")).unwrap()
    }

    /// The readings of a stream, as its file has them.
    fn readings(&self, stream: &str, file: &str) -> Readings {
        let stream = DECLARATION.stream(StreamId::read(stream).unwrap()).unwrap();
        let rule = DECLARATION.rule_of(&stream).unwrap();
        let mut reader = StreamReader::new(rule, ReadOptions::default()).unwrap();
        let mut readings = reader.none();
        reader.push(&self.bytes(file), &mut readings).unwrap();
        reader.finish(&mut readings).unwrap();
        readings
    }

    async fn upload(&self, server: &TestServer, instrument: &str, changed: &[(&str, Vec<u8>)]) -> String {
        let names: Vec<&str> = STREAMS.iter().map(|(name, _)| *name).collect();
        let session = json!({ "system": "cabin", "streams": names, "instrument": instrument });
        let session_id = server.session(session).await;
        for (stream, file) in STREAMS {
            let other = changed.iter().find(|(name, _)| *name == stream).map(|(_, bytes)| bytes.clone());
            let accepted =
                hand_in(server, &session_id, stream, other.unwrap_or_else(|| self.bytes(file))).await;
            assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
        }
        session_id
    }

    /// All readings in batches of so many milliseconds, in the order of time.
    fn batches(&self, batch_ms: i64) -> Vec<Batch> {
        let batch_ns = batch_ms * 1_000_000;
        let mut batches = Vec::new();
        for (stream, file) in STREAMS {
            let mut left = self.readings(stream, file);
            let mut sequence = 0;
            while !left.is_empty() {
                let first_ns = left.get(0).unwrap().t_ns();
                let same = |reading: &lodestep_engine::stream::Reading<'_>| {
                    reading.t_ns().div_euclid(batch_ns) == first_ns.div_euclid(batch_ns)
                };
                let rest = left.split_off(left.iter().take_while(same).count());
                let of = StreamId::read(stream).unwrap();
                batches.push((first_ns, Batch { stream: StreamKey::Id(of), sequence, readings: left }));
                sequence += 1;
                left = rest;
            }
        }
        batches.sort_by_key(|(t_ns, _)| *t_ns);
        batches.into_iter().map(|(_, batch)| batch).collect()
    }

    fn truth_at(&self, t_s: f64) -> [f64; 3] {
        let text = String::from_utf8(self.bytes("truth.csv")).unwrap();
        let rows = text.lines().skip(1).map(|line| {
            let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            (numbers[0], [numbers[1], numbers[2], numbers[3]])
        });
        rows.min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs())).unwrap().1
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

/// The last row of a track by the names of its columns.
async fn newest(server: &TestServer, session_id: &str, columns: &[&str]) -> Vec<f64> {
    let track = server.url(&format!("/api/v1/sessions/{session_id}/track.csv"));
    let text = server.client.get(track).send().await.unwrap().text().await.unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let last: Vec<&str> = text.lines().last().unwrap().split(',').collect();
    let at = |name: &&str| {
        head.iter().position(|column| column == name).unwrap_or_else(|| panic!("{name} in {head:?}"))
    };
    columns.iter().map(|name| last[at(name)].parse().unwrap_or(f64::NAN)).collect()
}

async fn begin(server: &TestServer, instrument: String) -> (TestDevice, String) {
    let mut device = TestDevice::connect(server).await;
    let hello = Hello::Begin {
        inspector_id: server.inspector().await,
        start: None,
        system: Some("cabin".to_owned()),
        streams: None,
        initial_heading_deg: None,
        instrument: Some(instrument),
    };
    device.send(&DeviceMessage::Hello(hello)).await;
    let Answer::Welcome { session_id, .. } = device.next().await else { panic!("no welcome") };
    (device, session_id)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_run_is_the_same_by_every_door_also_when_the_server_starts_anew_in_the_middle() {
    let cabin = Run::simulated().await;
    let report = cabin.by_command_line().await;
    let line = report["track_sha256"].as_str().unwrap();
    assert!(report["anomalies"].to_string().contains("wrong_fix"), "{report}");

    let server = TestServer::start().await;
    let uploaded = cabin.upload(&server, &cabin.instrument(), &[]).await;
    let job = server.process(&uploaded).await;
    assert_eq!(job["state"], "finished", "{job}");
    assert_eq!(finished(&server, &uploaded).await, line, "upload");
    let anomalies = server.look(&format!("/sessions/{uploaded}/anomalies")).await.body;
    assert!(anomalies.to_string().contains("A3"), "{anomalies}");
    // What the page draws: measured less planned, and which aids were in.
    let charts =
        server.look(&format!("/sessions/{uploaded}/charts?charts=off_plan,aids,protection_level")).await.body;
    for wanted in ["cabin_e", "platform_u", "\"A3\"", "\"S1\"", "encoders"] {
        assert!(charts.to_string().contains(wanted), "{wanted}");
    }

    let (mut device, session_id) = begin(&server, cabin.instrument()).await;
    let batches = cabin.batches(1000);
    let (before, after) = batches.split_at(batches.len() / 2);
    send(&mut device, before).await;
    let server = server.restart().await;
    let (mut device, _) = TestDevice::go_on(&server, &session_id).await;
    send(&mut device, after).await;
    // The pose is known while the device is still there, and how sure it is.
    let columns = ["t_s", "e_m", "n_m", "u_m", "sigma_e_m", "platform_e_m"];
    let mut told = newest(&server, &session_id, &columns).await;
    for _ in 0..400 {
        if told[0] > 15.0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
        told = newest(&server, &session_id, &columns).await;
    }
    let truth = cabin.truth_at(told[0]);
    let off_m = (0..3).map(|axis| (told[1 + axis] - truth[axis]).powi(2)).sum::<f64>().sqrt();
    assert!(told[0] > 15.0 && off_m < 0.03 && told[4] < 0.01 && told[5].is_finite(), "{told:?} {truth:?}");
    // Also what is wrong, and with which device.
    let anomalies = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
    assert!(
        anomalies.to_string().contains("wrong_fix") && anomalies.to_string().contains("A3"),
        "{anomalies}"
    );
    device.finish().await;
    assert_eq!(finished(&server, &session_id).await, line, "stream");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_that_starts_anew_takes_up_a_saved_state_of_a_cabin_and_reads_what_came_after() {
    let cabin = Run::of("185").await;
    let server = TestServer::start().await;
    let (mut device, session_id) = begin(&server, cabin.instrument()).await;
    let batches = cabin.batches(1000);
    let (before, after) = batches.split_at(batches.len() - 12);
    send(&mut device, before).await;
    let server = server.restart().await;
    let (mut device, _) = TestDevice::go_on(&server, &session_id).await;
    send(&mut device, after).await;
    let metrics = server.client.get(server.url("/metrics")).send().await.unwrap().text().await.unwrap();
    let figure = |name: &str| {
        let line = metrics.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_default();
        line.trim().parse::<f64>().unwrap_or(f64::NAN)
    };
    assert!((figure("lodestep_live_states_taken_up_total") - 1.0).abs() < 1e-9, "a saved state was taken up");
    let columns = ["t_s", "e_m", "n_m", "u_m", "sigma_e_m"];
    let mut told = newest(&server, &session_id, &columns).await;
    for _ in 0..400 {
        if told[0] > 194.0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
        told = newest(&server, &session_id, &columns).await;
    }
    let truth = cabin.truth_at(told[0]);
    let off_m = (0..3).map(|axis| (told[1 + axis] - truth[axis]).powi(2)).sum::<f64>().sqrt();
    assert!(told[0] > 194.0 && off_m < 0.005 && told[4] < 0.004, "{told:?} {truth:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_instrument_that_cannot_be_is_refused_and_logs_of_another_give_no_pose() {
    let cabin = Run::simulated().await;
    let server = TestServer::start().await;
    let good = cabin.instrument();
    for (wrong, said) in [
        (None, "the cabin's file"),
        (Some(good.replace("[rotator]", "[rotor]")), "rotator"),
        (Some(good.replace("\"A1\"", "\"antenna_one\"")), "8 letters"),
    ] {
        let new = json!({
            "inspector_id": server.inspector().await,
            "system": "cabin",
            "streams": ["imu", "gnss"],
            "instrument": wrong,
        });
        let refused = ask(server.client.post(server.api("/sessions")).json(&new)).await;
        assert_eq!((refused.status, refused.code()), (422, "wrong_instrument"), "{refused:?}");
        assert!(refused.detail().contains(said), "{refused:?}");
    }
    let antennas = String::from_utf8(cabin.bytes("antennas.csv")).unwrap();
    let stations = String::from_utf8(cabin.bytes("stations.csv")).unwrap();
    let gon = in_gon(&stations);
    for (stream, log, said) in
        [("gnss", antennas.replace(",A2,", ",A7,"), "antenna A7"), ("stations", gon, "an azimuth in radians")]
    {
        let session_id = cabin.upload(&server, &good, &[(stream, log.into_bytes())]).await;
        let job = server.process(&session_id).await;
        assert_eq!(job["state"], "failed", "{job}");
        assert!(job.to_string().contains(said), "{job}");
    }
}

/// The same angles in gon.
fn in_gon(stations: &str) -> String {
    let rows = stations.lines().enumerate().map(|(number, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if number > 0 {
            for angle in &mut cells[3..5] {
                let rad: f64 = angle.parse().unwrap();
                *angle = format!("{:.7}", rad * 200.0 / std::f64::consts::PI);
            }
        }
        cells.join(",")
    });
    rows.collect::<Vec<_>>().join("\n") + "\n"
}

/// Whether a program answers; one that is not there skips what needs it, in a sentence.
fn is_there(program: &str) -> bool {
    let found = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    let is_there = found.is_ok_and(|status| status.success());
    if !is_there {
        // For people only: nothing depends on whether it can be shown.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: there is no {program} here, so its client of the poses is not run"
        );
    }
    is_there
}

fn client(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/clients").join(name)
}

fn started(command: &mut Command, server: &TestServer, session_id: &str, poses: usize) -> Child {
    let address = server.url("");
    let (host, port) = address.trim_start_matches("http://").trim_end_matches('/').rsplit_once(':').unwrap();
    let count = poses.to_string();
    command.args([host, port, session_id, &count]).stdout(Stdio::piped()).spawn().unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_clients_in_python_and_c_are_told_valid_poses_that_are_close_to_the_truth() {
    const POSES: usize = 3000;
    let cabin = Run::simulated().await;
    let server = TestServer::start().await;
    let (mut device, session_id) = begin(&server, cabin.instrument()).await;
    let mut python = is_there("python3").then(|| {
        let mut command = Command::new("python3");
        started(command.arg(client("poses.py")), &server, &session_id, POSES)
    });
    let mut c = is_there("cc").then(|| {
        let program = cabin.path("poses");
        let mut build = Command::new("cc");
        build.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-o"]);
        let built = build.arg(&program).arg(client("poses.c")).status().unwrap();
        assert!(built.success(), "the client in C compiles without a warning");
        started(&mut Command::new(program), &server, &session_id, POSES)
    });
    // What they print is read while it comes: a pipe holds little.
    let read = |child: &mut Option<Child>| {
        let out = child.as_mut().and_then(|child| child.stdout.take());
        tokio::task::spawn_blocking(move || {
            let lines: Option<Vec<String>> =
                out.map(|out| BufReader::new(out).lines().map(Result::unwrap).collect());
            lines.unwrap_or_default()
        })
    };
    let (of_python, of_c) = (read(&mut python), read(&mut c));
    tokio::time::sleep(Duration::from_millis(300)).await;
    send(&mut device, &cabin.batches(250)).await;
    let (of_python, of_c) = (of_python.await.unwrap(), of_c.await.unwrap());
    for child in [&mut python, &mut c].into_iter().flatten() {
        assert!(child.wait().unwrap().success(), "it was told all of its poses");
    }
    if python.is_some() {
        let poses: Vec<Value> = of_python.iter().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!(poses.len(), POSES);
        assert!(poses.windows(2).all(|two| two[0]["sequence"].as_u64() < two[1]["sequence"].as_u64()));
        let pose = poses.iter().rfind(|pose| pose["bodies"][0]["valid"] == true).unwrap();
        let at = |body: usize, axis: usize| pose["bodies"][body]["position_n_m"][axis].as_f64().unwrap();
        let truth = cabin.truth_at(pose["t_s"].as_f64().unwrap());
        assert!((0..3).all(|axis| (at(0, axis) - truth[axis]).abs() < 0.05), "{pose} {truth:?}");
        let aid = |pose: &Value, name: &str| -> Value {
            pose["aids"].as_array().unwrap().iter().find(|aid| aid["name"] == name).unwrap().clone()
        };
        assert!(aid(pose, "imu")["in"] == true && at(1, 2) < at(0, 2) - 1.0, "{pose}");
        // The antenna that is wrong from 12 s on is out, and it is said why and since when.
        let wrong = poses.iter().find(|pose| pose["t_s"].as_f64().unwrap() > 13.5).unwrap();
        let (shut_out, other) = (aid(wrong, "A3"), aid(wrong, "A1"));
        assert_eq!(
            (&shut_out["in"], &shut_out["trouble"]),
            (&json!(false), &json!("wrong_fix")),
            "{shut_out}"
        );
        let since_s = shut_out["since_s"].as_f64().unwrap();
        assert!((1.2..1.8).contains(&since_s), "{shut_out}");
        // Batches of a quarter of a second may make it look silent, but never wrong.
        assert!(other["in"] == true && other["trouble"] != "wrong_fix", "{other}");
        assert!(pose["bodies"][0]["off_plan_n_m"][0].as_f64().unwrap().abs() < 0.3, "{pose}");
    }
    if c.is_some() {
        assert_eq!(of_c.len(), POSES + 1);
        let numbers =
            |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect::<Vec<f64>>();
        let rows: Vec<Vec<f64>> = of_c[1..].iter().map(|line| numbers(line)).collect();
        // Where the cabin's valid bit is set.
        let row = rows.iter().rfind(|row| row[12] == 1.0).unwrap();
        let truth = cabin.truth_at(row[1]);
        assert!((0..3).all(|axis| (row[5 + axis] - truth[axis]).abs() < 0.05), "{row:?} {truth:?}");
        assert!(row[11] > 0.0 && row[11] < 0.1, "protection level: {row:?}");
        let troubles = of_c[1..]
            .iter()
            .filter(|line| line.rsplit(',').next().is_some_and(|last| last.starts_with("3:")));
        assert!(troubles.count() > 200, "A3 is told with its trouble");
    }
}
