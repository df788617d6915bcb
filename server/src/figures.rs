//! The figures behind `/metrics`: how they are kept, and those of every request.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use axum::extract::{MatchedPath, Request};
use axum::middleware::Next;
use axum::response::Response;
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};
use tokio_util::sync::CancellationToken;

/// Bounds of the histograms of times, s: from a commit on a fast disk to a request that is given up.
const SECONDS: [f64; 12] = [0.000_5, 0.001, 0.002, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 5.0, 30.0];
/// How often what was recorded is folded into the histograms, s; without it, figures that nobody
/// fetches would grow.
const FOLD_EVERY: Duration = Duration::from_secs(5);

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
