//! Events folded into what a session finally says.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::anomaly::Anomaly;
use crate::event::{AidKind, AidOutcome, Alignment, Event, Stand, TrackPoint, VisitOutcome};

/// What a session has told so far, revisions applied.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track {
    /// The points, oldest first.
    pub points: Vec<TrackPoint>,
    /// The visits in the order in which they were used.
    pub visits: Vec<VisitOutcome>,
    /// The sensor trouble in the order of time: when it was found depends on which stream's samples
    /// came first.
    pub anomalies: Vec<Anomaly>,
    /// The alignments of the streams.
    pub alignments: Vec<Alignment>,
    /// What became of each aid's measurements.
    pub aids: BTreeMap<AidKind, AidTally>,
    /// The stands, each as it was told last.
    pub stands: Vec<Stand>,
    /// How many points were told again, counted each time.
    pub revised_points: u64,
}

/// What became of one aid's measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AidTally {
    /// Updates that were used.
    pub accepted: u64,
    /// Updates that were turned down.
    pub rejected: u64,
    /// Of these the ones that could not be weighed at all: a field that is not the earth's, for instance.
    pub unusable: u64,
    /// Degrees of freedom of the accepted updates, all together.
    pub accepted_degrees: u64,
    /// Mean of the normalised innovation squared of the accepted updates, over its degrees of
    /// freedom: 1 where the filter is honest about this aid.
    pub mean_nis_per_degree: f64,
}

impl Track {
    /// Takes one event in.
    pub fn take(&mut self, event: Event) {
        match event {
            Event::Aligned(alignment) => self.alignments.push(alignment),
            Event::Point(point) => self.points.push(point),
            Event::Revision { points } => self.revise(&points),
            Event::Visit(visit) => self.visits.push(visit),
            Event::Anomaly(anomaly) => {
                let order =
                    |anomaly: &Anomaly| (anomaly.t_start_ns, anomaly.stream, anomaly.kind, anomaly.t_end_ns);
                let at = self.anomalies.partition_point(|other| order(other) <= order(&anomaly));
                self.anomalies.insert(at, anomaly);
            }
            Event::Stand(stand) => match self.stands.iter_mut().find(|known| known.number == stand.number) {
                Some(known) => *known = stand,
                None => self.stands.push(stand),
            },
            Event::Aid(outcome) => self.aids.entry(outcome.aid).or_default().take(&outcome),
        }
    }

    /// Replaces points by those of the same time. Revisions touch the tail, so the place is sought
    /// from there; a point whose time was never told is not invented.
    fn revise(&mut self, revised: &[TrackPoint]) {
        let Some(first) = revised.first() else { return };
        let mut reach = 1;
        let len = self.points.len();
        while reach < len && self.points[len - reach].t_ns >= first.t_ns {
            reach *= 2;
        }
        let tail = len - reach.min(len);
        let mut at = tail + self.points[tail..].partition_point(|point| point.t_ns < first.t_ns);
        for point in revised {
            at += self.points[at..].iter().take_while(|old| old.t_ns < point.t_ns).count();
            if let Some(old) = self.points.get_mut(at).filter(|old| old.t_ns == point.t_ns) {
                *old = *point;
                at += 1;
                self.revised_points += 1;
            }
        }
    }
}

impl AidTally {
    fn take(&mut self, outcome: &AidOutcome) {
        let updates = u64::from(outcome.updates);
        if !outcome.accepted {
            self.rejected += updates;
            self.unusable += if outcome.nis.is_finite() { 0 } else { updates };
            return;
        }
        self.accepted += updates;
        self.accepted_degrees += updates * u64::from(outcome.degrees_of_freedom);
        let per_degree = outcome.nis / f64::from(outcome.degrees_of_freedom.max(1));
        if self.accepted > 0 && per_degree.is_finite() {
            self.mean_nis_per_degree +=
                (per_degree - self.mean_nis_per_degree) * updates as f64 / self.accepted as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::csv::tests::point;

    fn at(t_ns: i64, e: f64) -> TrackPoint {
        TrackPoint { t_ns, position_n_m: [e, 0.0, 0.0], ..point() }
    }

    #[test]
    fn revisions_replace_points_by_time() {
        let mut track = Track::default();
        for t in 0..1000 {
            track.take(Event::Point(at(t * 10, t as f64)));
        }
        track.take(Event::Revision { points: vec![at(9_970, -1.0), at(9_980, -2.0), at(9_990, -3.0)] });
        track
            .take(Event::Revision { points: vec![at(0, -4.0), at(5, -5.0), at(10, -6.0), at(20_000, -7.0)] });
        let e = |i: usize| track.points[i].position_n_m[0];
        assert_eq!(track.points.len(), 1000);
        assert_eq!((e(996), e(997), e(998), e(999)), (996.0, -1.0, -2.0, -3.0));
        assert_eq!((e(0), e(1), e(2)), (-4.0, -6.0, 2.0));
        assert_eq!(track.revised_points, 5);
        track.take(Event::Revision { points: Vec::new() });
        Track::default().take(Event::Revision { points: vec![at(0, 0.0)] });
    }

    #[test]
    fn aids_are_tallied_by_update() {
        let mut track = Track::default();
        let mut outcome = AidOutcome {
            t_ns: 0,
            stream: None,
            aid: AidKind::MARKERS,
            nis: 3.0,
            degrees_of_freedom: 3,
            updates: 30,
            accepted: true,
        };
        track.take(Event::Aid(outcome));
        outcome.nis = 6.0;
        outcome.updates = 10;
        track.take(Event::Aid(outcome));
        outcome.accepted = false;
        track.take(Event::Aid(outcome));
        let tally = track.aids[&AidKind::MARKERS];
        assert_eq!((tally.accepted, tally.rejected), (40, 10));
        assert!((tally.mean_nis_per_degree - 1.25).abs() < 1e-12);
    }
}
