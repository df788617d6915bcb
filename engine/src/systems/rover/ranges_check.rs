//! What is wrong with ranges and anchors before any filter: units, names, anchors that were swapped.

use super::causes::RoverCause;
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
pub fn matched(ranges: &TagRanges, anchors: &[SurveyedAnchor]) -> Result<Vec<Option<usize>>, RoverCause> {
    let matched: Vec<Option<usize>> =
        ranges.anchors.iter().map(|name| anchors.iter().position(|anchor| anchor.name == *name)).collect();
    if matched.iter().any(Option::is_some) {
        return Ok(matched);
    }
    let list = |names: Vec<&str>| names.join(", ");
    Err(RoverCause::NoKnownAnchor {
        ranged: list(ranges.anchors.iter().map(String::as_str).take(8).collect()),
        surveyed: list(anchors.iter().map(|anchor| anchor.name.as_str()).take(8).collect()),
    })
}

/// A sentence on ranges of anchors that nobody surveyed, where there are any.
pub fn unknown(ranges: &TagRanges, matched: &[Option<usize>]) -> Option<RoverCause> {
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
    Some(RoverCause::UnknownAnchor { ranges: count, anchors: names.join(", ") })
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
) -> Result<(), RoverCause> {
    const FEWEST: usize = 20;
    const FOOT_M: f64 = 0.3048;
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
    // Inside of the anchors' hull feet make triangles, too, but no place explains them all.
    let windows = Windows::of(rows, matched);
    let in_feet = Windows::clearly(windows.cost(anchors, 1.0), windows.cost(anchors, FOOT_M));
    let Some(in_metres) = share(1.0) else { return Ok(()) };
    if in_metres > 0.5 && !in_feet {
        return Ok(());
    }
    for (unit, scale) in [("millimetres", 1e-3), ("centimetres", 1e-2), ("feet", FOOT_M)] {
        if share(scale).is_some_and(|fit| fit > 0.8) {
            return Err(RoverCause::WrongUnit { unit });
        }
    }
    Ok(())
}

/// Windows of ranges over the whole file, each of about a second: anchor and length.
struct Windows(Vec<Vec<(usize, f64)>>);

impl Windows {
    const COUNT: usize = 15;
    const WINDOW_NS: i64 = 1_200_000_000;
    /// So many sigmas squared for each window, at least, have to go where a change explains the ranges.
    const CLEAR: f64 = 8.0;

    fn of(rows: &[TagRange], matched: &[Option<usize>]) -> Windows {
        let window = |k: usize| {
            let from = rows[rows.len() * k / Windows::COUNT].t_ns;
            let begin = rows.partition_point(|row| row.t_ns < from);
            rows[begin..]
                .iter()
                .take_while(|row| row.t_ns < from + Windows::WINDOW_NS)
                .filter(|row| row.range_m > 0.0)
                .filter_map(|row| Some((matched[row.anchor]?, row.range_m)))
                .collect()
        };
        let count = if rows.is_empty() { 0 } else { Windows::COUNT };
        Windows((0..count).map(window).collect())
    }

    /// How badly places explain the ranges, multiplied by a scale, and in how many windows that can be said.
    fn cost(&self, anchors: &[SurveyedAnchor], scale: f64) -> (f64, usize) {
        let height = AntennaHeight::of(None, None, anchors);
        let costs: Vec<f64> = self
            .0
            .iter()
            .filter_map(|window| {
                let scaled: Vec<(usize, f64)> =
                    window.iter().map(|(anchor, range_m)| (*anchor, range_m * scale)).collect();
                window_cost(&scaled, anchors, &height, EXPECTED_BIAS_M)
            })
            .collect();
        (costs.iter().sum(), costs.len())
    }

    /// Whether a change explains what is not explained without it.
    fn clearly(before: (f64, usize), after: (f64, usize)) -> bool {
        before.1 >= Windows::COUNT / 3
            && after.1 == before.1
            && after.0 < 0.3 * before.0
            && before.0 - after.0 > Windows::CLEAR * before.1 as f64
    }
}

/// A sentence on two anchors that explain the ranges only when they change places.
pub fn swapped(
    rows: &[TagRange],
    matched: &[Option<usize>],
    anchors: &[SurveyedAnchor],
) -> Option<RoverCause> {
    let windows = Windows::of(rows, matched);
    let as_told = windows.cost(anchors, 1.0);
    let mut best: Option<((f64, usize), usize, usize)> = None;
    for i in 0..anchors.len() {
        for j in 0..i {
            let mut changed = anchors.to_vec();
            let place = changed[i].p_n;
            changed[i].p_n = changed[j].p_n;
            changed[j].p_n = place;
            let cost = windows.cost(&changed, 1.0);
            if Windows::clearly(as_told, cost) && best.is_none_or(|(least, ..)| cost.0 < least.0) {
                best = Some((cost, j, i));
            }
        }
    }
    let (_, i, j) = best?;
    Some(RoverCause::AnchorsSwapped { first: anchors[i].name.clone(), second: anchors[j].name.clone() })
}
