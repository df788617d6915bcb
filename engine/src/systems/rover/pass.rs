//! One way through a run: epochs and ranges as they are due, one after the other, for whole files and for what comes live.

use super::arcs::{Known, Losses};
use super::causes::RoverCause;
use super::coupling::{self, CoupledRange, Coupling, RangeOutcome};
use super::differences::{Base, Pair, age_s};
use super::filter::{FLOOR_M, Filter, Position, Setting, Start};
use super::row::{Quality, Row};
use super::run::{AnchorOutcome, Due, Inputs, OLDEST_BASE_S, Outcome};
use super::smoothing::Tape;
use super::state::RANGES;
use crate::gnss::observations::Epoch;
use crate::gnss::single_point::{self, SinglePoint};
use crate::gnss::time::GpsTime;

/// Time tags that differ by less are the same, s.
pub(super) const SAME_TAG_S: f64 = 0.01;
/// So many rejected ranges of an anchor, and more than used ones, are told.
const MANY_REJECTED: usize = 20;

/// How far the base's epochs have been taken, and what the base lost since.
#[derive(Clone, Debug, Default)]
pub(super) struct BaseCursor {
    next: usize,
    losses: Losses,
}

impl BaseCursor {
    /// The base's epoch of a time tag, or the last before it.
    pub(super) fn at<'a>(&mut self, epochs: &'a [Epoch], rover: &Epoch) -> Option<&'a Epoch> {
        while let Some(epoch) = epochs.get(self.next) {
            if age_s(rover.time, epoch.time) < -SAME_TAG_S {
                break;
            }
            self.losses.take(epoch);
            self.next += 1;
        }
        let last = epochs.get(self.next.checked_sub(1)?)?;
        (age_s(rover.time, last.time) <= OLDEST_BASE_S).then_some(last)
    }
}

/// What does not change on the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground<'a> {
    pub(super) base: &'a Base,
    /// Time between epochs, s.
    pub(super) interval_s: f64,
    /// Both receivers have two bands.
    pub(super) two_bands: bool,
    /// Times count from here.
    pub(super) first: GpsTime,
}

/// A filter on its way.
#[derive(Clone, Debug, Default)]
pub(super) struct Pass {
    filter: Option<Filter>,
    bases: BaseCursor,
    rover_losses: Losses,
    next_range: usize,
    /// Whole cycles that are known from an earlier pass.
    known: Known,
    /// Rows with their knots on the tape, where it is to be smoothed.
    on_tape: Option<Vec<(usize, usize)>>,
    pub(super) rows: Vec<Row>,
}

impl Pass {
    /// At the start; smoothed, with the whole cycles of an earlier pass, where it is to be.
    pub(super) fn new(known: Known, smoothed: bool) -> Pass {
        Pass { known, on_tape: smoothed.then(Vec::new), ..Pass::default() }
    }

    /// Goes on to a time at which a row is due, and appends it, once the rover is found.
    pub(super) fn go_on(
        &mut self,
        inputs: &Inputs<'_>,
        ground: &Ground<'_>,
        due: &Due<'_>,
        ranges: &[(GpsTime, CoupledRange)],
    ) {
        let Ground { base, interval_s, two_bands, first } = *ground;
        if let Some(epoch) = due.epoch {
            self.rover_losses.take(epoch);
        }
        if self.filter.as_ref().is_none_or(|filter| filter.plan_sigma_m() > 100.0) {
            let coupling = Coupling::new(inputs.anchors.to_vec(), &inputs.instrument.uwb);
            let Some(Begin { p_n, sigma_n, by_satellites }) = start(inputs, base, due, &coupling, ranges)
            else {
                return;
            };
            // Where satellites say where the rover is they come first: a few ranges over metres of error, linearised, would put it
            // on the mirror image across two anchors, surer than any code.
            let earlier_s = if by_satellites { 0.0 } else { interval_s };
            self.next_range = ranges.partition_point(|(time, _)| due.time.since(*time) > earlier_s);
            let time = ranges.get(self.next_range).map_or(due.time, |(time, _)| (*time).min(due.time));
            let setting =
                Setting { instrument: inputs.instrument, two_bands, interval_s, systems: inputs.systems };
            let mut begun = Filter::new(Start { time, p_n, sigma_n }, &setting, coupling);
            begun.known.clone_from(&self.known);
            if self.on_tape.is_some() {
                begun.tape = Some(Tape::new(begun.state.len()));
                self.flush();
            }
            self.filter = Some(begun);
        }
        let Some(filter) = &mut self.filter else { return };
        let mut heard = vec![false; inputs.anchors.len()];
        while let Some((time, range)) = ranges.get(self.next_range) {
            if *time > due.time {
                break;
            }
            if *time >= filter.time {
                filter.move_to(*time);
            }
            if filter.range(range) == RangeOutcome::Used {
                heard[range.anchor] = true;
            }
            self.next_range += 1;
        }
        filter.move_to(due.time);
        let anchors = heard.iter().filter(|heard| **heard).count();
        let bases = &mut self.bases;
        let pair = due.epoch.and_then(|rover| {
            bases.at(&inputs.base.epochs, rover).map(|from_base| Pair { rover, base: from_base })
        });
        let satellites = pair.and_then(|pair| {
            let losses = [&self.rover_losses, &self.bases.losses];
            let position = filter.satellites(pair, base, inputs.navigation, losses);
            self.rover_losses.clear();
            self.bases.losses.clear();
            position
        });
        let with_base = satellites.is_some();
        let alone = satellites.is_none().then(|| single(inputs, base, due, filter)).flatten();
        let position = satellites.or(alone).unwrap_or_else(|| {
            let quality = if anchors > 0 { Quality::Uwb } else { Quality::Predicted };
            filter.position(&filter.state, quality, None, 0)
        });
        if let (Some(on_tape), Some(tape)) = (&mut self.on_tape, &filter.tape) {
            on_tape.push((self.rows.len(), tape.len().saturating_sub(1)));
        }
        let base_age_s = pair.filter(|_| with_base).map(|pair| age_s(pair.rover.time, pair.base.time));
        self.rows.push(Row { base_age_s, ..row(due.time, &position, anchors, base, first) });
    }

    /// Puts smoothed positions into the rows that a filter's tape has.
    fn flush(&mut self) {
        let (Some(filter), Some(on_tape)) = (&mut self.filter, &mut self.on_tape) else { return };
        let Some(mut tape) = filter.tape.take() else { return };
        tape.leave(&filter.state);
        let smoothed = tape.smoothed();
        for (row, knot) in on_tape.drain(..) {
            let row = &mut self.rows[row];
            if row.quality != Quality::Single {
                row.p_n_m = smoothed[knot].p_n;
                row.sigma_n_m = smoothed[knot].sigma_n.map(|sigma| libm::hypot(sigma, FLOOR_M));
                row.covariance_en_m2 = smoothed[knot].covariance_en_m2;
            }
        }
    }

    /// What the anchors have too much, and how sure that is; nothing before the rover is found.
    pub(super) fn anchors(&self, inputs: &Inputs<'_>) -> Vec<AnchorOutcome> {
        let Some(filter) = &self.filter else { return Vec::new() };
        let outcome = |(k, anchor): (usize, &coupling::CoupledAnchor)| AnchorOutcome {
            anchor: anchor.name.clone(),
            bias_m: filter.state.x[RANGES + 3 * k],
            sigma_m: filter.state.sigma(RANGES + 3 * k),
            used: filter.coupling.used[k],
            rejected: filter.coupling.rejected[k],
        };
        inputs.anchors.iter().enumerate().map(outcome).collect()
    }

    /// The end: what it came to, and the whole cycles that it came to hold.
    pub(super) fn finish(mut self, inputs: &Inputs<'_>, base: &Base) -> (Outcome, Known) {
        self.flush();
        let anchors = self.anchors(inputs);
        let mut outcome = Outcome { rows: self.rows, ..Outcome::default() };
        for row in &mut outcome.rows {
            place(row, base);
        }
        let Some(filter) = self.filter else { return (outcome, self.known) };
        outcome.slips = filter.arcs.slips_told + filter.arcs.slips_found;
        if filter.releases > 0 {
            outcome.anomalies.push(RoverCause::CyclesGivenUp { times: filter.releases });
        }
        for AnchorOutcome { anchor, used, rejected, .. } in &anchors {
            if rejected > used && *rejected >= MANY_REJECTED {
                outcome.anomalies.push(RoverCause::RangesRejected {
                    anchor: anchor.clone(),
                    rejected: *rejected,
                    ranges: used + rejected,
                });
            }
        }
        if !inputs.anchors.is_empty() {
            let clock = filter.coupling.clock();
            outcome.clock_offset_s = Some([filter.state.x[clock], filter.state.sigma(clock)]);
        }
        outcome.anchors = anchors;
        (outcome, filter.arcs.found)
    }
}

/// Puts latitude, longitude and height to a row's position.
fn place(row: &mut Row, base: &Base) {
    let place = base.frame.to_geodetic(row.p_n_m);
    row.geodetic = Some([place.latitude_deg, place.longitude_deg, place.height_m]);
}

/// The place by the rover's own code, where no base helps and the filter knows less.
fn single(inputs: &Inputs<'_>, base: &Base, due: &Due<'_>, filter: &mut Filter) -> Option<Position> {
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
    Some(Position {
        p_n,
        sigma_n,
        covariance_en_m2: 0.0,
        quality: Quality::Single,
        ratio: None,
        satellites: point.satellites,
    })
}

/// Where the filter begins, and how sure that is.
pub(super) struct Begin {
    pub(super) p_n: [f64; 3],
    sigma_n: [f64; 3],
    /// Satellites of this moment say where.
    by_satellites: bool,
}

/// Finds where the filter begins.
pub(super) fn start(
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

/// A row of a position.
pub(super) fn row(time: GpsTime, position: &Position, anchors: usize, base: &Base, first: GpsTime) -> Row {
    let place = base.frame.to_geodetic(position.p_n);
    Row {
        t_s: time.since(first),
        gps_time: Some((time.week(), time.tow_s())),
        p_n_m: position.p_n,
        geodetic: Some([place.latitude_deg, place.longitude_deg, place.height_m]),
        sigma_n_m: position.sigma_n,
        covariance_en_m2: position.covariance_en_m2,
        quality: position.quality,
        ratio: position.ratio,
        satellites: position.satellites,
        anchors,
        base_age_s: None,
    }
}

/// A single point in n.
pub(super) fn in_n(point: &SinglePoint, base: &Base) -> [f64; 3] {
    (base.c_ne * (point.p_e - base.p_e)).into()
}
