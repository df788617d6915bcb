//! From two files on disk to a stored track, measured whole: the 3.3 km walk on FAST's spiral road
//! with its visits, handed in to a real server and processed.
//!
//! `cargo run --release -p lodestep-tests --example file_to_track`, on one core with
//! `taskset -c 0` before it. Arguments: `gzip` sends the logs packed, `no-visits` leaves the visits
//! and with them the second run out.

#![allow(clippy::print_stdout, reason = "a benchmark prints its figures")]

use std::time::Instant;

use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};
use lodestep_tests::hand_in::{ask, gzip, log};
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

#[tokio::main(flavor = "current_thread")]
async fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let asked = |word: &str| arguments.iter().any(|argument| argument == word);
    let folder = tempfile::tempdir()?;
    let (start, visits) = write_logs(folder.path(), asked("gzip"))?;
    // What making the walk took is not the server's.
    std::fs::write("/proc/self/clear_refs", "5")?;

    let server = TestServer::start().await;
    for (name, [e_m, n_m, u_m]) in &visits {
        let marker = json!({ "name": name["marker"], "e_m": e_m, "n_m": n_m, "u_m": u_m });
        let _ = ask(server.client.post(server.api("/markers")).json(&marker)).await;
    }
    let session_id = server.session(json!({ "start": { "position_m": start } })).await;
    let names: Vec<&Value> = visits.iter().map(|(visit, _)| visit).collect();
    if !asked("no-visits") {
        let post = server.client.post(server.api(&format!("/sessions/{session_id}/visits")));
        let told = ask(post.json(&names)).await;
        anyhow::ensure!(told.status == 201, "{told:?}");
    }

    let (begun, cpu_before_s) = (Instant::now(), cpu_s()?);
    for foot in ["left", "right"] {
        let bytes = std::fs::read(folder.path().join(foot))?;
        let accepted = server.hand_in(&session_id, foot, bytes).await;
        anyhow::ensure!(accepted.body["state"] == "accepted", "{accepted:?}");
    }
    let (uploaded_s, uploaded_cpu_s) = (begun.elapsed().as_secs_f64(), cpu_s()? - cpu_before_s);
    let asked = ask(server.client.post(server.api(&format!("/sessions/{session_id}/process")))).await;
    let job = format!("/jobs/{}", asked.id());
    let session = format!("/sessions/{session_id}");
    let mut stored = None;
    loop {
        // The track is there before what it is compared with.
        if stored.is_none() && server.look(&session).await.body["state"] == "finished" {
            stored = Some((begun.elapsed().as_secs_f64(), cpu_s()? - cpu_before_s));
        }
        let job = server.look(&job).await.body;
        anyhow::ensure!(job["state"] != "failed", "{job}");
        if job["state"] == "finished" {
            break;
        }
        // The asking is done on the same core.
        tokio::time::sleep(std::time::Duration::from_millis(25)).await;
    }
    let (all_s, all_cpu_s) = (begun.elapsed().as_secs_f64(), cpu_s()? - cpu_before_s);
    let (stored_s, stored_cpu_s) = stored.unwrap_or((all_s, all_cpu_s));

    let opened = Instant::now();
    let track = server.look(&format!("/sessions/{session_id}/track")).await.body;
    let opened_s = opened.elapsed().as_secs_f64();
    let session = server.look(&format!("/sessions/{session_id}")).await.body;
    println!("samples          {}", session["samples"]);
    println!("epochs           {}", session["epochs"]);
    println!("distance         {:.0} m", session["distance_m"].as_f64().unwrap_or_default());
    println!("visits           {}", session["visits"]);
    println!("uploaded after   {uploaded_s:.2} s, of which the processor worked {uploaded_cpu_s:.2} s");
    println!("track stored     {stored_s:.2} s, of which the processor worked {stored_cpu_s:.2} s");
    println!("compared after   {all_s:.2} s, of which the processor worked {all_cpu_s:.2} s");
    println!("track opened in  {opened_s:.2} s, {} points", track["rows"].as_array().map_or(0, Vec::len));
    println!("peak memory      {} (server and client, one process)", peak_memory()?);
    server.stop().await;
    Ok(())
}

/// A visit as it is told, with its marker's position.
type MarkedVisit = (Value, [f64; 3]);

/// Makes the walk and writes a log for each foot; where it starts, and its visits.
fn write_logs(folder: &std::path::Path, packed: bool) -> anyhow::Result<([f64; 3], Vec<MarkedVisit>)> {
    let walk = simulate(&WalkKind::Spiral, 1, &Site::fast(), &SensorModel::cmp10a());
    let mut sent = 0;
    for (foot, samples) in [("left", &walk.left), ("right", &walk.right)] {
        // As `lodestep simulate` writes them.
        let logged: Vec<_> = samples.iter().map(|sample| sample.as_logged()).collect();
        let text = log(&logged);
        let bytes = if packed { gzip(&text) } else { text };
        sent += bytes.len();
        std::fs::write(folder.join(foot), bytes)?;
    }
    println!("logs             {:.1} MB, {} samples", sent as f64 / 1e6, walk.left.len() + walk.right.len());
    let visits = walk.visits.iter().map(|visit| {
        let told = json!({
            "marker": visit.marker,
            "t_start_s": visit.t_start_ns as f64 / 1e9,
            "t_end_s": visit.t_end_ns as f64 / 1e9,
        });
        (told, visit.position_n_m)
    });
    Ok((walk.start_n_m(), visits.collect()))
}

/// Processor time of this process so far, s: on a busy machine it says more than the clock.
fn cpu_s() -> anyhow::Result<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    // After the name, which may hold spaces: user and system time are fields 14 and 15, in 1/100 s.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    Ok((fields[11].parse::<f64>()? + fields[12].parse::<f64>()?) / 100.0)
}

/// The most memory that this process has held since it was last cleared.
fn peak_memory() -> anyhow::Result<String> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib: f64 = line.unwrap_or_default().trim().trim_end_matches(" kB").parse()?;
    Ok(format!("{:.0} MB", kib * 1024.0 / 1e6))
}
