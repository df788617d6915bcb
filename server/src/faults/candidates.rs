//! Which actuators a fault may be about, and how likely each is.
//!
//! Anchors stand 10 m apart, about as far as an uncorrected position is off, so the nearest one is
//! often the wrong one. The prior: with probability [`NONE`] the inspector stood anywhere, else at one of
//! the markers, each as likely as the other, up to an arm's length from it. The likelihood: the
//! position's own two-dimensional Gaussian. Bayes' rule gives the shares.

use std::f64::consts::TAU;

use crate::store::faults::Candidate;
use crate::store::markers::Marker;

/// How far from a marker an inspector stands while looking at it, one sigma on each axis, m.
const OFFSET_M: f64 = 1.0;
/// Share of faults that are at no marker (on the road, at a fence), before the position is known.
const NONE: f64 = 0.1;
/// Markers per square metre where there are any: FAST's anchors form triangles of 10 m.
const DENSITY_M2: f64 = 0.011_5;
/// Candidates that are named; more help nobody to choose.
const NAMED: usize = 8;
/// Markers less likely than this are not named.
const LEAST: f64 = 0.005;

/// Where an inspector was, in plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlanPosition {
    pub(super) e_m: f64,
    pub(super) n_m: f64,
    /// Variances of east and north, and their covariance, m².
    pub(super) variance_e_m2: f64,
    pub(super) variance_n_m2: f64,
    pub(super) covariance_en_m2: f64,
}

/// The candidates, likeliest first, and last the share of everything that is not named (`marker` is
/// `None`). The probabilities add up to 1.
pub(super) fn candidates(at: &PlanPosition, markers: &[Marker]) -> Vec<Candidate> {
    let var_e = at.variance_e_m2 + OFFSET_M * OFFSET_M;
    let var_n = at.variance_n_m2 + OFFSET_M * OFFSET_M;
    // A covariance that its variances do not allow (rounding) must not turn the Gaussian inside out.
    let cov_most = 0.999 * (var_e * var_n).sqrt();
    let cov = at.covariance_en_m2.clamp(-cov_most, cov_most);
    let det = var_e * var_n - cov * cov;
    let none = NONE * DENSITY_M2;

    let mut named: Vec<(f64, &Marker)> = markers
        .iter()
        .map(|marker| {
            let (de, dn) = (marker.e_m - at.e_m, marker.n_m - at.n_m);
            let squared = (var_n * de * de - 2.0 * cov * de * dn + var_e * dn * dn) / det;
            ((1.0 - NONE) * (-0.5 * squared).exp() / (TAU * det.sqrt()), marker)
        })
        .collect();
    let all = none + named.iter().map(|(weight, _)| weight).sum::<f64>();
    // Equal weights keep the order of their names, so that the list is the same every time.
    named.sort_by(|(a, first), (b, second)| b.total_cmp(a).then_with(|| first.name.cmp(&second.name)));

    let mut told: Vec<Candidate> = named
        .into_iter()
        .take(NAMED)
        .map(|(weight, marker)| Candidate {
            marker: Some(marker.name.clone()),
            probability: weight / all,
            distance_m: Some((marker.e_m - at.e_m).hypot(marker.n_m - at.n_m)),
        })
        .take_while(|candidate| candidate.probability >= LEAST)
        .collect();
    let rest = 1.0 - told.iter().map(|candidate| candidate.probability).sum::<f64>();
    told.push(Candidate { marker: None, probability: rest.max(0.0), distance_m: None });
    told
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::utc;

    fn marker(name: &str, e_m: f64, n_m: f64) -> Marker {
        let at = utc::from_us(0);
        Marker { name: name.into(), e_m, n_m, u_m: None, version: 1, created_at: at, updated_at: at }
    }

    /// Rows of markers 10 m apart, `A0` at the origin.
    fn lattice() -> Vec<Marker> {
        let mut all = Vec::new();
        for row in -10..=10 {
            for column in -10..=10 {
                let e = 10.0 * f64::from(column) + 5.0 * f64::from(row);
                all.push(marker(&format!("{column},{row}"), e, 8.66 * f64::from(row)));
            }
        }
        all
    }

    fn at(e_m: f64, n_m: f64, sigma_m: f64) -> PlanPosition {
        let variance = sigma_m * sigma_m;
        PlanPosition { e_m, n_m, variance_e_m2: variance, variance_n_m2: variance, covariance_en_m2: 0.0 }
    }

    fn sum(candidates: &[Candidate]) -> f64 {
        candidates.iter().map(|candidate| candidate.probability).sum()
    }

    #[test]
    fn a_sure_position_at_a_marker_names_it() {
        let told = candidates(&at(0.3, 0.2, 0.5), &lattice());
        assert_eq!(told[0].marker.as_deref(), Some("0,0"));
        assert!(told[0].probability > 0.95, "{told:?}");
        assert!((sum(&told) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn an_unsure_position_offers_several_and_no_certainty() {
        let told = candidates(&at(4.0, 1.0, 10.0), &lattice());
        assert_eq!(told.len(), NAMED + 1);
        assert!(told[0].probability < 0.2, "{told:?}");
        assert!(told.windows(2).take(NAMED - 1).all(|pair| pair[0].probability >= pair[1].probability));
        assert_eq!(told.last().unwrap().marker, None);
        assert!((sum(&told) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn far_from_every_marker_it_is_none_of_them() {
        let told = candidates(&at(900.0, 900.0, 2.0), &lattice());
        assert_eq!((told.len(), told[0].marker.as_deref()), (1, None));
        assert_eq!(told[0].probability, 1.0);
        assert_eq!(candidates(&at(0.0, 0.0, 1.0), &[]).len(), 1);
    }

    #[test]
    fn an_ellipse_prefers_the_marker_along_its_long_axis() {
        // 6 m to the north-east and 4 m to the south-east; the error runs north-east to south-west.
        let both = [marker("along", 6.0, 6.0), marker("across", 4.0, -4.0)];
        let tilted = PlanPosition {
            e_m: 0.0,
            n_m: 0.0,
            variance_e_m2: 25.0,
            variance_n_m2: 25.0,
            covariance_en_m2: 23.0,
        };
        let told = candidates(&tilted, &both);
        assert_eq!(told[0].marker.as_deref(), Some("along"));
        assert!(told[0].distance_m > told[1].distance_m.or(Some(0.0)));
    }

    /// The shares are what they say: of faults at a random place, drawn by the prior, a candidate of
    /// probability p is the right one in p of the cases.
    #[test]
    fn the_shares_come_true() {
        let markers = lattice();
        // A small generator of our own: the same numbers on every machine.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let sigma = 4.0;
        let (mut expected, mut right, mut expected_none, mut none) = (0.0, 0.0, 0.0, 0.0);
        for _ in 0..20_000 {
            let mut gauss = || {
                let (a, b) = (uniform(), uniform());
                (-2.0 * (1.0 - a).ln()).sqrt() * (TAU * b).cos()
            };
            let noise = [gauss(), gauss(), gauss(), gauss()];
            let truth = if uniform() < NONE {
                None
            } else {
                // One of the 25 in the middle, away from the lattice's rim.
                let pick = |u: f64| (u * 5.0) as i32 - 2;
                let name = format!("{},{}", pick(uniform()), pick(uniform()));
                markers.iter().find(|marker| marker.name == name)
            };
            let (e, n) = match truth {
                Some(marker) => (marker.e_m + OFFSET_M * noise[0], marker.n_m + OFFSET_M * noise[1]),
                // Anywhere in the parallelogram that the 25 markers stand for.
                None => {
                    let (a, b) = (uniform() * 5.0 - 2.5, uniform() * 5.0 - 2.5);
                    (10.0 * a + 5.0 * b, 8.66 * b)
                }
            };
            let told = candidates(&at(e + sigma * noise[2], n + sigma * noise[3], sigma), &markers);
            expected += told[0].marker.as_ref().map_or(0.0, |_| told[0].probability);
            right += f64::from(told[0].marker.is_some() && told[0].marker.as_ref() == truth.map(|m| &m.name));
            expected_none += told.last().unwrap().probability;
            none += f64::from(
                !told.iter().any(|c| c.marker.is_some() && c.marker.as_ref() == truth.map(|m| &m.name)),
            );
        }
        assert!((expected - right).abs() / 20_000.0 < 0.02, "expected {expected}, right {right}");
        assert!((expected_none - none).abs() / 20_000.0 < 0.02, "expected {expected_none}, none {none}");
    }
}
