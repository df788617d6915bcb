//! A whole run: rover, base and navigation in, rows and a report out.

use super::arcs::{Known, Losses};
use super::coupling::{self, CoupledAnchor, CoupledRange, Coupling, RangeOutcome};
use super::differences::{Base, Pair, age_s};
use super::doubts;
use super::filter::{FLOOR_M, Filter, Setting, Start};
use super::instrument::{AmbiguityMode, Instrument};
use super::paper;
use super::row::{Quality, Row};
use super::smoothing::Tape;
use super::state::RANGES;
use crate::geo::Geodetic;
use crate::gnss::ephemeris::Navigation;
use crate::gnss::observations::{Epoch, Observations};
use crate::gnss::satellite::Constellation;
use crate::gnss::single_point::{self, SinglePoint};
use crate::gnss::time::GpsTime;

/// The oldest base epoch that is used, s.
pub const OLDEST_BASE_S: f64 = 30.0;
/// Time tags that differ by less are the same, s.
const SAME_TAG_S: f64 = 0.01;

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
    /// What was odd, a sentence each.
    pub anomalies: Vec<String>,
}

/// The base's epochs in their order, with what the base lost in between.
struct BaseEpochs<'a> {
    epochs: &'a [Epoch],
    next: usize,
    losses: Losses,
}

impl<'a> BaseEpochs<'a> {
    /// The base's epoch of a time tag, or the last before it.
    fn at(&mut self, rover: &Epoch) -> Option<&'a Epoch> {
        while let Some(epoch) = self.epochs.get(self.next) {
            if age_s(rover.time, epoch.time) < -SAME_TAG_S {
                break;
            }
            self.losses.take(epoch);
            self.next += 1;
        }
        let last = self.epochs.get(self.next.checked_sub(1)?)?;
        (age_s(rover.time, last.time) <= OLDEST_BASE_S).then_some(last)
    }
}

/// So many rejected ranges of an anchor, and more than used ones, are told.
const MANY_REJECTED: usize = 20;

/// A time at which a row is due.
struct Due<'a> {
    time: GpsTime,
    epoch: Option<&'a Epoch>,
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
    let ranges: Vec<(GpsTime, CoupledRange)> = inputs
        .ranges
        .iter()
        .map(|range| (GpsTime::from_week(first.time.week(), range.t_s), *range))
        .collect();
    let mut bases = BaseEpochs { epochs: &inputs.base.epochs, next: 0, losses: Losses::default() };
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
        let pair =
            due.epoch.and_then(|rover| bases.at(rover).map(|from_base| Pair { rover, base: from_base }));
        let Some(position) = paper::epoch(&setting, pair, &near, start) else { continue };
        at = Some(position.p_n);
        outcome.rows.push(row(due.time, &position, near.len(), &base, first));
    }
    if inputs.doubtful || !doubts.is_empty() {
        outcome
            .rows
            .iter_mut()
            .filter(|row| row.quality == Quality::Fixed)
            .for_each(|row| row.quality = Quality::Float);
    }
    outcome.anomalies = doubts;
    outcome
}

/// One pass, and the whole cycles that it came to hold.
fn once(inputs: &Inputs<'_>, known: Known, smoothed: bool) -> (Outcome, Known) {
    let mut outcome = Outcome::default();
    let Some(first) = inputs.rover.epochs.first() else { return (outcome, known) };
    let base = Base::new(inputs.base_place);
    let mut doubts = doubts::before(inputs, &base);
    let interval_s = inputs.rover.interval_s().unwrap_or(1.0);
    let two_bands = inputs.rover.has_two_bands() && inputs.base.has_two_bands();
    let ranges: Vec<(GpsTime, CoupledRange)> = inputs
        .ranges
        .iter()
        .map(|range| (GpsTime::from_week(first.time.week(), range.t_s), *range))
        .collect();
    let mut bases = BaseEpochs { epochs: &inputs.base.epochs, next: 0, losses: Losses::default() };
    let mut rover_losses = Losses::default();
    let mut filter: Option<Filter> = None;
    let mut next_range = 0;
    let mut on_tape: Vec<(usize, usize)> = Vec::new();
    for due in due(inputs, interval_s, &ranges) {
        if let Some(epoch) = due.epoch {
            rover_losses.take(epoch);
        }
        if filter.as_ref().is_none_or(|filter| filter.plan_sigma_m() > 100.0) {
            let coupling = Coupling::new(inputs.anchors.to_vec(), &inputs.instrument.uwb);
            let Some(Begin { p_n, sigma_n, by_satellites }) = start(inputs, &base, &due, &coupling, &ranges)
            else {
                continue;
            };
            // Where satellites say where the rover is they come first: a few ranges over metres of error, linearised, would put it
            // on the mirror image across two anchors, surer than any code.
            let earlier_s = if by_satellites { 0.0 } else { interval_s };
            next_range = ranges.partition_point(|(time, _)| due.time.since(*time) > earlier_s);
            let time = ranges.get(next_range).map_or(due.time, |(time, _)| (*time).min(due.time));
            let setting =
                Setting { instrument: inputs.instrument, two_bands, interval_s, systems: inputs.systems };
            let mut begun = Filter::new(Start { time, p_n, sigma_n }, &setting, coupling);
            begun.known.clone_from(&known);
            if smoothed {
                begun.tape = Some(Tape::new(begun.state.len()));
                flush(&mut filter, &mut outcome.rows, &mut on_tape);
            }
            filter = Some(begun);
        }
        let Some(filter) = &mut filter else { continue };
        let mut heard = vec![false; inputs.anchors.len()];
        while let Some((time, range)) = ranges.get(next_range) {
            if *time > due.time {
                break;
            }
            if *time >= filter.time {
                filter.move_to(*time);
            }
            if filter.range(range) == RangeOutcome::Used {
                heard[range.anchor] = true;
            }
            next_range += 1;
        }
        filter.move_to(due.time);
        let anchors = heard.iter().filter(|heard| **heard).count();
        let pair =
            due.epoch.and_then(|rover| bases.at(rover).map(|from_base| Pair { rover, base: from_base }));
        let satellites = pair.and_then(|pair| {
            let position = filter.satellites(pair, &base, inputs.navigation, [&rover_losses, &bases.losses]);
            rover_losses.clear();
            bases.losses.clear();
            position
        });
        let alone = satellites.is_none().then(|| single(inputs, &base, &due, filter)).flatten();
        let position = satellites.or(alone).unwrap_or_else(|| {
            let quality = if anchors > 0 { Quality::Uwb } else { Quality::Predicted };
            filter.position(&filter.state, quality, None, 0)
        });
        if let Some(tape) = &filter.tape {
            on_tape.push((outcome.rows.len(), tape.len().saturating_sub(1)));
        }
        outcome.rows.push(row(due.time, &position, anchors, &base, first));
    }
    flush(&mut filter, &mut outcome.rows, &mut on_tape);
    for row in &mut outcome.rows {
        place(row, &base);
    }
    doubts.extend(doubts::ranges_clock(inputs, &outcome.rows));
    if inputs.doubtful || !doubts.is_empty() {
        outcome
            .rows
            .iter_mut()
            .filter(|row| row.quality == Quality::Fixed)
            .for_each(|row| row.quality = Quality::Float);
    }
    outcome.anomalies.append(&mut doubts);
    let mut found = known;
    if let Some(filter) = filter {
        found.clone_from(&filter.arcs.found);
        outcome.slips = filter.arcs.slips_told + filter.arcs.slips_found;
        if filter.releases > 0 {
            outcome.anomalies.push(format!(
                "whole cycles were given up {} times, as they no longer fitted",
                filter.releases
            ));
        }
        for (k, anchor) in inputs.anchors.iter().enumerate() {
            let (used, rejected) = (filter.coupling.used[k], filter.coupling.rejected[k]);
            if rejected > used && rejected >= MANY_REJECTED {
                outcome.anomalies.push(format!(
                    "{rejected} of {} ranges to anchor {} fit neither satellites nor the other anchors; check its place in the survey \
                     and what stands in between",
                    used + rejected,
                    anchor.name
                ));
            }
            outcome.anchors.push(AnchorOutcome {
                anchor: anchor.name.clone(),
                bias_m: filter.state.x[RANGES + 3 * k],
                sigma_m: filter.state.sigma(RANGES + 3 * k),
                used: filter.coupling.used[k],
                rejected: filter.coupling.rejected[k],
            });
        }
        if !inputs.anchors.is_empty() {
            let clock = filter.coupling.clock();
            outcome.clock_offset_s = Some([filter.state.x[clock], filter.state.sigma(clock)]);
        }
    }
    (outcome, found)
}

/// Puts smoothed positions into the rows that a filter's tape has.
fn flush(filter: &mut Option<Filter>, rows: &mut [Row], on_tape: &mut Vec<(usize, usize)>) {
    let Some(mut tape) = filter.as_mut().and_then(|filter| filter.tape.take()) else { return };
    if let Some(filter) = filter {
        tape.leave(&filter.state);
    }
    let smoothed = tape.smoothed();
    for (row, knot) in on_tape.drain(..) {
        if rows[row].quality != Quality::Single {
            rows[row].p_n_m = smoothed[knot].p_n;
            rows[row].sigma_n_m = smoothed[knot].sigma_n.map(|sigma| libm::hypot(sigma, FLOOR_M));
        }
    }
}

/// Puts latitude, longitude and height to a row's position.
fn place(row: &mut Row, base: &Base) {
    let place = base.frame.to_geodetic(row.p_n_m);
    row.geodetic = Some([place.latitude_deg, place.longitude_deg, place.height_m]);
}

/// The place by the rover's own code, where no base helps and the filter knows less.
fn single(
    inputs: &Inputs<'_>,
    base: &Base,
    due: &Due<'_>,
    filter: &mut Filter,
) -> Option<super::filter::Position> {
    let epoch = due.epoch?;
    if filter.plan_sigma_m() < 2.0 {
        return None;
    }
    let point = single_point::locate(epoch, inputs.navigation, Some(base.p_e))?;
    let p_n = in_n(&point, base);
    // What codes of neighbouring epochs have in common does not become better by many of them.
    let sigma_n = point.sigma_n_m.map(|sigma| sigma.max(3.0));
    if filter.plan_sigma_m() > 3.0 * sigma_n[0].max(sigma_n[1]) {
        for axis in 0..3 {
            filter.state.reset(axis, p_n[axis], 100.0 * sigma_n[axis] * sigma_n[axis]);
        }
    }
    Some(super::filter::Position {
        p_n,
        sigma_n,
        quality: Quality::Single,
        ratio: None,
        satellites: point.satellites,
    })
}

/// Where the filter begins, and how sure that is.
struct Begin {
    p_n: [f64; 3],
    sigma_n: [f64; 3],
    /// Satellites of this moment say where.
    by_satellites: bool,
}

/// Finds where the filter begins.
fn start(
    inputs: &Inputs<'_>,
    base: &Base,
    due: &Due<'_>,
    coupling: &Coupling,
    ranges: &[(GpsTime, CoupledRange)],
) -> Option<Begin> {
    let begin = |p_n, sigma_n, by_satellites| Some(Begin { p_n, sigma_n, by_satellites });
    if let Some(given) = inputs.initial_position_m {
        return begin(given, [1.0; 3], false);
    }
    let single = due
        .epoch
        .and_then(|epoch| single_point::locate(epoch, inputs.navigation, Some(base.p_e)))
        .map(|point| in_n(&point, base));
    let first = ranges.partition_point(|(time, _)| due.time.since(*time) > 2.0);
    let end = ranges.partition_point(|(time, _)| due.time.since(*time) > -2.0);
    let near: Vec<CoupledRange> = ranges.get(first..end)?.iter().map(|(_, range)| *range).collect();
    let tag = &inputs.instrument.uwb;
    let up = tag.antenna_height_m.map_or(2.0, |_| tag.antenna_height_sigma_m.unwrap_or(0.1));
    match (single, coupling::locate(coupling, &near, tag.antenna_height_m)) {
        // Ranges put the plan where they agree with the satellites.
        (Some(single), Some(place)) if libm::hypot(single[0] - place.x, single[1] - place.y) < 20.0 => {
            begin(place.into(), [3.0, 3.0, up.max(3.0)], true)
        }
        (Some(single), _) => begin(single, [30.0; 3], true),
        (None, Some(place)) => begin(place.into(), [3.0, 3.0, up], false),
        (None, None) => None,
    }
}

fn row(time: GpsTime, position: &super::filter::Position, anchors: usize, base: &Base, first: &Epoch) -> Row {
    let place = base.frame.to_geodetic(position.p_n);
    Row {
        t_s: time.since(first.time),
        gps_time: Some((time.week(), time.tow_s())),
        p_n_m: position.p_n,
        geodetic: Some([place.latitude_deg, place.longitude_deg, place.height_m]),
        sigma_n_m: position.sigma_n,
        quality: position.quality,
        ratio: position.ratio,
        satellites: position.satellites,
        anchors,
    }
}

/// A single point in n.
pub fn in_n(point: &SinglePoint, base: &Base) -> [f64; 3] {
    (base.c_ne * (point.p_e - base.p_e)).into()
}
