//! Devices that send in other units: told before anything is stored, or said in the hello and converted, in frames and in JSON.

use lodestep_engine::parse::live_message::Answer;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::device::TestDevice;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

/// Half a second of standing at 100 Hz, in these units.
fn standing(step: i64, force: f64) -> Vec<ImuSample> {
    let sample = |k: i64| ImuSample {
        t_ns: k * step,
        w_ib_b_rad_s: [0.001 * (k % 5) as f64, 0.0, 0.0],
        f_b_m_s2: [0.0, 0.001 * force * (k % 3) as f64, force],
        mag_b_ut: None,
        pressure_hpa: None,
    };
    (0..50).map(sample).collect()
}

fn as_json(samples: &[ImuSample]) -> String {
    let rows: Vec<Value> = samples
        .iter()
        .map(|s| {
            let ([wx, wy, wz], [fx, fy, fz]) = (s.w_ib_b_rad_s, s.f_b_m_s2);
            json!([s.t_ns, wx, wy, wz, fx, fy, fz, null, null, null, null])
        })
        .collect();
    json!({ "type": "batch", "stream": "left", "sequence": 0, "samples": rows }).to_string()
}

/// Begins a session with a hello that says this of units; the device and the session's id.
async fn begin(server: &TestServer, units: Value) -> (TestDevice, String) {
    let mut device = TestDevice::connect(server).await;
    let mut hello = json!({ "type": "hello", "inspector_id": server.inspector().await, "start": { "position_m": [0, 0, 0] } });
    if !units.is_null() {
        hello["units"] = units;
    }
    device.send_text(hello.to_string()).await;
    match device.next().await {
        Answer::Welcome { session_id, .. } => (device, session_id),
        other => panic!("expected a welcome, found {other:?}"),
    }
}

async fn problem(device: &mut TestDevice) -> (String, String) {
    match device.next().await {
        Answer::Error(problem) => {
            let word = |key: &str| problem[key].as_str().unwrap_or_default().to_owned();
            (word("code"), word("detail"))
        }
        other => panic!("expected an error, found {other:?}"),
    }
}

#[tokio::test]
async fn samples_in_other_units_are_told_before_anything_is_stored_and_taken_once_that_is_said() {
    let server = TestServer::start().await;
    for (step, force, code, way, units) in [
        (10, 9.8, "bad_time", "\"time\":\"ms\"", json!({ "time": "ms" })),
        (10_000, 9.8, "bad_time", "\"time\":\"us\"", json!({ "time": "us" })),
        (10_000_000, 1.0, "other_unit", "\"acc\":\"g\"", json!({ "acc": "g" })),
        (10_000_000, 999.0, "other_unit", "\"acc\":\"mg\"", json!({ "acc": "mg" })),
    ] {
        let samples = standing(step, force);
        for frames in [true, false] {
            let (mut device, session_id) = begin(&server, Value::Null).await;
            if frames {
                device.send_frame(Side::Left, 0, &samples).await;
            } else {
                device.send_text(as_json(&samples)).await;
            }
            let (found, sentence) = problem(&mut device).await;
            assert!(found == code && sentence.contains(way), "{found}: {sentence}");
            device.cut();
            // It comes back and says it; the batch has not been stored.
            let mut device = TestDevice::connect(&server).await;
            let hello = json!({ "type": "hello", "session_id": session_id, "units": units });
            device.send_text(hello.to_string()).await;
            let Answer::Welcome { next_sequence, .. } = device.next().await else { panic!("a welcome") };
            assert!(next_sequence.values().all(|next| *next == 0), "{next_sequence:?}");
            if frames {
                device.send_frame(Side::Left, 0, &samples).await;
            } else {
                device.send_text(as_json(&samples)).await;
            }
            device.acknowledged(Side::Left, 0).await;
            device.finish().await;
        }
    }
    let mut device = TestDevice::connect(&server).await;
    let hello = json!({ "type": "hello", "inspector_id": server.inspector().await, "units": { "time": "fortnights" } });
    device.send_text(hello.to_string()).await;
    assert_eq!(problem(&mut device).await.0, "not_json");
}
