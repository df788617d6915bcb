//! How long a file of all 2,226 markers takes, every one of them moved, against a real server with everything
//! on disk: `cargo run --release -p lodestep-tests --example marker_import`.

#![allow(clippy::print_stdout, reason = "a benchmark prints its figures")]

use std::time::Instant;

use anyhow::{Context, Result, ensure};
use lodestep_engine::geo::{Site, terrain};
use lodestep_engine::parse::markers_csv;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

#[tokio::main]
async fn main() -> Result<()> {
    let server = TestServer::start().await;
    let anchors = terrain::anchors(&Site::fast());
    let table = |east_m: f64| {
        markers_csv::write(anchors.iter().map(|anchor| {
            let [e_m, n_m, u_m] = anchor.position_n_m;
            (anchor.name.as_str(), e_m + east_m, n_m, Some(u_m))
        }))
    };
    let import = server.client.post(server.api("/markers/import")).header("content-type", "text/csv");
    import.body(table(0.0)).send().await?.error_for_status()?;
    for run in 1..=5 {
        let begun = Instant::now();
        let post = server.client.post(server.api("/markers/imports")).header("content-type", "text/csv");
        let view: Value = post.body(table(0.25)).send().await?.error_for_status()?.json().await?;
        let compared = begun.elapsed();
        ensure!(view["changed"] == anchors.len(), "expected all to have moved, found {}", view["changed"]);
        let path = format!("/markers/imports/{}", view["id"].as_str().context("an import has an id")?);
        let begun = Instant::now();
        let (status, answer) = server.post(&format!("{path}/apply"), &json!({})).await;
        let applied = begun.elapsed();
        ensure!(status == 200, "{answer}");
        let begun = Instant::now();
        let (status, answer) = server.post(&format!("{path}/revert"), &json!({})).await;
        let reverted = begun.elapsed();
        ensure!(status == 200, "{answer}");
        println!(
            "run {run}: {} markers compared in {:.0} ms, applied in {:.0} ms, reverted in {:.0} ms",
            anchors.len(),
            compared.as_secs_f64() * 1e3,
            applied.as_secs_f64() * 1e3,
            reverted.as_secs_f64() * 1e3
        );
    }
    server.stop().await;
    Ok(())
}
