//! A survey with the pole goes through every door: command line, upload and device socket.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello};
use lodestep_engine::parse::{ReadOptions, StreamReader, frame};
use lodestep_engine::stream::{Readings, StreamId};
use lodestep_engine::systems::pole::DECLARATION;
use lodestep_server::cli;
use lodestep_tests::device::TestDevice;
use lodestep_tests::hand_in::{Answer as Told, ask, sha256};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use tempfile::TempDir;

/// The streams with their files.
const STREAMS: [(&str, &str); 3] = [("imu", "imu.csv"), ("gnss", "gnss.csv"), ("switch", "contact.csv")];

async fn run(arguments: &[&str]) -> ExitCode {
    let line: Vec<OsString> =
        std::iter::once("lodestep").chain(arguments.iter().copied()).map(Into::into).collect();
    tokio::task::spawn_blocking(move || cli::run(line)).await.unwrap()
}

/// A survey that never was, with its site in a file of its own.
struct Survey {
    folder: TempDir,
}

impl Survey {
    async fn simulated() -> Survey {
        let survey = Survey { folder: tempfile::tempdir().unwrap() };
        let out = survey.folder.path().to_str().unwrap().to_owned();
        assert_eq!(run(&["simulate", "pole", "--route", "I20", "--out", &out]).await, ExitCode::SUCCESS);
        let pole = survey.pole();
        let (site, _) = pole.split_once("[pole]").unwrap();
        std::fs::write(survey.path("site.toml"), site.replace("[site]", "")).unwrap();
        survey
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    fn pole(&self) -> String {
        String::from_utf8(self.bytes("pole.toml")).unwrap()
    }

    /// The report of the command line; `more` are further options.
    async fn by_command_line(&self, more: &[&str]) -> Value {
        let of = |name: &str| self.path(name).to_str().unwrap().to_owned();
        let [imu, gnss, contact] = STREAMS.map(|(_, file)| of(file));
        let options: &[&str] = &[
            "process",
            "pole",
            "--imu",
            &imu,
            "--gnss",
            &gnss,
            "--contact",
            &contact,
            "--instrument",
            &of("pole.toml"),
            "--out",
            &of("track.csv"),
            "--report",
            &of("report.json"),
        ];
        let done = run(&[options, more].concat()).await;
        assert_eq!(done, ExitCode::SUCCESS);
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

    async fn server(&self) -> TestServer {
        let site = self.path("site.toml");
        TestServer::start_with(|config| config.site = Some(site)).await
    }

    async fn upload(&self, server: &TestServer, pole: &str) -> String {
        let names: Vec<&str> = STREAMS.iter().map(|(name, _)| *name).collect();
        let session = json!({ "system": "pole", "streams": names, "instrument": pole });
        let session_id = server.session(session).await;
        for (stream, file) in STREAMS {
            let accepted = hand_in(server, &session_id, stream, self.bytes(file)).await;
            assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
        }
        session_id
    }
}

async fn hand_in(server: &TestServer, session_id: &str, stream: &str, bytes: Vec<u8>) -> Told {
    let begun = server.begin_log(session_id, json!({ "stream": stream })).await;
    assert_eq!(begun.status, 201, "{begun:?}");
    let hash = sha256(&bytes);
    assert_eq!(server.append(begun.id(), 0, bytes).await.status, 204);
    server.finish_log(begun.id(), &hash).await
}

/// The readings of all streams in batches of a second.
fn batches(survey: &Survey) -> Vec<Batch> {
    let mut batches = Vec::new();
    for (stream, file) in STREAMS {
        let mut left = survey.readings(stream, file);
        let mut sequence = 0;
        while !left.is_empty() {
            let first_ns = left.get(0).unwrap().t_ns();
            let second = first_ns.div_euclid(1_000_000_000);
            let same = |reading: &lodestep_engine::stream::Reading<'_>| {
                reading.t_ns().div_euclid(1_000_000_000) == second
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

fn truth_at(path: &Path, t_s: f64) -> [f64; 2] {
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        (numbers[0], [numbers[1], numbers[2]])
    });
    rows.min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs())).unwrap().1
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_survey_is_the_same_by_every_door_also_when_the_server_starts_anew_in_the_middle() {
    let survey = Survey::simulated().await;
    let report = survey.by_command_line(&[]).await;
    let line = report["track_sha256"].as_str().unwrap();

    let server = survey.server().await;
    let uploaded = survey.upload(&server, &survey.pole()).await;
    let job = server.process(&uploaded).await;
    assert_eq!(job["state"], "finished", "{job}");
    assert_eq!(finished(&server, &uploaded).await, line, "upload");

    let mut device = TestDevice::connect(&server).await;
    let hello = Hello::Begin {
        inspector_id: server.inspector().await,
        start: None,
        system: Some("pole".to_owned()),
        streams: None,
        initial_heading_deg: None,
        instrument: Some(survey.pole()),
    };
    device.send(&DeviceMessage::Hello(hello)).await;
    let Answer::Welcome { session_id, .. } = device.next().await else { panic!("no welcome") };
    let batches = batches(&survey);
    let (before, after) = batches.split_at(batches.len() / 2);
    send(&mut device, before).await;
    let site = survey.path("site.toml");
    let server = server.restart_with(|config| config.site = Some(site)).await;
    let (mut device, _) = TestDevice::go_on(&server, &session_id).await;
    send(&mut device, after).await;
    // The tip is known while the device is still there, and how sure it is.
    let mut told = newest(&server, &session_id).await;
    for _ in 0..400 {
        if told[0] > 20.0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
        told = newest(&server, &session_id).await;
    }
    let truth = truth_at(&survey.path("truth.csv"), told[0]);
    let off_m = (told[1] - truth[0]).hypot(told[2] - truth[1]);
    assert!(told[0] > 20.0 && off_m < 0.3 && told[3] < 0.3, "{told:?} {truth:?}");
    device.finish().await;
    assert_eq!(finished(&server, &session_id).await, line, "stream");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_pole_that_cannot_be_is_refused_in_a_sentence_and_gives_no_point() {
    let survey = Survey::simulated().await;
    let server = survey.server().await;
    for (wrong, said) in [
        (None, "the pole's file"),
        (Some("[pole]\nantenna_b_m = [0, 1]\n"), "tip_b_m"),
        (Some("[pole]\ntip_b_m = [0, 0, -1]\n"), "antenna_b_m"),
    ] {
        let new = json!({
            "inspector_id": server.inspector().await,
            "system": "pole",
            "streams": ["imu", "gnss"],
            "instrument": wrong,
        });
        let refused = ask(server.client.post(server.api("/sessions")).json(&new)).await;
        assert_eq!((refused.status, refused.code()), (422, "wrong_instrument"), "{refused:?}");
        assert!(refused.detail().contains(said), "{refused:?}");
    }
    let pole = survey.pole();
    let swapped =
        pole.replace("antenna_b_m", "x").replace("tip_b_m", "antenna_b_m").replace("x =", "tip_b_m =");
    let session_id = survey.upload(&server, &swapped).await;
    let job = server.process(&session_id).await;
    assert_eq!(job["state"], "failed", "{job}");
    assert!(job.to_string().contains("swapped"), "{job}");
}

/// The row of a file that has one.
fn row(text: &str) -> Vec<String> {
    text.lines().nth(1).unwrap().split(',').map(str::to_owned).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_survey_is_compared_with_the_markers_and_stands_as_their_source_when_it_is_applied() {
    let survey = Survey::simulated().await;
    let server = survey.server().await;
    let text = |name: &str| String::from_utf8(survey.bytes(name)).unwrap();
    let truth: Vec<f64> =
        row(&text("points_truth.csv"))[4..7].iter().map(|cell| cell.parse().unwrap()).collect();
    // An old coordinate that is 8 cm off.
    let old = format!("name,e_m,n_m,u_m\nT,{},{},{}\n", truth[0] + 0.08, truth[1], truth[2]);
    let put = server.client.post(server.api("/markers/import")).header("Content-Type", "text/csv").body(old);
    assert_eq!(ask(put).await.status, 200);
    let session_id = survey.upload(&server, &survey.pole()).await;
    let nothing = ask(server.client.post(server.api(&format!("/sessions/{session_id}/marker-import")))).await;
    assert_eq!((nothing.status, nothing.code()), (409, "nothing_surveyed"), "{nothing:?}");
    let [_, from_s, to_s] = &row(&text("points.csv"))[..] else { panic!("points.csv has three columns") };
    let [from_s, to_s]: [f64; 2] = [from_s, to_s].map(|cell| cell.parse().unwrap());
    let middle_s = 0.5 * (from_s + to_s);
    // Twice: the first and the second half of the stand.
    let halves = [(from_s, middle_s - 0.5), (middle_s + 0.5, to_s)];
    for (t_start_s, t_end_s) in halves {
        let visit = json!({ "marker": "T", "t_start_s": t_start_s, "t_end_s": t_end_s });
        let told =
            ask(server.client.post(server.api(&format!("/sessions/{session_id}/visits"))).json(&visit)).await;
        assert_eq!(told.status, 201, "{told:?}");
    }
    let job = server.process(&session_id).await;
    assert_eq!(job["state"], "finished", "{job}");

    let points = server.look(&format!("/sessions/{session_id}/surveyed-points")).await.body;
    let [point] = &points.as_array().unwrap()[..] else { panic!("{points}") };
    assert_eq!((&point["marker"], &point["visits"]), (&json!("T"), &json!(2)));
    let number = |value: &Value| value.as_f64().unwrap();
    let apart_m = number(&point["visits_apart_m"]);
    assert!(apart_m > 0.0 && apart_m < 0.02, "{point}");
    let sigma_m = number(&point["sigma_m"][0]);
    assert!((0.002..0.06).contains(&sigma_m), "{point}");
    assert!((number(&point["off_m"][0]) + 0.08).abs() < 4.0 * sigma_m, "{point}");
    // Of both visits together, as the command line has it.
    let halves: String = halves.iter().map(|(from_s, to_s)| format!("T,{from_s},{to_s}\n")).collect();
    std::fs::write(survey.path("halves.csv"), format!("name,t_start_s,t_end_s\n{halves}")).unwrap();
    let [told, out] =
        ["halves.csv", "surveyed.csv"].map(|name| survey.path(name).to_str().unwrap().to_owned());
    survey.by_command_line(&["--points", &told, "--points-out", &out]).await;
    let by_line = &row(&text("surveyed.csv"))[7..10];
    for (axis, by_line) in by_line.iter().enumerate() {
        let by_line: f64 = by_line.parse().unwrap();
        assert!((number(&point["sigma_m"][axis]) - by_line).abs() < 1e-4, "{axis}: {by_line}, {point}");
    }

    let compared =
        ask(server.client.post(server.api(&format!("/sessions/{session_id}/marker-import")))).await;
    assert_eq!(compared.status, 201, "{compared:?}");
    let [difference] = &compared.body["differences"].as_array().unwrap()[..] else { panic!("{compared:?}") };
    assert!((number(&difference["sigma_m"][0]) - sigma_m).abs() < 1e-4, "{difference}");
    assert!((number(&difference["before"]["e_m"]) - truth[0] - 0.08).abs() < 1e-6, "{difference}");
    let apply = json!({ "reason": "surveyed anew", "accept_warnings": true });
    let id = compared.id();
    let applied =
        ask(server.client.post(server.api(&format!("/markers/imports/{id}/apply"))).json(&apply)).await;
    assert_eq!(applied.status, 200, "{applied:?}");
    let history = server.look("/markers/T/history").await.body;
    assert_eq!(history[0]["import_id"], json!(id), "{history}");
    let source = server.look(&format!("/markers/imports/{id}")).await.body;
    assert_eq!(source["file_name"], json!(format!("survey-{session_id}.csv")));
    let points = server.look(&format!("/sessions/{session_id}/surveyed-points")).await.body;
    assert!(number(&points[0]["off_m"][0]).abs() < 1e-3, "what was taken over is not off any more: {points}");

    let walk = server.session(json!({})).await;
    let refused = ask(server.client.get(server.api(&format!("/sessions/{walk}/surveyed-points")))).await;
    assert_eq!((refused.status, refused.code()), (409, "not_a_survey"), "{refused:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_point_that_is_no_marker_yet_becomes_one_when_the_survey_is_accepted() {
    let survey = Survey::simulated().await;
    let server = survey.server().await;
    let text = |name: &str| String::from_utf8(survey.bytes(name)).unwrap();
    let truth: Vec<f64> =
        row(&text("points_truth.csv"))[4..7].iter().map(|cell| cell.parse().unwrap()).collect();
    let session_id = survey.upload(&server, &survey.pole()).await;
    let [_, from_s, to_s] = &row(&text("points.csv"))[..] else { panic!("points.csv has three columns") };
    let [from_s, to_s]: [f64; 2] = [from_s, to_s].map(|cell| cell.parse().unwrap());
    let visit = json!({ "marker": "NEW", "t_start_s": from_s, "t_end_s": to_s });
    let visits = server.api(&format!("/sessions/{session_id}/visits"));
    let told = ask(server.client.post(&visits).json(&visit)).await;
    assert_eq!(told.status, 201, "{told:?}");
    let nameless = json!({ "marker": "'", "t_start_s": from_s, "t_end_s": to_s });
    let refused = ask(server.client.post(&visits).json(&nameless)).await;
    assert_eq!((refused.status, refused.code()), (422, "wrong_name"), "{refused:?}");
    let job = server.process(&session_id).await;
    assert_eq!(job["state"], "finished", "{job}");
    let told = server.look(&format!("/sessions/{session_id}/visits")).await.body;
    assert!(told[0]["reason"].as_str().unwrap().contains("a new point"), "{told}");

    let points = server.look(&format!("/sessions/{session_id}/surveyed-points")).await.body;
    assert_eq!((&points[0]["marker"], &points[0]["off_m"]), (&json!("NEW"), &Value::Null));
    let import = server.api(&format!("/sessions/{session_id}/marker-import"));
    let compared = ask(server.client.post(import)).await;
    assert_eq!(compared.status, 201, "{compared:?}");
    let [difference] = &compared.body["differences"].as_array().unwrap()[..] else { panic!("{compared:?}") };
    assert_eq!((&difference["name"], &difference["change"]), (&json!("NEW"), &json!("added")));
    let id = compared.id();
    let apply = json!({ "reason": "a new point", "accept_warnings": true });
    let apply = server.client.post(server.api(&format!("/markers/imports/{id}/apply"))).json(&apply);
    assert_eq!(ask(apply).await.status, 200);
    let markers = server.look("/markers").await.body;
    let [marker] = &markers.as_array().unwrap()[..] else { panic!("{markers}") };
    for (axis, name) in ["e_m", "n_m", "u_m"].into_iter().enumerate() {
        assert!((marker[name].as_f64().unwrap() - truth[axis]).abs() < 0.1, "{marker}, {truth:?}");
    }
    assert_eq!(server.look("/markers/NEW/history").await.body[0]["import_id"], json!(id));
    // Held against the marker that it has become, it is not off.
    let points = server.look(&format!("/sessions/{session_id}/surveyed-points")).await.body;
    assert!(points[0]["off_m"][0].as_f64().unwrap().abs() < 1e-3, "{points}");
}
