//! What a survey found out, as JSON.

use lodestep_engine::systems::pole::findings::Finding;
use lodestep_engine::systems::pole::survey::{Figures, Survey};
use serde::Serialize;

use crate::sessions::provenance::{ENGINE_SHA256, ENGINE_VERSION};

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
    anomalies: &'a [Finding],
    points: usize,
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
            anomalies: &survey.findings,
            points: survey.points.len(),
            figures: &survey.figures,
        }
    }
}
