//! What is wrong with ranges and anchors before any filter: units, names, anchors that were swapped.

use crate::sample::{SurveyedAnchor, TagRange, TagRanges};
use crate::systems::rover::anchors::{AntennaHeight, distance_m};
use crate::systems::rover::uwb_alone::{EXPECTED_BIAS_M, window_cost};

/// Ranges so near in time belong to one place, s.
const TOGETHER_S: f64 = 0.3;
/// What two such ranges may be off, m: biases, and the way in between.
const SLACK_M: f64 = 2.0;

/// The anchor of each name of the ranges' file; `None` for those that nobody surveyed.
///
/// # Errors
///
/// A sentence, where no name is known.
pub fn matched(ranges: &TagRanges, anchors: &[SurveyedAnchor]) -> Result<Vec<Option<usize>>, String> {
    let matched: Vec<Option<usize>> =
        ranges.anchors.iter().map(|name| anchors.iter().position(|anchor| anchor.name == *name)).collect();
    if matched.iter().any(Option::is_some) {
        return Ok(matched);
    }
    let list = |names: Vec<&str>| names.join(", ");
    Err(format!(
        "none of the anchors of the ranges ({}) is among the surveyed ones ({}); correct the names in one of the two files",
        list(ranges.anchors.iter().map(String::as_str).take(8).collect()),
        list(anchors.iter().map(|anchor| anchor.name.as_str()).take(8).collect()),
    ))
}

/// A sentence on ranges of anchors that nobody surveyed, where there are any.
pub fn unknown(ranges: &TagRanges, matched: &[Option<usize>]) -> Option<String> {
    let names: Vec<&str> = ranges
        .anchors
        .iter()
        .zip(matched)
        .filter(|(_, anchor)| anchor.is_none())
        .map(|(name, _)| name.as_str())
        .collect();
    if names.is_empty() {
        return None;
    }
    let count = ranges.rows.iter().filter(|row| matched[row.anchor].is_none()).count();
    Some(format!("{count} ranges to {} were left out: no such anchor is surveyed", names.join(", ")))
}

/// Refuses ranges that are in another unit than metres: two ranges of one moment and the distance of their anchors
/// make a triangle.
///
/// # Errors
///
/// A sentence that names the likely unit.
pub fn check_unit(
    rows: &[TagRange],
    matched: &[Option<usize>],
    anchors: &[SurveyedAnchor],
) -> Result<(), String> {
    const FEWEST: usize = 20;
    let share = |scale: f64| {
        let (mut pairs, mut fit) = (0_usize, 0_usize);
        for pair in rows.windows(2) {
            let [a, b] = pair else { continue };
            let (Some(i), Some(j)) = (matched[a.anchor], matched[b.anchor]) else { continue };
            if i == j || (b.t_ns - a.t_ns) as f64 * 1e-9 > TOGETHER_S {
                continue;
            }
            let (first, second) = (a.range_m * scale, b.range_m * scale);
            let apart = distance_m(&anchors[i].p_n, &anchors[j].p_n);
            pairs += 1;
            fit += usize::from((first - second).abs() < apart + SLACK_M && first + second > apart - SLACK_M);
        }
        (pairs >= FEWEST).then(|| fit as f64 / pairs as f64)
    };
    let Some(in_metres) = share(1.0) else { return Ok(()) };
    if in_metres > 0.5 {
        return Ok(());
    }
    for (unit, scale) in [("millimetres", 1e-3), ("centimetres", 1e-2), ("feet", 0.3048)] {
        if share(scale).is_some_and(|fit| fit > 0.8) {
            return Err(format!(
                "ranges do not fit the anchors in metres, but in {unit}; give range_m in metres"
            ));
        }
    }
    Ok(())
}

/// A sentence on two anchors that explain the ranges only when they change places.
pub fn swapped(rows: &[TagRange], matched: &[Option<usize>], anchors: &[SurveyedAnchor]) -> Option<String> {
    const WINDOWS: usize = 15;
    const WINDOW_NS: i64 = 1_200_000_000;
    /// Three ranges have a place for any three anchors.
    const FEWEST_ANCHORS: usize = 4;
    /// So many sigmas squared for each window, at least, have to go.
    const CLEAR: f64 = 8.0;
    if matched.iter().flatten().count() < FEWEST_ANCHORS {
        return None;
    }
    let height = AntennaHeight::of(None, None, anchors);
    let windows: Vec<Vec<(usize, f64)>> = (0..WINDOWS)
        .map(|k| {
            let from = rows[rows.len() * k / WINDOWS].t_ns;
            let begin = rows.partition_point(|row| row.t_ns < from);
            rows[begin..]
                .iter()
                .take_while(|row| row.t_ns < from + WINDOW_NS)
                .filter(|row| row.range_m > 0.0)
                .filter_map(|row| Some((matched[row.anchor]?, row.range_m)))
                .collect()
        })
        .collect();
    let cost = |anchors: &[SurveyedAnchor]| -> (f64, usize) {
        let costs: Vec<f64> = windows
            .iter()
            .filter_map(|window| window_cost(window, anchors, &height, EXPECTED_BIAS_M))
            .collect();
        (costs.iter().sum(), costs.len())
    };
    let (as_told, count) = cost(anchors);
    if count < WINDOWS / 3 {
        return None;
    }
    let mut best: Option<(f64, usize, usize)> = None;
    for i in 0..anchors.len() {
        for j in 0..i {
            let mut changed = anchors.to_vec();
            let place = changed[i].p_n;
            changed[i].p_n = changed[j].p_n;
            changed[j].p_n = place;
            let (swapped, found) = cost(&changed);
            if found == count && best.is_none_or(|(cost, ..)| swapped < cost) {
                best = Some((swapped, j, i));
            }
        }
    }
    let (swapped, i, j) = best?;
    (swapped < 0.3 * as_told && as_told - swapped > CLEAR * count as f64).then(|| {
        format!(
            "anchors {} and {} seem to be swapped in the survey: the ranges fit only when they change places",
            anchors[i].name, anchors[j].name
        )
    })
}
