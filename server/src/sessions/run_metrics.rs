//! What a run came to, in the figures by which runs are compared.

use lodestep_engine::evaluate::SessionReport;
use lodestep_engine::event::{AidKind, VisitOutcome};
use lodestep_engine::session::Summary;
use lodestep_engine::track::Track;

use crate::store::columns_word;
use crate::store::lab_runs::Figures;

/// Of a track that has been told to its end.
pub(super) fn figures_of(
    track: &Track,
    summary: &Summary,
    report: &SessionReport,
    process_s: f64,
) -> Figures {
    let known = |value: f64| value.is_finite().then_some(value);
    let errors = report.visit_errors.map(|errors| errors.horizontal);
    let corrections = track.visits.iter().filter(|visit| visit.accepted).map(|visit| {
        let [east_m, north_m] =
            [0, 1].map(|i| visit.after_minus_marker_n_m[i] - visit.before_minus_marker_n_m[i]);
        east_m.hypot(north_m)
    });
    let aids = report.aids.iter().filter(|aid| aid.tally.accepted_degrees > 0);
    let aids = aids.map(|aid| (aid.aid, aid.tally.mean_nis_per_degree));
    let [left_stance_share, right_stance_share] = report.stance_share;
    Figures {
        epochs: summary.epochs,
        duration_s: summary.duration_s,
        distance_m: summary.distance_m,
        closure_m: report.closure.and_then(|closure| known(closure.end_error_m)),
        closure_percent: report.closure.and_then(|closure| known(closure.end_error_percent)),
        closure_up_m: report.closure.and_then(|closure| known(closure.height_error_m)),
        marker_mean_m: errors.and_then(|errors| known(errors.mean_m)),
        marker_rms_m: errors.and_then(|errors| known(errors.rms_m)),
        marker_max_m: errors.and_then(|errors| known(errors.max_m)),
        marker_p95_m: errors.and_then(|errors| known(errors.p95_m)),
        visits: track.visits.len() as u64,
        visits_accepted: track.visits.iter().filter(|visit| visit.accepted).count() as u64,
        largest_correction_m: corrections.filter(|metres| metres.is_finite()).reduce(f64::max),
        left_stance_share,
        right_stance_share,
        nis_per_degree: aids
            .chain(markers_nis_per_degree(&track.visits).map(|nis| (AidKind::MARKERS, nis)))
            .filter_map(|(aid, nis)| Some((columns_word(aid), known(nis)?)))
            .collect(),
        end_sigma_plan_m: report.end_sigma_plan_m.and_then(known),
        anomalies: track.anomalies.len() as u64,
        process_s,
    }
}

/// Of the visits that were used: visits are told one by one, not as an aid's outcomes.
fn markers_nis_per_degree(visits: &[VisitOutcome]) -> Option<f64> {
    let used = || visits.iter().filter(|visit| visit.accepted);
    let degrees: usize = used().map(|visit| visit.degrees_of_freedom as usize).sum();
    (degrees > 0).then(|| used().map(|visit| visit.nis).sum::<f64>() / degrees as f64)
}
