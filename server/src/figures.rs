//! The figures behind `/metrics`: how they are kept, and those of every request.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use axum::extract::{MatchedPath, Request};
use axum::middleware::Next;
use axum::response::Response;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};
use tokio_util::sync::CancellationToken;

use crate::state::App;
use crate::store::jobs;
use crate::{backup, utc};

/// Bounds of the histograms of times, s: from a commit on a fast disk to a request that is given up.
const SECONDS: [f64; 12] = [0.000_5, 0.001, 0.002, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 5.0, 30.0];
/// How often what was recorded is folded into the histograms, s; without it, figures that nobody
/// fetches would grow.
const FOLD_EVERY: Duration = Duration::from_secs(5);

/// What kind of figure one is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Only ever grows.
    Counter,
    /// Goes up and down.
    Gauge,
    /// Times, by [`SECONDS`].
    Histogram,
}

/// Every figure: what Prometheus is told of it. A counter without labels is there from the start, at zero.
const FIGURES: [(&str, Kind, &str); 36] = [
    ("lodestep_build_info", Kind::Gauge, "1, with the version as a label"),
    ("lodestep_requests_total", Kind::Counter, "Requests by method, route and status"),
    ("lodestep_request_seconds", Kind::Histogram, "Time until a request's answer begins, by route"),
    ("lodestep_writes_total", Kind::Counter, "Writes that went into a commit"),
    ("lodestep_write_failures_total", Kind::Counter, "Writes whose commit did not reach the disk"),
    ("lodestep_commit_seconds", Kind::Histogram, "Time of a commit, the sync to the disk included"),
    (
        "lodestep_write_piece_seconds",
        Kind::Histogram,
        "Time of one write within its commit, while all others wait",
    ),
    (
        "lodestep_write_pieces_over_budget_total",
        Kind::Counter,
        "Writes that took longer than they may; the log names them",
    ),
    (
        "lodestep_live_wait_seconds",
        Kind::Gauge,
        "How long the live record has waited for the disk that has waited longest",
    ),
    ("lodestep_connections", Kind::Gauge, "Connections that are open"),
    (
        "lodestep_connections_cut_total",
        Kind::Counter,
        "Connections that did nothing and were closed for others",
    ),
    ("lodestep_live_devices", Kind::Gauge, "Devices that are connected"),
    ("lodestep_live_sessions", Kind::Gauge, "Walks that are in memory because they are streamed"),
    ("lodestep_live_batches_total", Kind::Counter, "Batches that devices sent and that were new"),
    ("lodestep_live_samples_total", Kind::Counter, "Samples in these batches"),
    ("lodestep_live_acks_total", Kind::Counter, "Batches that were acknowledged"),
    ("lodestep_live_states_taken_up_total", Kind::Counter, "Walks that were made again from a saved state"),
    (
        "lodestep_live_commit_seconds",
        Kind::Histogram,
        "Time from a live write's submission until it is on disk",
    ),
    ("lodestep_feed_clients", Kind::Gauge, "Pages that follow the feed"),
    ("lodestep_feed_changes_total", Kind::Counter, "Changes that were told"),
    (
        "lodestep_feed_resynchronised_total",
        Kind::Counter,
        "Pages that fell behind and were given the whole picture",
    ),
    ("lodestep_uploaded_samples_total", Kind::Counter, "Samples of logs that were accepted"),
    ("lodestep_jobs_total", Kind::Counter, "Jobs that have ended, by outcome"),
    ("lodestep_job_seconds", Kind::Histogram, "Time of a job"),
    ("lodestep_jobs_waiting", Kind::Gauge, "Jobs that have not ended"),
    ("lodestep_passwords_checked_total", Kind::Counter, "Passwords that were looked at, right or wrong"),
    ("lodestep_sign_ins_refused_total", Kind::Counter, "Sign-ins with a wrong name or password"),
    ("lodestep_disk_free_bytes", Kind::Gauge, "Free space on the disk of the data folder, bytes"),
    (
        "lodestep_scrubbed_rows_total",
        Kind::Counter,
        "Rows that were read again to see whether they have changed",
    ),
    (
        "lodestep_damaged",
        Kind::Gauge,
        "What is stored and has changed on the disk: the log and /api/v1/server name it",
    ),
    (
        "lodestep_backup_age_seconds",
        Kind::Gauge,
        "Age of the newest backup in the data folder; none: no figure",
    ),
    ("lodestep_backup_good", Kind::Gauge, "1 when the newest backup was good when it was last read, else 0"),
    ("lodestep_database_bytes", Kind::Gauge, "Size of the database with its log, bytes"),
    (
        "lodestep_webhook_tries_total",
        Kind::Counter,
        "Tries to tell another program something, by whether it arrived",
    ),
    ("process_cpu_seconds_total", Kind::Gauge, "Processor time of this process, s (Linux)"),
    ("process_resident_memory_bytes", Kind::Gauge, "Memory of this process that is in use, bytes (Linux)"),
];

/// Counters that have labels begin with their first label.
const LABELLED: [&str; 3] =
    ["lodestep_requests_total", "lodestep_jobs_total", "lodestep_webhook_tries_total"];

fn describe() {
    for (name, kind, about) in FIGURES {
        match kind {
            Kind::Counter => {
                metrics::describe_counter!(name, about);
                if !LABELLED.contains(&name) {
                    metrics::counter!(name).increment(0);
                }
            }
            Kind::Gauge => metrics::describe_gauge!(name, about),
            Kind::Histogram => metrics::describe_histogram!(name, metrics::Unit::Seconds, about),
        }
    }
    for name in [
        "lodestep_live_devices",
        "lodestep_live_sessions",
        "lodestep_live_wait_seconds",
        "lodestep_feed_clients",
        "lodestep_connections",
        "lodestep_damaged",
    ] {
        metrics::gauge!(name).set(0.0);
    }
    metrics::gauge!("lodestep_build_info", "version" => env!("CARGO_PKG_VERSION")).set(1.0);
}

/// Figures that are looked at when somebody asks for them.
pub(crate) async fn look(app: &App) {
    let size = |path: &std::path::Path| std::fs::metadata(path).map_or(0, |file| file.len());
    let database = app.config.database();
    let mut log = database.clone().into_os_string();
    log.push("-wal");
    metrics::gauge!("lodestep_database_bytes").set((size(&database) + size(log.as_ref())) as f64);
    if let Ok(free_bytes) = fs4::available_space(&app.config.data) {
        metrics::gauge!("lodestep_disk_free_bytes").set(free_bytes as f64);
    }
    if let Some(made_at) = backup::newest(&app.config.data) {
        metrics::gauge!("lodestep_backup_age_seconds").set((utc::now() - made_at).as_seconds_f64());
    }
    metrics::gauge!("lodestep_live_wait_seconds").set(app.store.longest_live_wait().as_secs_f64());
    match jobs::unfinished(app.store.read()).await {
        Ok(waiting) => metrics::gauge!("lodestep_jobs_waiting").set(waiting.len() as f64),
        Err(error) => tracing::warn!(%error, "the jobs could not be counted: {error}"),
    }
}

/// The process has one set of figures, however many servers a test starts in it.
pub(crate) fn handle() -> PrometheusHandle {
    static HANDLE: OnceLock<PrometheusHandle> = OnceLock::new();
    HANDLE
        .get_or_init(|| {
            let recorder = PrometheusBuilder::new()
                .set_buckets(&SECONDS)
                .expect("the bounds are not empty")
                .build_recorder();
            let handle = recorder.handle();
            if metrics::set_global_recorder(recorder).is_err() {
                tracing::warn!("another recorder of figures is installed: /metrics will stay empty");
            }
            describe();
            handle
        })
        .clone()
}

/// The figures as Prometheus text, those of this process among them.
pub(crate) fn render(handle: &PrometheusHandle) -> String {
    if let Some(process) = process_figures() {
        metrics::gauge!("process_cpu_seconds_total").set(process.cpu_s);
        metrics::gauge!("process_resident_memory_bytes").set(process.resident_bytes);
    }
    handle.render()
}

struct ProcessFigures {
    cpu_s: f64,
    resident_bytes: f64,
}

/// What the kernel says of this process; `None` where there is no `/proc`.
fn process_figures() -> Option<ProcessFigures> {
    // In hundredths of a second on every Linux, whatever its own tick.
    const TICKS_PER_S: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which stands in brackets and may hold anything: user and system time are the 12th and 13th.
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    let cpu_s = (ticks()? + ticks()?) / TICKS_PER_S;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let resident_kb =
        status.lines().find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB"))?;
    Some(ProcessFigures { cpu_s, resident_bytes: resident_kb.trim().parse::<f64>().ok()? * 1024.0 })
}

/// Folds the figures until the server stops.
pub(crate) async fn fold(handle: PrometheusHandle, stopping: CancellationToken) {
    while stopping.run_until_cancelled(tokio::time::sleep(FOLD_EVERY)).await.is_some() {
        handle.run_upkeep();
    }
}

/// Layer: counts and times every request under its route, never under its path: ids would make a
/// figure of their own each.
pub(crate) async fn requests(request: Request, next: Next) -> Response {
    let route = request.extensions().get::<MatchedPath>().map_or("page", MatchedPath::as_str).to_owned();
    let method = request.method().to_string();
    let begun = Instant::now();
    let response = next.run(request).await;
    let status = response.status().as_u16().to_string();
    metrics::counter!("lodestep_requests_total", "method" => method, "route" => route.clone(), "status" => status)
        .increment(1);
    metrics::histogram!("lodestep_request_seconds", "route" => route).record(begun.elapsed().as_secs_f64());
    response
}
