//! Whether the server is well, for the machines that watch it.

use std::time::Duration;

use axum::extract::State;
use axum::http::StatusCode;
use schemars::JsonSchema;
use serde::Serialize;
use tokio::time::timeout;

use crate::error::{Error, Result};
use crate::figures;
use crate::http::media::{Metrics, PlainText};
use crate::http::{File, Json, Routes};
use crate::rights::Right;
use crate::state::App;
use crate::store::health::Health;
use crate::store::{self, markers};

/// A write that has not come through in this time is one that nobody should wait for.
const WRITES_WITHIN: Duration = Duration::from_secs(5);
/// What a device has sent and that is not on disk after so long has waited too long: its inspector sees it.
const LIVE_WITHIN: Duration = Duration::from_secs(2);

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/healthz", Right::Open, health)
        .about("check_health", "Whether the database answers and the last write reached the disk")
        .get("/readyz", Right::Open, ready)
        .about("check_readiness", "Whether the server can do its work; 503 names what keeps it from it")
        .get("/metrics", Right::Read, figures_text)
        .about("get_metrics", "Figures for Prometheus")
}

/// `ok` when the database answers and the last write reached the disk.
async fn health(State(app): State<App>) -> Result<File<PlainText>> {
    markers::revision(app.store.read()).await?;
    if app.store.health() != Health::Good {
        return Err(Error::http(
            StatusCode::SERVICE_UNAVAILABLE,
            "disk",
            "the last write did not reach the disk: see the server's log, and whether the disk is full",
        ));
    }
    if let Some(why) = waits(&app) {
        return Err(Error::http(StatusCode::SERVICE_UNAVAILABLE, "slow", why));
    }
    Ok(File::new("ok"))
}

/// What is said when a live record has waited too long.
fn waits(app: &App) -> Option<String> {
    let longest = app.store.longest_live_wait();
    (longest > LIVE_WITHIN).then(|| {
        format!(
            "what a device sent has waited {:.1} s for the disk, longer than {} s: see the server's log for the write that takes so long, and whether the disk is slow",
            longest.as_secs_f64(),
            LIVE_WITHIN.as_secs()
        )
    })
}

/// What the server needs for its work, and whether it has it.
#[derive(Debug, Serialize, JsonSchema)]
struct Readiness {
    /// The version of the tables: how many steps the database has made.
    database_version: i64,
    /// Free space on the disk of the data folder, bytes; `None` where the system does not say.
    free_bytes: Option<u64>,
}

/// Ready when the database takes a write and is of this version, the disk has room, and somebody does the jobs.
async fn ready(State(app): State<App>) -> Result<Json<Readiness>> {
    let mut lacks = Vec::new();
    if app.stopping.is_cancelled() {
        lacks.push("the server is stopping".to_owned());
    }
    let write = app.store.writer().run(|db| Box::pin(async move { store::version(db).await }));
    let database_version = match timeout(WRITES_WITHIN, write).await {
        Ok(Ok(version)) if version == store::VERSION => version,
        Ok(Ok(version)) => {
            lacks.push(format!("the database is of version {version}, this server of {}", store::VERSION));
            version
        }
        Ok(Err(error)) => {
            tracing::warn!(%error, "not ready: the database takes no write: {error}");
            lacks.push("the database takes no write".to_owned());
            0
        }
        Err(_) => {
            lacks.push(format!("the database took no write within {} s", WRITES_WITHIN.as_secs()));
            0
        }
    };
    match app.store.health() {
        Health::Good => {}
        Health::NotStored => lacks.push("the last write was not stored".to_owned()),
        Health::DiskFull => lacks.push("the disk is full".to_owned()),
        Health::DiskFailed => lacks.push("the disk failed".to_owned()),
    }
    lacks.extend(waits(&app));
    let free_bytes = fs4::available_space(&app.config.data).ok();
    if let Some(free_bytes) = free_bytes.filter(|free| *free < app.config.least_free_bytes) {
        let least_bytes = app.config.least_free_bytes;
        lacks.push(format!("the disk has {free_bytes} bytes left, fewer than {least_bytes}"));
    }
    if !app.jobs.has_worker() {
        lacks.push("nobody does the jobs".to_owned());
    }
    if lacks.is_empty() {
        return Ok(Json(Readiness { database_version, free_bytes }));
    }
    Err(Error::http(
        StatusCode::SERVICE_UNAVAILABLE,
        "not_ready",
        format!(
            "expected a server that is ready, found: {}; see the server's log and its disk",
            lacks.join("; ")
        ),
    ))
}

/// Prometheus text.
async fn figures_text(State(app): State<App>) -> File<Metrics> {
    figures::look(&app).await;
    File::new(figures::render(&app.metrics))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::serve;
    use crate::store::StoreError;

    #[tokio::test]
    async fn a_server_whose_devices_wait_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let app = serve::open(Config::for_testing(folder.path())).await.unwrap();
        assert!(health(State(app.clone())).await.is_ok());
        // Somebody holds the writer, and a device has sent something.
        let (writer, other) = (app.store.writer().clone(), app.store.writer().clone());
        let holds = tokio::spawn(async move {
            let hold = writer.run(|_| {
                Box::pin(async {
                    tokio::time::sleep(LIVE_WITHIN + Duration::from_millis(400)).await;
                    Ok::<_, StoreError>(())
                })
            });
            hold.await
        });
        tokio::time::sleep(Duration::from_millis(50)).await;
        let waits = tokio::spawn(async move { other.record(store::Record::default()).await });
        tokio::time::sleep(LIVE_WITHIN + Duration::from_millis(100)).await;
        let problem = health(State(app.clone())).await.unwrap_err().into_problem();
        assert_eq!((problem.status, problem.code.as_str()), (503, "slow"), "{problem:?}");
        assert!(problem.detail.contains("has waited"), "{problem:?}");
        holds.await.unwrap().unwrap();
        waits.await.unwrap().unwrap();
        assert!(health(State(app)).await.is_ok());
    }

    #[tokio::test]
    async fn what_keeps_a_server_from_its_work_is_told_all_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let config = Config { least_free_bytes: u64::MAX, ..Config::for_testing(folder.path()) };
        let app = serve::open(config).await.unwrap();
        app.store.close().await;
        app.stopping.cancel();
        // Nobody has begun to do the jobs of this one.
        let problem = ready(State(app)).await.unwrap_err().into_problem();
        assert_eq!((problem.status, problem.code.as_str()), (503, "not_ready"));
        for lack in ["stopping", "takes no write", "bytes left", "nobody does the jobs"] {
            assert!(problem.detail.contains(lack), "{lack} is missing: {}", problem.detail);
        }
    }
}
