//! Runs the filter over what has come, remembers enough to go back, and tells what changed.
//!
//! A separation of the feet or a late visit applies to a past moment: the filter of that moment is
//! taken out of memory, updated, and what came since is run again. As nothing but the samples
//! decides what happens, running again gives the same bits.

use std::collections::VecDeque;

use super::filter::{Demand, Filter, Setting};
use super::foot::Step;
use crate::event::{Anomaly, AnomalyKind, Event, TrackPoint, VisitOutcome};
use crate::session::Visit;

/// A checkpoint is kept this often, ns.
const CHECKPOINT_NS: i64 = 2_000_000_000;

/// The filter with its recent past.
#[derive(Clone, Debug)]
pub(crate) struct History<const B: usize, const F: usize> {
    setting: Setting,
    filter: Filter<B, F>,
    steps: Numbered<EpochStep>,
    /// Number of the step that the filter takes next.
    next: u64,
    /// The filter before the step of that number, oldest first.
    checkpoints: VecDeque<(u64, Box<Filter<B, F>>)>,
    /// For each foot, the filter after the step at which it was nearest to the other.
    remembered: [Option<(u64, Box<Filter<B, F>>)>; 2],
    points: Numbered<TrackPoint>,
    /// How many points have been told.
    told_points: u64,
    /// The oldest told point that has been computed anew and not been told again.
    revised_from: Option<u64>,
    /// Steps below this number have been taken before: their outcomes have been told.
    seen: u64,
    visits: Vec<(Visit, bool)>,
    t_ns: i64,
}

#[derive(Clone, Copy, Debug)]
struct EpochStep {
    step: Step,
    epoch: u64,
}

impl<const B: usize, const F: usize> History<B, F> {
    pub(crate) fn new(setting: Setting, filter: Filter<B, F>) -> Self {
        History {
            setting,
            checkpoints: VecDeque::from([(0, Box::new(filter.clone()))]),
            filter,
            steps: Numbered::new(),
            next: 0,
            remembered: [None, None],
            points: Numbered::new(),
            told_points: 0,
            revised_from: None,
            seen: 0,
            visits: Vec::new(),
            t_ns: i64::MIN,
        }
    }

    /// The filter as it is now.
    pub(crate) fn filter(&self) -> &Filter<B, F> {
        &self.filter
    }

    /// Takes the next sample and appends what became known.
    pub(crate) fn push(&mut self, step: Step, told: &mut Vec<Event>) {
        let epoch = match self.steps.last() {
            Some(last) => last.epoch + u64::from(step.opens_epoch),
            None => 0,
        };
        self.steps.push(EpochStep { step, epoch });
        self.run(told);
        self.tell(told);
    }

    /// Takes a visit, for now or for a moment that is past.
    pub(crate) fn visit(&mut self, visit: Visit, told: &mut Vec<Event>) {
        let at_ns = moment(&visit);
        if at_ns < self.t_ns {
            let checkpoint = self.checkpoints.iter().rposition(|(next, _)| {
                *next == 0 || self.steps.get(next - 1).is_some_and(|before| before.step.t_ns <= at_ns)
            });
            let Some(checkpoint) = checkpoint else {
                told.push(Event::Visit(turned_down(
                    &visit,
                    format!(
                        "it is {:.0} s in the past, more than the history of a live session holds; it will be used when the session is finished and run again",
                        (self.t_ns - at_ns) as f64 * 1e-9
                    ),
                )));
                return;
            };
            self.checkpoints.truncate(checkpoint + 1);
            let (next, filter) = &self.checkpoints[checkpoint];
            self.next = *next;
            self.filter.clone_from(filter);
            self.remembered = [None, None];
        }
        let place = self.visits.partition_point(|(other, _)| moment(other) <= at_ns);
        self.visits.insert(place, (visit, false));
        self.run(told);
        self.tell(told);
    }

    /// No more samples come: closes the last epoch and uses what visits are left.
    pub(crate) fn finish(&mut self, told: &mut Vec<Event>) {
        while let Some((visit, _)) = self.visits.get(self.filter.visits_applied) {
            if visit.t_start_ns > self.t_ns {
                let late = visit.clone();
                self.filter.visits_applied += 1;
                told.push(Event::Visit(turned_down(&late, "it begins after the end of the log".to_owned())));
            } else {
                self.apply_visit(told);
            }
        }
        if let Some(last) = self.steps.last().copied() {
            self.record(last.epoch, last.step.t_ns);
        }
        self.tell(told);
    }

    fn run(&mut self, told: &mut Vec<Event>) {
        while let Some(entry) = self.steps.get(self.next).copied() {
            let step = entry.step;
            while self
                .visits
                .get(self.filter.visits_applied)
                .is_some_and(|(visit, _)| moment(visit) < step.t_ns)
            {
                self.apply_visit(told);
            }
            if step.opens_epoch && entry.epoch > 0 {
                let closed_ns = self.steps.get(self.next - 1).map_or(step.t_ns, |before| before.step.t_ns);
                self.record(entry.epoch - 1, closed_ns);
            }
            self.keep_checkpoint(step.t_ns, told);
            let known = told.len();
            let demand = self.filter.step(&self.setting, &step, told);
            if self.next < self.seen {
                told.truncate(known);
            }
            self.next += 1;
            self.seen = self.seen.max(self.next);
            self.t_ns = self.t_ns.max(step.t_ns);
            match demand {
                Demand::None => {}
                Demand::Remember { sensor } => self.remember(sensor),
                Demand::GoBack { sensor } => self.go_back(sensor, told),
            }
        }
    }

    fn remember(&mut self, sensor: usize) {
        match &mut self.remembered[sensor] {
            Some((next, filter)) => {
                *next = self.next;
                (**filter).clone_from(&self.filter);
            }
            empty => *empty = Some((self.next, Box::new(self.filter.clone()))),
        }
    }

    fn go_back(&mut self, sensor: usize, told: &mut Vec<Event>) {
        // Taken out, so that a moment is used once, whatever comes.
        let remembered = self.remembered[sensor].take().filter(|(next, _)| *next > self.steps.first_number());
        let known = told.len();
        let again = self.next < self.seen;
        if let Some((next, filter)) = remembered {
            self.checkpoints.retain(|(kept, _)| *kept <= next);
            self.filter.clone_from(&filter);
            self.next = next;
            self.filter.apply_separation(&self.setting, sensor, told);
            self.remembered[sensor] = Some((next, filter));
        } else {
            self.filter.feet[sensor].swing.mark_used();
        }
        // The other foot's moment lies in a filter that has just been overruled.
        self.remembered[1 - sensor] = None;
        if again {
            told.truncate(known);
        }
    }

    fn apply_visit(&mut self, told: &mut Vec<Event>) {
        let (visit, told_before) = &mut self.visits[self.filter.visits_applied];
        self.filter.visits_applied += 1;
        if !self.setting.aids.markers {
            // Without the aid the visit still shows how far off the track is.
            let mut without = self.filter.clone();
            let mut outcome = without.apply_visit(&self.setting, visit, moment(visit));
            outcome.accepted = false;
            outcome.after_minus_marker_n_m = outcome.before_minus_marker_n_m;
            outcome.reason = "markers are not among the aids of this run".to_owned();
            told.push(Event::Visit(outcome));
            return;
        }
        let outcome = self.filter.apply_visit(&self.setting, visit, moment(visit));
        if !*told_before {
            *told_before = true;
            told.push(Event::Visit(outcome));
        }
    }

    fn record(&mut self, epoch: u64, t_ns: i64) {
        let point = self.filter.point(&self.setting, t_ns);
        if epoch < self.told_points {
            self.revised_from = Some(self.revised_from.map_or(epoch, |from| from.min(epoch)));
        }
        self.points.set(epoch, point);
    }

    fn tell(&mut self, told: &mut Vec<Event>) {
        if let Some(from) = self.revised_from.take() {
            let points = (from..self.told_points).filter_map(|n| self.points.get(n).copied()).collect();
            told.push(Event::Revision { points });
        }
        while let Some(point) = self.points.get(self.told_points) {
            told.push(Event::Point(*point));
            self.told_points += 1;
        }
    }

    fn keep_checkpoint(&mut self, t_ns: i64, told: &mut Vec<Event>) {
        let newest_ns = self.checkpoints.back().map_or(i64::MIN, |(_, filter)| time_of(filter));
        let since_ns = t_ns.saturating_sub(newest_ns);
        // While all feet stand no moment of a swing is remembered, which a checkpoint would lack.
        let all_stand = self.filter.feet.iter().all(|foot| foot.stance.stands);
        if since_ns < CHECKPOINT_NS || (!all_stand && since_ns < 3 * CHECKPOINT_NS) {
            return;
        }
        if !self.filter.is_sound() {
            self.start_again(t_ns, told);
        }
        self.checkpoints.push_back((self.next, Box::new(self.filter.clone())));
        let oldest_ns = t_ns - (self.setting.tuning.history_s * 1e9) as i64;
        while self.checkpoints.len() > 2 && time_of(&self.checkpoints[1].1) < oldest_ns {
            self.checkpoints.pop_front();
        }
        let oldest = self.checkpoints.front().map_or(self.next, |(next, _)| *next);
        // One before it, for the time at which an epoch was closed.
        self.steps.forget_before(oldest.saturating_sub(1));
        if let Some(step) = self.steps.first() {
            self.points.forget_before(step.epoch.saturating_sub(1).min(self.told_points));
        }
    }

    /// A number that is none has come into the filter: goes on from the last sound checkpoint, with
    /// the feet somewhere near.
    fn start_again(&mut self, t_ns: i64, told: &mut Vec<Event>) {
        let Some((_, sound)) = self.checkpoints.iter().rev().find(|(_, filter)| filter.is_sound()) else {
            return;
        };
        let visits_applied = self.filter.visits_applied;
        let since_ns = time_of(sound);
        self.filter.clone_from(sound);
        self.filter.visits_applied = visits_applied;
        for foot in &mut self.filter.feet {
            foot.lost = true;
        }
        told.push(Event::Anomaly(Anomaly {
            kind: AnomalyKind::FilterReset,
            foot: None,
            t_start_ns: since_ns,
            t_end_ns: t_ns,
            samples: 0,
            detail: "the filter came to a number that is none and went on from the last sound state; look at the samples in this stretch".to_owned(),
        }));
    }
}

/// When a visit is applied: in the middle of the stand, which forgives a stamp that is early or late.
fn moment(visit: &Visit) -> i64 {
    visit.t_start_ns + (visit.t_end_ns - visit.t_start_ns) / 2
}

fn time_of<const B: usize, const F: usize>(filter: &Filter<B, F>) -> i64 {
    filter.feet.iter().map(|foot| foot.t_ns).max().unwrap_or(i64::MIN)
}

/// The outcome of a visit that could not be weighed at all.
fn turned_down(visit: &Visit, reason: String) -> VisitOutcome {
    VisitOutcome {
        marker: visit.marker.clone(),
        t_ns: moment(visit),
        before_minus_marker_n_m: [f64::NAN; 3],
        after_minus_marker_n_m: [f64::NAN; 3],
        nis: f64::NAN,
        degrees_of_freedom: 0,
        accepted: false,
        reason,
    }
}

/// A queue whose members keep their number when the oldest are forgotten.
#[derive(Clone, Debug)]
struct Numbered<T> {
    first: u64,
    members: VecDeque<T>,
}

impl<T> Numbered<T> {
    fn new() -> Self {
        Numbered { first: 0, members: VecDeque::new() }
    }

    fn first_number(&self) -> u64 {
        self.first
    }

    #[inline]
    fn get(&self, number: u64) -> Option<&T> {
        number.checked_sub(self.first).and_then(|k| self.members.get(k as usize))
    }

    fn first(&self) -> Option<&T> {
        self.members.front()
    }

    fn last(&self) -> Option<&T> {
        self.members.back()
    }

    fn push(&mut self, member: T) {
        self.members.push_back(member);
    }

    /// Puts a member in the place of that number, or behind the last.
    fn set(&mut self, number: u64, member: T) {
        match number.checked_sub(self.first).and_then(|k| self.members.get_mut(k as usize)) {
            Some(place) => *place = member,
            None if number >= self.first => self.members.push_back(member),
            None => {}
        }
    }

    fn forget_before(&mut self, number: u64) {
        while self.first < number && self.members.pop_front().is_some() {
            self.first += 1;
        }
    }
}
