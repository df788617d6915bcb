//! Logs of a whole walk, handed in while others stream.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use bytes::Bytes;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::imu_csv;
use lodestep_engine::sim::pedestrian::{SensorModel, Simulator, WalkKind};
use serde_json::json;
use sha2::{Digest, Sha256};
use tokio::time::{Instant, sleep, sleep_until};

use super::api::Api;
use crate::cli::progress;

/// A walk's track is looked for this often.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// It is there within this time.
const FINISHED_WITHIN: Duration = Duration::from_secs(600);

/// The two logs of a walk of 45 minutes, 50 MB together.
pub(super) struct Walk {
    logs: [(Bytes, String); 2],
}

/// How one walk was taken in.
#[derive(Clone, Copy, Debug)]
pub(super) struct HandedIn {
    /// From the first byte sent to both logs accepted.
    pub(super) accepted_after: Duration,
    /// From the first byte sent to the track stored.
    pub(super) stored_after: Duration,
    pub(super) bytes: usize,
}

impl Walk {
    pub(super) fn make(seed: u64) -> Result<Walk> {
        Walk::of(&WalkKind::Spiral, seed, 1.0)
    }

    /// One of so many hours along a line, whose times are so many times what they should be.
    pub(super) fn of_hours(seed: u64, hours: f64, times: f64) -> Result<Walk> {
        Walk::of(&WalkKind::Line { metres: 1.2 * 3_600.0 * hours }, seed, times)
    }

    fn of(kind: &WalkKind, seed: u64, times: f64) -> Result<Walk> {
        let mut simulator = Simulator::new(kind, seed, &Site::fast(), &SensorModel::cmp10a());
        let bar = progress::of_count(simulator.epochs() as u64, "epochs of a log made");
        let (mut left, mut right, mut first) = (String::new(), String::new(), true);
        while let Some(epoch) = simulator.next_epoch() {
            for (text, sample) in [&mut left, &mut right].into_iter().zip(&epoch.samples) {
                let mut sample = sample.as_logged();
                sample.t_ns = (sample.t_ns as f64 * times) as i64;
                imu_csv::write(&[sample], first, text);
            }
            first = false;
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(Walk { logs: [packaged(left), packaged(right)] })
    }
}

fn packaged(text: String) -> (Bytes, String) {
    let sha256 = Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect();
    (text.into(), sha256)
}

/// Hands the walk in so many times at once.
pub(super) async fn hand_in(api: Api, walk: Arc<Walk>, times: u32, from: Instant) -> Result<Vec<HandedIn>> {
    let sessions = api.begin_sessions(times).await?;
    sleep_until(from).await;
    let tasks: Vec<_> = sessions
        .into_iter()
        .map(|session_id| tokio::spawn(one(api.clone(), Arc::clone(&walk), session_id.to_string())))
        .collect();
    let mut handed_in = Vec::new();
    for task in tasks {
        handed_in.push(task.await.context("an upload stopped")??);
    }
    Ok(handed_in)
}

pub(super) async fn one(api: Api, walk: Arc<Walk>, session_id: String) -> Result<HandedIn> {
    let begun = Instant::now();
    let mut bytes = 0;
    for (foot, (text, sha256)) in ["left", "right"].into_iter().zip(&walk.logs) {
        bytes += text.len();
        let announced = json!({"foot": foot, "sha256": sha256, "size_bytes": text.len(), "file_name": format!("{foot}.csv")});
        let log = api.post(&format!("/sessions/{session_id}/logs"), &announced).await?;
        let id = log["id"].as_str().context("the server began an upload without an id")?.to_owned();
        let sent = api.request("PATCH", &format!("/logs/{id}")).header("upload-offset", "0");
        api.answer(sent, text.clone()).await?;
        api.post(&format!("/logs/{id}/finish"), &json!({ "sha256": sha256 })).await?;
    }
    let accepted_after = begun.elapsed();
    let process = api.request("POST", &format!("/sessions/{session_id}/process"));
    api.answer(process, Bytes::new()).await?;
    loop {
        let session = api.get(&format!("/sessions/{session_id}")).await?;
        match session["state"].as_str() {
            Some("finished") => break,
            Some("failed") => bail!("a walk that was handed in failed: {}", session["error"]),
            _ if begun.elapsed() > FINISHED_WITHIN => {
                bail!("a walk that was handed in has no track after ten minutes")
            }
            _ => sleep(LOOK_EVERY).await,
        }
    }
    Ok(HandedIn { accepted_after, stored_after: begun.elapsed(), bytes })
}
