//! What a survey found out, as JSON.

use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::event::Event;
use lodestep_engine::systems::pole::survey::{Figures, Survey};
use lodestep_engine::systems::pole::track_point;
use lodestep_engine::track::Track;
use serde::Serialize;

use crate::sessions::provenance::{ENGINE_SHA256, ENGINE_VERSION};

/// What a surveyor has to know.
#[derive(Debug, Serialize)]
struct Finding<'a> {
    kind: &'a str,
    t_start_s: f64,
    t_end_s: f64,
    detail: &'a str,
}

impl<'a> Finding<'a> {
    fn of(anomaly: &'a Anomaly) -> Finding<'a> {
        let [t_start_s, t_end_s] = [anomaly.t_start_ns, anomaly.t_end_ns].map(|t_ns| t_ns as f64 * 1e-9);
        Finding { kind: anomaly.kind.as_str(), t_start_s, t_end_s, detail: &anomaly.detail }
    }
}

fn track_sha256(survey: &Survey) -> String {
    let mut track = Track { points: survey.rows.iter().map(track_point).collect(), ..Track::default() };
    for finding in &survey.findings {
        track.take(Event::Anomaly(finding.clone()));
    }
    track.sha256()
}

/// The report of `process pole`.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    engine_version: &'static str,
    engine_sha256: &'static str,
    estimator: &'static str,
    solution: &'static str,
    samples: usize,
    duration_s: f64,
    process_seconds: f64,
    warnings: Vec<&'a str>,
    anomalies: Vec<Finding<'a>>,
    points: usize,
    /// The hash of the track as a session of the same readings has it.
    track_sha256: String,
    #[serde(flatten)]
    figures: &'a Figures,
}

impl<'a> Report<'a> {
    pub(super) fn new(
        survey: &'a Survey,
        estimator: &'static str,
        solution: &'static str,
        samples: usize,
        duration_s: f64,
        process_seconds: f64,
    ) -> Report<'a> {
        Report {
            engine_version: ENGINE_VERSION,
            engine_sha256: ENGINE_SHA256,
            estimator,
            solution,
            samples,
            duration_s,
            process_seconds,
            warnings: survey.findings.iter().map(|finding| finding.detail.as_str()).collect(),
            anomalies: survey.findings.iter().map(Finding::of).collect(),
            track_sha256: track_sha256(survey),
            points: survey.points.len(),
            figures: &survey.figures,
        }
    }
}
