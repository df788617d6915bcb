//! Whose survey is suspect: what the walks found at each marker, held against what they found at the others.
//!
//! A walk arrives at a marker with an error of its own, some metres, in any direction. Over several visits
//! these errors cancel; a marker that was surveyed wrongly is off by the same vector every time. So for n
//! visits with mean m the figure n |m|² / σ² follows χ² with two degrees of freedom, where σ is what one
//! visit is off by on one axis: as the other markers' visits have it (robust, from their median distance), or
//! as this marker's own visits scatter, whichever is more. A slip of the keys scatters; a wrong survey does not.

use std::collections::{BTreeMap, HashSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::frame_fit::median;
use crate::store::marker_residuals::VisitResidual;

/// Fewer visits than this prove nothing.
const LEAST_VISITS: usize = 3;
/// A mean below this is a matter of where one stands at a marker, m.
const LEAST_MEAN_M: f64 = 0.5;
/// A suspicion is right in all but this share of tables in which every survey is right.
const FALSE_ALARM: f64 = 0.05;
/// No visit is surer than this on one axis, m: it is the arm's length from which one looks at a marker.
const LEAST_SIGMA_M: f64 = 0.3;
/// The median distance of a two-dimensional normal distribution with unit sigma: √(2 ln 2).
const MEDIAN_DISTANCE: f64 = 1.177_410_022_515_474_6;

/// What the walks found at a marker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct MarkerResiduals {
    /// Its name.
    #[schemars(example = &"A17")]
    pub(crate) marker: String,
    /// Visits that were weighed, accepted or not.
    pub(crate) visits: u64,
    /// Of which so many were rejected. Where these are fewer than half, they were slips of the keys: the figures below are
    /// without them.
    pub(crate) rejected: u64,
    /// Walks that they are of.
    pub(crate) sessions: u64,
    /// Mean of position minus marker, east and north, m.
    pub(crate) mean_m: [f64; 2],
    /// Its length, m.
    pub(crate) mean_length_m: f64,
    /// Where it points, clockwise from true north, degrees in [0, 360).
    pub(crate) mean_direction_deg: f64,
    /// Root mean square of the distances, m.
    pub(crate) rms_m: f64,
    /// The largest distance, m.
    pub(crate) largest_m: f64,
    /// How likely so large a mean is where the survey is right; `None` with fewer than three visits.
    pub(crate) p_value: Option<f64>,
    /// Whether the survey is suspect.
    pub(crate) suspect: bool,
}

/// What the walks found at all markers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "SurveyResiduals")]
pub(crate) struct Residuals {
    /// What one visit is off by on one axis, one sigma over all, m; `None` without visits.
    pub(crate) sigma_m: Option<f64>,
    /// By marker: suspects first, then by the length of the mean.
    pub(crate) markers: Vec<MarkerResiduals>,
}

/// Adds up the visits of each marker.
pub(crate) fn residuals(visits: &[VisitResidual]) -> Residuals {
    let mut of_marker: BTreeMap<&str, Vec<&VisitResidual>> = BTreeMap::new();
    for visit in visits {
        of_marker.entry(&visit.marker).or_default().push(visit);
    }
    let tested = of_marker.values().filter(|visits| visits.len() >= LEAST_VISITS).count().max(1);
    let mut all: Vec<(f64, &str)> =
        visits.iter().map(|visit| (length(visit.residual_m), visit.marker.as_str())).collect();
    all.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut markers: Vec<_> = of_marker
        .iter()
        .map(|(name, visits)| {
            let others =
                median(all.iter().filter(|(_, of)| of != name).map(|(distance, _)| *distance).collect());
            one(name, visits, others / MEDIAN_DISTANCE, tested)
        })
        .collect();
    markers
        .sort_by(|a, b| b.suspect.cmp(&a.suspect).then_with(|| b.mean_length_m.total_cmp(&a.mean_length_m)));
    let sigma_m = (!all.is_empty())
        .then(|| median(all.into_iter().map(|(distance, _)| distance).collect()) / MEDIAN_DISTANCE);
    Residuals { sigma_m, markers }
}

fn one(name: &str, all: &[&VisitResidual], others_sigma_m: f64, tested: usize) -> MarkerResiduals {
    let accepted: Vec<&VisitResidual> = all.iter().filter(|visit| visit.accepted).copied().collect();
    // Where most are rejected it may be the survey that is wrong.
    let visits = if 2 * accepted.len() > all.len() { &accepted[..] } else { all };
    let n = visits.len() as f64;
    let mean_of = |axis: usize| visits.iter().map(|visit| visit.residual_m[axis]).sum::<f64>() / n;
    let mean_m = [mean_of(0), mean_of(1)];
    let mean_length_m = length(mean_m);
    let squared_m2 = visits.iter().map(|visit| length(visit.residual_m).powi(2)).sum::<f64>();
    let scatter_m2 = visits
        .iter()
        .map(|visit| length([visit.residual_m[0] - mean_m[0], visit.residual_m[1] - mean_m[1]]).powi(2))
        .sum::<f64>()
        / (2.0 * (n - 1.0)).max(1.0);
    let sigma_m = others_sigma_m.max(scatter_m2.sqrt()).max(LEAST_SIGMA_M);
    let p_value = (visits.len() >= LEAST_VISITS)
        .then(|| (-0.5 * n * mean_length_m * mean_length_m / (sigma_m * sigma_m)).exp());
    MarkerResiduals {
        marker: name.to_owned(),
        visits: all.len() as u64,
        rejected: (all.len() - accepted.len()) as u64,
        sessions: all.iter().map(|visit| visit.session_id).collect::<HashSet<_>>().len() as u64,
        mean_m,
        mean_length_m,
        mean_direction_deg: mean_m[0].atan2(mean_m[1]).to_degrees().rem_euclid(360.0),
        rms_m: (squared_m2 / n).sqrt(),
        largest_m: visits.iter().map(|visit| length(visit.residual_m)).fold(0.0, f64::max),
        p_value,
        suspect: mean_length_m >= LEAST_MEAN_M && p_value.is_some_and(|p| p * (tested as f64) < FALSE_ALARM),
    }
}

fn length([e_m, n_m]: [f64; 2]) -> f64 {
    e_m.hypot(n_m)
}

#[cfg(test)]
mod tests {
    use uuid::Uuid;

    use super::*;
    use crate::utc;

    #[test]
    fn a_slip_of_the_keys_is_no_residual_and_a_marker_that_most_reject_is_looked_at_with_all() {
        let visit = |e_m: f64, accepted: bool| VisitResidual {
            marker: "A1".to_owned(),
            session_id: Uuid::nil(),
            t_applied_ns: 0,
            visited_at: utc::now(),
            accepted,
            nis: 1.0,
            residual_m: [e_m, 0.0],
        };
        let told = residuals(&[visit(1.0, true), visit(3.0, true), visit(2.0, true), visit(114.0, false)]);
        let marker = &told.markers[0];
        assert_eq!((marker.visits, marker.rejected), (4, 1));
        assert_eq!((marker.mean_length_m, marker.largest_m), (2.0, 3.0));
        let told = residuals(&[visit(1.0, true), visit(30.0, false), visit(32.0, false)]);
        assert_eq!(told.markers[0].largest_m, 32.0);
    }

    /// Normal numbers of a small generator of our own: the same on every machine.
    fn normal() -> impl FnMut() -> f64 {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut uniform = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        move || (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
    }

    fn visit(marker: &str, session: u128, residual_m: [f64; 2]) -> VisitResidual {
        VisitResidual {
            marker: marker.to_owned(),
            session_id: Uuid::from_u128(session),
            t_applied_ns: 0,
            visited_at: utc::from_us(0),
            accepted: true,
            nis: 1.0,
            residual_m,
        }
    }

    /// Twenty markers with eight visits each, off by 2 m a visit; `off_m` is added at M7.
    fn table(gauss: &mut impl FnMut() -> f64, off_m: [f64; 2]) -> Vec<VisitResidual> {
        (0..160)
            .map(|k| {
                let marker = format!("M{}", k % 20);
                let off = if marker == "M7" { off_m } else { [0.0; 2] };
                visit(&marker, k / 20, [off[0] + 2.0 * gauss(), off[1] + 2.0 * gauss()])
            })
            .collect()
    }

    #[test]
    fn a_marker_that_is_off_by_the_same_vector_every_time_is_suspect() {
        let told = residuals(&table(&mut normal(), [4.0, 0.0]));
        let first = &told.markers[0];
        assert_eq!((first.marker.as_str(), first.suspect, first.visits, first.sessions), ("M7", true, 8, 8));
        assert!((first.mean_direction_deg - 90.0).abs() < 25.0 && first.mean_length_m > 2.5, "{first:?}");
        assert_eq!(told.markers.iter().filter(|marker| marker.suspect).count(), 1);
        assert!((told.sigma_m.unwrap() - 2.0).abs() < 0.3, "{:?}", told.sigma_m);
    }

    #[test]
    fn right_surveys_are_suspected_no_more_often_than_promised() {
        let mut gauss = normal();
        let alarms = (0..400)
            .filter(|_| residuals(&table(&mut gauss, [0.0; 2])).markers.iter().any(|marker| marker.suspect))
            .count();
        assert!(alarms <= 28, "{alarms} of 400 tables, at most 5 % and its own scatter were promised");
    }

    #[test]
    fn slips_of_the_keys_and_too_few_visits_prove_nothing() {
        let mut gauss = normal();
        let mut visits = table(&mut gauss, [0.0; 2]);
        visits.extend((0..4).map(|k| {
            let (sin, cos) = (1.7 * k as f64).sin_cos();
            visit("keyed wrong", k, [3.0 + 30.0 * sin, 30.0 * cos])
        }));
        visits.extend([visit("twice", 1, [9.0, 9.0]), visit("twice", 2, [9.0, 9.0])]);
        let told = residuals(&visits);
        let of = |name: &str| told.markers.iter().find(|marker| marker.marker == name).unwrap();
        assert!(!of("keyed wrong").suspect && !of("twice").suspect);
        assert_eq!(of("twice").p_value, None);
        assert_eq!(residuals(&[]), Residuals { sigma_m: None, markers: Vec::new() });
    }
}
