//! What one person can do to all others: a long walk worked out again, another removed, a hundred thousand markers imported and
//! reverted, a log of milliseconds handed in ten times, a backup; all at once, while devices stream.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use bytes::Bytes;
use serde_json::{Value, json};
use tokio::time::{Instant, sleep, sleep_until};
use ureq::http::header;

use super::api::Api;
use super::uploads::{self, Walk};

/// Markers that are imported.
const MARKERS: u32 = 100_000;
/// How often the log of milliseconds is handed in.
const WRONG_LOGS: u32 = 10;
/// A job is looked for this often.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// What has been made ready.
pub(super) struct Ready {
    again: String,
    gone: String,
    wrong: Walk,
}

/// How long something took, s, or what was said of it.
pub(super) type Told = (&'static str, String);

/// Hands a walk of so many hours in twice, and has both worked out.
pub(super) async fn make_ready(api: &Api, seed: u64, hours: f64) -> Result<Ready> {
    let long = Arc::new(Walk::of_hours(seed, hours, 1.0)?);
    let mut sessions = Vec::new();
    for _ in 0..2 {
        let session = api.begin_sessions(1).await?.remove(0);
        uploads::one(api.clone(), Arc::clone(&long), session.to_string()).await?;
        sessions.push(session.to_string());
    }
    let gone = sessions.pop().context("two sessions were begun")?;
    let again = sessions.pop().context("two sessions were begun")?;
    // Nineteen minutes, with times that count milliseconds where seconds are meant.
    Ok(Ready { again, gone, wrong: Walk::of_hours(seed, 19.0 / 60.0, 1e3)? })
}

/// Does all of it at once, from then on; how long each took.
pub(super) async fn all_at_once(api: Api, ready: Ready, from: Instant) -> Result<Vec<Told>> {
    sleep_until(from).await;
    let Ready { again, gone, wrong } = ready;
    let (again, removed, markers, wrong, backup) = tokio::join!(
        worked_out_again(&api, &again),
        removed(&api, &gone),
        imported_and_reverted(&api),
        handed_in_wrong(&api, Arc::new(wrong)),
        backed_up(&api),
    );
    Ok(vec![
        ("a long walk worked out again, s", again?),
        ("another removed, s", removed?),
        ("100,000 markers imported, reverted, s", markers?),
        ("a log of milliseconds, ten times", wrong),
        ("a backup, s", backup?),
    ])
}

async fn worked_out_again(api: &Api, session: &str) -> Result<String> {
    let begun = Instant::now();
    let job = api.post(&format!("/sessions/{session}/process"), &Value::Null).await?;
    let path = format!("/jobs/{}", job["id"].as_str().context("a job has an id")?);
    loop {
        let job = api.get(&path).await?;
        match job["state"].as_str() {
            Some("finished") => return Ok(seconds(begun)),
            Some("failed") => bail!("a walk could not be worked out again: {}", job["error"]),
            _ => sleep(LOOK_EVERY).await,
        }
    }
}

async fn removed(api: &Api, session: &str) -> Result<String> {
    let begun = Instant::now();
    api.answer(api.request("DELETE", &format!("/sessions/{session}")), Bytes::new()).await?;
    Ok(seconds(begun))
}

async fn imported_and_reverted(api: &Api) -> Result<String> {
    let rows = (0..MARKERS).map(|n| format!("T{n},{}.5,{}.25,1\n", n % 1_000, n / 1_000));
    let table: String = std::iter::once("name,e_m,n_m,u_m\n".to_owned()).chain(rows).collect();
    let begun = Instant::now();
    let request = api.request("POST", "/markers/import").header(header::CONTENT_TYPE, "text/csv");
    api.answer(request, table.into()).await?;
    let (imported, begun) = (seconds(begun), Instant::now());
    let imports = api.get("/markers/imports").await?;
    let id = imports[0]["id"].as_str().context("an import has an id")?;
    api.post(&format!("/markers/imports/{id}/revert"), &json!({})).await?;
    Ok(format!("{imported}, {}", seconds(begun)))
}

/// Whether it is refused or worked out, the others must not notice.
async fn handed_in_wrong(api: &Api, walk: Arc<Walk>) -> String {
    let (mut taken, mut refused) = (0, String::new());
    for _ in 0..WRONG_LOGS {
        let handed_in = async {
            let session = api.begin_sessions(1).await?.remove(0);
            uploads::one(api.clone(), Arc::clone(&walk), session.to_string()).await
        };
        match handed_in.await {
            Ok(_) => taken += 1,
            Err(error) => refused = error.to_string(),
        }
    }
    let said: String = refused.chars().take(160).collect();
    if refused.is_empty() { format!("{taken} worked out") } else { format!("{taken} worked out; {said}") }
}

async fn backed_up(api: &Api) -> Result<String> {
    let begun = Instant::now();
    api.post("/backups", &Value::Null).await?;
    Ok(seconds(begun))
}

fn seconds(begun: Instant) -> String {
    format!("{:.1}", begun.elapsed().as_secs_f64())
}
