//! Listens to what a session tells, finds its stands, and tells them with their candidates.
//!
//! Positions are taken as they were when a stand was told. A visit moves the track; by how much is
//! seen where the track's newest point is told again, or in the step from one point to the next while
//! nobody walks, and noted as a known correction: it changes the error, not what is known of it.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::automatic::{SLACK_NS, holds, nearly_certain};
use super::candidates::named;
use super::hypotheses::{Hypotheses, Seen};
use super::markers::Markers;
use super::track_error::Stretch;
use super::tuning::Identification;
use crate::detect::standing::{Standing, StandingDetector};
use crate::event::{Event, Stand, StandVisit, TrackPoint};
use crate::rotation::wrap;
use crate::visit::Visit;

/// The path's length is summed over steps of this duration, ns.
const LENGTH_STEP_NS: i64 = 1_000_000_000;
/// A stand is told again when a probability has changed by more than this.
const WORTH_TELLING: f64 = 0.005;

/// The stands of one session. Saved is what does not follow from what the session was told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Stands {
    #[serde(skip)]
    identification: Identification,
    #[serde(skip)]
    markers: Arc<Markers>,
    detector: StandingDetector,
    hypotheses: Hypotheses,
    told: Vec<Stand>,
    /// Visits that the session was told, and whether each is automatic.
    visits: Vec<(Visit, bool)>,
    /// Those that were used: marker, moment, and whether automatic.
    used: Vec<(String, i64, bool)>,
    /// Stretches since the last stand, and where the running one began.
    stretches: Vec<Stretch>,
    from_n_m: Option<Vector3<f64>>,
    length_m: f64,
    length_at: Option<(i64, Vector3<f64>)>,
    last: Option<TrackPoint>,
    /// A visit was used, and the track's newest point has not been told since.
    corrected: bool,
}

impl Stands {
    pub(crate) fn new(identification: &Identification) -> Stands {
        Stands {
            identification: identification.clone(),
            markers: Arc::clone(&identification.markers),
            detector: StandingDetector::default(),
            hypotheses: Hypotheses::new(identification.tuning.clone()),
            told: Vec::new(),
            visits: identification.automatic_visits.iter().map(|visit| (visit.clone(), true)).collect(),
            used: Vec::new(),
            stretches: Vec::new(),
            from_n_m: None,
            length_m: 0.0,
            length_at: None,
            last: None,
            corrected: false,
        }
    }

    /// Stands that were saved, of a session that is told the same again, or other markers.
    pub(crate) fn told_again(mut self, identification: &Identification) -> Stands {
        self.identification = identification.clone();
        self.markers = Arc::clone(&identification.markers);
        self.hypotheses.think_again(&identification.markers, identification.tuning.clone());
        self
    }

    /// Somebody told the session of a visit.
    pub(crate) fn note_visit(&mut self, visit: &Visit) {
        self.visits.push((visit.clone(), false));
    }

    /// The walk is over, and with it a stand that lasted.
    pub(crate) fn finish(&mut self, events: &mut Vec<Event>) {
        if let Some(stand) = self.told.last_mut().filter(|stand| stand.lasts) {
            stand.lasts = false;
            stand.t_end_ns = self.last.map_or(stand.t_end_ns, |point| point.t_ns);
            events.push(Event::Stand(stand.clone()));
        }
    }

    /// Takes what a session has told. Appends stands to `events`, and visits that are to be made to
    /// `visits`.
    pub(crate) fn take(&mut self, told: &[Event], events: &mut Vec<Event>, visits: &mut Vec<Visit>) {
        for event in told {
            match event {
                Event::Point(point) => self.on_point(point, events, visits),
                Event::Revision { points } => {
                    if let (Some(newest), Some(last)) = (points.last(), &mut self.last)
                        && newest.t_ns == last.t_ns
                    {
                        if self.corrected {
                            self.on_correction(newest);
                        } else {
                            *last = *newest;
                        }
                    }
                }
                Event::Visit(outcome) if outcome.accepted => {
                    self.corrected = true;
                    self.on_visit(&outcome.marker, outcome.t_ns, events);
                }
                _ => {}
            }
        }
    }

    fn on_point(&mut self, point: &TrackPoint, events: &mut Vec<Event>, visits: &mut Vec<Visit>) {
        // The filter starts again after a number that is none; until then nothing is known.
        if !point.position_n_m.iter().chain([&point.heading_rad]).all(|value| value.is_finite()) {
            return;
        }
        if self.corrected {
            self.on_correction(point);
        }
        let position = Vector3::from(point.position_n_m);
        self.from_n_m.get_or_insert(position);
        let (at_ns, at_n_m) = *self.length_at.get_or_insert((point.t_ns, position));
        if point.t_ns - at_ns >= LENGTH_STEP_NS {
            self.length_m += (position - at_n_m).norm();
            self.length_at = Some((point.t_ns, position));
        }
        self.last = Some(*point);
        match self.detector.take(point) {
            Standing::Nothing => {}
            Standing::Begun { t_start_ns } => self.on_stand(point, t_start_ns, events, visits),
            Standing::Ended { t_end_ns } => {
                if let Some(stand) = self.told.last_mut() {
                    stand.t_end_ns = t_end_ns;
                    stand.lasts = false;
                    events.push(Event::Stand(stand.clone()));
                }
            }
        }
    }

    /// A visit has moved the newest point to `moved`.
    fn on_correction(&mut self, moved: &TrackPoint) {
        self.corrected = false;
        let Some(last) = self.last else { return };
        let jump_n_m = Vector3::from(moved.position_n_m) - Vector3::from(last.position_n_m);
        self.close_stretch(&last, jump_n_m, wrap(moved.heading_rad - last.heading_rad));
        self.from_n_m = Some(Vector3::from(moved.position_n_m));
        if let Some((_, at_n_m)) = &mut self.length_at {
            *at_n_m += jump_n_m;
        }
        self.detector.shift(&jump_n_m);
        self.last = Some(*moved);
    }

    fn close_stretch(&mut self, at: &TrackPoint, jump_n_m: Vector3<f64>, jump_heading_rad: f64) {
        let position = Vector3::from(at.position_n_m);
        self.stretches.push(Stretch {
            displacement_n_m: position - self.from_n_m.unwrap_or(position),
            length_m: std::mem::take(&mut self.length_m),
            heading_sigma_rad: at.sigma_heading_rad,
            jump_n_m,
            jump_heading_rad,
        });
        self.from_n_m = Some(position);
    }

    fn on_stand(
        &mut self,
        point: &TrackPoint,
        t_start_ns: i64,
        events: &mut Vec<Event>,
        visits: &mut Vec<Visit>,
    ) {
        self.close_stretch(point, Vector3::zeros(), 0.0);
        self.told.push(Stand {
            number: self.told.len() as u32 + 1,
            t_start_ns,
            t_end_ns: point.t_ns,
            lasts: true,
            position_n_m: point.position_n_m,
            candidates: Vec::new(),
            visit: None,
        });
        let seen = Seen {
            stretches: std::mem::take(&mut self.stretches),
            position_n_m: Vector3::from(point.position_n_m),
            keyed: None,
        };
        self.hypotheses.take(seen, &self.markers);
        let stand = self.told.len() - 1;
        // The middle of a visit may lie before the time at which a stand is known to be one.
        let applied = self.used.iter().rfind(|(_, t_ns, _)| *t_ns >= t_start_ns - SLACK_NS);
        if let Some((marker, _, automatic)) = applied.cloned() {
            self.mark_visited(stand, &marker, automatic);
        }
        self.look_again(Some(stand), events);
        let stand = &self.told[stand];
        let claimed = self.visits.iter().any(|(visit, _)| {
            visit.t_start_ns <= stand.t_end_ns + SLACK_NS && visit.t_end_ns >= stand.t_start_ns - SLACK_NS
        });
        if self.identification.automatic
            && !claimed
            && let Some(visit) = nearly_certain(stand, &self.identification)
        {
            self.visits.push((visit.clone(), true));
            visits.push(visit);
        }
    }

    /// A visit was used.
    fn on_visit(&mut self, marker: &str, t_ns: i64, events: &mut Vec<Event>) {
        let automatic = self
            .visits
            .iter()
            .any(|(visit, automatic)| *automatic && visit.marker == marker && middle_ns(visit) == t_ns);
        self.used.push((marker.to_owned(), t_ns, automatic));
        let stand = self.told.iter().rposition(|stand| holds(stand, t_ns));
        if let Some(stand) = stand {
            self.mark_visited(stand, marker, automatic);
            self.look_again(Some(stand), events);
        }
    }

    /// What people keyed in is evidence; what was concluded from the track is none.
    fn mark_visited(&mut self, stand: usize, marker: &str, automatic: bool) {
        self.told[stand].visit = Some(StandVisit { marker: marker.to_owned(), automatic });
        if !automatic {
            self.hypotheses.key(stand, marker, &self.markers);
        }
    }

    /// Tells every stand again of which more is known now, and `anyway` this one.
    fn look_again(&mut self, anyway: Option<usize>, events: &mut Vec<Event>) {
        for (number, (stand, shares)) in self.told.iter_mut().zip(self.hypotheses.marks()).enumerate() {
            let place = Vector3::from(stand.position_n_m).xy();
            let marks = shares.into_iter().filter_map(|(mark, share)| Some((mark?, share)));
            let candidates = named(marks, &place, &self.markers);
            let changed = candidates.len() != stand.candidates.len()
                || candidates.iter().zip(&stand.candidates).any(|(new, old)| {
                    new.marker != old.marker || (new.probability - old.probability).abs() > WORTH_TELLING
                });
            if changed || anyway == Some(number) {
                stand.candidates = candidates;
                events.push(Event::Stand(stand.clone()));
            }
        }
    }
}

fn middle_ns(visit: &Visit) -> i64 {
    visit.t_start_ns + (visit.t_end_ns - visit.t_start_ns) / 2
}
