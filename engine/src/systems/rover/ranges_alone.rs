//! A whole run without satellites: ranges and anchors in, rows and what became of each anchor out.

use super::causes::RoverCause;
use super::instrument::Instrument;
use super::ranges_check;
use super::row::{Quality, Row};
use super::uwb_alone::{AnchorUse, UwbAlone, UwbPoint, UwbRange, UwbSettings};
use crate::sample::{SurveyedAnchor, TagRanges};

/// What a run gives.
#[derive(Clone, Debug, Default)]
pub struct RangesAlone {
    /// One for each time of the ranges' file, from the moment at which the tag is found.
    pub rows: Vec<Row>,
    /// Each surveyed anchor's name and what became of its ranges.
    pub anchors: Vec<(String, AnchorUse)>,
    /// What was odd, a sentence each.
    pub anomalies: Vec<RoverCause>,
}

/// What the filter is told of the tag.
pub(super) fn settings(instrument: &Instrument, initial_position_m: Option<[f64; 3]>) -> UwbSettings {
    let tag = &instrument.uwb;
    UwbSettings {
        antenna_height_m: tag.antenna_height_m,
        antenna_height_sigma_m: tag.antenna_height_sigma_m,
        range_sigma_m: tag.range_sigma_m,
        range_bias_m: tag.range_bias_m,
        initial_position_m,
    }
}

/// Works a run out; `smoothed`: by all of the ranges.
///
/// # Errors
///
/// A sentence, where the ranges and the anchors have nothing to do with each other.
pub fn run(
    ranges: &TagRanges,
    anchors: &[SurveyedAnchor],
    instrument: &Instrument,
    initial_position_m: Option<[f64; 3]>,
    smoothed: bool,
) -> Result<RangesAlone, RoverCause> {
    let matched = ranges_check::matched(ranges, anchors)?;
    ranges_check::check_unit(&ranges.rows, &matched, anchors)?;
    let mut out = RangesAlone::default();
    out.anomalies.extend(ranges_check::unknown(ranges, &matched));
    let swapped = ranges_check::swapped(&ranges.rows, &matched, anchors);
    let doubtful = swapped.is_some();
    out.anomalies.extend(swapped);
    let known: Vec<UwbRange> = ranges
        .rows
        .iter()
        .filter_map(|row| {
            Some(UwbRange { t_ns: row.t_ns, anchor: matched[row.anchor]?, range_m: row.range_m })
        })
        .collect();
    let mut filter = UwbAlone::new(anchors.to_vec(), settings(instrument, initial_position_m));
    let mut points: Vec<UwbPoint> = Vec::new();
    for of_one_time in known.chunk_by(|a, b| a.t_ns == b.t_ns) {
        points.extend(filter.push(of_one_time));
    }
    if smoothed {
        points = filter.smoothed();
    }
    let answering = filter.anchors().iter().filter(|anchor| anchor.used > 0).count();
    match filter.started_ns() {
        None => {
            out.anomalies.push(RoverCause::TagNotFound { answered: matched.iter().flatten().count() });
        }
        Some(_) if answering < 3 => out.anomalies.push(RoverCause::FewAnchors { agree: answering }),
        Some(_) => {}
    }
    if filter.restarts() > 0 {
        out.anomalies.push(RoverCause::TagLost { times: filter.restarts() });
    }
    out.anchors = anchors.iter().map(|anchor| anchor.name.clone()).zip(filter.anchors()).collect();
    for (name, of) in &out.anchors {
        if of.rejected > of.used && of.used + of.rejected > 20 {
            out.anomalies.push(RoverCause::RangesRejected {
                anchor: name.clone(),
                rejected: of.rejected as usize,
                ranges: (of.used + of.rejected) as usize,
            });
        }
    }
    out.rows = points.iter().map(|point| row(point, doubtful)).collect();
    Ok(out)
}

/// A row; with a survey that is in doubt its sigmas say so.
pub(super) fn row(point: &UwbPoint, doubtful: bool) -> Row {
    const IN_DOUBT_M: f64 = 10.0;
    let sigma = |axis: usize| {
        let own = point.covariance[axis][axis].max(0.0).sqrt();
        if doubtful { own.max(IN_DOUBT_M) } else { own }
    };
    Row {
        t_s: point.t_ns as f64 * 1e-9,
        gps_time: None,
        p_n_m: point.p_n,
        geodetic: None,
        sigma_n_m: [sigma(0), sigma(1), sigma(2)],
        covariance_en_m2: if doubtful { 0.0 } else { point.covariance[0][1] },
        quality: if point.anchors > 0 { Quality::Uwb } else { Quality::Predicted },
        ratio: None,
        satellites: 0,
        anchors: point.anchors,
        base_age_s: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anomaly::Cause as _;
    use crate::sample::TagRange;
    use crate::systems::rover::anchors::distance_m;

    fn anchors() -> Vec<SurveyedAnchor> {
        let places = [[0.0, 0.0, 2.0], [18.0, 1.0, 1.2], [14.0, 12.0, 2.2], [1.0, 9.0, 1.0]];
        places.iter().enumerate().map(|(k, p)| SurveyedAnchor { name: format!("A{k}"), p_n: *p }).collect()
    }

    /// A tag on a circle, its ranges in a unit of so many metres.
    fn ranges(metres: f64) -> TagRanges {
        let names = anchors().iter().map(|anchor| anchor.name.clone()).collect();
        let rows = (0..1200_usize)
            .map(|k| {
                let t_s = 0.05 * k as f64;
                let tag = [8.0 + 4.0 * libm::cos(0.2 * t_s), 6.0 + 4.0 * libm::sin(0.2 * t_s), 1.5];
                let anchor = k % 4;
                let wander = 0.02 * libm::sin(37.0 * t_s + anchor as f64);
                let range_m = (distance_m(&tag, &anchors()[anchor].p_n) + 0.15 + wander) / metres;
                TagRange { t_ns: (t_s * 1e9) as i64, anchor, range_m }
            })
            .collect();
        TagRanges { anchors: names, rows, notes: Vec::new() }
    }

    fn alone(ranges: &TagRanges, anchors: &[SurveyedAnchor]) -> Result<RangesAlone, String> {
        run(ranges, anchors, &Instrument::default(), None, false).map_err(|cause| cause.sentence())
    }

    fn said(out: &RangesAlone) -> Vec<String> {
        out.anomalies.iter().map(RoverCause::sentence).collect()
    }

    #[test]
    fn a_row_comes_with_each_time_once_the_tag_is_found() {
        let out = alone(&ranges(1.0), &anchors()).unwrap();
        assert!(out.anomalies.is_empty(), "{:?}", out.anomalies);
        assert!((1150..1200).contains(&out.rows.len()), "{}", out.rows.len());
        assert!(out.rows.iter().all(|row| row.quality == Quality::Uwb && row.gps_time.is_none()));
        let last = out.rows.last().unwrap();
        let tag = [8.0 + 4.0 * libm::cos(0.2 * last.t_s), 6.0 + 4.0 * libm::sin(0.2 * last.t_s)];
        assert!((last.p_n_m[0] - tag[0]).abs() < 0.2 && (last.p_n_m[1] - tag[1]).abs() < 0.2);
    }

    #[test]
    fn other_units_are_refused_by_the_distances_of_the_anchors() {
        for (metres, unit) in [(0.001, "millimetres"), (0.01, "centimetres"), (0.3048, "feet")] {
            let error = alone(&ranges(metres), &anchors()).unwrap_err();
            assert!(error.contains(unit), "{error}");
        }
    }

    #[test]
    fn names_that_nobody_surveyed_are_said() {
        let mut some = anchors();
        some[3].name = "B9".into();
        let out = alone(&ranges(1.0), &some).unwrap();
        assert!(said(&out)[0].contains("300 ranges to A3"), "{:?}", out.anomalies);
        some.iter_mut().for_each(|anchor| anchor.name.insert(0, 'X'));
        let error = alone(&ranges(1.0), &some).unwrap_err();
        assert!(error.contains("XA0") && error.contains("A3"), "{error}");
    }

    #[test]
    fn anchors_that_were_swapped_are_named_and_the_sigmas_say_that_nothing_is_sure() {
        let mut swapped = anchors();
        let place = swapped[0].p_n;
        swapped[0].p_n = swapped[1].p_n;
        swapped[1].p_n = place;
        let out = alone(&ranges(1.0), &swapped).unwrap();
        let said = said(&out);
        let said = said.iter().find(|sentence| sentence.contains("swapped")).unwrap();
        assert!(said.contains("A0 and A1"), "{said}");
        assert!(out.rows.iter().all(|row| row.sigma_n_m[0] >= 10.0));
    }

    #[test]
    fn two_anchors_are_too_few_and_that_is_said() {
        let out = alone(&ranges(1.0), &anchors()[..2]).unwrap();
        assert!(out.rows.is_empty());
        assert!(said(&out).iter().any(|sentence| sentence.contains("three anchors")), "{:?}", out.anomalies);
    }
}
