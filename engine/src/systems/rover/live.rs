//! What is known while the rover is on its way: each epoch as soon as the base's is there, too.
//!
//! It is the same pass that goes over whole files, and what is stored in the end is computed from all of the readings; so nothing
//! here has to be right for ever, only soon.

use super::arcs::Known;
use super::causes::RoverCause;
use super::computation::{Means, coupled, coupled_anchors};
use super::coupling::{CoupledAnchor, CoupledRange};
use super::differences::Base;
use super::doubts;
use super::pass::{Ground, Pass, SAME_TAG_S};
use super::ranges_alone;
use super::recording::Recorder;
use super::row::{Quality, Row};
use super::run::{Due, Inputs};
use super::told::{Placement, Points};
use super::uwb_alone::{UwbAlone, UwbRange};
use crate::anomaly::Cause as _;
use crate::event::Event;
use crate::geo::Geodetic;
use crate::gnss::time::GpsTime;
use crate::sample::SurveyedAnchor;

/// Epochs from which the time between them is known.
const FIRST_EPOCHS: usize = 3;
/// The base is waited for so long, s.
const WAIT_FOR_BASE_S: f64 = 1.0;
/// An epoch that is missing is waited for so long while ranges go on, s.
const WAIT_FOR_EPOCH_S: f64 = 0.3;
/// Files are doubted when so many epochs or ranges have come, and each time that there are three times as many.
const FIRST_LOOK: usize = 30;

/// A rover on its way.
#[derive(Debug)]
pub(super) struct Live {
    site: Option<Geodetic>,
    surveyed: Vec<SurveyedAnchor>,
    anchors: Vec<CoupledAnchor>,
    ranges: Vec<(GpsTime, CoupledRange)>,
    /// Rows of ranges that were taken.
    taken: usize,
    /// The surveyed anchor of each name of the ranges.
    matched: Vec<Option<usize>>,
    pass: Pass,
    begun: Option<Begun>,
    next_epoch: usize,
    told: usize,
    points: Option<Points>,
    /// Where ranges are all there is.
    alone: UwbAlone,
    waiting: Vec<UwbRange>,
    next_look: usize,
    doubts: Vec<RoverCause>,
    /// Something speaks against the files: nothing is called fixed.
    doubtful: bool,
    /// Ranges are of no use.
    without_ranges: bool,
}

#[derive(Debug)]
struct Begun {
    base: Base,
    interval_s: f64,
    base_interval_s: f64,
    two_bands: bool,
    first: GpsTime,
    last_due: Option<GpsTime>,
}

impl Live {
    pub(super) fn new(means: &Means, site: Option<Geodetic>) -> Live {
        let surveyed = means.instrument.surveyed();
        Live {
            site,
            anchors: coupled_anchors(&surveyed),
            ranges: Vec::new(),
            taken: 0,
            matched: Vec::new(),
            pass: Pass::new(Known::new(), false),
            begun: None,
            next_epoch: 0,
            told: 0,
            points: None,
            alone: UwbAlone::new(surveyed.clone(), ranges_alone::settings(&means.instrument, None)),
            surveyed,
            waiting: Vec::new(),
            next_look: FIRST_LOOK,
            doubts: Vec::new(),
            doubtful: false,
            without_ranges: !means.with_ranges,
        }
    }

    /// How long the way is so far, m.
    pub(super) fn distance_m(&self) -> f64 {
        self.points.as_ref().map_or(0.0, |points| points.distance_m)
    }

    /// Goes on by what the recorder has got.
    pub(super) fn go_on(
        &mut self,
        means: &Means,
        recorder: &Recorder,
        with_satellites: bool,
        events: &mut Vec<Event>,
    ) {
        if !with_satellites {
            return self.by_ranges_alone(recorder, events);
        }
        if self.begun.is_none() {
            self.begin(means, recorder);
        }
        self.look(means, recorder, events);
        let Some(mut begun) = self.begun.take() else { return };
        self.take_ranges(recorder, begun.first);
        while let Some(due) = self.next_due(recorder, &begun) {
            let mut pass = std::mem::take(&mut self.pass);
            let inputs = self.inputs(means, recorder, &begun.base);
            let Begun { base, interval_s, two_bands, first, .. } = &begun;
            let ground = Ground { base, interval_s: *interval_s, two_bands: *two_bands, first: *first };
            pass.go_on(&inputs, &ground, &due, &self.ranges);
            self.pass = pass;
            self.next_epoch += usize::from(due.epoch.is_some());
            begun.last_due = Some(due.time);
            self.tell(&begun.base, recorder, events);
        }
        self.begun = Some(begun);
    }

    fn inputs<'a>(&'a self, means: &'a Means, recorder: &'a Recorder, base: &Base) -> Inputs<'a> {
        Inputs {
            rover: &recorder.recording.rover,
            base: &recorder.recording.base,
            navigation: &recorder.recording.navigation,
            base_place: base.place,
            instrument: &means.instrument,
            systems: &means.systems,
            ranges: &[],
            anchors: &self.anchors,
            doubtful: self.doubtful,
            smoothed: false,
            paper: false,
            initial_position_m: means.initial_position_m,
        }
    }

    fn begin(&mut self, means: &Means, recorder: &Recorder) {
        let recording = &recorder.recording;
        let (rover, navigation) = (&recording.rover, &recording.navigation);
        let told = means.instrument.base.map(|base| base.geodetic());
        let Some(place) = told.or_else(|| recording.base_place()) else { return };
        let known = |epoch: &crate::gnss::observations::Epoch| {
            epoch.satellites.iter().any(|one| navigation.nearest(one.satellite, epoch.time).is_some())
        };
        let some_orbit = rover.epochs.last().is_some_and(known);
        if rover.epochs.len() < FIRST_EPOCHS || recording.base.epochs.is_empty() || !some_orbit {
            return;
        }
        self.begun = Some(Begun {
            base: Base::new(place),
            interval_s: rover.interval_s().unwrap_or(1.0),
            base_interval_s: recording.base.interval_s().unwrap_or(1.0),
            two_bands: rover.has_two_bands() && recording.base.has_two_bands(),
            first: rover.epochs[0].time,
            last_due: None,
        });
    }

    fn match_names(&mut self, recorder: &Recorder) {
        let names = &recorder.ranges().anchors;
        for name in &names[self.matched.len()..] {
            self.matched.push(self.surveyed.iter().position(|anchor| anchor.name == *name));
        }
    }

    fn take_ranges(&mut self, recorder: &Recorder, first: GpsTime) {
        self.match_names(recorder);
        let rows = &recorder.ranges().rows;
        for row in &rows[self.taken..] {
            let Some(anchor) = self.matched[row.anchor].filter(|_| row.range_m.is_finite()) else { continue };
            let t_s = row.t_ns as f64 * 1e-9;
            let time = GpsTime::from_week(first.week(), t_s);
            // One that comes late is used when all is worked out.
            if !self.without_ranges && self.ranges.last().is_none_or(|(last, _)| *last <= time) {
                self.ranges.push((time, CoupledRange { t_s, anchor, range_m: row.range_m }));
            }
        }
        self.taken = rows.len();
    }

    /// The next row that is due: an epoch whose base is there or will not come, or a time of the grid where ranges go on without.
    fn next_due<'a>(&mut self, recorder: &'a Recorder, begun: &Begun) -> Option<Due<'a>> {
        let (rover, base) = (&recorder.recording.rover.epochs, &recorder.recording.base.epochs);
        let late = |time: GpsTime| begun.last_due.is_some_and(|last| time <= last);
        while rover.get(self.next_epoch).is_some_and(|epoch| late(epoch.time)) {
            self.next_epoch += 1;
        }
        let grid = begun.last_due.map(|last| last + begun.interval_s);
        let newest_range = self.ranges.last().map(|(time, _)| *time);
        let Some(epoch) = rover.get(self.next_epoch) else {
            let (grid, newest) = (grid?, newest_range?);
            return (newest.since(grid) >= WAIT_FOR_EPOCH_S).then_some(Due { time: grid, epoch: None });
        };
        if let (Some(grid), Some(last)) = (grid, begun.last_due)
            && epoch.time.since(grid) >= 0.5 * begun.interval_s
        {
            let from = self.ranges.partition_point(|(time, _)| *time <= last);
            if self.ranges.get(from).is_some_and(|(time, _)| *time <= grid) {
                return Some(Due { time: grid, epoch: None });
            }
        }
        let newest = rover.last()?.time.max(newest_range.unwrap_or(epoch.time));
        let base_is_there = base.last().is_some_and(|last| {
            let age_s = epoch.time.since(last.time);
            age_s < SAME_TAG_S || age_s < begun.base_interval_s - SAME_TAG_S
        });
        let given_up = newest.since(epoch.time) >= WAIT_FOR_BASE_S;
        (base_is_there || given_up).then_some(Due { time: epoch.time, epoch: Some(epoch) })
    }

    fn tell(&mut self, base: &Base, recorder: &Recorder, events: &mut Vec<Event>) {
        let site = self.site;
        let points = self
            .points
            .get_or_insert_with(|| Points::new(Placement::new(Some(base.place), site), recorder.zero_ns()));
        for row in &mut self.pass.rows[self.told..] {
            if self.doubtful && row.quality == Quality::Fixed {
                row.quality = Quality::Float;
            }
            let point = points.point(row);
            events.push(Event::Point(point));
        }
        self.told = self.pass.rows.len();
    }

    /// Looks, now and then, at whether what came belongs together.
    fn look(&mut self, means: &Means, recorder: &Recorder, events: &mut Vec<Event>) {
        let epochs = recorder.recording.rover.epochs.len();
        if epochs < self.next_look || !recorder.recording.base.epochs.is_empty() && self.begun.is_none() {
            return;
        }
        self.next_look = 3 * epochs;
        let mut found = Vec::new();
        match &self.begun {
            None => found.push(RoverCause::NotStored { stream: "base".to_owned() }),
            Some(begun) => {
                let inputs = self.inputs(means, recorder, &begun.base);
                found.extend(doubts::before(&inputs, &begun.base));
                let ranges: Vec<CoupledRange> = self.ranges.iter().map(|(_, range)| *range).collect();
                let inputs = Inputs { ranges: &ranges, ..inputs };
                found.extend(doubts::ranges_clock(&inputs, &self.pass.rows));
            }
        }
        if !recorder.ranges().rows.is_empty() && !self.without_ranges {
            match coupled(recorder.ranges(), &self.surveyed) {
                Ok(coupled) => found.extend(coupled.swapped),
                Err(cause) => {
                    self.without_ranges = true;
                    found.push(cause);
                }
            }
        }
        let t_ns = recorder.recording.rover.epochs.last().map_or(0, |last| {
            last.time.ns - GpsTime::from_week(last.time.week(), 0.0).ns + recorder.zero_ns()
        });
        for cause in found {
            self.doubtful = true;
            if !self.doubts.iter().any(|told| told.kind() == cause.kind()) {
                events.push(Event::Anomaly(cause.anomaly(None, [t_ns; 2], 0)));
                self.doubts.push(cause);
            }
        }
    }

    fn by_ranges_alone(&mut self, recorder: &Recorder, events: &mut Vec<Event>) {
        self.match_names(recorder);
        let rows = &recorder.ranges().rows;
        for row in &rows[self.taken..] {
            let Some(anchor) = self.matched[row.anchor] else { continue };
            let range = UwbRange { t_ns: row.t_ns, anchor, range_m: row.range_m };
            match self.waiting.last().map(|last| last.t_ns) {
                // One that comes late is used when all is worked out.
                Some(last_ns) if range.t_ns < last_ns => continue,
                Some(last_ns) if range.t_ns > last_ns => {
                    let at_one_time = std::mem::take(&mut self.waiting);
                    if let Some(found) = self.alone.push(&at_one_time) {
                        let row: Row = ranges_alone::row(&found, false);
                        let points = self.points.get_or_insert_with(|| {
                            Points::new(Placement::new(None, None), recorder.zero_ns())
                        });
                        events.push(Event::Point(points.point(&row)));
                    }
                }
                _ => {}
            }
            self.waiting.push(range);
        }
        self.taken = rows.len();
    }
}
