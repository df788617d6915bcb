//! Logs as other makers' loggers write them: recognised, looked at, mapped, and the same walk all the same.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::sync::OnceLock;

use lodestep_engine::geo::Site;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_tests::hand_in::{Answer, ask, gzip, log, sha256};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

const G: f64 = 9.806_65;

/// A walk of twenty metres.
fn walk() -> &'static Walk {
    static WALK: OnceLock<Walk> = OnceLock::new();
    WALK.get_or_init(|| simulate(&WalkKind::Line { metres: 20.0 }, 1, &Site::fast(), &SensorModel::cmp10a()))
}

/// As x-io's software writes it, its clock 1000 s ahead of the session's.
fn x_io(samples: &[ImuSample]) -> Vec<u8> {
    let mut text = "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT)\n".to_owned();
    for sample in samples {
        let ([wx, wy, wz], [fx, fy, fz]) =
            (sample.w_ib_b_rad_s.map(|w| w * 180.0 / PI), sample.f_b_m_s2.map(|f| f / G));
        let [mx, my, mz] = sample
            .mag_b_ut
            .map_or([String::new(), String::new(), String::new()], |m| m.map(|m| m.to_string()));
        let t_s = 1000.0 + sample.t_ns as f64 / 1e9;
        writeln!(text, "{t_s:.4},{wx},{wy},{wz},{fx},{fy},{fz},{mx},{my},{mz}").unwrap();
    }
    text.into_bytes()
}

/// As a WitMotion sensor sends it on its line: steps of 1/32768 of its ranges, milliseconds.
fn wit_serial(samples: &[ImuSample]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut packet = |kind: u8, data: [u8; 8]| {
        let start = bytes.len();
        bytes.extend([0x55, kind]);
        bytes.extend(data);
        let sum = bytes[start..].iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
        bytes.push(sum);
    };
    let words = |values: [f64; 3], full: f64| {
        let mut data = [0; 8];
        for (i, value) in values.into_iter().enumerate() {
            let word = (value / full * 32_768.0).round().clamp(-32_768.0, 32_767.0) as i16;
            data[2 * i..2 * i + 2].copy_from_slice(&word.to_le_bytes());
        }
        data
    };
    for sample in samples {
        let ms = sample.t_ns / 1_000_000;
        let [low, high] = ((ms % 1000) as u16).to_le_bytes();
        packet(0x50, [26, 11, 25, 9, (ms / 60_000) as u8, (ms / 1000 % 60) as u8, low, high]);
        packet(0x51, words(sample.f_b_m_s2, 16.0 * G));
        packet(0x52, words(sample.w_ib_b_rad_s, 2000.0_f64.to_radians()));
        // Tenths of a microtesla.
        packet(0x54, words(sample.mag_b_ut.unwrap_or_default(), 3276.8));
    }
    bytes
}

/// A table that nobody knows.
fn own(samples: &[ImuSample]) -> Vec<u8> {
    let mut text = "Our logger\nms;wx;wy;wz;fx;fy;fz\n".to_owned();
    for sample in samples {
        let ([wx, wy, wz], [fx, fy, fz]) = (sample.w_ib_b_rad_s.map(|w| w * 180.0 / PI), sample.f_b_m_s2);
        writeln!(text, "{};{wx};{wy};{wz};{fx};{fy};{fz}", sample.t_ns / 1_000_000).unwrap();
    }
    text.into_bytes()
}

fn mapping() -> Value {
    json!({
        "delimiter": "semicolon",
        "time": { "column": "ms", "unit": "ms" },
        "gyr": { "columns": ["wx", "wy", "wz"], "unit": "deg_s" },
        "acc": { "columns": ["fx", "fy", "fz"], "unit": "m_s2" },
    })
}

async fn preview(server: &TestServer, bytes: Vec<u8>, reading: Value, part: bool) -> Answer {
    let query = [("part", part.to_string()), ("reading", reading.to_string())];
    let url = reqwest::Url::parse_with_params(&server.api("/logs/preview"), &query).unwrap();
    ask(server.client.post(url).body(bytes)).await
}

/// Hands both feet in, processes, and tells the session.
async fn walked(server: &TestServer, feet: [Vec<u8>; 2], reading: Value) -> (Value, Value) {
    let session_id = server.session(json!({ "initial_heading_deg": 0 })).await;
    let mut format = Value::Null;
    for (foot, bytes) in ["left", "right"].into_iter().zip(feet) {
        let hash = sha256(&bytes);
        let begun =
            server.begin_log(&session_id, json!({ "foot": foot, "sha256": hash, "reading": reading })).await;
        let log_id = begun.id().to_owned();
        server.append(&log_id, 0, bytes).await;
        let accepted = server.finish_log(&log_id, &hash).await;
        assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
        assert_eq!(accepted.body["t_first_ns"], 0, "{accepted:?}");
        format = accepted.body["format"].clone();
    }
    let job = server.process(&session_id).await;
    assert_eq!(job["state"], "finished", "{job}");
    (format, server.look(&format!("/sessions/{session_id}")).await.body)
}

#[tokio::test]
async fn the_same_walk_comes_out_of_every_format() {
    let server = TestServer::start().await;
    let feet = |write: fn(&[ImuSample]) -> Vec<u8>| [write(&walk().left), write(&walk().right)];
    let (format, canonical) = walked(&server, feet(log), json!({})).await;
    assert_eq!(format, "canonical");
    let metres = canonical["distance_m"].as_f64().unwrap();
    assert!((metres - 20.0).abs() < 1.5, "{metres}");
    let own_reading = json!({ "mapping": mapping() });
    for (write, reading, expected) in [
        (x_io as fn(&[ImuSample]) -> Vec<u8>, json!({}), "x_io"),
        (wit_serial, json!({ "field_ut_per_count": 0.1 }), "wit_serial"),
        (own, own_reading, "mapped"),
    ] {
        let (format, session) = walked(&server, feet(write), reading).await;
        assert_eq!(format, expected);
        let other = session["distance_m"].as_f64().unwrap();
        assert!((other - metres).abs() < 0.3, "{expected}: {other} m, canonical {metres} m");
        assert_eq!(session["samples"], canonical["samples"], "{expected}");
    }
}

#[tokio::test]
async fn a_log_is_looked_at_and_nothing_is_kept() {
    let server = TestServer::start().await;
    let seen = preview(&server, gzip(&x_io(&walk().left)), json!({}), false).await;
    assert_eq!(seen.status, 200, "{seen:?}");
    let (body, survey) = (&seen.body, &seen.body["survey"]);
    assert_eq!((body["format"].as_str(), &body["problem"]), (Some("x_io"), &Value::Null));
    assert_eq!(body["mapping"]["gyr"]["unit"], "deg_s");
    assert_eq!(survey["samples"], walk().left.len());
    assert!((survey["rate_hz"].as_f64().unwrap() - 100.0).abs() < 1.0, "{survey}");
    assert!(survey["still_s"].as_f64().unwrap() > 8.0, "{survey}");
    assert!(survey["chart"]["rate_rad_s"].as_array().unwrap().len() > 50);
    assert_eq!(body["clock_ns"][0], 1_000_000_000_000_i64);

    // A dump's field is in counts until somebody says how much one is.
    let counts = preview(&server, wit_serial(&walk().left), json!({}), false).await.body;
    assert_eq!(
        (counts["field_in_counts"].as_bool(), counts["format"].as_str()),
        (Some(true), Some("wit_serial"))
    );
    let field = counts["survey"]["field_mean_ut"].as_f64().unwrap();
    assert!((field - 481.0).abs() < 40.0, "{field}");

    // Half of a log, as the page sends it of a long one.
    let half = gzip(&log(&walk().left));
    let part = preview(&server, half[..half.len() / 2].to_vec(), json!({}), true).await.body;
    assert_eq!((part["part"].as_bool(), &part["problem"]), (Some(true), &Value::Null));

    let wrong = preview(&server, own(&walk().left), json!({}), false).await.body;
    assert_eq!((&wrong["format"], wrong["problem"]["code"].as_str()), (&Value::Null, Some("unknown_format")));
    assert_eq!(wrong["columns"][1], "wx");
    let picture = preview(&server, b"\x89PNG\r\n\x1a\n".to_vec(), json!({}), false).await;
    assert_eq!((picture.status, picture.code()), (422, "not_text"));
    assert_eq!(preview(&server, Vec::new(), json!({}), false).await.code(), "empty_file");
    assert_eq!(preview(&server, Vec::new(), json!({ "rate": 1 }), false).await.code(), "wrong_field");
    let large = preview(&server, vec![b'x'; (16 << 20) + 1], json!({}), true).await;
    assert_eq!((large.status, large.code()), (413, "preview_too_large"));

    assert_eq!(server.look("/sessions").await.body, json!([]));
    assert_eq!(std::fs::read_dir(server.folder().join("uploads")).unwrap().count(), 0);
}

#[tokio::test]
async fn an_upload_is_looked_at_whole_before_it_is_finished() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let bytes = own(&walk().left);
    let hash = sha256(&bytes);
    let log_id = server
        .begin_log(&session_id, json!({ "foot": "left", "size_bytes": bytes.len(), "sha256": hash }))
        .await
        .id()
        .to_owned();
    server.append(&log_id, 0, bytes[..50_000].to_vec()).await;
    let look = async |reading: Value| {
        let post = server.client.post(server.api(&format!("/logs/{log_id}/preview")));
        ask(post.json(&json!({ "reading": reading }))).await.body
    };
    assert_eq!(look(json!({})).await["part"], true);
    server.append(&log_id, 50_000, bytes[50_000..].to_vec()).await;
    assert_eq!(look(json!({})).await["problem"]["code"], "unknown_format");
    // Degrees where radians were said.
    let mut radians = mapping();
    radians["gyr"]["unit"] = json!("rad_s");
    assert_eq!(look(json!({ "mapping": radians })).await["problem"]["code"], "degrees_not_radians");
    let fine = look(json!({ "mapping": mapping() })).await;
    assert_eq!((&fine["problem"], fine["format"].as_str()), (&Value::Null, Some("mapped")));
    assert_eq!(fine["survey"]["samples"], walk().left.len());

    let finish = server.client.post(server.api(&format!("/logs/{log_id}/finish")));
    let accepted = ask(finish.json(&json!({ "sha256": hash, "reading": { "mapping": mapping() } }))).await;
    assert_eq!(accepted.body["state"], "accepted", "{accepted:?}");
    assert_eq!(accepted.body["reading"]["mapping"]["time"]["unit"], "ms");
    let late = ask(server.client.post(server.api(&format!("/logs/{log_id}/preview"))).json(&json!({}))).await;
    assert_eq!((late.status, late.code()), (409, "upload_finished"));

    // The same bytes read alike are here already; read otherwise they are refused.
    let again =
        json!({ "foot": "left", "sha256": hash, "reading": { "mapping": mapping(), "clock_zero_ns": 5 } });
    assert_eq!(server.begin_log(&session_id, again).await.body["state"], "unchanged");
    let otherwise = server.begin_log(&session_id, json!({ "foot": "left", "sha256": hash })).await;
    assert_eq!((otherwise.status, otherwise.code()), (409, "other_reading"));
}

#[tokio::test]
async fn a_log_in_no_known_format_is_refused_with_what_is_known() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let refused = server.hand_in(&session_id, "left", own(&walk().left)).await;
    assert_eq!((refused.status, refused.code()), (422, "unknown_format"));
    for said in
        ["ms, wx, wy", "WitMotion", "NGIMU", "Xsens", "SensorConnect", "say which column is which channel"]
    {
        assert!(refused.detail().contains(said), "{said}: {}", refused.detail());
    }
}

#[tokio::test]
async fn two_logs_of_one_clock_are_placed_by_it() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    let reading = json!({ "clock_zero_ns": 999_500_000_000_i64 });
    let bytes = x_io(&walk().left);
    let begun = server.begin_log(&session_id, json!({ "foot": "left", "reading": reading })).await;
    server.append(begun.id(), 0, bytes.clone()).await;
    let accepted = server.finish_log(begun.id(), &sha256(&bytes)).await;
    assert_eq!(accepted.body["t_first_ns"], 500_000_000);
}

#[tokio::test]
async fn mappings_are_kept_under_a_name() {
    let server = TestServer::start().await;
    let new = json!({ "name": " Our logger ", "mapping": mapping() });
    let post = async |body: &Value| ask(server.client.post(server.api("/mappings")).json(body)).await;
    let made = post(&new).await;
    assert_eq!((made.status, made.body["name"].as_str()), (201, Some("Our logger")));
    assert_eq!(made.body["mapping"]["gyr"], mapping()["gyr"]);
    assert_eq!(post(&new).await.code(), "name_taken");
    let mut twice = new.clone();
    twice["mapping"]["acc"]["columns"][0] = json!("wx");
    assert_eq!(post(&twice).await.code(), "bad_mapping");
    assert_eq!(post(&json!({ "name": "", "mapping": mapping() })).await.code(), "wrong_name");

    let path = format!("/mappings/{}", made.id());
    let put = server.client.put(server.api(&path)).json(&json!({ "name": "Renamed", "mapping": mapping() }));
    assert_eq!(ask(put).await.body["name"], "Renamed");
    let server = server.restart().await;
    assert_eq!(server.look("/mappings").await.body[0]["name"], "Renamed");
    assert_eq!(ask(server.client.delete(server.api(&path))).await.status, 204);
    assert_eq!(server.look(&path).await.status, 404);
}
