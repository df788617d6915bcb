//! What a session told, checked for what must hold whatever it was given.

use std::collections::BTreeMap;

use lodestep_engine::anomaly::{Anomaly, AnomalyKind};
use lodestep_engine::evaluate::{TruthErrors, against_truth};
use lodestep_engine::event::{Event, TrackPoint};
use lodestep_engine::session::Summary;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::track::Track;

use crate::scenario::Scenario;

/// The events of a session, orderly and finite.
pub(crate) struct Told {
    pub(crate) events: Vec<Event>,
    pub(crate) track: Track,
    pub(crate) summary: Summary,
}

impl Told {
    /// Checks what every session keeps to: points in the order of time; revisions that replace an
    /// unbroken run of told points, times unchanged; every number finite but those of a visit that
    /// could not be weighed, every sigma positive; anomalies that end after they begin and say why.
    pub(crate) fn check(events: Vec<Event>, summary: Summary) -> Told {
        let mut track = Track::default();
        let mut told_ns: Vec<i64> = Vec::new();
        let mut places: BTreeMap<i64, usize> = BTreeMap::new();
        for event in &events {
            match event {
                Event::Point(point) => {
                    assert!(
                        told_ns.last().is_none_or(|last_ns| *last_ns < point.t_ns),
                        "points go back in time"
                    );
                    places.insert(point.t_ns, told_ns.len());
                    told_ns.push(point.t_ns);
                    assert_sound(point);
                }
                Event::Revision { points } => {
                    let first = points.first().expect("a revision revises something");
                    let at = *places.get(&first.t_ns).expect("a revised point has been told before");
                    let times: Vec<i64> = points.iter().map(|point| point.t_ns).collect();
                    assert_eq!(told_ns.get(at..at + points.len()), Some(&times[..]), "revisions keep times");
                    points.iter().for_each(assert_sound);
                }
                Event::Visit(visit) => {
                    let weighed = visit.degrees_of_freedom > 0;
                    let numbers = visit.before_minus_marker_n_m.iter().chain(&visit.after_minus_marker_n_m);
                    let finite = numbers.chain([&visit.nis]).all(|x| x.is_finite());
                    assert_eq!(finite, weighed, "{visit:?}");
                    assert_eq!(visit.accepted, visit.reason.is_empty(), "{visit:?}");
                }
                Event::Anomaly(anomaly) => {
                    assert!(anomaly.t_start_ns <= anomaly.t_end_ns, "{anomaly:?}");
                    assert!(!anomaly.detail.is_empty(), "{anomaly:?}");
                }
                Event::Aid(outcome) => {
                    assert!(outcome.nis.is_finite() || !outcome.accepted, "{outcome:?}");
                    assert!(outcome.nis >= 0.0 && outcome.degrees_of_freedom > 0, "{outcome:?}");
                }
                Event::Aligned(alignment) => {
                    let numbers = [
                        alignment.heading_rad,
                        alignment.sigma_heading_rad,
                        alignment.rest_specific_force_m_s2,
                    ];
                    assert!(
                        numbers.iter().chain(&alignment.gyro_bias_b_rad_s).all(|x| x.is_finite()),
                        "{alignment:?}"
                    );
                }
                Event::Stand(stand) => {
                    let sum: f64 = stand.candidates.iter().map(|candidate| candidate.probability).sum();
                    assert!((sum - 1.0).abs() < 1e-9, "{stand:?}");
                }
            }
            track.take(event.clone());
        }
        assert_eq!(summary.epochs, track.points.len() as u64);
        assert!(
            [summary.duration_s, summary.distance_m].iter().all(|x| x.is_finite() && *x >= 0.0),
            "{summary:?}"
        );
        Told { events, track, summary }
    }

    /// Errors of the final track against the scenario's truth.
    pub(crate) fn errors(&self, scenario: &Scenario) -> TruthErrors {
        against_truth(&self.track.points, &scenario.true_places()).expect("track and truth share their time")
    }

    /// The anomalies of one kind on one foot.
    pub(crate) fn anomalies(&self, kind: AnomalyKind, foot: Side) -> Vec<&Anomaly> {
        let anomalies = self.track.anomalies.iter();
        anomalies.filter(|anomaly| anomaly.kind == kind && anomaly.stream == Some(foot.stream())).collect()
    }

    /// The last point of the track.
    pub(crate) fn last(&self) -> &TrackPoint {
        self.track.points.last().expect("the session told points")
    }
}

fn assert_sound(point: &TrackPoint) {
    let feet = point.parts.into_iter().flatten().flat_map(|foot| foot.position_n_m);
    let [sigma_e, sigma_n, _] = point.sigma_n_m;
    let numbers =
        point.position_n_m.into_iter().chain(feet).chain([point.heading_rad, point.covariance_en_m2]);
    assert!(numbers.into_iter().all(f64::is_finite), "{point:?}");
    let sigmas = point.sigma_n_m.into_iter().chain([point.sigma_heading_rad]);
    assert!(sigmas.into_iter().all(|sigma| sigma.is_finite() && sigma > 0.0), "{point:?}");
    assert!(point.covariance_en_m2.abs() <= sigma_e * sigma_n * (1.0 + 1e-9), "no covariance: {point:?}");
    assert!(point.heading_rad.abs() <= std::f64::consts::PI, "{point:?}");
}
