//! Files as they come from the field (`tests/data/cases`, whose README says what is right), a row a case: logs by the
//! command line, tables of markers by the import.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use lodestep_engine::parse::{LogReader, ReadOptions};
use lodestep_tests::hand_in::sha256;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

fn case(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/cases").join(name)
}

fn log(name: &str, foot: &str) -> PathBuf {
    let found = ["csv.gz", "txt.gz"].map(|ending| case(name).join(format!("{foot}.{ending}")));
    found.into_iter().find(|path| path.exists()).unwrap()
}

/// What a case's logs are processed with beside the site.
#[derive(Clone, Copy, Default)]
struct With {
    both_feet: bool,
    no_magnetometer: bool,
    rate: bool,
}

/// The report of `lodestep process`, and the track in a format for maps; `None` where it was refused.
fn process(name: &str, with: With, ending: &str) -> Option<(Value, String)> {
    let folder = tempfile::tempdir().unwrap();
    let (report, track) = (folder.path().join("r.json"), folder.path().join(format!("t.{ending}")));
    let mut arguments: Vec<OsString> = ["lodestep", "process", "--site"].map(OsString::from).to_vec();
    arguments.extend([case("site.toml").into(), "--out".into(), track.clone().into()]);
    arguments.extend(["--report".into(), report.clone().into(), "--left".into(), log(name, "left").into()]);
    if with.both_feet {
        arguments.extend(["--right".into(), log(name, "right").into()]);
    }
    if case(name).join("mapping.json").exists() {
        arguments.extend(["--mapping".into(), case(name).join("mapping.json").into()]);
    }
    if with.no_magnetometer {
        arguments.extend(["--initial-heading-deg".into(), "-9.2".into()]);
    }
    if with.rate {
        arguments.extend(["--sensor-rate-hz".into(), "100".into()]);
    }
    let _ = lodestep_server::cli::run(arguments);
    let report = serde_json::from_slice(&std::fs::read(report).ok()?).unwrap();
    Some((report, std::fs::read_to_string(track).unwrap()))
}

fn kinds(report: &Value) -> Vec<&str> {
    report["anomalies"].as_array().unwrap().iter().map(|anomaly| anomaly["kind"].as_str().unwrap()).collect()
}

#[tokio::test]
async fn the_same_logs_handed_in_are_the_same_walks() {
    let server = TestServer::start().await;
    for (name, with, told) in log_cases() {
        let more = if with.no_magnetometer { json!({ "initial_heading_deg": -9.2 }) } else { json!({}) };
        let session_id = server.session(more).await;
        let mut reading = json!({});
        if let Ok(mapping) = std::fs::read(case(name).join("mapping.json")) {
            reading["mapping"] = serde_json::from_slice(&mapping).unwrap();
        }
        if with.rate {
            reading["rate_hz"] = json!(100.0);
        }
        for foot in if with.both_feet { &["left", "right"][..] } else { &["left"] } {
            let bytes = std::fs::read(log(name, foot)).unwrap();
            let begun = server.begin_log(&session_id, json!({ "foot": foot, "reading": reading })).await;
            server.append(begun.id(), 0, bytes.clone()).await;
            let accepted = server.finish_log(begun.id(), &sha256(&bytes)).await;
            assert_eq!(accepted.body["state"], "accepted", "{name}: {accepted:?}");
        }
        let job = server.process(&session_id).await;
        assert_eq!(job["state"], "finished", "{name}: {job}");
        let anomalies = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
        let of_walk = |kind: &&str| *kind != "foot_missing";
        let mut found: Vec<&str> = anomalies
            .as_array()
            .unwrap()
            .iter()
            .map(|anomaly| anomaly["anomaly"].as_str().unwrap())
            .filter(of_walk)
            .collect();
        found.sort_unstable();
        // Logs that are handed in one by one count from their own first rows: an hour between them is none.
        if name != "feet-one-hour-apart" {
            assert_eq!(found, told, "{name}: {anomalies}");
        }
        let session = server.look(&format!("/sessions/{session_id}")).await.body;
        let distance_m = session["distance_m"].as_f64().unwrap();
        let (report, _) = process(name, with, "csv").unwrap();
        assert!((distance_m - report["distance_m"].as_f64().unwrap()).abs() < 0.5, "{name}: {distance_m} m");
    }
}

/// Why a log is refused.
fn refusal(name: &str) -> String {
    let packed = std::fs::read(log(name, "left")).unwrap();
    let mut text = Vec::new();
    std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(&packed[..]), &mut text).unwrap();
    let (mut reader, mut samples) = (LogReader::new(ReadOptions::default()), Vec::new());
    let pushed = reader.push(&text, &mut samples);
    pushed.and_then(|()| reader.finish(&mut samples)).unwrap_err().to_string()
}

/// A case, what it is processed with, and what is told.
type LogCase = (&'static str, With, &'static [&'static str]);

fn log_cases() -> [LogCase; 18] {
    let left = With::default();
    let no_mag = With { no_magnetometer: true, ..left };
    let feet = With { both_feet: true, ..left };
    let feet_no_mag = With { both_feet: true, ..no_mag };
    let rate = |with| With { rate: true, ..with };
    [
        ("00-control", feet, &[]),
        ("arrival-stamps", feet, &["times_put_right", "times_put_right"]),
        ("whole-seconds", left, &["times_put_right"]),
        ("whole-seconds", rate(left), &["times_put_right"]),
        ("stamps-lost-digits", rate(left), &["times_put_right"]),
        ("counter-late-at-wrap", no_mag, &["times_put_right"]),
        ("clock-set-forward", no_mag, &["clock_set"]),
        ("clock-set-back-1h", no_mag, &["clock_set"]),
        ("feet-one-hour-apart", feet_no_mag, &["clocks_apart"]),
        ("iso-zone", no_mag, &[]),
        ("units-row", left, &[]),
        ("mt-manager-nan", rate(no_mag), &[]),
        ("rate-halves", left, &[]),
        ("slow-field", left, &[]),
        ("doors", left, &[]),
        ("last-line-cut", left, &["lines_left_out"]),
        ("zeros-at-the-end", left, &["lines_left_out"]),
        ("gap-in-the-walk", left, &["gap"]),
    ]
}

#[test]
fn every_log_is_the_walk_that_it_is_and_what_was_done_is_told() {
    for (name, with, told) in log_cases() {
        let (report, _) = process(name, with, "csv").unwrap_or_else(|| panic!("{name} was refused"));
        assert_eq!(kinds(&report), told, "{name}");
        if name == "gap-in-the-walk" {
            continue;
        }
        let number = |at: &str| report.pointer(at).and_then(Value::as_f64).unwrap();
        let (off, of_length) = if with.both_feet { (0.4, 1.0) } else { (1.1, 1.5) };
        // The same walk, processed alike, with nothing wrong in its logs.
        let (control, _) = process("00-control", With { rate: false, ..with }, "csv").unwrap();
        let away = |axis: &str| number(axis) - control.pointer(axis).and_then(Value::as_f64).unwrap();
        let [east, north] = ["/end/position_m/0", "/end/position_m/1"].map(away);
        assert!(east.hypot(north) < off, "{name}: {east:.2} m east, {north:.2} m north of the control's end");
        if name == "00-control" {
            let [east, north] = [number("/end/position_m/0"), number("/end/position_m/1") - 40.0];
            assert!(east.hypot(north) < off, "{name}: {east:.2} m east, {north:.2} m north of the true end");
        }
        assert!((number("/distance_m") - 39.0).abs() < of_length, "{name}: {} m", number("/distance_m"));
        assert!((number("/duration_s") - 49.8).abs() < 0.6, "{name}: {} s", number("/duration_s"));
    }
}

#[test]
fn what_only_the_user_knows_is_asked_in_one_sentence() {
    for (name, words) in [
        ("stamps-lost-digits", &["lost their digits", "give the rate"][..]),
        ("mt-manager-nan", &["rate"]),
        ("no-header", &["header"]),
        ("units-row", &["Foot/Acceleration/X", "suggest"]),
    ] {
        let sentence = refusal(name);
        for word in words {
            assert!(sentence.contains(word), "{name}: {sentence}");
        }
    }
}

#[test]
fn nothing_is_drawn_across_a_gap() {
    for (ending, pieces) in [("gpx", "<trkseg>"), ("kml", "<LineString>"), ("geojson", "MultiLineString")] {
        let (_, track) = process("gap-in-the-walk", With::default(), ending).unwrap();
        let found = track.matches(pieces).count();
        assert_eq!(found, if ending == "geojson" { 1 } else { 2 }, "{ending}");
    }
}

async fn send(server: &TestServer, file: impl Into<Vec<u8>>) -> (u16, Value) {
    let request = server.client.post(server.api("/markers/imports?file_name=survey.csv"));
    let answer = request.header("content-type", "text/csv").body(file.into()).send().await.unwrap();
    (answer.status().as_u16(), answer.json().await.unwrap())
}

/// Where the plan of an import has a marker, east and north, m.
fn place(import: &Value, name: &str) -> [f64; 2] {
    let differences = import["differences"].as_array().unwrap();
    let found = differences.iter().find(|difference| difference["name"] == name);
    let after = &found.unwrap_or_else(|| panic!("no {name} in {import}"))["after"];
    ["e_m", "n_m"].map(|axis| after[axis].as_f64().unwrap())
}

/// A file, one of its markers, where that is (east and north, m), how exactly, and the warnings that it needs.
type TableCase = (&'static str, &'static str, [f64; 2], f64, &'static [&'static str]);

#[tokio::test]
async fn every_table_of_markers_is_read_or_questioned() {
    let server = TestServer::start().await;
    let rows: [TableCase; 8] = [
        ("regional-table/semicolon.csv", "A10", [12.189, 33.609], 1e-6, &[]),
        ("regional-table/tab-utf16.txt", "A10", [12.189, 33.609], 1e-6, &[]),
        ("regional-table/sep-line.csv", "A10", [12.189, 33.609], 1e-6, &[]),
        ("wide-digits/markers.csv", "A10", [12.189, 33.609], 1e-6, &[]),
        ("degrees-minutes-seconds/markers.csv", "A10", [12.189, 33.609], 0.02, &[]),
        ("survey-axes/anchors.csv", "K10", [12.189, 33.609], 1e-6, &[]),
        ("survey-axes/three.csv", "A10", [12.189, 33.609], 1e-6, &["axes_by_custom"]),
        ("names-for-a-spreadsheet/markers.csv", "促动器一号", [10.0, 20.0], 1e-6, &[]),
    ];
    for (file, name, [east, north], off, needed) in rows {
        let (status, import) = send(&server, std::fs::read(case(file)).unwrap()).await;
        assert_eq!(status, 201, "{file}: {import}");
        let findings = import["findings"].as_array().unwrap();
        let of = |level: &str| findings.iter().filter(|found| found["level"] == level).count();
        assert_eq!(of("error"), 0, "{file}: {import}");
        for code in needed {
            assert!(findings.iter().any(|found| found["code"] == *code), "{file}: {import}");
        }
        let [e, n] = place(&import, name);
        assert!((e - east).hypot(n - north) < off, "{file}: {e} {n}");
    }
}

#[tokio::test]
async fn grids_twins_and_changed_columns_are_told() {
    let server = TestServer::start().await;
    for (file, code) in [
        ("zone-in-the-easting/markers.csv", "national_grid"),
        ("latitude-longitude-swapped/markers.csv", "swapped_lat_lon"),
        ("look-alike-names/markers.csv", "repeated_name"),
        ("look-alike-names/markers.csv", "wrong_name"),
    ] {
        let (_, import) = send(&server, std::fs::read(case(file)).unwrap()).await;
        let findings = import["findings"].as_array().unwrap();
        assert!(findings.iter().any(|found| found["code"] == code), "{file}: {import}");
    }
}

#[tokio::test]
async fn names_survive_a_spreadsheet() {
    let server = TestServer::start().await;
    let (_, import) =
        send(&server, std::fs::read(case("names-for-a-spreadsheet/markers.csv")).unwrap()).await;
    let path = format!("/markers/imports/{}/apply", import["id"].as_str().unwrap());
    let (status, answer) = server.post(&path, &json!({ "accept_warnings": true })).await;
    assert_eq!(status, 200, "{answer}");
    let export = server.client.get(server.api("/markers.csv")).send().await.unwrap().bytes().await.unwrap();
    // By its mark a spreadsheet knows UTF-8; what it saves comes back without a difference.
    assert!(export.starts_with(b"\xEF\xBB\xBF"));
    let (_, import) = send(&server, export.to_vec()).await;
    assert_eq!(import["unchanged"], 2, "{import}");
}
