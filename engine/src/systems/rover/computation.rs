//! A whole run from a recording: with satellites and ranges, with satellites alone or with ranges alone.

use super::causes::RoverCause;
use super::coupling::{CoupledAnchor, CoupledRange};
use super::instrument::Instrument;
use super::ranges_alone;
use super::ranges_check;
use super::recording::Recording;
use super::row::Row;
use super::run::{self, AnchorOutcome, Inputs};
use crate::geo::Geodetic;
use crate::gnss::satellite::Constellation;
use crate::sample::{SurveyedAnchor, TagRanges};

/// A base that is said to be so near to where it was has not moved, m.
const SURVEYED_M: f64 = 0.01;

/// How it is worked out.
#[derive(Clone, Debug)]
pub struct Means {
    /// What is known of the instruments.
    pub instrument: Instrument,
    /// Satellite systems to use.
    pub systems: Vec<Constellation>,
    /// Where the rover's antenna begins, where somebody knows it, m.
    pub initial_position_m: Option<[f64; 3]>,
    /// Whether ranges are used beside satellites.
    pub with_ranges: bool,
}

/// What it came to.
#[derive(Clone, Debug, Default)]
pub struct Done {
    /// A row for each time.
    pub rows: Vec<Row>,
    /// Slips, told and found.
    pub slips: usize,
    /// The anchors, and what was learnt of them.
    pub anchors: Vec<AnchorOutcome>,
    /// Ranges' clock less GPS time, s, and its sigma.
    pub clock_offset_s: Option<[f64; 2]>,
    /// What was odd.
    pub anomalies: Vec<RoverCause>,
    /// The base's antenna; none with ranges alone.
    pub base: Option<Geodetic>,
}

/// Works a recording out; smoothed, or by the straight reading of the paper, where that is asked for.
///
/// # Errors
///
/// Why there is no position at all.
pub fn compute(
    recording: &Recording,
    means: &Means,
    smoothed: bool,
    paper: bool,
) -> Result<Done, RoverCause> {
    match (recording.rover.epochs.is_empty(), recording.base.epochs.is_empty()) {
        (true, true) if !recording.ranges.rows.is_empty() => ranges_only(recording, means, smoothed),
        (true, _) => Err(RoverCause::NotStored { stream: "rover".to_owned() }),
        (false, true) => Err(RoverCause::NotStored { stream: "base".to_owned() }),
        (false, false) => with_satellites(recording, means, smoothed, paper),
    }
}

fn with_satellites(
    recording: &Recording,
    means: &Means,
    smoothed: bool,
    paper: bool,
) -> Result<Done, RoverCause> {
    let instrument = &means.instrument;
    let told = instrument.base.map(|base| base.geodetic());
    let base_place = told.or_else(|| recording.base_place()).ok_or(RoverCause::NoBasePlace)?;
    let surveyed = instrument.surveyed();
    let mut anomalies = Vec::new();
    let coupled = match (recording.ranges.rows.is_empty() || !means.with_ranges, surveyed.is_empty()) {
        (true, _) => Coupled::default(),
        (false, true) => {
            anomalies.push(RoverCause::NoAnchors { ranges: recording.ranges.rows.len() });
            Coupled::default()
        }
        (false, false) => coupled(&recording.ranges, &surveyed)?,
    };
    anomalies.extend(coupled.unknown);
    let moved = (recording.base_moved_m > SURVEYED_M)
        .then_some(RoverCause::BaseMoved { moved_m: recording.base_moved_m });
    anomalies.extend(moved.clone());
    let outcome = run::run(&Inputs {
        rover: &recording.rover,
        base: &recording.base,
        navigation: &recording.navigation,
        base_place,
        instrument,
        systems: &means.systems,
        ranges: &coupled.ranges,
        anchors: &coupled.anchors,
        doubtful: coupled.swapped.is_some() || moved.is_some(),
        smoothed,
        paper,
        initial_position_m: means.initial_position_m,
    });
    let clear = coupled.swapped.is_none();
    anomalies.extend(coupled.swapped);
    let swapped = |cause: &RoverCause| matches!(cause, RoverCause::AnchorsSwapped { .. });
    // Two looks at the same anchors say the same.
    anomalies.extend(outcome.anomalies.into_iter().filter(|cause| clear || !swapped(cause)));
    if outcome.rows.is_empty() {
        let epochs = recording.rover.epochs.len();
        return Err(anomalies.pop().unwrap_or(RoverCause::NoPosition { epochs }));
    }
    Ok(Done {
        rows: outcome.rows,
        slips: outcome.slips,
        anchors: outcome.anchors,
        clock_offset_s: outcome.clock_offset_s,
        anomalies,
        base: Some(base_place),
    })
}

/// Ranges and anchors by number, and what speaks against them.
#[derive(Clone, Debug, Default)]
pub(super) struct Coupled {
    ranges: Vec<CoupledRange>,
    anchors: Vec<CoupledAnchor>,
    unknown: Option<RoverCause>,
    pub(super) swapped: Option<RoverCause>,
}

pub(super) fn coupled(ranges: &TagRanges, surveyed: &[SurveyedAnchor]) -> Result<Coupled, RoverCause> {
    let matched = ranges_check::matched(ranges, surveyed)?;
    ranges_check::check_unit(&ranges.rows, &matched, surveyed)?;
    let known = ranges.rows.iter().filter(|row| row.range_m.is_finite()).filter_map(|row| {
        Some(CoupledRange { t_s: row.t_ns as f64 * 1e-9, anchor: matched[row.anchor]?, range_m: row.range_m })
    });
    Ok(Coupled {
        ranges: known.collect(),
        anchors: coupled_anchors(surveyed),
        unknown: ranges_check::unknown(ranges, &matched),
        swapped: ranges_check::swapped(&ranges.rows, &matched, surveyed),
    })
}

/// Anchors as the filter has them.
pub(super) fn coupled_anchors(surveyed: &[SurveyedAnchor]) -> Vec<CoupledAnchor> {
    surveyed.iter().map(|one| CoupledAnchor { name: one.name.clone(), p_n: one.p_n.into() }).collect()
}

fn ranges_only(recording: &Recording, means: &Means, smoothed: bool) -> Result<Done, RoverCause> {
    let surveyed = means.instrument.surveyed();
    let ranges = &recording.ranges;
    if surveyed.is_empty() {
        return Err(RoverCause::NoAnchors { ranges: ranges.rows.len() });
    }
    let outcome =
        ranges_alone::run(ranges, &surveyed, &means.instrument, means.initial_position_m, smoothed)?;
    if outcome.rows.is_empty() {
        let not_found = |cause: &RoverCause| matches!(cause, RoverCause::TagNotFound { .. });
        let found = outcome.anomalies.into_iter().find(not_found);
        return Err(found.unwrap_or(RoverCause::TagNotFound { answered: 0 }));
    }
    let anchors = outcome.anchors.into_iter().map(|(anchor, one)| AnchorOutcome {
        anchor,
        bias_m: one.bias_m,
        sigma_m: one.bias_sigma_m,
        used: one.used as usize,
        rejected: one.rejected as usize,
    });
    Ok(Done {
        rows: outcome.rows,
        anchors: anchors.collect(),
        anomalies: outcome.anomalies,
        ..Done::default()
    })
}
