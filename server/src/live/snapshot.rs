//! The picture that a new client is given: what all changes so far add up to.

use std::collections::{BTreeMap, VecDeque};

use serde::Serialize;
use uuid::Uuid;

use super::trail::{Trail, TrailPoint};
use crate::alarms::{Heard, Limits, Watched};
use crate::store::alarms::Alarm;
use crate::store::anomalies::Anomaly;
use crate::store::faults::Fault;
use crate::store::inspectors::Inspector;
use crate::store::sessions::{Session, SessionState};
use crate::store::stands::Stand;
use crate::store::visits::Visit;
use crate::wire::{Change, Position};

/// Sessions that nobody streams any more (or not yet) and that are shown all the same.
pub(super) const RESTING_SHOWN: usize = 20;
/// Visits, stands and anomalies shown for each session.
const RECENT_SHOWN: usize = 50;

/// The state of everything that the live page shows.
#[derive(Clone, Debug, Default)]
pub struct Board {
    inspectors: Vec<Inspector>,
    sessions: BTreeMap<Uuid, Shown>,
    faults: BTreeMap<Uuid, Fault>,
    alarms: BTreeMap<String, Alarm>,
    markers_revision: i64,
}

/// One session on the board.
#[derive(Clone, Debug)]
struct Shown {
    session: Session,
    trail: Trail,
    position: Option<Position>,
    visits: VecDeque<Visit>,
    stands: BTreeMap<u32, Stand>,
    anomalies: VecDeque<Anomaly>,
}

/// The picture, ready to be sent.
#[derive(Clone, Debug, Serialize)]
pub struct Picture {
    inspectors: Vec<Inspector>,
    sessions: Vec<WalkPicture>,
    faults: Vec<Fault>,
    alarms: Vec<Alarm>,
    markers_revision: i64,
}

/// One session in the picture.
#[derive(Clone, Debug, Serialize)]
struct WalkPicture {
    #[serde(flatten)]
    session: Session,
    trail: Vec<TrailPoint>,
    position: Option<Position>,
    visits: Vec<Visit>,
    stands: Vec<Stand>,
    anomalies: Vec<Anomaly>,
}

impl Board {
    /// Takes in one change. The picture after it is what a client has that was told the change.
    pub fn apply(&mut self, change: &Change) {
        match change {
            Change::Position(position) => {
                if let Some(walk) = self.sessions.get_mut(&position.session_id) {
                    let [east_m, north_m, _] = position.position_m;
                    walk.trail.push((position.t_ns, east_m, north_m));
                    walk.position = Some(position.clone());
                }
            }
            Change::Revision { session_id, points } => {
                if let Some(walk) = self.sessions.get_mut(session_id) {
                    walk.trail.revise(points);
                }
            }
            Change::Session { session, deleted } => {
                if let Some(session) = session {
                    self.apply_session(session);
                }
                if let Some(id) = deleted {
                    self.sessions.remove(id);
                }
            }
            Change::Inspectors { inspectors } => self.inspectors.clone_from(inspectors),
            Change::Visit(visit) => {
                if let Some(walk) = self.sessions.get_mut(&visit.session_id) {
                    walk.visits.retain(|known| known.id != visit.id);
                    keep_recent(&mut walk.visits, visit.clone());
                }
            }
            Change::VisitRemoved { session_id, id } => {
                if let Some(walk) = self.sessions.get_mut(session_id) {
                    walk.visits.retain(|known| known.id != *id);
                }
            }
            Change::Stands { session_id, all, stands } => {
                if let Some(walk) = self.sessions.get_mut(session_id) {
                    if *all {
                        walk.stands.clear();
                    }
                    walk.stands.extend(stands.iter().map(|stand| (stand.number, stand.clone())));
                    while walk.stands.len() > RECENT_SHOWN {
                        walk.stands.pop_first();
                    }
                }
            }
            Change::Anomaly(anomaly) => {
                if let Some(walk) = self.sessions.get_mut(&anomaly.session_id) {
                    keep_recent(&mut walk.anomalies, anomaly.clone());
                }
            }
            Change::Fault { fault } => {
                if fault.state.stands() {
                    self.faults.insert(fault.id, fault.clone());
                } else {
                    self.faults.remove(&fault.id);
                }
            }
            Change::AlarmRaised { alarm } => {
                self.alarms.insert(alarm.key.clone(), alarm.clone());
            }
            Change::AlarmEnded { key } => {
                self.alarms.remove(key);
            }
            Change::Markers { revision } => self.markers_revision = *revision,
            Change::Job { .. } | Change::Alarm { .. } => {}
        }
    }

    fn apply_session(&mut self, session: &Session) {
        self.sessions.entry(session.id).and_modify(|walk| walk.session = session.clone()).or_insert_with(
            || Shown {
                session: session.clone(),
                trail: Trail::default(),
                position: None,
                visits: VecDeque::new(),
                stands: BTreeMap::new(),
                anomalies: VecDeque::new(),
            },
        );
        self.forget_the_oldest_at_rest();
    }

    fn forget_the_oldest_at_rest(&mut self) {
        let resting = self.sessions.values().filter(|walk| walk.session.state != SessionState::Live);
        let mut resting: Vec<_> = resting.map(|walk| (walk.session.started_at, walk.session.id)).collect();
        resting.sort_unstable();
        for (_, id) in resting.iter().rev().skip(RESTING_SHOWN) {
            self.sessions.remove(id);
        }
    }

    /// Where those who walk now are.
    pub fn live_positions(&self) -> Vec<Position> {
        let live = self.sessions.values().filter(|walk| walk.session.state == SessionState::Live);
        live.filter_map(|walk| walk.position.clone()).collect()
    }

    /// What is looked at for alarms: the live sessions of which something was heard, and the faults that stand.
    pub(crate) fn watched(&self, limits: &Limits) -> Watched {
        let live = self.sessions.values().filter(|walk| walk.session.state == SessionState::Live);
        let heard = live.filter_map(|walk| {
            let last = walk.position.as_ref()?;
            let is_person = walk.session.declaration().carrier_kind == "person";
            let stays_since_ns = is_person.then(|| walk.trail.stays_since(limits.one_spot_m)).flatten();
            Some(Heard {
                session_id: walk.session.id,
                inspector_id: walk.session.inspector_id,
                started_at: walk.session.started_at,
                last_ns: last.t_ns,
                position_m: last.position_m,
                sigma_m: last.sigma_m,
                received_at: last.received_at,
                stays_since_ns,
            })
        });
        Watched { heard: heard.collect(), faults: self.faults.values().cloned().collect() }
    }

    /// The picture as it is now.
    pub fn picture(&self) -> Picture {
        Picture {
            inspectors: self.inspectors.clone(),
            sessions: self
                .sessions
                .values()
                .map(|walk| WalkPicture {
                    session: walk.session.clone(),
                    trail: walk.trail.simplified(),
                    position: walk.position.clone(),
                    visits: walk.visits.iter().cloned().collect(),
                    stands: walk.stands.values().cloned().collect(),
                    anomalies: walk.anomalies.iter().cloned().collect(),
                })
                .collect(),
            faults: self.faults.values().cloned().collect(),
            alarms: self.alarms.values().cloned().collect(),
            markers_revision: self.markers_revision,
        }
    }
}

fn keep_recent<T>(recent: &mut VecDeque<T>, newest: T) {
    recent.push_back(newest);
    while recent.len() > RECENT_SHOWN {
        recent.pop_front();
    }
}
