//! A whole run without satellites: ranges and anchors in, rows and what became of each anchor out.

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
    pub anomalies: Vec<String>,
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
) -> Result<RangesAlone, String> {
    let matched = ranges_check::matched(ranges, anchors)?;
    ranges_check::check_unit(&ranges.rows, &matched, anchors)?;
    let mut out = RangesAlone { anomalies: ranges.notes.clone(), ..RangesAlone::default() };
    out.anomalies.extend(ranges_check::unknown(ranges, &matched));
    let swapped = ranges_check::swapped(&ranges.rows, &matched, anchors);
    let doubtful = swapped.is_some();
    out.anomalies.extend(swapped);
    let tag = &instrument.uwb;
    let settings = UwbSettings {
        antenna_height_m: tag.antenna_height_m,
        antenna_height_sigma_m: tag.antenna_height_sigma_m,
        range_sigma_m: tag.range_sigma_m,
        range_bias_m: tag.range_bias_m,
        initial_position_m,
    };
    let known: Vec<UwbRange> = ranges
        .rows
        .iter()
        .filter_map(|row| {
            Some(UwbRange { t_ns: row.t_ns, anchor: matched[row.anchor]?, range_m: row.range_m })
        })
        .collect();
    let mut filter = UwbAlone::new(anchors.to_vec(), settings);
    let mut points: Vec<UwbPoint> = Vec::new();
    for of_one_time in known.chunk_by(|a, b| a.t_ns == b.t_ns) {
        points.extend(filter.push(of_one_time));
    }
    if smoothed {
        points = filter.smoothed();
    }
    let answering = filter.anchors().iter().filter(|anchor| anchor.used > 0).count();
    match filter.started_ns() {
        None => out.anomalies.push(format!(
            "the tag was not found: a position needs three anchors that agree, and {} answered",
            matched.iter().flatten().count()
        )),
        Some(_) if answering < 3 => {
            out.anomalies
                .push("fewer than three anchors agree: positions are not to be relied on".to_owned());
        }
        Some(_) => {}
    }
    if filter.restarts() > 0 {
        out.anomalies.push(format!("the tag was lost and found anew {} times", filter.restarts()));
    }
    out.anchors = anchors.iter().map(|anchor| anchor.name.clone()).zip(filter.anchors()).collect();
    for (name, of) in &out.anchors {
        if of.rejected > of.used && of.used + of.rejected > 20 {
            out.anomalies.push(format!(
                "anchor {name}: {} of its {} ranges were rejected; check its coordinates and its cable",
                of.rejected,
                of.used + of.rejected
            ));
        }
    }
    out.rows = points.iter().map(|point| row(point, doubtful)).collect();
    Ok(out)
}

/// A row; with a survey that is in doubt its sigmas say so.
fn row(point: &UwbPoint, doubtful: bool) -> Row {
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
        quality: if point.anchors > 0 { Quality::Uwb } else { Quality::Predicted },
        ratio: None,
        satellites: 0,
        anchors: point.anchors,
    }
}
