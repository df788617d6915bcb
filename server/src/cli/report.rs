//! What a processing found out, as JSON.

use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::evaluate::SessionReport;
use lodestep_engine::event::{Alignment, TrackPoint};
use lodestep_engine::parameters::Parameters;
use lodestep_engine::session::{SessionConfig, Solution};
use serde::Serialize;

use crate::cli::inputs::Inputs;
use crate::cli::run::Walked;
use crate::sessions::provenance::{ENGINE_SHA256, ENGINE_VERSION};

/// The report of `process`.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    engine_version: &'static str,
    engine_sha256: &'static str,
    /// Those that are not as they are by default.
    parameters: &'a Parameters,
    inputs: Inputs,
    solution: Solution,
    config: &'a SessionConfig,
    epochs: u64,
    samples: u64,
    duration_s: f64,
    distance_m: f64,
    process_seconds: f64,
    /// Samples that came too late to be merged by time.
    late_samples: u64,
    revised_points: u64,
    /// Over the exact bits of all points, visits and anomalies.
    track_sha256: String,
    end: Option<End>,
    alignments: &'a [Alignment],
    /// What was done to read the logs, then what the system found.
    anomalies: Vec<&'a Anomaly>,
    visits: Vec<ReportedVisit<'a>>,
    /// How the walk went by what the filter itself saw.
    #[serde(flatten)]
    quality: SessionReport,
}

/// Where the walk ended.
#[derive(Debug, Serialize)]
struct End {
    t_s: f64,
    position_m: [f64; 3],
    sigma_m: [f64; 3],
    heading_rad: f64,
    sigma_heading_rad: f64,
}

/// A visit: the position before its correction minus the marker's.
#[derive(Debug, Serialize)]
struct ReportedVisit<'a> {
    marker: &'a str,
    t_s: f64,
    east_m: f64,
    north_m: f64,
    up_m: f64,
    nis: f64,
    accepted: bool,
    reason: &'a str,
}

impl<'a> Report<'a> {
    pub(super) fn new(
        config: &'a SessionConfig,
        parameters: &'a Parameters,
        inputs: Inputs,
        walked: &'a Walked,
    ) -> Report<'a> {
        let Walked { track, read_with, summary, process_seconds } = walked;
        let visits = track.visits.iter().map(|visit| {
            let [east_m, north_m, up_m] = visit.before_minus_marker_n_m;
            ReportedVisit {
                marker: &visit.marker,
                t_s: seconds(visit.t_ns),
                east_m,
                north_m,
                up_m,
                nis: visit.nis,
                accepted: visit.accepted,
                reason: &visit.reason,
            }
        });
        let end = |point: &TrackPoint| End {
            t_s: seconds(point.t_ns),
            position_m: point.position_n_m,
            sigma_m: point.sigma_n_m,
            heading_rad: point.heading_rad,
            sigma_heading_rad: point.sigma_heading_rad,
        };
        Report {
            engine_version: ENGINE_VERSION,
            engine_sha256: ENGINE_SHA256,
            parameters,
            inputs,
            solution: config.solution,
            config,
            epochs: summary.epochs,
            samples: summary.samples,
            duration_s: summary.duration_s,
            distance_m: summary.distance_m,
            process_seconds: *process_seconds,
            late_samples: summary.late_samples,
            revised_points: track.revised_points,
            track_sha256: track.sha256(),
            end: track.points.last().map(end),
            alignments: &track.alignments,
            anomalies: read_with.iter().chain(&track.anomalies).collect(),
            visits: visits.collect(),
            quality: SessionReport::of(track, summary.distance_m),
        }
    }
}

fn seconds(t_ns: i64) -> f64 {
    t_ns as f64 / 1e9
}
