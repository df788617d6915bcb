//! What is wrong with a run's files as a whole, a sentence each: such a run is worked out, and never called fixed.

use nalgebra::Vector3;

use super::causes::RoverCause;
use super::differences::Base;
use super::row::{Quality, Row};
use super::run::Inputs;
use crate::gnss::observations::{Epoch, Observations};
use crate::gnss::single_point::{self, SinglePoint};

/// A place by code is this good, m: a base that is farther from its own is somewhere else.
const BASE_M: f64 = 30.0;
/// Epochs that are looked at.
const LOOKED_AT: usize = 7;
/// Time tags are tried so far off, s.
const TAGS_S: i32 = 30;

/// What speaks against the files before any filter.
pub fn before(inputs: &Inputs<'_>, base: &Base) -> Vec<RoverCause> {
    let mut all = Vec::new();
    let (rover, navigation) = (inputs.rover, inputs.navigation);
    let (Some(first), Some(last)) = (rover.epochs.first(), rover.epochs.last()) else { return all };
    let with_orbit = |epoch: &Epoch| {
        epoch.satellites.iter().filter(|one| navigation.nearest(one.satellite, epoch.time).is_some()).count()
    };
    if with_orbit(first) == 0 && with_orbit(last) == 0 {
        all.push(RoverCause::NoOrbits {
            rover: [first.time, last.time],
            orbits: navigation.span().map(|(from, to)| [from, to]),
        });
        return all;
    }
    if let (Some(base_first), Some(base_last)) = (inputs.base.epochs.first(), inputs.base.epochs.last())
        && (base_first.time.since(last.time) > 0.5
            || first.time.since(base_last.time) > super::run::OLDEST_BASE_S)
    {
        all.push(RoverCause::NoCommonTime {
            rover: [first.time, last.time],
            base: [base_first.time, base_last.time],
        });
        return all;
    }
    if let Some(point) = middle(inputs.base, inputs, Some(base.p_e)) {
        let off = base.c_ne * (point - base.p_e);
        let plan = libm::hypot(off.x, off.y);
        if plan > BASE_M || off.z.abs() > 2.0 * BASE_M {
            all.push(RoverCause::BasePlace { plan_m: plan, height_m: off.z.abs() });
        }
    }
    for (who, file) in [("rover", rover), ("base", inputs.base)] {
        if let Some(seconds) = tags_off(file, inputs, base) {
            all.push(RoverCause::TimeTags { who, off_s: f64::from(seconds) });
        }
    }
    all
}

/// The middle of the places by code over a file.
fn middle(file: &Observations, inputs: &Inputs<'_>, near: Option<Vector3<f64>>) -> Option<Vector3<f64>> {
    let points: Vec<SinglePoint> =
        spread(file).filter_map(|epoch| single_point::locate(epoch, inputs.navigation, near)).collect();
    if points.is_empty() {
        return None;
    }
    let mut place = Vector3::zeros();
    for axis in 0..3 {
        let mut values: Vec<f64> = points.iter().map(|point| point.p_e[axis]).collect();
        values.sort_by(f64::total_cmp);
        place[axis] = values[values.len() / 2];
    }
    Some(place)
}

/// A few epochs, spread over the file.
fn spread(file: &Observations) -> impl Iterator<Item = &Epoch> {
    let step = (file.epochs.len() / LOOKED_AT).max(1);
    file.epochs.iter().step_by(step).take(LOOKED_AT)
}

/// By how many seconds time tags are off, where no place fits as they are and one fits so.
fn tags_off(file: &Observations, inputs: &Inputs<'_>, base: &Base) -> Option<i32> {
    let epochs: Vec<&Epoch> = spread(file).filter(|epoch| epoch.satellites.len() >= 7).take(3).collect();
    if epochs.is_empty() {
        return None;
    }
    let misfit = |seconds: i32| -> f64 {
        let mut worst = 0.0_f64;
        for epoch in &epochs {
            let mut moved = (*epoch).clone();
            moved.time = moved.time - f64::from(seconds);
            worst = worst.max(
                single_point::locate(&moved, inputs.navigation, Some(base.p_e))
                    .map_or(f64::INFINITY, |point| point.rms_m),
            );
        }
        worst
    };
    if misfit(0).is_finite() {
        return None;
    }
    let best =
        (-TAGS_S..=TAGS_S).map(|seconds| (misfit(seconds), seconds)).min_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0.is_finite() && best.1 != 0).then_some(best.1)
}

/// By how much the ranges' clock is off, s, where ranges do not fit the places that satellites fixed, and fit so.
pub fn ranges_clock(inputs: &Inputs<'_>, rows: &[Row]) -> Option<RoverCause> {
    let fixed: Vec<(f64, Vector3<f64>)> = rows
        .iter()
        .filter(|row| row.quality == Quality::Fixed)
        .filter_map(|row| Some((row.gps_time?.1, Vector3::from(row.p_n_m))))
        .collect();
    if fixed.len() < 10 || inputs.ranges.len() < 50 {
        return None;
    }
    let offset = Vector3::from(inputs.instrument.uwb.antenna_offset_m);
    // Ranges as if clocks were off, or two anchors had each other's name.
    let misfit = |seconds: f64, swapped: [usize; 2]| -> Option<f64> {
        let mut residuals = Vec::new();
        for range in inputs.ranges {
            let t_s = range.t_s - seconds;
            let next = fixed.partition_point(|(time, _)| *time < t_s);
            let (Some(before), Some(after)) =
                (next.checked_sub(1).and_then(|k| fixed.get(k)), fixed.get(next))
            else {
                continue;
            };
            let gap = after.0 - before.0;
            if gap > 2.5 {
                continue;
            }
            let p = before.1 + (after.1 - before.1) * ((t_s - before.0) / gap);
            let anchor = match range.anchor {
                of if of == swapped[0] => swapped[1],
                of if of == swapped[1] => swapped[0],
                of => of,
            };
            residuals.push(((p + offset - inputs.anchors[anchor].p_n).norm() - range.range_m).abs());
        }
        residuals.sort_by(f64::total_cmp);
        (residuals.len() >= 50).then(|| residuals[residuals.len() / 2])
    };
    let now = misfit(0.0, [0, 0])?;
    if now < 0.6 {
        return None;
    }
    let count = inputs.anchors.len();
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
    let swap =
        pairs.filter_map(|pair| misfit(0.0, pair).map(|off| (off, pair))).min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((off, [a, b])) = swap
        && off < 0.6
        && off < 0.5 * now
    {
        let name = |k: usize| inputs.anchors[k].name.clone();
        return Some(RoverCause::AnchorsSwapped { first: name(a), second: name(b) });
    }
    let clocks = (-60..=60).filter_map(|half| misfit(f64::from(half) * 0.5, [0, 0]).map(|off| (off, half)));
    let best = clocks.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if best.0 < 0.6 && best.0 < 0.5 * now && best.1 != 0 {
        return Some(RoverCause::RangesClock { off_s: f64::from(best.1) * 0.5 });
    }
    (now > 3.0).then_some(RoverCause::RangesOff { off_m: now })
}
