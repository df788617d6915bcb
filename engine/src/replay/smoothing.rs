//! A session in stretches that can be gone back over: what the smoother runs on.
//!
//! A stretch begins with a copy of the filter. Its recording is either still there, or made again by
//! running the stretch once more, with the same visits at the same steps: that gives the same bits, so memory holds inputs rather than covariances.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::filter::{Input, Replayed};
use super::inputs::Inputs;
use super::numbered_queue::NumberedQueue;
use super::recording::{Recording, RecordingLength, WayBack};
use crate::event::TrackPoint;
use crate::ins::tape::Tape;
use crate::visit::Visit;

/// A stretch is this long, ns.
const STRETCH_NS: i64 = 60_000_000_000;
/// So much is kept of recordings, which saves the run to make them again, bytes.
const KEPT_BYTES: usize = 32 << 20;
/// What is found out is put into the beginning at most so often.
const MOST_TIMES_ANEW: usize = 3;
/// So much of a live session's past is smoothed at a visit, ns.
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
pub(super) struct Smoothing<F: Replayed<B>, const B: usize> {
    stretches: VecDeque<Stretch<F, B>>,
    /// The visits that were weighed, by number, each with the number of the input it came before.
    weighed: NumberedQueue<(u64, usize)>,
    live: bool,
}

#[derive(Clone, Debug)]
struct Stretch<F: Replayed<B>, const B: usize> {
    /// Its first input.
    first: u64,
    first_ns: i64,
    first_weighed: u64,
    filter: Box<F>,
    /// The filter had to be started again: what came before is not known from what comes after.
    afresh: bool,
    recording: Option<Recording<F, B>>,
}

/// The beginning of a stretch, as it is saved.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct StretchStart<F> {
    pub(super) first: u64,
    pub(super) first_ns: i64,
    pub(super) first_weighed: u64,
    pub(super) afresh: bool,
    pub(super) filter: F,
}

/// What a stretch is run again on.
pub(super) struct Source<'a, F: Replayed<B>, const B: usize> {
    pub(super) setting: &'a F::Setting,
    pub(super) inputs: &'a Inputs<F::Input>,
    pub(super) visits: &'a [(Visit, bool)],
    /// Number of the input after the last.
    pub(super) next: u64,
    /// The last epoch is complete, and told.
    pub(super) closed: bool,
}

impl<F: Replayed<B>, const B: usize> Smoothing<F, B> {
    /// For a filter at its start. A `live` one keeps the inputs of some minutes, the other all of them,
    /// and the newest recordings.
    pub(super) fn new(filter: &mut F, live: bool) -> Self {
        filter.eskf_mut().tape.set_recording(!live);
        let mut smoothing = Smoothing { stretches: VecDeque::new(), weighed: NumberedQueue::new(), live };
        smoothing.begin(0, i64::MIN, filter, false);
        smoothing
    }

    /// A live one as it was when this stretch had begun, but for what came before.
    pub(super) fn restored(start: StretchStart<F>) -> Self {
        let StretchStart { first, first_ns, first_weighed, afresh, filter } = start;
        let stretch =
            Stretch { first, first_ns, first_weighed, filter: Box::new(filter), afresh, recording: None };
        Smoothing {
            stretches: VecDeque::from([stretch]),
            weighed: NumberedQueue::from(first_weighed, []),
            live: true,
        }
    }

    /// Where the newest stretch began.
    pub(super) fn newest_start(&self) -> Option<StretchStart<F>> {
        self.stretches.back().map(|stretch| StretchStart {
            first: stretch.first,
            first_ns: stretch.first_ns,
            first_weighed: stretch.first_weighed,
            afresh: stretch.afresh,
            filter: (*stretch.filter).clone(),
        })
    }

    fn begin(&mut self, first: u64, first_ns: i64, filter: &F, afresh: bool) {
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
        self.let_recordings_go();
        while self.live && self.stretches.get(1).is_some_and(|second| first_ns - second.first_ns > TRAIL_NS) {
            self.stretches.pop_front();
        }
        let oldest = self.stretches.front().map_or(0, |stretch| stretch.first_weighed);
        self.weighed.forget_before(oldest);
    }

    /// Keeps the newest recordings, as far as there is room.
    fn let_recordings_go(&mut self) {
        let mut kept_bytes = 0;
        for stretch in self.stretches.iter_mut().rev() {
            kept_bytes += stretch.recording.as_ref().map_or(0, Recording::bytes);
            if kept_bytes > KEPT_BYTES {
                stretch.recording = None;
            }
        }
    }

    /// A checkpoint was taken before the input `first`: a new stretch begins there, when it is time.
    /// Says whether it does.
    pub(super) fn consider(&mut self, first: u64, first_ns: i64, filter: &F, afresh: bool) -> bool {
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

    /// The oldest input that is needed.
    pub(super) fn oldest(&self) -> u64 {
        self.stretches.front().map_or(0, |stretch| stretch.first)
    }

    pub(super) fn mark(&self) -> Mark {
        Mark {
            weighed: self.weighed.end_number(),
            recording: self.newest().map(Recording::length).unwrap_or_default(),
        }
    }

    fn newest(&self) -> Option<&Recording<F, B>> {
        self.stretches.back().and_then(|last| last.recording.as_ref())
    }

    /// The filter goes back to before the input `next`, when so much had been recorded.
    pub(super) fn cut_back(&mut self, next: u64, mark: Mark) {
        while self.stretches.len() > 1 && self.stretches.back().is_some_and(|last| last.first >= next) {
            self.stretches.pop_back();
        }
        self.weighed.forget_from(mark.weighed);
        if let Some(recording) = self.stretches.back_mut().and_then(|last| last.recording.as_mut()) {
            recording.cut_back(mark.recording);
        }
    }

    /// The visit of that number was weighed before the input `next`.
    pub(super) fn weigh(&mut self, next: u64, visit: usize, tape: &mut Tape) {
        self.weighed.push((next, visit));
        self.gather(tape);
    }

    /// Takes what the filter has recorded.
    #[inline]
    pub(super) fn gather(&mut self, tape: &mut Tape) {
        match self.stretches.back_mut().and_then(|last| last.recording.as_mut()) {
            Some(recording) => recording.gather(tape),
            None => tape.cut_back(Default::default()),
        }
    }

    pub(super) fn point(&mut self, filter: &mut F, epoch: u64, point: &TrackPoint) {
        if let Some(recording) = self.stretches.back_mut().and_then(|last| last.recording.as_mut()) {
            recording.point(filter, epoch, point);
        }
    }

    /// Whether it holds a live session's trail, not a whole session.
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

    /// The first input of the stretch of that number.
    pub(super) fn first_input(&self, number: usize) -> u64 {
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
        source: &Source<'_, F, B>,
    ) -> Vec<TrackPoint> {
        let Some(stretch) = self.stretches.get_mut(number) else { return Vec::new() };
        let kept = stretch.recording.take();
        let stretch = &self.stretches[number];
        let recording = kept.unwrap_or_else(|| self.run_again(number, (*stretch.filter).clone(), source).0);
        let points = recording.go_back(way, &stretch.filter, source.setting);
        if stretch.afresh {
            *way = WayBack::new();
        }
        points
    }

    /// The stretches from number `from` on, with what `end`, the filter at their end, has found out put into their
    /// beginnings, and run again; `None` where there is nothing of that kind.
    ///
    /// What is found out so may change what there is to be found: the walk runs on until there is no more.
    pub(super) fn anew(&self, from: usize, end: &F, source: &Source<'_, F, B>) -> Option<Self> {
        let mut filter = (*self.stretches.get(from)?.filter).clone();
        if !end.teach(source.setting, &mut filter) {
            return None;
        }
        let mut anew = None;
        for _ in 0..MOST_TIMES_ANEW {
            let start = filter.clone();
            let (smoothing, end) = self.run_all(from, filter, source);
            anew = Some(smoothing);
            filter = start;
            if !end.teach(source.setting, &mut filter) {
                break;
            }
        }
        anew
    }

    /// The same stretches from number `from` on, which begins as `filter`; and the filter at the end.
    fn run_all(&self, from: usize, mut filter: F, source: &Source<'_, F, B>) -> (Self, F) {
        let mut all =
            Smoothing { stretches: VecDeque::new(), weighed: self.weighed.clone(), live: self.live };
        for number in from..self.stretches.len() {
            let of = &self.stretches[number];
            let start = filter.clone();
            let (recording, end) = self.run_again(number, filter, source);
            filter = end;
            all.stretches.push_back(Stretch {
                filter: Box::new(start),
                recording: Some(recording),
                afresh: of.afresh,
                ..*of
            });
            all.let_recordings_go();
        }
        (all, filter)
    }

    /// Runs over the stretch of that number, beginning as `filter`; gives it as it is at the end, too.
    fn run_again(&self, number: usize, mut filter: F, source: &Source<'_, F, B>) -> (Recording<F, B>, F) {
        let stretch = &self.stretches[number];
        let (end, end_weighed, closed) = match self.stretches.get(number + 1) {
            Some(next) => (
                next.first,
                next.first_weighed,
                source.inputs.get(next.first).is_some_and(Input::opens_epoch),
            ),
            None => (source.next, self.weighed.end_number(), source.closed),
        };
        filter.eskf_mut().tape.set_recording(true);
        let mut recording = Recording::new();
        let mut events = Vec::new();
        let mut weighed = stretch.first_weighed;
        for next in stretch.first..=end {
            while let Some((_, visit)) =
                self.weighed.get(weighed).filter(|(before, _)| *before == next && weighed < end_weighed)
            {
                weigh_again(&mut filter, source, *visit);
                weighed += 1;
                recording.gather(&mut filter.eskf_mut().tape);
            }
            let input = source.inputs.get(next).filter(|_| next < end);
            let closes = input.map_or(closed, |input| input.opens_epoch() && next > stretch.first);
            if closes && let Some(before) = next.checked_sub(1).and_then(|before| source.inputs.get(before)) {
                let point = filter.point(source.setting, before.t_ns());
                recording.point(&mut filter, before.epoch(), &point);
            }
            if let Some(input) = input {
                filter.step(source.setting, input, &mut events);
                recording.gather(&mut filter.eskf_mut().tape);
                events.clear();
            }
        }
        (recording, filter)
    }
}

fn weigh_again<F: Replayed<B>, const B: usize>(filter: &mut F, source: &Source<'_, F, B>, number: usize) {
    filter.set_visits_weighed(number + 1);
    if F::uses_visits(source.setting)
        && let Some((visit, _)) = source.visits.get(number)
    {
        filter.weigh(source.setting, visit, &mut Vec::new());
    }
}
