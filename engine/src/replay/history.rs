//! Runs a filter over what has come, remembers enough to go back, and reports what changed.
//!
//! A late visit applies to a past moment: the filter of that moment is taken out of memory, updated, and what
//! came since is run again. As nothing but the inputs decides what happens, running again gives the same
//! bits.

use std::collections::VecDeque;

use super::filter::{Input, Replayed};
use super::inputs::{InputStore, Inputs};
use super::recording::WayBack;
use super::smoothing::{Mark, Smoothing, Source, TRAIL_NS};
use crate::anomaly::Cause;
use crate::cause::SensorCause;
use crate::event::{Event, TrackPoint, VisitOutcome};
use crate::replay::Solution;
use crate::visit::Visit;

mod saved;

pub(crate) use saved::SavedHistory;

/// How far a live history looks back at most, ns: over its trail; a late visit goes back less far.
pub(crate) const LOOKS_BACK_NS: i64 = TRAIL_NS;
/// A checkpoint is taken this often, ns.
const CHECKPOINT_NS: i64 = 2_000_000_000;
/// The newest so many are kept, of older ones one in so long, ns: a visit of some time ago makes little more be run
/// again, and a checkpoint is the largest thing that a session holds.
const NEWEST_KEPT: usize = 2;
const OLDER_KEPT_NS: i64 = 8_000_000_000;

/// The filter with its recent past.
#[derive(Debug)]
pub(crate) struct History<F: Replayed<B>, const B: usize> {
    setting: F::Setting,
    filter: F,
    inputs: Inputs<F::Input>,
    /// Number of the input that the filter takes next.
    next: u64,
    /// Oldest first.
    checkpoints: VecDeque<Snapshot<F>>,
    smoothing: Option<Smoothing<F, B>>,
    /// Where the smoother has come to: how many stretches are left.
    way_back: Option<(usize, Box<WayBack<B>>)>,
    /// A visit was used: the trail is to be smoothed and reported again.
    trail_bends: bool,
    /// How many points have been reported.
    points: u64,
    /// Points computed since anything was last reported: revised ones, and new ones.
    revised: Vec<TrackPoint>,
    fresh: Vec<TrackPoint>,
    /// Inputs below this number have been taken before: their outcomes have been reported.
    seen: u64,
    visits: Vec<(Visit, bool)>,
    t_ns: i64,
    /// A stretch of the trail has begun since this was last asked.
    stretch_begun: bool,
    /// Of one that was restored: time of the newest input that it does not know, ns.
    unknown_until_ns: Option<i64>,
    /// A visit would have gone back to before that.
    lacks_past: bool,
}

/// The filter at a moment to which it may be taken back.
#[derive(Clone, Debug)]
struct Snapshot<F> {
    /// Number of the input that it takes next.
    next: u64,
    /// Time of the input before it, ns.
    before_ns: i64,
    /// What had been recorded for the smoother.
    mark: Mark,
    filter: Box<F>,
}

impl<F: Replayed<B>, const B: usize> History<F, B> {
    pub(crate) fn new(
        setting: F::Setting,
        mut filter: F,
        solution: Solution,
        store: Option<Box<dyn InputStore>>,
    ) -> Self {
        let smoothing = match solution {
            Solution::Filtered => None,
            Solution::Trail => Some(Smoothing::new(&mut filter, true)),
            Solution::Smoothed => Some(Smoothing::new(&mut filter, false)),
        };
        let start = Snapshot {
            next: 0,
            before_ns: i64::MIN,
            mark: Mark::default(),
            filter: Box::new(filter.clone()),
        };
        History {
            setting,
            checkpoints: VecDeque::from([start]),
            smoothing,
            way_back: None,
            trail_bends: false,
            filter,
            inputs: Inputs::new(store),
            next: 0,
            points: 0,
            revised: Vec::new(),
            fresh: Vec::new(),
            seen: 0,
            visits: Vec::new(),
            t_ns: i64::MIN,
            stretch_begun: false,
            unknown_until_ns: None,
            lacks_past: false,
        }
    }

    /// The filter as it is now.
    pub(crate) fn filter(&self) -> &F {
        &self.filter
    }

    /// What the filter knows beside its inputs.
    pub(crate) fn setting(&self) -> &F::Setting {
        &self.setting
    }

    /// Number of the epoch of the next input, when it `opens` one or belongs to the last.
    pub(crate) fn next_epoch(&self, opens: bool) -> u64 {
        self.inputs.last().map_or(0, |last| last.epoch() + u64::from(opens))
    }

    #[cfg(test)]
    pub(crate) fn held(&self) -> Held {
        Held {
            inputs: self.inputs.in_memory(),
            checkpoints: self.checkpoints.len(),
            stretches: self.smoothing.as_ref().map_or(0, Smoothing::stretches),
        }
    }

    /// Takes the next input and appends what became known.
    pub(crate) fn push(&mut self, input: F::Input, events: &mut Vec<Event>) {
        self.inputs.push(input);
        self.run(events);
        self.tell(events);
        self.inputs.tidy(self.next);
    }

    /// Takes a visit, for now or for a moment that is past.
    pub(crate) fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        let at_ns = visit.moment_ns();
        if at_ns < self.t_ns {
            // Not as far as there happen to be checkpoints: that depends on when they were taken.
            let held = at_ns >= self.t_ns - self.history_ns();
            self.lacks_past |= held && self.unknown_until_ns.is_some_and(|unknown_ns| at_ns < unknown_ns);
            let checkpoint = self.checkpoints.iter().rposition(|kept| kept.before_ns <= at_ns);
            let checkpoint = checkpoint.filter(|number| {
                let needed = self.checkpoints[*number].next.saturating_sub(1);
                held && self.inputs.bring_back(needed) <= needed
            });
            let Some(checkpoint) = checkpoint else {
                events.push(Event::Visit(VisitOutcome::turned_down(
                    &visit,
                    format!(
                        "it is {:.0} s in the past, more than the history of a live session holds; it will be used when the session is finished and run again",
                        (self.t_ns - at_ns) as f64 * 1e-9
                    ),
                )));
                return;
            };
            self.checkpoints.truncate(checkpoint + 1);
            let kept = &self.checkpoints[checkpoint];
            self.next = kept.next;
            self.filter.clone_from(&kept.filter);
            if let Some(smoothing) = &mut self.smoothing {
                smoothing.cut_back(kept.next, kept.mark);
            }
        }
        let place = self.visits.partition_point(|(other, _)| other.moment_ns() <= at_ns);
        self.visits.insert(place, (visit, false));
        self.run(events);
        // Those before it are what they were, however far back a checkpoint was found.
        let first = self.revised.partition_point(|point| point.t_ns <= at_ns).saturating_sub(1);
        self.revised.drain(..first);
        self.tell(events);
        self.inputs.tidy(self.next);
    }

    /// No more samples come: closes the last epoch and uses what visits are left.
    pub(crate) fn finish(&mut self, events: &mut Vec<Event>) {
        while let Some((visit, _)) = self.visits.get(self.filter.visits_weighed()) {
            if visit.t_start_ns > self.t_ns {
                let late = visit.clone();
                self.filter.set_visits_weighed(self.filter.visits_weighed() + 1);
                events.push(Event::Visit(VisitOutcome::turned_down(
                    &late,
                    "it begins after the end of the log".to_owned(),
                )));
            } else {
                self.apply_visit(events);
            }
        }
        if let Some(last) = self.inputs.last().copied() {
            self.record(last.epoch(), last.t_ns());
        }
        self.tell(events);
        if let Some(smoothing) = self.smoothing.as_mut().filter(|smoothing| !smoothing.is_live()) {
            let source = Source {
                setting: &self.setting,
                inputs: &self.inputs,
                visits: &self.visits,
                next: self.next,
                closed: true,
            };
            if let Some(anew) = smoothing.anew(0, &self.filter, &source) {
                *smoothing = anew;
            }
        }
        self.way_back = match &self.smoothing {
            Some(smoothing) if !smoothing.is_live() => {
                Some((smoothing.stretches(), Box::new(WayBack::new())))
            }
            _ => None,
        };
    }

    /// Smooths the next piece of a session that is finished, from its end to its start; says whether there
    /// was one.
    pub(crate) fn smooth_next(&mut self, events: &mut Vec<Event>) -> bool {
        let (Some(smoothing), Some((left, way))) = (&mut self.smoothing, &mut self.way_back) else {
            return false;
        };
        let Some(number) = left.checked_sub(1) else { return false };
        *left = number;
        let source = Source {
            setting: &self.setting,
            inputs: &self.inputs,
            visits: &self.visits,
            next: self.next,
            closed: true,
        };
        let points = smoothing.go_back(number, way, &source);
        if !points.is_empty() {
            events.push(Event::Revision { points });
        }
        true
    }

    #[cfg(test)]
    pub(crate) fn forget_recordings(&mut self) {
        if let Some(smoothing) = &mut self.smoothing {
            smoothing.forget_recordings();
        }
    }

    /// Smooths what a live session holds of its trail.
    fn bend_trail(&mut self, events: &mut Vec<Event>) {
        let Some(smoothing) = self.smoothing.as_mut().filter(|smoothing| smoothing.is_live()) else { return };
        let in_memory = self.inputs.bring_back(smoothing.oldest().saturating_sub(1));
        let source = Source {
            setting: &self.setting,
            inputs: &self.inputs,
            visits: &self.visits,
            next: self.next,
            closed: false,
        };
        let mut way = WayBack::new();
        let mut pieces = Vec::new();
        let reached = |number: &usize| smoothing.first_input(*number).saturating_sub(1) >= in_memory;
        let first = (0..smoothing.stretches()).rev().take_while(reached).last();
        let Some(first) = first else { return };
        let mut anew = smoothing.anew(first, &self.filter, &source);
        let (smoothing, numbers) = match &mut anew {
            Some(anew) => {
                let numbers = 0..anew.stretches();
                (anew, numbers)
            }
            None => {
                let numbers = first..smoothing.stretches();
                (smoothing, numbers)
            }
        };
        for number in numbers.rev() {
            pieces.push(smoothing.go_back(number, &mut way, &source));
        }
        let points: Vec<TrackPoint> = pieces.into_iter().rev().flatten().collect();
        if !points.is_empty() {
            events.push(Event::Revision { points });
        }
    }

    fn run(&mut self, events: &mut Vec<Event>) {
        while let Some(input) = self.inputs.get(self.next).copied() {
            let t_ns = input.t_ns();
            while self
                .visits
                .get(self.filter.visits_weighed())
                .is_some_and(|(visit, _)| visit.moment_ns() < t_ns)
            {
                self.apply_visit(events);
            }
            // Before the point is reported: after a rewind to here it is reported again.
            let mark = self.mark();
            if input.opens_epoch() && input.epoch() > 0 {
                let closed_ns = self.inputs.get(self.next - 1).map_or(t_ns, Input::t_ns);
                self.record(input.epoch() - 1, closed_ns);
            }
            self.keep_checkpoint(t_ns, mark, events);
            let known = events.len();
            self.filter.step(&self.setting, &input, events);
            if let Some(smoothing) = &mut self.smoothing {
                smoothing.gather(&mut self.filter.eskf_mut().tape);
            }
            if self.next < self.seen {
                events.truncate(known);
            }
            self.next += 1;
            self.seen = self.seen.max(self.next);
            self.t_ns = self.t_ns.max(t_ns);
        }
    }

    /// A visit may be so late, ns.
    fn history_ns(&self) -> i64 {
        (F::history_s(&self.setting) * 1e9) as i64
    }

    fn mark(&self) -> Mark {
        self.smoothing.as_ref().map(Smoothing::mark).unwrap_or_default()
    }

    /// Records for the smoother that a visit has just been weighed.
    fn weighed(&mut self, visit: usize) {
        if let Some(smoothing) = &mut self.smoothing {
            smoothing.weigh(self.next, visit, &mut self.filter.eskf_mut().tape);
        }
    }

    fn apply_visit(&mut self, events: &mut Vec<Event>) {
        let number = self.filter.visits_weighed();
        let (visit, reported) = &mut self.visits[number];
        self.filter.set_visits_weighed(number + 1);
        if !F::uses_visits(&self.setting) {
            // Without the aid the visit still shows how far off the track is.
            let mut without = self.filter.clone();
            let mut outcome = without.weigh(&self.setting, visit, &mut Vec::new());
            outcome.accepted = false;
            outcome.after_minus_marker_n_m = outcome.before_minus_marker_n_m;
            outcome.reason = "markers are not among the aids of this run".to_owned();
            events.push(Event::Visit(outcome));
            self.weighed(number);
            return;
        }
        let mut shown = Vec::new();
        let outcome = self.filter.weigh(&self.setting, visit, &mut shown);
        self.trail_bends |= outcome.accepted;
        if !*reported {
            *reported = true;
            events.append(&mut shown);
            events.push(Event::Visit(outcome));
        }
        self.weighed(number);
    }

    fn record(&mut self, epoch: u64, t_ns: i64) {
        let point = self.filter.point(&self.setting, t_ns);
        if let Some(smoothing) = &mut self.smoothing {
            smoothing.point(&mut self.filter, epoch, &point);
        }
        if epoch < self.points {
            self.revised.push(point);
        } else {
            self.fresh.push(point);
            self.points = epoch + 1;
        }
    }

    fn tell(&mut self, events: &mut Vec<Event>) {
        if !self.revised.is_empty() {
            events.push(Event::Revision { points: std::mem::take(&mut self.revised) });
        }
        events.extend(self.fresh.drain(..).map(Event::Point));
        if std::mem::take(&mut self.trail_bends) {
            self.bend_trail(events);
        }
    }

    fn keep_checkpoint(&mut self, t_ns: i64, mark: Mark, events: &mut Vec<Event>) {
        // After a rewind the checkpoint is retaken, with what has been weighed here by now: so what follows does not depend on
        // how far the rewind went.
        let again = self.next > 0 && self.checkpoints.back().is_some_and(|kept| kept.next == self.next);
        let newest_ns = self.checkpoints.back().map_or(i64::MIN, |kept| kept.filter.t_ns());
        let since_ns = t_ns.saturating_sub(newest_ns);
        if since_ns < CHECKPOINT_NS && !again {
            return;
        }
        if again {
            self.checkpoints.pop_back();
        }
        let afresh = !self.filter.is_sound() && self.start_again(t_ns, events);
        let before = self.next.checked_sub(1).and_then(|before| self.inputs.get(before));
        self.checkpoints.push_back(Snapshot {
            next: self.next,
            before_ns: before.map_or(i64::MIN, Input::t_ns),
            mark,
            filter: Box::new(self.filter.clone()),
        });
        self.thin_checkpoints();
        let oldest_ns = t_ns - self.history_ns();
        while self.checkpoints.len() > 2 && self.checkpoints[1].filter.t_ns() < oldest_ns {
            self.checkpoints.pop_front();
        }
        let oldest = self.checkpoints.front().map_or(self.next, |kept| kept.next);
        let mut oldest_needed = oldest;
        if let Some(smoothing) = &mut self.smoothing {
            self.stretch_begun |= smoothing.consider(self.next, t_ns, &self.filter, afresh);
            oldest_needed = oldest.min(smoothing.oldest());
        }
        // One before it, for the time at which an epoch was closed.
        self.inputs.forget_before(oldest_needed.saturating_sub(1));
    }

    /// Lets the checkpoint go that has just become an older one, where those around it are near enough.
    fn thin_checkpoints(&mut self) {
        let Some(number) = self.checkpoints.len().checked_sub(NEWEST_KEPT + 1) else { return };
        let time = |number: usize| self.checkpoints.get(number).map(|kept| kept.filter.t_ns());
        if let Some((before_ns, after_ns)) = number.checked_sub(1).and_then(time).zip(time(number + 1))
            && after_ns.saturating_sub(before_ns) <= OLDER_KEPT_NS
        {
            self.checkpoints.remove(number);
        }
    }

    /// A NaN or infinity has come into the filter: goes on from the last sound checkpoint, with what is positioned
    /// somewhere near.
    fn start_again(&mut self, t_ns: i64, events: &mut Vec<Event>) -> bool {
        let Some(sound) =
            self.checkpoints.iter().rev().map(|kept| &kept.filter).find(|filter| filter.is_sound())
        else {
            return false;
        };
        let visits_weighed = self.filter.visits_weighed();
        let since_ns = sound.t_ns();
        self.filter.clone_from(sound);
        self.filter.set_visits_weighed(visits_weighed);
        self.filter.lose_all();
        events.push(Event::Anomaly(SensorCause::FilterReset.anomaly(None, [since_ns, t_ns], 0)));
        true
    }
}

/// How much of the past is in memory.
#[cfg(test)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    pub(crate) inputs: u64,
    pub(crate) checkpoints: usize,
    pub(crate) stretches: usize,
}
