//! From handed-in logs to a track that can be looked at and taken away.

use std::sync::OnceLock;

use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_tests::hand_in::{Answer, ask, log};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// A walk of thirty metres.
fn walk() -> &'static Walk {
    static WALK: OnceLock<Walk> = OnceLock::new();
    WALK.get_or_init(|| simulate(&WalkKind::Line { metres: 30.0 }, 3, &Site::fast(), &SensorModel::cmp10a()))
}

/// A session with both logs and a marker `A1` half a metre east of its start.
async fn handed_in(server: &TestServer) -> String {
    let [e, n, u] = walk().start_n_m();
    let marker = json!({ "name": "A1", "e_m": e + 0.5, "n_m": n, "u_m": u });
    let added = ask(server.client.post(server.api("/markers")).json(&marker)).await;
    assert_eq!(added.status, 201, "{added:?}");
    let session_id = server.session(json!({ "start": { "position_m": [e, n, u] } })).await;
    for (foot, samples) in [("left", &walk().left), ("right", &walk().right)] {
        let accepted = server.hand_in(&session_id, foot, log(samples)).await;
        assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
    }
    session_id
}

async fn add_visits(server: &TestServer, session_id: &str, kind: &str, body: String) -> Answer {
    let post = server.client.post(server.api(&format!("/sessions/{session_id}/visits")));
    ask(post.header("content-type", kind).body(body)).await
}

async fn text(server: &TestServer, path: &str) -> (Vec<String>, String) {
    let response = server.client.get(server.api(path)).send().await.unwrap();
    assert_eq!(response.status(), 200, "{path}");
    let header = |name: &str| response.headers().get(name).map_or("", |v| v.to_str().unwrap()).to_owned();
    (vec![header("content-type"), header("content-disposition")], response.text().await.unwrap())
}

#[tokio::test]
async fn a_session_is_processed_with_and_without_its_markers() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    let told =
        add_visits(&server, &session_id, "text/csv", "t_start_s,t_end_s,marker\n4,7,A1\n".into()).await;
    assert_eq!((told.status, told.body["added"].as_u64()), (201, Some(1)), "{told:?}");

    let job = server.process(&session_id).await;
    assert_eq!((job["state"].as_str(), job["progress"].as_f64()), (Some("finished"), Some(1.0)), "{job}");
    let session = server.look(&format!("/sessions/{session_id}")).await.body;
    assert_eq!(session["state"], "finished");
    assert_eq!(session["samples"], 2 * walk().left.len());
    let distance_m = session["distance_m"].as_f64().unwrap();
    assert!((distance_m - walk().distance_m).abs() < 2.0, "{distance_m} m of {} m", walk().distance_m);

    let visits = server.look(&format!("/sessions/{session_id}/visits")).await.body;
    assert_eq!(visits[0]["accepted"], true, "{visits}");
    let before = visits[0]["before_minus_marker_m"][0].as_f64().unwrap();
    assert!((before + 0.5).abs() < 0.1, "{visits}");

    let path = format!("/sessions/{session_id}/track");
    let main = server.look(&path).await.body;
    let without = server.look(&format!("{path}?run=without_markers")).await.body;
    assert_eq!((main["run"].as_str(), without["run"].as_str()), (Some("main"), Some("without_markers")));
    let filtered = server.look(&format!("{path}?run=filtered")).await.body;
    assert_eq!(filtered["run"], "filtered");
    assert_eq!(filtered["rows"].as_array().unwrap().len(), main["rows"].as_array().unwrap().len());
    assert_ne!(filtered["rows"], main["rows"], "smoothing moved nothing");
    // Behind the last row of the grid come a few samples at most, which have hardly anything to add.
    let last = |track: &Value| -> Vec<f64> {
        track["rows"]
            .as_array()
            .unwrap()
            .last()
            .unwrap()
            .as_array()
            .unwrap()
            .iter()
            .filter_map(Value::as_f64)
            .collect()
    };
    for (filtered, smoothed) in last(&filtered).into_iter().zip(last(&main)) {
        assert!((filtered - smoothed).abs() < 1e-3, "{filtered} {smoothed}");
    }
    let rows = main["rows"].as_array().unwrap();
    let seconds = walk().left.last().unwrap().t_ns as f64 / 1e9;
    assert!((rows.len() as f64 - 10.0 * seconds).abs() < 10.0 * 12.0, "{} rows of {seconds} s", rows.len());
    assert_eq!(rows.len(), without["rows"].as_array().unwrap().len());
    assert_ne!(main["rows"], without["rows"], "the visit moved nothing");
    let thinned = server.look(&format!("{path}?rate_hz=2")).await.body;
    let fifth = rows.len().div_ceil(5);
    assert!(thinned["rows"].as_array().unwrap().len().abs_diff(fifth) <= 1);
    let full = server.look(&format!("{path}?rate_hz=full")).await.body;
    assert_eq!(full["rows"].as_array().unwrap().len() as u64, session["epochs"].as_u64().unwrap());
    assert!(rows.iter().all(|row| full["rows"].as_array().unwrap().contains(row)));
    assert_eq!(server.look(&format!("{path}?rate_hz=0")).await.code(), "wrong_rate");

    // Again: the same bits, the same visit, nothing doubled.
    server.process(&session_id).await;
    assert_eq!(server.look(&path).await.body, main);
    let again = server.look(&format!("/sessions/{session_id}")).await.body;
    assert_eq!(again["track_sha256"], session["track_sha256"]);
    assert_eq!(again["anomalies"], session["anomalies"]);

    // The marker's survey is held against the walk; one that is put right is right at once.
    let residuals = server.look("/markers/residuals").await.body;
    let told = &residuals["markers"][0];
    assert_eq!(
        (told["marker"].as_str(), told["visits"].as_u64(), told["sessions"].as_u64()),
        (Some("A1"), Some(1), Some(1))
    );
    assert_eq!((told["mean_m"][0].as_f64(), told["suspect"].as_bool()), (Some(before), Some(false)));
    let surveyed = server.look("/markers/A1").await.body;
    let moved = json!({ "e_m": surveyed["e_m"].as_f64().unwrap() - 0.5, "n_m": surveyed["n_m"], "u_m": surveyed["u_m"], "version": surveyed["version"] });
    let answer = ask(server.client.put(server.api("/markers/A1")).json(&moved)).await;
    assert_eq!(answer.status, 200, "{answer:?}");
    let one = server.look("/markers/A1/residuals").await.body;
    assert!((one[0]["residual_m"][0].as_f64().unwrap() - before - 0.5).abs() < 1e-9, "{one}");
    assert_eq!(one[0]["session_id"], session["id"]);
}

#[tokio::test]
async fn a_track_is_taken_away_as_a_file() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    assert_eq!(server.process(&session_id).await["state"], "finished");
    let formats = [
        ("csv", "text/csv; charset=utf-8", "t_s,e_m,n_m,u_m,heading_rad"),
        ("geojson", "application/geo+json", "\"LineString\""),
        ("gpx", "application/gpx+xml", "<trkpt"),
        ("kml", "application/vnd.google-earth.kml+xml", "<kml"),
    ];
    for (extension, kind, words) in formats {
        let (headers, text) = text(&server, &format!("/sessions/{session_id}/track.{extension}")).await;
        assert_eq!(headers[0], kind);
        let name = headers[1].strip_prefix("attachment; filename=\"").unwrap().strip_suffix('"').unwrap();
        assert!(name.ends_with(&format!("{session_id}.{extension}")), "{name}");
        assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || "-.".contains(c)), "{name}");
        assert!(text.contains(words), "{extension}: {}", &text[..200]);
    }
    let (_, csv) = text(&server, &format!("/sessions/{session_id}/track.csv?rate_hz=1")).await;
    let json = server.look(&format!("/sessions/{session_id}/track?rate_hz=1")).await.body;
    assert_eq!(csv.lines().count(), 1 + json["rows"].as_array().unwrap().len());
    let nobody = "0199f1c8-0000-7000-8000-000000000000";
    assert_eq!(server.look(&format!("/sessions/{nobody}/track.csv")).await.code(), "session_not_found");
}

#[tokio::test]
async fn a_job_that_a_restart_interrupts_is_done_after_it() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    let asked = ask(server.client.post(server.api(&format!("/sessions/{session_id}/process")))).await;
    let server = server.restart().await;
    loop {
        let job = server.look(&format!("/jobs/{}", asked.id())).await.body;
        assert_ne!(job["state"], "failed", "{job}");
        if job["state"] == "finished" {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    }
    assert_eq!(server.look(&format!("/sessions/{session_id}")).await.body["state"], "finished");
}

#[tokio::test]
async fn a_failure_says_why_and_leaves_the_former_track() {
    let server = TestServer::start().await;
    let empty = server.session(json!({})).await;
    let job = server.process(&empty).await;
    assert_eq!(job["state"], "failed");
    assert!(job["error"].as_str().unwrap().contains("upload a log"), "{job}");

    let session_id = handed_in(&server).await;
    server.process(&session_id).await;
    let path = format!("/sessions/{session_id}/track");
    let former = server.look(&path).await.body;
    // A later log stands for its foot: this one is too short for anything.
    for (foot, samples) in [("left", &walk().left), ("right", &walk().right)] {
        assert_eq!(server.hand_in(&session_id, foot, log(&samples[..3])).await.body["state"], "accepted");
    }
    let job = server.process(&session_id).await;
    assert_eq!(job["state"], "failed", "{job}");
    let session = server.look(&format!("/sessions/{session_id}")).await.body;
    assert_eq!((session["state"].as_str(), &session["error"]), (Some("failed"), &job["error"]));
    assert_eq!(server.look(&path).await.body, former);
}

#[tokio::test]
async fn a_session_without_one_foots_log_is_computed_and_says_so() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    server.hand_in(&session_id, "right", log(&walk().right)).await;
    assert_eq!(server.process(&session_id).await["state"], "finished");
    let anomalies = server.look(&format!("/sessions/{session_id}/anomalies")).await.body;
    let missing: Vec<&Value> =
        anomalies.as_array().unwrap().iter().filter(|found| found["anomaly"] == "foot_missing").collect();
    assert_eq!(missing.len(), 1, "{anomalies}");
    assert_eq!(missing[0]["foot"], "left");
}

#[tokio::test]
async fn visits_are_checked_as_a_whole_and_added_once() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    let json_kind = "application/json";
    let tell = async |body: Value| add_visits(&server, &session_id, json_kind, body.to_string()).await;
    let good = json!({ "marker": "A1", "t_start_s": 4.0, "t_end_s": 7.5 });
    assert_eq!(tell(json!([good, good])).await.body["added"], 1);
    let again = tell(good.clone()).await;
    assert_eq!((again.status, again.body["unchanged"].as_u64()), (200, Some(1)));
    let crossing = tell(json!({ "marker": "A1", "t_start_s": 7.0, "t_end_s": 8.0 })).await;
    assert_eq!(crossing.body["overlaps"][0]["t_start_ns"], 7_000_000_000_i64, "{crossing:?}");

    let unknown = tell(json!([{ "marker": "A1", "t_start_s": 20, "t_end_s": 21 }, { "marker": "B9", "t_start_s": 30, "t_end_s": 31 }])).await;
    assert_eq!((unknown.status, unknown.code()), (422, "unknown_marker"));
    assert_eq!(unknown.body["where"], json!({ "line": 2, "column": "marker" }));
    let backward = tell(json!({ "marker": "A1", "t_start_s": 9, "t_end_s": 8.5 })).await;
    assert_eq!((backward.status, backward.code()), (422, "bad_time"));
    assert_eq!(tell(json!({ "marker": "A1" })).await.code(), "wrong_field");
    let csv = add_visits(&server, &session_id, "text/csv", "t_start_s,t_end_s,marker\n1,x,A1\n".into()).await;
    assert_eq!((csv.status, csv.body["where"]["line"].as_u64()), (422, Some(2)), "{csv:?}");
    let picture = add_visits(&server, &session_id, "image/png", String::new()).await;
    assert_eq!(picture.status, 415);
    // Of the refused lists nothing was stored.
    let visits = server.look(&format!("/sessions/{session_id}/visits")).await.body;
    assert_eq!(visits.as_array().unwrap().len(), 2);
}
