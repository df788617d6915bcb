//! A whole run: rover, base and navigation in, rows and a report out.

use super::arcs::Known;
use super::causes::RoverCause;
use super::coupling::{CoupledAnchor, CoupledRange, Coupling};
use super::differences::{Base, Pair};
use super::doubts;
use super::instrument::{AmbiguityMode, Instrument};
use super::paper;
use super::pass::{BaseCursor, Ground, Pass, row, start};
use super::row::{Quality, Row};
use crate::geo::Geodetic;
use crate::gnss::ephemeris::Navigation;
use crate::gnss::observations::{Epoch, Observations};
use crate::gnss::satellite::Constellation;
use crate::gnss::time::GpsTime;

/// The oldest base epoch that is used, s.
pub const OLDEST_BASE_S: f64 = 30.0;

/// What a run takes.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The rover's observations.
    pub rover: &'a Observations,
    /// The base's.
    pub base: &'a Observations,
    /// Orbits and clocks.
    pub navigation: &'a Navigation,
    /// The base's antenna.
    pub base_place: Geodetic,
    /// What is known beforehand.
    pub instrument: &'a Instrument,
    /// Systems to use.
    pub systems: &'a [Constellation],
    /// Ranges, in order of time.
    pub ranges: &'a [CoupledRange],
    /// Their anchors.
    pub anchors: &'a [CoupledAnchor],
    /// Something speaks against the files: nothing is called fixed.
    pub doubtful: bool,
    /// Each row by all observations.
    pub smoothed: bool,
    /// By the straight reading of the paper.
    pub paper: bool,
    /// Where the rover begins, e n u, m.
    pub initial_position_m: Option<[f64; 3]>,
}

/// What a run came to know of an anchor.
#[derive(Clone, Debug, PartialEq)]
pub struct AnchorOutcome {
    /// Its name.
    pub anchor: String,
    /// What its ranges have too much, m.
    pub bias_m: f64,
    /// Standard deviation of the bias, m.
    pub sigma_m: f64,
    /// Ranges used.
    pub used: usize,
    /// Ranges rejected.
    pub rejected: usize,
}

/// What a run gives.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One for each epoch.
    pub rows: Vec<Row>,
    /// Slips, told and found.
    pub slips: usize,
    /// Anchors with what was learnt of them.
    pub anchors: Vec<AnchorOutcome>,
    /// Ranges' clock minus GPS time, s, and its sigma.
    pub clock_offset_s: Option<[f64; 2]>,
    /// What was odd.
    pub anomalies: Vec<RoverCause>,
}

/// A time at which a row is due.
#[derive(Clone, Copy, Debug)]
pub(super) struct Due<'a> {
    pub(super) time: GpsTime,
    /// The rover's epoch; none where the receiver wrote none.
    pub(super) epoch: Option<&'a Epoch>,
}

/// The rover's epochs, and the same grid where the receiver wrote none but ranges came.
fn due<'a>(inputs: &Inputs<'a>, interval_s: f64, ranges: &[(GpsTime, CoupledRange)]) -> Vec<Due<'a>> {
    let mut all = Vec::with_capacity(inputs.rover.epochs.len());
    let some_range = |from: GpsTime, to: GpsTime| {
        let first = ranges.partition_point(|(time, _)| *time <= from);
        ranges.get(first).is_some_and(|(time, _)| *time <= to)
    };
    let fill = |all: &mut Vec<Due<'a>>, mut time: GpsTime, until: GpsTime| loop {
        let next = time + interval_s;
        if until.since(next) < 0.5 * interval_s {
            break;
        }
        if some_range(time, next) {
            all.push(Due { time: next, epoch: None });
        }
        time = next;
    };
    let mut last: Option<GpsTime> = None;
    for epoch in &inputs.rover.epochs {
        if let Some(last) = last {
            fill(&mut all, last, epoch.time);
        }
        all.push(Due { time: epoch.time, epoch: Some(epoch) });
        last = Some(epoch.time);
    }
    if let (Some(last), Some((until, _))) = (last, ranges.last()) {
        fill(&mut all, last, *until + 1.01 * interval_s);
    }
    all
}

/// Works a run out.
pub fn run(inputs: &Inputs<'_>) -> Outcome {
    if inputs.paper {
        return by_paper(inputs);
    }
    let first = once(inputs, Known::new(), false);
    if !inputs.smoothed || inputs.instrument.ambiguities.mode == AmbiguityMode::Epoch {
        return first.0;
    }
    // Once more with the whole cycles that are known by the end, from where each arc began.
    once(inputs, first.1, true).0
}

/// Works a run out by the straight reading of the paper, an epoch at a time.
fn by_paper(inputs: &Inputs<'_>) -> Outcome {
    let mut outcome = Outcome::default();
    let Some(first) = inputs.rover.epochs.first() else { return outcome };
    let base = Base::new(inputs.base_place);
    let interval_s = inputs.rover.interval_s().unwrap_or(1.0);
    let doubts = doubts::before(inputs, &base);
    let setting = paper::Setting {
        base: &base,
        navigation: inputs.navigation,
        systems: inputs.systems,
        instrument: inputs.instrument,
        anchors: inputs.anchors,
        two_bands: inputs.rover.has_two_bands() && inputs.base.has_two_bands(),
    };
    let ranges = timed(inputs.ranges, first.time);
    let mut bases = BaseCursor::default();
    let mut last_ranges = vec![None; inputs.anchors.len()];
    let coupling = Coupling::new(inputs.anchors.to_vec(), &inputs.instrument.uwb);
    let mut at: Option<[f64; 3]> = inputs.initial_position_m;
    for due in due(inputs, interval_s, &ranges) {
        let from = ranges.partition_point(|(time, _)| due.time.since(*time) > 0.5 * interval_s);
        let to = ranges.partition_point(|(time, _)| due.time.since(*time) > -0.5 * interval_s);
        let near: Vec<CoupledRange> = ranges[from..to].iter().map(|(_, range)| *range).collect();
        let near = paper::nearest(&near, inputs.anchors.len(), due.time.tow_s(), &mut last_ranges);
        let start = at.or_else(|| start(inputs, &base, &due, &coupling, &ranges).map(|begin| begin.p_n));
        let Some(start) = start else { continue };
        let pair = due.epoch.and_then(|rover| {
            bases.at(&inputs.base.epochs, rover).map(|from_base| Pair { rover, base: from_base })
        });
        let Some(position) = paper::epoch(&setting, pair, &near, start) else { continue };
        at = Some(position.p_n);
        outcome.rows.push(row(due.time, &position, near.len(), &base, first.time));
    }
    if inputs.doubtful || !doubts.is_empty() {
        never_fixed(&mut outcome.rows);
    }
    outcome.anomalies = doubts;
    outcome
}

/// Each range with its time, in the week of the rover's first epoch.
pub(super) fn timed(ranges: &[CoupledRange], first: GpsTime) -> Vec<(GpsTime, CoupledRange)> {
    ranges.iter().map(|range| (GpsTime::from_week(first.week(), range.t_s), *range)).collect()
}

/// One pass, and the whole cycles that it came to hold.
fn once(inputs: &Inputs<'_>, known: Known, smoothed: bool) -> (Outcome, Known) {
    let Some(first) = inputs.rover.epochs.first() else { return (Outcome::default(), known) };
    let base = Base::new(inputs.base_place);
    let mut doubts = doubts::before(inputs, &base);
    let ground = Ground {
        base: &base,
        interval_s: inputs.rover.interval_s().unwrap_or(1.0),
        two_bands: inputs.rover.has_two_bands() && inputs.base.has_two_bands(),
        first: first.time,
    };
    let ranges = timed(inputs.ranges, first.time);
    let mut pass = Pass::new(known, smoothed);
    for due in due(inputs, ground.interval_s, &ranges) {
        pass.go_on(inputs, &ground, &due, &ranges);
    }
    let (mut outcome, found) = pass.finish(inputs, &base);
    doubts.extend(doubts::ranges_clock(inputs, &outcome.rows));
    if inputs.doubtful || !doubts.is_empty() {
        never_fixed(&mut outcome.rows);
    }
    doubts.append(&mut outcome.anomalies);
    outcome.anomalies = doubts;
    (outcome, found)
}

/// Something speaks against the files: nothing is called fixed.
pub(super) fn never_fixed(rows: &mut [Row]) {
    let fixed = rows.iter_mut().filter(|row| row.quality == Quality::Fixed);
    fixed.for_each(|row| row.quality = Quality::Float);
}
