//! One walk as it comes in: the engine's session, and what of its events is kept and what is shown.
//!
//! A function of the samples and visits alone, in the order in which they were taken: fed again from
//! the stored log it comes to the same state, to the last bit. Nothing here waits, reads or writes.

use std::collections::{BTreeMap, VecDeque};

use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::event::{Event, Stand, TrackPoint, VisitOutcome};
use lodestep_engine::replay::InputStore;
use lodestep_engine::session::{ConfigError, Session, SessionConfig, Summary, Visit};
use lodestep_engine::stream::{Readings, StreamId};
use serde::{Deserialize, Serialize};

use super::thinning::{Choice, SavedThinning, Thinning};
use super::trail::TrailPoint;
use crate::store::anomalies::Gathered;
use crate::store::live_states::LiveState;
use crate::wire::Motion;

/// The speed that is shown is the mean over this time, ns.
const SPEED_OVER_NS: i64 = 1_000_000_000;
/// Both streams have to stand for this long until the inspector counts as standing, ns: longer than the
/// moments in which both streams are on the ground while walking.
const STANDING_AFTER_NS: i64 = 700_000_000;

/// A state is saved this often at most, ns: there is one for each minute of a walk.
const SAVED_EVERY_NS: i64 = 90_000_000_000;

/// A walk in progress.
#[derive(Debug)]
pub(crate) struct LiveSession {
    session: Session,
    grid: Thinning,
    shown: VecDeque<TrailPoint>,
    moved_ns: i64,
    samples_taken: u64,
    events: Vec<Event>,
    /// Time of the state that was saved last, ns.
    saved_ns: Option<i64>,
}

/// What is saved of a walk.
#[derive(Serialize, Deserialize)]
struct Saved {
    engine: Vec<u8>,
    grid: SavedThinning,
    shown: VecDeque<TrailPoint>,
    moved_ns: i64,
    samples_taken: u64,
}

/// What came out of some samples or a visit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Findings {
    /// Points to be stored, by their time; they replace what is stored for it.
    pub(crate) points: BTreeMap<i64, TrackPoint>,
    /// What is shown, in the order in which it became known.
    pub(crate) shown: Vec<Shown>,
    /// What became of visits.
    pub(crate) visits: Vec<VisitOutcome>,
    /// Where the inspector stood, each as it was told last, by number.
    pub(crate) stands: BTreeMap<u32, Stand>,
    /// What is wrong with the sensors.
    pub(crate) anomalies: Vec<Anomaly>,
    /// What is wrong as it was many times before.
    pub(crate) more_anomalies: Vec<Gathered>,
    /// Whether some points take the place of others that were told before.
    pub(crate) revised: bool,
}

/// Something for the map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shown {
    /// The newest point.
    Position(Box<NewestPoint>),
    /// A corrected stretch of the trail, oldest vertex first.
    Revision(Vec<TrailPoint>),
}

/// The newest point, with what is told beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NewestPoint {
    pub(crate) point: TrackPoint,
    pub(crate) speed_m_s: f64,
    pub(crate) motion: Motion,
    pub(crate) summary: Summary,
}

impl Findings {
    /// Adds what came after, but for what is shown.
    pub(super) fn add(&mut self, later: Findings) {
        self.points.extend(later.points);
        self.visits.extend(later.visits);
        self.stands.extend(later.stands);
        self.anomalies.extend(later.anomalies);
        self.more_anomalies.extend(later.more_anomalies);
        self.revised |= later.revised;
    }

    /// What is wrong with the sensors, as it is stored.
    pub(super) fn new_anomalies(&self) -> impl Iterator<Item = Gathered> {
        self.anomalies.iter().map(|found| Gathered { found: found.clone(), times: 1 })
    }
}

impl LiveSession {
    /// A walk that waits for its first readings, of which so many points a second are stored; what it seldom needs lies in
    /// `inputs`.
    pub(crate) fn new(
        config: SessionConfig,
        stored_hz: f64,
        inputs: Option<Box<dyn InputStore>>,
    ) -> Result<LiveSession, ConfigError> {
        Ok(LiveSession {
            session: Session::with_store(config, inputs)?,
            grid: Thinning::new(stored_hz),
            shown: VecDeque::new(),
            moved_ns: i64::MIN,
            samples_taken: 0,
            events: Vec::new(),
            saved_ns: None,
        })
    }

    /// The walk whose state this is, told the same; it goes on with what came after. `None` where the state is none of this program's.
    pub(crate) fn restored(
        config: SessionConfig,
        stored_hz: f64,
        inputs: Box<dyn InputStore>,
        state: &LiveState,
    ) -> Option<LiveSession> {
        let saved: Saved = postcard::from_bytes(&state.body).ok()?;
        Some(LiveSession {
            session: Session::restored(config, &saved.engine, Some(inputs)).ok()?,
            grid: Thinning::restored(stored_hz, saved.grid),
            shown: saved.shown,
            moved_ns: saved.moved_ns,
            samples_taken: saved.samples_taken,
            events: Vec::new(),
            saved_ns: Some(state.t_ns),
        })
    }

    /// Its state and the time of that, ns, every two minutes of the walk; and again when a visit went back to before that time.
    pub(crate) fn state_to_save(&mut self) -> Option<(i64, Vec<u8>)> {
        let state = self.session.state_to_save()?;
        let again = |saved_ns: i64| state.t_ns <= saved_ns;
        let due = |saved_ns: i64| state.t_ns >= saved_ns.saturating_add(SAVED_EVERY_NS);
        if !self.saved_ns.is_none_or(|saved_ns| again(saved_ns) || due(saved_ns)) {
            return None;
        }
        self.saved_ns = Some(state.t_ns);
        let saved = Saved {
            engine: state.bytes,
            grid: self.grid.saved(),
            shown: self.shown.clone(),
            moved_ns: self.moved_ns,
            samples_taken: self.samples_taken,
        };
        Some((state.t_ns, postcard::to_allocvec(&saved).ok()?))
    }

    /// Whether it was restored, and would be another if it had been made from all of its samples.
    pub(crate) fn lacks_past(&self) -> bool {
        self.session.lacks_past()
    }

    /// Takes the next readings of a stream.
    pub(crate) fn take(&mut self, stream: StreamId, readings: &Readings) -> Findings {
        self.take_each(stream, readings, |_| {})
    }

    /// The same; `look` looks at the session after each of them.
    pub(crate) fn take_each(
        &mut self,
        stream: StreamId,
        readings: &Readings,
        mut look: impl FnMut(&Session),
    ) -> Findings {
        let mut findings = Findings::default();
        for reading in readings.iter() {
            self.session.push(stream, reading, &mut self.events);
            look(&self.session);
            self.samples_taken += 1;
            self.sort_events(&mut findings);
        }
        findings
    }

    /// Takes a visit.
    pub(crate) fn visit(&mut self, visit: Visit) -> Findings {
        let mut findings = Findings::default();
        self.session.visit(visit, &mut self.events);
        self.sort_events(&mut findings);
        findings
    }

    /// No more samples will come.
    pub(crate) fn finish(&mut self) -> Findings {
        let mut findings = Findings::default();
        for stream in self.session.config().streams.clone() {
            self.session.end(stream.id, &mut self.events);
        }
        self.session.finish(&mut self.events);
        self.sort_events(&mut findings);
        findings
    }

    /// What it amounts to so far.
    pub(crate) fn summary(&self) -> Summary {
        self.session.summary()
    }

    /// Samples that it was given, both streams: the place in the stream.
    pub(crate) fn samples_taken(&self) -> u64 {
        self.samples_taken
    }

    fn sort_events(&mut self, findings: &mut Findings) {
        let mut events = std::mem::take(&mut self.events);
        for event in events.drain(..) {
            match event {
                Event::Point(point) => self.on_point(point, findings),
                Event::Revision { points } => self.on_revision(&points, findings),
                Event::Visit(outcome) => findings.visits.push(outcome),
                Event::Stand(stand) => {
                    findings.stands.insert(stand.number, stand);
                }
                Event::Anomaly(anomaly) => findings.anomalies.push(anomaly),
                // Of interest to a navigation engineer, who has the report of the final run.
                Event::Aligned(_) | Event::Aid(_) => {}
            }
        }
        // A corrected trail is thousands of points; the room that they took is not needed again.
        if events.capacity() <= 256 {
            self.events = events;
        }
    }

    fn on_point(&mut self, point: TrackPoint, findings: &mut Findings) {
        // What has no parts that could stand is on its way while it changes its place.
        let moves = match self.shown.back() {
            Some(last) if point.parts.iter().all(Option::is_none) => {
                (last.1, last.2) != (point.position_n_m[0], point.position_n_m[1])
            }
            _ => point.parts.iter().flatten().any(|part| !part.stance),
        };
        if moves {
            self.moved_ns = point.t_ns;
        }
        let choice = self.grid.choose(point.t_ns);
        if choice == Choice::Skipped {
            return;
        }
        findings.points.insert(point.t_ns, point);
        if choice == Choice::Shown {
            self.shown.push_back(vertex(&point));
            while self.shown.len() > 2 && self.shown[1].0 <= point.t_ns - SPEED_OVER_NS {
                self.shown.pop_front();
            }
            findings.shown.push(Shown::Position(Box::new(NewestPoint {
                point,
                speed_m_s: self.speed_m_s(),
                motion: if point.t_ns.saturating_sub(self.moved_ns) >= STANDING_AFTER_NS {
                    Motion::Standing
                } else {
                    Motion::Walking
                },
                summary: self.session.summary(),
            })));
        }
    }

    fn on_revision(&mut self, points: &[TrackPoint], findings: &mut Findings) {
        findings.revised = true;
        let mut stretch = Vec::new();
        for point in points {
            let choice = self.grid.chosen(point.t_ns);
            if choice != Choice::Skipped {
                findings.points.insert(point.t_ns, *point);
            }
            if choice == Choice::Shown {
                stretch.push(vertex(point));
                if let Ok(at) = self.shown.binary_search_by_key(&point.t_ns, |vertex| vertex.0) {
                    self.shown[at] = vertex(point);
                }
            }
        }
        if !stretch.is_empty() {
            findings.shown.push(Shown::Revision(stretch));
        }
    }

    fn speed_m_s(&self) -> f64 {
        match (self.shown.front(), self.shown.back()) {
            (Some(from), Some(to)) if to.0 > from.0 => {
                (to.1 - from.1).hypot(to.2 - from.2) / ((to.0 - from.0) as f64 * 1e-9)
            }
            _ => 0.0,
        }
    }
}

/// A point as a vertex of the trail.
pub(crate) fn vertex(point: &TrackPoint) -> TrailPoint {
    (point.t_ns, point.position_n_m[0], point.position_n_m[1])
}
