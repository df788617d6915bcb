//! What the feed is told of a walk's findings.

use time::OffsetDateTime;
use uuid::Uuid;

use super::actor::Actor;
use super::live_session::{Findings, NewestPoint, Shown};
use crate::sessions::anomaly_runs::Grown;
use crate::sessions::unknown_start::is_unknown;
use crate::store::stands::Stand;
use crate::store::visits::{Origin, Outcome, Visit};
use crate::utc;
use crate::wire::{Change, Position};

impl Actor {
    /// The changes that follow from findings once they are on disk. Notes on the way what became of
    /// visits, and where the inspector is; and of what was found wrong, leaves to be stored as rows of their own what is
    /// among the first of its kind.
    pub(super) fn changes(&mut self, findings: &mut Findings, received_at: OffsetDateTime) -> Vec<Change> {
        let session_id = self.session.id;
        let Grown { rows, more } = self.growing.take(std::mem::take(&mut findings.anomalies));
        (findings.anomalies, findings.more_anomalies) = (rows, more);
        let mut changes = Vec::new();
        for shown in &findings.shown {
            match shown {
                // Without a start a walk is nowhere until a marker says where.
                Shown::Position(newest) if is_unknown(newest.point.sigma_n_m) => {}
                Shown::Revision(points) => {
                    changes.push(Change::Revision { session_id, points: points.clone() });
                }
                Shown::Position(newest) => {
                    let position = self.position(newest, received_at);
                    self.newest = Some(position.clone());
                    changes.push(Change::Position(position));
                }
            }
        }
        if !findings.stands.is_empty() {
            let stands = findings.stands.values().map(Stand::from).collect();
            changes.push(Change::Stands { session_id, all: false, stands });
        }
        for outcome in &findings.visits {
            let told = self.told.iter_mut().map(|told| &mut told.visit);
            let weighed = told.chain(&mut self.automatic).find(|visit| {
                visit.marker == outcome.marker && (visit.t_start_ns..=visit.t_end_ns).contains(&outcome.t_ns)
            });
            if let Some(visit) = weighed {
                visit.outcome = Some(Outcome::from(outcome));
                changes.push(Change::Visit(visit.clone()));
            }
        }
        changes.extend(findings.new_anomalies().map(|new| Change::Anomaly(new.of(session_id))));
        changes
    }

    /// The visits that automatic mode has just made, as they are stored; the walk knows them already.
    pub(super) fn note_automatic(&mut self, findings: &Findings) -> Vec<Visit> {
        let made: Vec<Visit> = automatic_visits(self.session.id, findings)
            .filter(|made| !self.automatic.iter().any(|known| is_same(known, made)))
            .collect();
        self.automatic.extend(made.iter().cloned());
        made
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

/// The visits that automatic mode made of the stands among some findings.
pub(super) fn automatic_visits(session_id: Uuid, findings: &Findings) -> impl Iterator<Item = Visit> {
    findings.stands.values().filter_map(move |stand| {
        let visit = stand.visit.as_ref().filter(|visit| visit.automatic)?;
        let outcome = findings.visits.iter().find(|outcome| {
            outcome.marker == visit.marker && (stand.t_start_ns..=stand.t_end_ns).contains(&outcome.t_ns)
        });
        Some(Visit {
            id: Uuid::now_v7(),
            session_id,
            marker: visit.marker.clone(),
            t_start_ns: stand.t_start_ns,
            t_end_ns: stand.t_end_ns,
            origin: Origin::Automatic,
            keyed_shift_ns: 0,
            created_at: utc::now(),
            outcome: outcome.map(Outcome::from),
        })
    })
}

pub(super) fn is_same(visit: &Visit, other: &Visit) -> bool {
    visit.marker == other.marker && visit.t_start_ns == other.t_start_ns
}
