//! The walk in stretches that can be gone back over: what the smoother runs on.
//!
//! A stretch begins with a copy of the filter. Its recording is either still there, or made again by
//! running the stretch once more, with the same visits at the same steps: that gives the same bits, so memory holds samples rather than covariances.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::filter::{Filter, Setting};
use super::kept_step::KeptStep;
use super::numbered::Numbered;
use super::recording::{Recording, RecordingLength, WayBack};
use super::steps::Steps;
use crate::event::TrackPoint;
use crate::ins::tape::Tape;
use crate::session::Visit;

/// A stretch is this long, ns.
const STRETCH_NS: i64 = 60_000_000_000;
/// So much is kept of recordings, which saves the run to make them again, bytes.
const KEPT_BYTES: usize = 32 << 20;
/// So much of a live walk's past is smoothed at a visit, ns.
pub(super) const TRAIL_NS: i64 = 300_000_000_000;

/// How much had been recorded at a moment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mark {
    weighed: u64,
    recording: RecordingLength,
}

impl Mark {
    /// Nothing recorded; visits below this number have been weighed.
    pub(super) fn before(weighed: u64) -> Mark {
        Mark { weighed, ..Mark::default() }
    }
}

/// The stretches so far.
#[derive(Clone, Debug)]
pub(super) struct Smoothing<const B: usize, const F: usize> {
    stretches: VecDeque<Stretch<B, F>>,
    /// The visits that were weighed, by number, each with the number of the step it came before.
    weighed: Numbered<(u64, usize)>,
    live: bool,
}

#[derive(Clone, Debug)]
struct Stretch<const B: usize, const F: usize> {
    /// Its first step.
    first: u64,
    first_ns: i64,
    first_weighed: u64,
    filter: Box<Filter<B, F>>,
    /// The filter had to be started again: what came before is not known from what comes after.
    afresh: bool,
    recording: Option<Recording<B>>,
}

/// The beginning of a stretch, as it is saved.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct StretchStart<const B: usize, const F: usize> {
    pub(super) first: u64,
    pub(super) first_ns: i64,
    pub(super) first_weighed: u64,
    pub(super) afresh: bool,
    pub(super) filter: Filter<B, F>,
}

/// What a stretch is run again on.
pub(super) struct Source<'a> {
    pub(super) setting: &'a Setting,
    pub(super) steps: &'a Steps,
    pub(super) visits: &'a [(Visit, bool)],
    /// Number of the step after the last.
    pub(super) next: u64,
    /// The last epoch is complete, and told.
    pub(super) closed: bool,
}

impl<const B: usize, const F: usize> Smoothing<B, F> {
    /// For a filter at its start. A `live` one keeps the samples of some minutes, the other all of them,
    /// and the newest recordings.
    pub(super) fn new(filter: &mut Filter<B, F>, live: bool) -> Self {
        filter.eskf.tape.set_recording(!live);
        let mut smoothing = Smoothing { stretches: VecDeque::new(), weighed: Numbered::new(), live };
        smoothing.begin(0, i64::MIN, filter, false);
        smoothing
    }

    /// A live one as it was when this stretch had begun, but for what came before.
    pub(super) fn restored(start: StretchStart<B, F>) -> Self {
        let StretchStart { first, first_ns, first_weighed, afresh, filter } = start;
        let stretch =
            Stretch { first, first_ns, first_weighed, filter: Box::new(filter), afresh, recording: None };
        Smoothing {
            stretches: VecDeque::from([stretch]),
            weighed: Numbered::from(first_weighed, []),
            live: true,
        }
    }

    /// Where the newest stretch began.
    pub(super) fn newest_start(&self) -> Option<StretchStart<B, F>> {
        self.stretches.back().map(|stretch| StretchStart {
            first: stretch.first,
            first_ns: stretch.first_ns,
            first_weighed: stretch.first_weighed,
            afresh: stretch.afresh,
            filter: (*stretch.filter).clone(),
        })
    }

    fn begin(&mut self, first: u64, first_ns: i64, filter: &Filter<B, F>, afresh: bool) {
        if let Some(recording) = self.stretches.back_mut().and_then(|last| last.recording.as_mut()) {
            recording.shrink();
        }
        self.stretches.push_back(Stretch {
            first,
            first_ns,
            first_weighed: self.weighed.end_number(),
            filter: Box::new(filter.clone()),
            afresh,
            recording: (!self.live).then(Recording::new),
        });
        let mut kept_bytes = 0;
        for stretch in self.stretches.iter_mut().rev() {
            kept_bytes += stretch.recording.as_ref().map_or(0, Recording::bytes);
            if kept_bytes > KEPT_BYTES {
                stretch.recording = None;
            }
        }
        while self.live && self.stretches.get(1).is_some_and(|second| first_ns - second.first_ns > TRAIL_NS) {
            self.stretches.pop_front();
        }
        let oldest = self.stretches.front().map_or(0, |stretch| stretch.first_weighed);
        self.weighed.forget_before(oldest);
    }

    /// A checkpoint was taken before the step `first`: a new stretch begins there, when it is time.
    /// Says whether it does.
    pub(super) fn consider(
        &mut self,
        first: u64,
        first_ns: i64,
        filter: &Filter<B, F>,
        afresh: bool,
    ) -> bool {
        if let Some(start) = self.stretches.front_mut()
            && start.first_ns == i64::MIN
        {
            start.first_ns = first_ns;
        }
        let since_ns = self.stretches.back().map_or(i64::MAX, |last| first_ns.saturating_sub(last.first_ns));
        let begins = afresh || since_ns >= STRETCH_NS;
        if begins {
            self.begin(first, first_ns, filter, afresh);
        }
        begins
    }

    /// The oldest step that is needed.
    pub(super) fn oldest(&self) -> u64 {
        self.stretches.front().map_or(0, |stretch| stretch.first)
    }

    pub(super) fn mark(&self) -> Mark {
        Mark {
            weighed: self.weighed.end_number(),
            recording: self.newest().map(Recording::length).unwrap_or_default(),
        }
    }

    fn newest(&self) -> Option<&Recording<B>> {
        self.stretches.back().and_then(|last| last.recording.as_ref())
    }

    /// The filter goes back to before the step `next`, when so much had been recorded.
    pub(super) fn cut_back(&mut self, next: u64, mark: Mark) {
        while self.stretches.len() > 1 && self.stretches.back().is_some_and(|last| last.first >= next) {
            self.stretches.pop_back();
        }
        self.weighed.forget_from(mark.weighed);
        if let Some(recording) = self.stretches.back_mut().and_then(|last| last.recording.as_mut()) {
            recording.cut_back(mark.recording);
        }
    }

    /// The visit of that number was weighed before the step `next`.
    pub(super) fn weigh(&mut self, next: u64, visit: usize, tape: &mut Tape) {
        self.weighed.push((next, visit));
        self.gather(tape);
    }

    /// Takes what the filter has taken down.
    #[inline]
    pub(super) fn gather(&mut self, tape: &mut Tape) {
        match self.stretches.back_mut().and_then(|last| last.recording.as_mut()) {
            Some(recording) => recording.gather(tape),
            None => tape.cut_back(Default::default()),
        }
    }

    pub(super) fn point(&mut self, filter: &mut Filter<B, F>, epoch: u64, point: &TrackPoint) {
        if let Some(recording) = self.stretches.back_mut().and_then(|last| last.recording.as_mut()) {
            recording.point(filter, epoch, point);
        }
    }

    /// Whether it holds a live walk's trail, not a whole walk.
    pub(super) fn is_live(&self) -> bool {
        self.live
    }

    /// Lets the recordings go: every stretch will be run again.
    #[cfg(test)]
    pub(super) fn forget_recordings(&mut self) {
        for stretch in &mut self.stretches {
            stretch.recording = None;
        }
    }

    /// The first step of the stretch of that number.
    pub(super) fn first_step(&self, number: usize) -> u64 {
        self.stretches.get(number).map_or(0, |stretch| stretch.first)
    }

    /// How many stretches there are.
    pub(super) fn stretches(&self) -> usize {
        self.stretches.len()
    }

    /// Goes back over the stretch of that number; the later ones have been gone over.
    pub(super) fn go_back(
        &mut self,
        number: usize,
        way: &mut WayBack<B>,
        source: &Source<'_>,
    ) -> Vec<TrackPoint> {
        let Some(stretch) = self.stretches.get_mut(number) else { return Vec::new() };
        let kept = stretch.recording.take();
        let stretch = &self.stretches[number];
        let recording = kept.unwrap_or_else(|| self.run_again(number, source));
        let points = recording.go_back(way, &stretch.filter, source.setting);
        if stretch.afresh {
            *way = WayBack::new();
        }
        points
    }

    fn run_again(&self, number: usize, source: &Source<'_>) -> Recording<B> {
        let stretch = &self.stretches[number];
        let (end, end_weighed, closed) = match self.stretches.get(number + 1) {
            Some(next) => (
                next.first,
                next.first_weighed,
                source.steps.get(next.first).is_some_and(KeptStep::opens_epoch),
            ),
            None => (source.next, self.weighed.end_number(), source.closed),
        };
        let mut filter = (*stretch.filter).clone();
        filter.eskf.tape.set_recording(true);
        let mut recording = Recording::new();
        let mut told = Vec::new();
        let mut weighed = stretch.first_weighed;
        for next in stretch.first..=end {
            while let Some((_, visit)) =
                self.weighed.get(weighed).filter(|(before, _)| *before == next && weighed < end_weighed)
            {
                filter.weigh_again(source, *visit);
                weighed += 1;
                recording.gather(&mut filter.eskf.tape);
            }
            let step = source.steps.get(next).filter(|_| next < end);
            let closes = step.map_or(closed, |step| step.opens_epoch() && next > stretch.first);
            if closes && let Some(before) = next.checked_sub(1).and_then(|before| source.steps.get(before)) {
                let point = filter.point(source.setting, before.t_ns);
                recording.point(&mut filter, before.epoch(), &point);
            }
            if let Some(step) = step {
                filter.step(source.setting, &step.step(), &mut told);
                recording.gather(&mut filter.eskf.tape);
                told.clear();
            }
        }
        recording
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    fn weigh_again(&mut self, source: &Source<'_>, number: usize) {
        self.visits_applied = number + 1;
        if source.setting.aids.markers
            && let Some((visit, _)) = source.visits.get(number)
        {
            self.apply_visit(source.setting, visit, visit.moment_ns());
        }
    }
}
