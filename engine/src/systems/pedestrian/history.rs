//! Runs the filter over what has come, remembers enough to go back, and tells what changed.
//!
//! A late visit applies to a past moment: the filter of that moment is taken out of memory, updated, and what
//! came since is run again. As nothing but the samples decides what happens, running again gives the same
//! bits.

use std::collections::VecDeque;

use super::filter::{Filter, Setting};
use super::foot::Step;
use super::kept_step::KeptStep;
use super::recording::WayBack;
use super::smoothing::{Mark, Smoothing, Source, TRAIL_NS};
use super::steps::{Attic, Steps};
use crate::event::{Event, TrackPoint, VisitOutcome};
use crate::session::{SensorState, Solution, Visit};
use crate::trouble::Trouble;

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
pub(crate) struct History<const B: usize, const F: usize> {
    setting: Setting,
    filter: Filter<B, F>,
    steps: Steps,
    /// Number of the step that the filter takes next.
    next: u64,
    /// Oldest first.
    checkpoints: VecDeque<Snapshot<B, F>>,
    smoothing: Option<Smoothing<B, F>>,
    /// Where the smoother has come to: how many stretches are left.
    way_back: Option<(usize, Box<WayBack<B>>)>,
    /// A visit was used: the trail is to be told anew.
    trail_bends: bool,
    /// How many points have been told.
    told_points: u64,
    /// Points that have been computed since anything was last told: told ones anew, and new ones.
    revised: Vec<TrackPoint>,
    fresh: Vec<TrackPoint>,
    /// Steps below this number have been taken before: their outcomes have been told.
    seen: u64,
    visits: Vec<(Visit, bool)>,
    t_ns: i64,
    /// A stretch of the trail has begun since somebody last asked.
    stretch_begun: bool,
    /// Of one that was restored: time of the newest step that it does not know, ns.
    unknown_until_ns: Option<i64>,
    /// A visit would have gone back to before that.
    lacks_past: bool,
}

/// The filter at a moment to which it may be taken back.
#[derive(Clone, Debug)]
struct Snapshot<const B: usize, const F: usize> {
    /// Number of the step that it takes next.
    next: u64,
    /// Time of the step before it, ns.
    before_ns: i64,
    /// What had been recorded for the smoother.
    mark: Mark,
    filter: Box<Filter<B, F>>,
}

impl<const B: usize, const F: usize> History<B, F> {
    pub(crate) fn new(
        setting: Setting,
        mut filter: Filter<B, F>,
        solution: Solution,
        attic: Option<Box<dyn Attic>>,
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
            steps: Steps::new(attic),
            next: 0,
            told_points: 0,
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
    pub(crate) fn filter(&self) -> &Filter<B, F> {
        &self.filter
    }

    /// What the filter believes of its sensors now.
    pub(crate) fn sensors(&self) -> Vec<SensorState> {
        self.filter.sensors(&self.setting)
    }

    #[cfg(test)]
    pub(crate) fn held(&self) -> Held {
        Held {
            steps: self.steps.in_memory(),
            checkpoints: self.checkpoints.len(),
            stretches: self.smoothing.as_ref().map_or(0, Smoothing::stretches),
        }
    }

    /// Takes the next sample and appends what became known.
    pub(crate) fn push(&mut self, step: Step, told: &mut Vec<Event>) {
        let epoch = match self.steps.last() {
            Some(last) => last.epoch() + u64::from(step.opens_epoch),
            None => 0,
        };
        self.steps.push(KeptStep::new(&step, epoch));
        self.run(told);
        self.tell(told);
        self.steps.tidy(self.next);
    }

    /// Takes a visit, for now or for a moment that is past.
    pub(crate) fn visit(&mut self, visit: Visit, told: &mut Vec<Event>) {
        let at_ns = visit.moment_ns();
        if at_ns < self.t_ns {
            // Not as far as there happen to be checkpoints: that depends on when they were taken.
            let held = at_ns >= self.t_ns - self.history_ns();
            self.lacks_past |= held && self.unknown_until_ns.is_some_and(|unknown_ns| at_ns < unknown_ns);
            let checkpoint = self.checkpoints.iter().rposition(|kept| kept.before_ns <= at_ns);
            let checkpoint = checkpoint.filter(|number| {
                let needed = self.checkpoints[*number].next.saturating_sub(1);
                held && self.steps.bring_back(needed) <= needed
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
            let kept = &self.checkpoints[checkpoint];
            self.next = kept.next;
            self.filter.clone_from(&kept.filter);
            if let Some(smoothing) = &mut self.smoothing {
                smoothing.cut_back(kept.next, kept.mark);
            }
        }
        let place = self.visits.partition_point(|(other, _)| other.moment_ns() <= at_ns);
        self.visits.insert(place, (visit, false));
        self.run(told);
        // Those before it are what they were, however far back a checkpoint was found.
        let first = self.revised.partition_point(|point| point.t_ns <= at_ns).saturating_sub(1);
        self.revised.drain(..first);
        self.tell(told);
        self.steps.tidy(self.next);
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
            self.record(last.epoch(), last.t_ns);
        }
        self.tell(told);
        self.way_back = match &self.smoothing {
            Some(smoothing) if !smoothing.is_live() => {
                Some((smoothing.stretches(), Box::new(WayBack::new())))
            }
            _ => None,
        };
    }

    /// Smooths the next piece of a walk that is finished, from its end to its start; says whether there
    /// was one.
    pub(crate) fn smooth_next(&mut self, told: &mut Vec<Event>) -> bool {
        let (Some(smoothing), Some((left, way))) = (&mut self.smoothing, &mut self.way_back) else {
            return false;
        };
        let Some(number) = left.checked_sub(1) else { return false };
        *left = number;
        let source = Source {
            setting: &self.setting,
            steps: &self.steps,
            visits: &self.visits,
            next: self.next,
            closed: true,
        };
        let points = smoothing.go_back(number, way, &source);
        if !points.is_empty() {
            told.push(Event::Revision { points });
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
    fn bend_trail(&mut self, told: &mut Vec<Event>) {
        let Some(smoothing) = self.smoothing.as_mut().filter(|smoothing| smoothing.is_live()) else { return };
        let in_memory = self.steps.bring_back(smoothing.oldest().saturating_sub(1));
        let source = Source {
            setting: &self.setting,
            steps: &self.steps,
            visits: &self.visits,
            next: self.next,
            closed: false,
        };
        let mut way = WayBack::new();
        let mut pieces = Vec::new();
        let reached = |number: &usize| smoothing.first_step(*number).saturating_sub(1) >= in_memory;
        let numbers: Vec<usize> = (0..smoothing.stretches()).rev().take_while(reached).collect();
        for number in numbers {
            pieces.push(smoothing.go_back(number, &mut way, &source));
        }
        let points: Vec<TrackPoint> = pieces.into_iter().rev().flatten().collect();
        if !points.is_empty() {
            told.push(Event::Revision { points });
        }
    }

    fn run(&mut self, told: &mut Vec<Event>) {
        while let Some(entry) = self.steps.get(self.next).copied() {
            let step = entry.step();
            while self
                .visits
                .get(self.filter.visits_applied)
                .is_some_and(|(visit, _)| visit.moment_ns() < step.t_ns)
            {
                self.apply_visit(told);
            }
            // Before the point is told: whoever comes back here tells it again.
            let mark = self.mark();
            if step.opens_epoch && entry.epoch() > 0 {
                let closed_ns = self.steps.get(self.next - 1).map_or(step.t_ns, |before| before.t_ns);
                self.record(entry.epoch() - 1, closed_ns);
            }
            self.keep_checkpoint(step.t_ns, mark, told);
            let known = told.len();
            self.filter.step(&self.setting, &step, told);
            if let Some(smoothing) = &mut self.smoothing {
                smoothing.gather(&mut self.filter.eskf.tape);
            }
            if self.next < self.seen {
                told.truncate(known);
            }
            self.next += 1;
            self.seen = self.seen.max(self.next);
            self.t_ns = self.t_ns.max(step.t_ns);
        }
    }

    /// A visit may be so late, ns.
    fn history_ns(&self) -> i64 {
        (self.setting.tuning.history_s * 1e9) as i64
    }

    fn mark(&self) -> Mark {
        self.smoothing.as_ref().map(Smoothing::mark).unwrap_or_default()
    }

    /// Takes down for the smoother that a visit has just been weighed.
    fn weighed(&mut self, visit: usize) {
        if let Some(smoothing) = &mut self.smoothing {
            smoothing.weigh(self.next, visit, &mut self.filter.eskf.tape);
        }
    }

    fn apply_visit(&mut self, told: &mut Vec<Event>) {
        let number = self.filter.visits_applied;
        let (visit, told_before) = &mut self.visits[number];
        self.filter.visits_applied += 1;
        if !self.setting.aids.markers {
            // Without the aid the visit still shows how far off the track is.
            let mut without = self.filter.clone();
            let mut outcome = without.apply_visit(&self.setting, visit, visit.moment_ns());
            outcome.accepted = false;
            outcome.after_minus_marker_n_m = outcome.before_minus_marker_n_m;
            outcome.reason = "markers are not among the aids of this run".to_owned();
            told.push(Event::Visit(outcome));
            self.weighed(number);
            return;
        }
        let outcome = self.filter.apply_visit(&self.setting, visit, visit.moment_ns());
        self.trail_bends |= outcome.accepted;
        if !*told_before {
            *told_before = true;
            told.push(Event::Visit(outcome));
        }
        self.weighed(number);
    }

    fn record(&mut self, epoch: u64, t_ns: i64) {
        let point = self.filter.point(&self.setting, t_ns);
        if let Some(smoothing) = &mut self.smoothing {
            smoothing.point(&mut self.filter, epoch, &point);
        }
        if epoch < self.told_points {
            self.revised.push(point);
        } else {
            self.fresh.push(point);
            self.told_points = epoch + 1;
        }
    }

    fn tell(&mut self, told: &mut Vec<Event>) {
        if !self.revised.is_empty() {
            told.push(Event::Revision { points: std::mem::take(&mut self.revised) });
        }
        told.extend(self.fresh.drain(..).map(Event::Point));
        if std::mem::take(&mut self.trail_bends) {
            self.bend_trail(told);
        }
    }

    fn keep_checkpoint(&mut self, t_ns: i64, mark: Mark, told: &mut Vec<Event>) {
        // Whoever has gone back to this very checkpoint takes it again, with what was weighed here by now; so what follows
        // does not depend on how far back one went.
        let again = self.next > 0 && self.checkpoints.back().is_some_and(|kept| kept.next == self.next);
        let newest_ns = self.checkpoints.back().map_or(i64::MIN, |kept| time_of(&kept.filter));
        let since_ns = t_ns.saturating_sub(newest_ns);
        if since_ns < CHECKPOINT_NS && !again {
            return;
        }
        if again {
            self.checkpoints.pop_back();
        }
        let afresh = !self.filter.is_sound() && self.start_again(t_ns, told);
        let before = self.next.checked_sub(1).and_then(|before| self.steps.get(before));
        self.checkpoints.push_back(Snapshot {
            next: self.next,
            before_ns: before.map_or(i64::MIN, |before| before.t_ns),
            mark,
            filter: Box::new(self.filter.clone()),
        });
        self.thin_checkpoints();
        let oldest_ns = t_ns - self.history_ns();
        while self.checkpoints.len() > 2 && time_of(&self.checkpoints[1].filter) < oldest_ns {
            self.checkpoints.pop_front();
        }
        let oldest = self.checkpoints.front().map_or(self.next, |kept| kept.next);
        let mut oldest_needed = oldest;
        if let Some(smoothing) = &mut self.smoothing {
            self.stretch_begun |= smoothing.consider(self.next, t_ns, &self.filter, afresh);
            oldest_needed = oldest.min(smoothing.oldest());
        }
        // One before it, for the time at which an epoch was closed.
        self.steps.forget_before(oldest_needed.saturating_sub(1));
    }

    /// Lets the checkpoint go that has just become an older one, where those around it are near enough.
    fn thin_checkpoints(&mut self) {
        let Some(number) = self.checkpoints.len().checked_sub(NEWEST_KEPT + 1) else { return };
        let time = |number: usize| self.checkpoints.get(number).map(|kept| time_of(&kept.filter));
        if let Some((before_ns, after_ns)) = number.checked_sub(1).and_then(time).zip(time(number + 1))
            && after_ns.saturating_sub(before_ns) <= OLDER_KEPT_NS
        {
            self.checkpoints.remove(number);
        }
    }

    /// A number that is none has come into the filter: goes on from the last sound checkpoint, with
    /// the feet somewhere near.
    fn start_again(&mut self, t_ns: i64, told: &mut Vec<Event>) -> bool {
        let Some(sound) =
            self.checkpoints.iter().rev().map(|kept| &kept.filter).find(|filter| filter.is_sound())
        else {
            return false;
        };
        let visits_applied = self.filter.visits_applied;
        let since_ns = time_of(sound);
        self.filter.clone_from(sound);
        self.filter.visits_applied = visits_applied;
        for foot in &mut self.filter.feet {
            foot.lost = true;
        }
        told.push(Event::Anomaly(Trouble::FilterReset.anomaly(None, [since_ns, t_ns], 0)));
        true
    }
}

/// How much of the past is in memory.
#[cfg(test)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    pub(crate) steps: u64,
    pub(crate) checkpoints: usize,
    pub(crate) stretches: usize,
}

fn time_of<const B: usize, const F: usize>(filter: &Filter<B, F>) -> i64 {
    filter.feet.iter().map(|foot| foot.t_ns).max().unwrap_or(i64::MIN)
}

/// The outcome of a visit that could not be weighed at all.
fn turned_down(visit: &Visit, reason: String) -> VisitOutcome {
    VisitOutcome {
        marker: visit.marker.clone(),
        t_ns: visit.moment_ns(),
        before_minus_marker_n_m: [f64::NAN; 3],
        after_minus_marker_n_m: [f64::NAN; 3],
        nis: f64::NAN,
        degrees_of_freedom: 0,
        accepted: false,
        reason,
    }
}
