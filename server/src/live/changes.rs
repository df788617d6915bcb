//! What the feed is told of a walk's findings.

use time::OffsetDateTime;

use super::actor::Actor;
use super::walk::{Findings, NewestPoint, Shown};
use crate::store::anomalies::Anomaly;
use crate::store::visits::Outcome;
use crate::wire::{Change, Position};

impl Actor {
    /// The changes that follow from findings once they are on disk. Notes on the way what became of
    /// visits, and where the inspector is.
    pub(super) fn changes(&mut self, findings: &Findings, received_at: OffsetDateTime) -> Vec<Change> {
        let session_id = self.session.id;
        let mut changes = Vec::new();
        for shown in &findings.shown {
            changes.push(match shown {
                Shown::Revision(points) => Change::Revision { session_id, points: points.clone() },
                Shown::Position(newest) => {
                    let position = self.position(newest, received_at);
                    self.newest = Some(position.clone());
                    Change::Position(position)
                }
            });
        }
        for outcome in &findings.visits {
            let weighed = self.told.iter_mut().find(|told| {
                told.visit.marker == outcome.marker
                    && (told.visit.t_start_ns..=told.visit.t_end_ns).contains(&outcome.t_ns)
            });
            if let Some(told) = weighed {
                told.visit.outcome = Some(Outcome::from(outcome));
                changes.push(Change::Visit(told.visit.clone()));
            }
        }
        changes.extend(
            findings
                .anomalies
                .iter()
                .map(|found| Change::Anomaly(Anomaly { session_id, found: found.clone() })),
        );
        changes
    }

    fn position(&self, newest: &NewestPoint, received_at: OffsetDateTime) -> Position {
        Position {
            session_id: self.session.id,
            inspector_id: self.session.inspector_id,
            t_ns: newest.point.t_ns,
            position_m: newest.point.position_n_m,
            heading_rad: newest.point.heading_rad,
            sigma_m: newest.point.sigma_n_m,
            covariance_en_m2: newest.point.covariance_en_m2,
            speed_m_s: newest.speed_m_s,
            state: newest.motion,
            since_marker_s: newest.summary.since_marker_s,
            since_marker_m: newest.summary.since_marker_m,
            distance_m: newest.summary.distance_m,
            received_at,
        }
    }
}
