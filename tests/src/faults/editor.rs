//! Who moves a marker again and again, and who reports one fault after the other, without ever giving up.

use std::time::Duration;

use reqwest::Method;
use serde_json::json;
use uuid::Uuid;

use super::promises::Promises;
use super::uploader::Asker;

/// The marker that is moved.
pub const MOVED: &str = "M1";
/// Between two changes.
const PACE: Duration = Duration::from_millis(15);

/// Moves the marker so many times, a metre each: the next only when the last is known to be stored.
pub async fn move_marker(asker: &mut Asker, promises: &Promises, times: u64) {
    let path = format!("/markers/{MOVED}");
    for number in 1..=times {
        loop {
            let now = asker.insist(promises, Method::GET, &path, |request| request).await;
            // The answer was lost, the change was not.
            if now.body["e_m"].as_f64() == Some(number as f64) {
                break;
            }
            let marker = json!({"name": MOVED, "e_m": number, "n_m": 5, "version": now.body["version"]});
            let put = asker.insist(promises, Method::PUT, &path, |request| request.json(&marker)).await;
            match put.status {
                200 | 201 => break,
                // The one before, whose answer was lost, has come in between.
                409 => {}
                _ => return promises.broken(format!("a marker could not be moved: {put:?}")),
            }
        }
        promises.moved(number);
        tokio::time::sleep(PACE).await;
    }
}

/// The places of the moved marker, in the order in which its history tells them.
pub async fn moves(asker: &mut Asker, promises: &Promises) -> Vec<u64> {
    let path = format!("/markers/{MOVED}/history");
    let history = asker.insist(promises, Method::GET, &path, |request| request).await;
    let changes = history.body.as_array().into_iter().flatten().rev();
    changes.filter_map(|change| change["after"]["e_m"].as_f64()).map(|e_m| e_m as u64).collect()
}

/// Reports so many faults.
pub async fn report_faults(asker: &mut Asker, promises: &Promises, inspector: &str, times: u64) {
    for number in 0..times {
        let id = Uuid::now_v7();
        let fault = json!({
            "id": id, "inspector_id": inspector, "reported_at": "2026-03-01T08:00:00Z",
            "kind": "hydraulic_leak", "severity": "low", "text": format!("number {number}"),
        });
        let told = asker.insist(promises, Method::POST, "/faults", |request| request.json(&fault)).await;
        if !matches!(told.status, 200 | 201) {
            return promises.broken(format!("a fault could not be reported: {told:?}"));
        }
        promises.fault(id);
        tokio::time::sleep(PACE).await;
    }
}
