//! How a walk went by what the filter itself saw: whether it was as sure as it may be, what it turned down,
//! and how well the ends meet. It needs no truth.

use serde::Serialize;

use crate::evaluate::{LoopClosure, Spread, VisitErrors, chi_square_bounds_95, loop_closure, visits};
use crate::event::{AidKind, MOST_PARTS, TrackPoint};
use crate::track::{AidTally, Track};

/// The report on one walk.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SessionReport {
    /// Each aid that has measured anything.
    pub aids: Vec<AidReport>,
    /// How far off the track was at the markers before it was corrected; `None` without visits.
    pub visit_errors: Option<VisitErrors>,
    /// Each visit that was turned down, with the reason.
    pub rejected_visits: Vec<RejectedVisit>,
    /// End against start: an error only where the walk was a closed one. `None` without a path.
    pub closure: Option<LoopClosure>,
    /// Sigma in plan (the root of the sum of both variances), over all points, m.
    pub sigma_plan_m: Option<Spread>,
    /// The same at the end, m.
    pub end_sigma_plan_m: Option<f64>,
    /// Sigma of the height at the end, m.
    pub end_sigma_up_m: Option<f64>,
    /// For how much of the time each part stood; `None` for a part that is not there.
    pub stance_share: [Option<f64>; MOST_PARTS],
}

/// What became of one aid's measurements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AidReport {
    /// Which aid.
    #[cfg_attr(feature = "schema", schemars(with = "String", example = &"zupt"))]
    pub aid: AidKind,
    /// Its tally.
    #[serde(flatten)]
    pub tally: AidTally,
    /// Where the mean lies in 95 of 100 walks if the filter is as sure as it may be and measurements err
    /// independently; neighbouring ones of one stance do not, so a mean that is far below is no wonder.
    pub bounds_95: Option<[f64; 2]>,
}

/// A visit that was turned down.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RejectedVisit {
    /// The marker.
    #[cfg_attr(feature = "schema", schemars(example = &"A17"))]
    pub marker: String,
    /// When, ns.
    pub t_ns: i64,
    /// Normalised innovation squared; not a number where it was not weighed.
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nis: f64,
    /// In a sentence.
    #[cfg_attr(feature = "schema", schemars(example = &"the marker is 4.2 m away, 5.1 sigma"))]
    pub reason: String,
}

impl SessionReport {
    /// Of a track that has been told to its end; `path_m` is its length, stance by stance.
    pub fn of(track: &Track, path_m: f64) -> SessionReport {
        let points = &track.points;
        let sigma_plan_m = |point: &TrackPoint| libm::hypot(point.sigma_n_m[0], point.sigma_n_m[1]);
        let sigmas: Vec<f64> = points.iter().map(sigma_plan_m).collect();
        SessionReport {
            aids: track.aids.iter().map(|(aid, tally)| AidReport::new(*aid, tally)).collect(),
            visit_errors: visits(&track.visits),
            rejected_visits: track
                .visits
                .iter()
                .filter(|visit| !visit.accepted)
                .map(|visit| RejectedVisit {
                    marker: visit.marker.clone(),
                    t_ns: visit.t_ns,
                    nis: visit.nis,
                    reason: visit.reason.clone(),
                })
                .collect(),
            closure: loop_closure(points, path_m),
            sigma_plan_m: Spread::of(&sigmas),
            end_sigma_plan_m: sigmas.last().copied(),
            end_sigma_up_m: points.last().map(|point| point.sigma_n_m[2]),
            stance_share: std::array::from_fn(|part| stance_share(points, part)),
        }
    }
}

impl AidReport {
    fn new(aid: AidKind, tally: &AidTally) -> AidReport {
        let degrees = tally.accepted_degrees;
        let bounds_95 =
            (degrees > 0).then(|| chi_square_bounds_95(degrees).map(|bound| bound / degrees as f64));
        AidReport { aid, tally: *tally, bounds_95 }
    }
}

fn stance_share(points: &[TrackPoint], part: usize) -> Option<f64> {
    let (mut known, mut stances) = (0u64, 0u64);
    for part in points.iter().filter_map(|point| point.parts[part]) {
        known += 1;
        stances += u64::from(part.stance);
    }
    (known > 0).then(|| stances as f64 / known as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;
    use crate::event::{AidOutcome, Event, Part, VisitOutcome};

    #[test]
    fn a_report_says_what_was_used_what_was_not_and_why() {
        let mut track = Track::default();
        let aid = |nis, accepted| {
            Event::Aid(AidOutcome {
                t_ns: 0,
                stream: None,
                aid: AidKind::MARKERS,
                nis,
                degrees_of_freedom: 1,
                updates: 1,
                accepted,
            })
        };
        for _ in 0..100 {
            track.take(aid(1.0, true));
        }
        track.take(aid(30.0, false));
        track.take(aid(f64::INFINITY, false));
        track.take(Event::Visit(VisitOutcome {
            marker: "A1".to_owned(),
            t_ns: 5,
            before_minus_marker_n_m: [30.0, 40.0, 0.0],
            after_minus_marker_n_m: [30.0, 40.0, 0.0],
            nis: 99.0,
            degrees_of_freedom: 3,
            accepted: false,
            reason: "too far".to_owned(),
        }));
        for (k, mut point) in points([[0.0; 3], [3.0, 0.0, 0.0], [0.3, 0.4, 0.0]]).into_iter().enumerate() {
            point.sigma_n_m = [0.6, 0.8, 0.1];
            point.parts[0] = Some(Part { position_n_m: [0.0; 3], stance: k < 2 });
            track.take(Event::Point(point));
        }
        let report = SessionReport::of(&track, 50.0);
        let heading = report.aids[0];
        assert_eq!((heading.tally.accepted, heading.tally.rejected, heading.tally.unusable), (100, 2, 1));
        let [low, high] = heading.bounds_95.unwrap();
        assert!((low - 0.742).abs() < 0.01 && (high - 1.296).abs() < 0.01, "{low} {high}");
        assert_eq!(report.rejected_visits[0].reason, "too far");
        assert_eq!(report.visit_errors.unwrap().horizontal.max_m, 50.0);
        assert!((report.closure.unwrap().end_error_percent - 1.0).abs() < 1e-12);
        assert!((report.end_sigma_plan_m.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(report.stance_share, [Some(2.0 / 3.0), None]);
    }
}
