//! What charts are drawn from: of every step in time the smallest and the largest value.

use std::sync::OnceLock;

use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_tests::hand_in::{ask, log};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// A walk of thirty metres, with one sample that stands out.
fn walk() -> &'static Walk {
    static WALK: OnceLock<Walk> = OnceLock::new();
    WALK.get_or_init(|| {
        let mut walk = simulate(&WalkKind::Line { metres: 30.0 }, 4, &Site::fast(), &SensorModel::cmp10a());
        let at = walk.left.len() / 2;
        walk.left[at].w_ib_b_rad_s = [30.0, 0.0, 0.0];
        walk
    })
}

async fn handed_in(server: &TestServer) -> String {
    let [e, n, u] = walk().start_n_m();
    let marker = json!({ "name": "A1", "e_m": e + 0.5, "n_m": n, "u_m": u });
    assert_eq!(ask(server.client.post(server.api("/markers")).json(&marker)).await.status, 201);
    let session_id = server.session(json!({ "start": { "position_m": [e, n, u] } })).await;
    for (foot, samples) in [("left", &walk().left), ("right", &walk().right)] {
        assert_eq!(server.hand_in(&session_id, foot, log(samples)).await.body["state"], "accepted");
    }
    let visit = json!({ "marker": "A1", "t_start_s": 4.0, "t_end_s": 7.0 });
    let told = server.client.post(server.api(&format!("/sessions/{session_id}/visits"))).json(&visit);
    assert_eq!(ask(told).await.status, 201);
    session_id
}

fn line<'a>(charts: &'a Value, chart: &str, series: &str) -> &'a Value {
    let all = charts["series"].as_array().unwrap();
    let found = all.iter().find(|line| line["chart"] == chart && line["series"] == series);
    found.unwrap_or_else(|| {
        let names: Vec<_> = all.iter().map(|line| format!("{} {}", line["chart"], line["series"])).collect();
        panic!("no line {chart} {series} in {names:?}")
    })
}

fn values(line: &Value) -> Vec<f64> {
    let high = if line["high"].is_null() { &line["low"] } else { &line["high"] };
    high.as_array().unwrap().iter().filter_map(Value::as_f64).collect()
}

#[tokio::test]
async fn a_processed_walk_has_all_its_charts_and_no_peak_is_lost() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    assert_eq!(server.process(&session_id).await["state"], "finished");
    let path = format!("/sessions/{session_id}/charts");
    let charts = server.look(&format!("{path}?buckets=20")).await.body;
    for chart in ["gyro_norm", "force_norm", "field", "pressure_height", "rate", "stance", "magnetic"] {
        for foot in ["left", "right"] {
            assert!(!values(line(&charts, chart, foot)).is_empty(), "{chart} {foot}");
        }
    }
    for chart in ["sigma_plan", "sigma_up", "sigma_heading", "heading", "height"] {
        for run in ["main", "filtered", "without_markers"] {
            assert!(!values(line(&charts, chart, run)).is_empty(), "{chart} {run}");
        }
    }
    for chart in ["nis_zupt", "nis_heading", "nis_separation", "nis_altimeter"] {
        assert!(values(line(&charts, chart, "accepted")).iter().all(|nis| *nis >= 0.0), "{chart}");
    }
    for chart in ["gyro_bias", "gyro_bias_sigma", "accelerometer_bias", "accelerometer_bias_sigma"] {
        assert!(!values(line(&charts, chart, "right_z")).is_empty(), "{chart}");
    }
    // At most as many values as there is room for, and one at either end; the one sample is among them.
    let gyro = line(&charts, "gyro_norm", "left");
    assert!(gyro["low"].as_array().unwrap().len() <= 22, "{gyro}");
    assert_eq!(values(gyro).into_iter().fold(0.0, f64::max), 30.0);
    assert!(values(line(&charts, "rate", "left")).iter().all(|rate| *rate == 100.0));
    // The height by pressure begins where the track does.
    let first = |chart: &str, series: &str| line(&charts, chart, series)["low"][0].as_f64().unwrap();
    assert!((first("pressure_height", "left") - first("height", "main")).abs() < 2.0);
    let limits = charts["limits"].as_array().unwrap();
    assert!(limits.contains(&json!({ "chart": "field", "name": "weakest", "value": 40.0 })), "{limits:?}");

    // Close to, the samples themselves: a step of two milliseconds and more holds one sample at most.
    let at_s = walk().left[walk().left.len() / 2].t_ns as f64 * 1e-9;
    let window = format!("from_s={}&to_s={}&buckets=100&charts=gyro_norm,stance", at_s - 0.25, at_s + 0.25);
    let close = server.look(&format!("{path}?{window}")).await.body;
    let gyro = line(&close, "gyro_norm", "left");
    assert_eq!((values(gyro).len(), gyro["high"].is_null()), (50, true), "{gyro}");
    assert!(gyro["step_s"].as_f64().unwrap() < 0.006);
    assert!(values(gyro).contains(&30.0));
    assert!(close["series"].as_array().unwrap().iter().all(|line| line["chart"] != "field"), "not asked for");

    // Worked out again, they are the same.
    server.process(&session_id).await;
    assert_eq!(server.look(&format!("{path}?buckets=20")).await.body, charts);
}

#[tokio::test]
async fn a_walk_that_was_never_processed_shows_its_samples() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    let charts =
        server.look(&format!("/sessions/{session_id}/charts?from_s=0&to_s=20&buckets=40")).await.body;
    assert_eq!(line(&charts, "force_norm", "right")["low"].as_array().unwrap().len(), 40);
    assert!(charts["series"].as_array().unwrap().iter().all(|line| line["chart"] != "gyro_bias"));
}

#[tokio::test]
async fn a_wrong_window_is_told() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    server.process(&session_id).await;
    let path = format!("/sessions/{session_id}/charts");
    assert_eq!(server.look(&format!("{path}?from_s=9&to_s=3")).await.code(), "wrong_window");
    assert_eq!(server.look(&format!("{path}?from_s=1e300")).await.code(), "wrong_window");
    assert_eq!(server.look(&format!("{path}?buckets=0")).await.code(), "wrong_buckets");
    assert_eq!(server.look("/sessions/0198c0de-0000-7000-8000-000000000000/charts").await.status, 404);
}

#[tokio::test]
async fn a_track_is_cut_to_a_stretch() {
    let server = TestServer::start().await;
    let session_id = handed_in(&server).await;
    server.process(&session_id).await;
    let path = format!("/sessions/{session_id}/track");
    let rows = |track: &Value| track["rows"].as_array().unwrap().clone();
    let main = rows(&server.look(&path).await.body);
    let piece = rows(&server.look(&format!("{path}?from_s=8&to_s=10")).await.body);
    assert!((19..=21).contains(&piece.len()), "{}", piece.len());
    assert!(piece.iter().all(|row| main.contains(row)));
}
