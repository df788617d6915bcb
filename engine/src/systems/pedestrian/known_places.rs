//! Known places of a walk, and the turn that they agree on.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::filter::{GATE_1, GATE_2};

/// A turn that is less sure than this says too little for a linear filter to go on from, rad.
pub(super) const SURE_RAD: f64 = 0.2;

/// A place that is known, and where the walk has it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Anchor {
    pub(super) t_ns: i64,
    /// As the strapdowns have it, without what visits have corrected, m.
    pub(super) walked_n: Vector2<f64>,
    /// As it is known, m.
    pub(super) place_n: Vector2<f64>,
    /// How well, m² on each axis.
    pub(super) variance_m2: f64,
    /// What the walk has become less sure by since the place before, m² on each axis.
    pub(super) grown_m2: f64,
}

/// A turn that some known places agree on.
pub(super) struct Agreement {
    pub(super) turn_rad: f64,
    pub(super) sigma_rad: f64,
    /// Which of the places.
    pub(super) members: Vec<bool>,
    /// How far they are from it, over their sigmas, squared and summed.
    pub(super) off: f64,
}

impl Agreement {
    pub(super) fn count(&self) -> usize {
        self.members.iter().filter(|member| **member).count()
    }
}

pub(super) fn turned(rad: f64, v: &Vector2<f64>) -> Vector2<f64> {
    let (sin, cos) = libm::sincos(rad);
    Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// Variance of how far two known places are apart, on each axis, with what the walk between them adds, m².
pub(super) fn apart_m2(anchors: &[Anchor], a: usize, b: usize) -> f64 {
    let (first, last) = (a.min(b), a.max(b));
    let grown: f64 = anchors[first + 1..=last].iter().map(|anchor| anchor.grown_m2).sum();
    anchors[a].variance_m2 + anchors[b].variance_m2 + grown
}

/// Whether the walk has two known places as far apart as they are, by whatever turn.
pub(super) fn distance_fits(anchors: &[Anchor], a: usize, b: usize) -> bool {
    let (walked_m, apart_m) = (
        (anchors[b].walked_n - anchors[a].walked_n).norm(),
        (anchors[b].place_n - anchors[a].place_n).norm(),
    );
    (walked_m - apart_m).powi(2) <= GATE_1 * apart_m2(anchors, a, b)
}

/// The places that a turn about number `pivot` agrees with.
pub(super) fn agreement_about(anchors: &[Anchor], pivot: usize, turn_rad: f64, sigma_rad: f64) -> Agreement {
    let mut off = 0.0;
    let members = (0..anchors.len())
        .map(|k| {
            let way = anchors[k].walked_n - anchors[pivot].walked_n;
            let rest = turned(turn_rad, &way) + anchors[pivot].place_n - anchors[k].place_n;
            let variance = apart_m2(anchors, pivot, k) + sigma_rad * sigma_rad * way.norm_squared();
            let nis = rest.norm_squared() / variance;
            let fits = k == pivot || nis <= GATE_2;
            off += if fits { nis } else { 0.0 };
            fits
        })
        .collect();
    Agreement { turn_rad, sigma_rad, members, off }
}

/// The turn that the members agree on, by least squares: that of two sets of points about their weighted middles.
fn fitted(anchors: &[Anchor], agreement: Agreement) -> Agreement {
    let members = || anchors.iter().zip(&agreement.members).filter(|(_, member)| **member).map(|(a, _)| a);
    let (mut weight, mut walked_n, mut place_n) = (0.0, Vector2::zeros(), Vector2::zeros());
    for anchor in members() {
        weight += 1.0 / anchor.variance_m2;
        walked_n += anchor.walked_n / anchor.variance_m2;
        place_n += anchor.place_n / anchor.variance_m2;
    }
    let (walked_n, place_n) = (walked_n / weight, place_n / weight);
    let (mut cos, mut sin, mut grown_m2, mut farthest_m2) = (0.0, 0.0, 0.0, 0.0_f64);
    for anchor in members() {
        let (from, to) = (anchor.walked_n - walked_n, anchor.place_n - place_n);
        cos += from.dot(&to) / anchor.variance_m2;
        sin += from.perp(&to) / anchor.variance_m2;
        grown_m2 += anchor.grown_m2;
        farthest_m2 = farthest_m2.max(to.norm_squared());
    }
    let information = libm::hypot(cos, sin);
    if information <= 0.0 || farthest_m2 <= 0.0 {
        return Agreement { sigma_rad: f64::INFINITY, ..agreement };
    }
    Agreement {
        turn_rad: libm::atan2(sin, cos),
        sigma_rad: (1.0 / information + grown_m2 / farthest_m2).sqrt(),
        ..agreement
    }
}

/// The turn that most of the known places agree on, by the pairs of them; of two that as many agree on the one that fits
/// better. With `of`, only turns that this place agrees with.
pub(super) fn most_agree(anchors: &[Anchor], of: Option<usize>) -> Option<Agreement> {
    let mut best: Option<Agreement> = None;
    for a in 0..anchors.len() {
        for b in a + 1..anchors.len() {
            let (way, to) =
                (anchors[b].walked_n - anchors[a].walked_n, anchors[b].place_n - anchors[a].place_n);
            let sigma_rad = (apart_m2(anchors, a, b) / to.norm_squared().max(1e-6)).sqrt();
            if sigma_rad > 2.0 * SURE_RAD || !distance_fits(anchors, a, b) {
                continue;
            }
            let found = agreement_about(anchors, a, libm::atan2(way.perp(&to), way.dot(&to)), sigma_rad);
            if of.is_some_and(|of| !found.members[of]) {
                continue;
            }
            let (count, off) = (found.count(), found.off);
            let better = best
                .as_ref()
                .is_none_or(|best| count > best.count() || count == best.count() && off < best.off);
            if better {
                best = Some(found);
            }
        }
    }
    best.map(|best| fitted(anchors, best))
}

/// Whether the places agree with the walk seen in a mirror, as they do with no turn of it: so many more of them. Markers
/// whose east and north are exchanged look so, and sensors with left-handed axes.
pub(super) fn are_mirrored(anchors: &[Anchor]) -> bool {
    let count = |found: Option<Agreement>| found.map_or(0, |found| found.count());
    let mirrored: Vec<Anchor> = anchors
        .iter()
        .map(|anchor| Anchor { walked_n: Vector2::new(anchor.walked_n.x, -anchor.walked_n.y), ..*anchor })
        .collect();
    count(most_agree(&mirrored, None)) >= count(most_agree(anchors, None)).max(2) + 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::wrap;

    fn anchor(walked_n: [f64; 2], place_n: [f64; 2], sigma_m: f64) -> Anchor {
        Anchor {
            t_ns: 0,
            walked_n: walked_n.into(),
            place_n: place_n.into(),
            variance_m2: sigma_m * sigma_m,
            grown_m2: 0.01,
        }
    }

    #[test]
    fn two_places_tell_the_turn_and_how_sure_it_is() {
        // A walk of 10 m east by its strapdowns that went north.
        let anchors = [anchor([0.0, 0.0], [5.0, 5.0], 0.1), anchor([10.0, 0.0], [5.0, 15.0], 0.3)];
        let found = most_agree(&anchors, Some(1)).unwrap();
        assert!((found.turn_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        let expected_rad = (0.1_f64.powi(2) + 0.3_f64.powi(2)).sqrt() / 10.0;
        assert!((found.sigma_rad / expected_rad - 1.0).abs() < 0.3, "{}", found.sigma_rad);
        assert!(!distance_fits(&[anchors[0], anchor([10.0, 0.0], [5.0, 18.0], 0.3)], 0, 1));
    }

    #[test]
    fn of_many_places_those_that_agree_are_found_whatever_the_others_say() {
        let walked = [[0.0, 0.0], [8.0, 1.0], [16.0, -3.0], [21.0, 9.0], [5.0, 14.0]];
        let turn_rad = 2.5;
        for wrong in 1..walked.len() {
            let anchors: Vec<Anchor> = walked
                .iter()
                .enumerate()
                .map(|(k, walked_n)| {
                    let by_rad = if k == wrong { 0.4 } else { turn_rad };
                    anchor(*walked_n, turned(by_rad, &Vector2::from(*walked_n)).into(), 0.2)
                })
                .collect();
            let found = most_agree(&anchors, None).unwrap();
            assert!(wrap(found.turn_rad - turn_rad).abs() < 1e-9, "{wrong}: {}", found.turn_rad);
            let members: Vec<bool> = (0..walked.len()).map(|k| k != wrong).collect();
            assert_eq!(found.members, members);
        }
    }

    #[test]
    fn markers_with_east_and_north_exchanged_are_found_out() {
        let walked = [[0.0, 0.0], [8.0, 1.0], [16.0, -3.0], [21.0, 9.0], [5.0, 14.0]];
        let of = |place: fn([f64; 2]) -> [f64; 2]| -> Vec<Anchor> {
            walked.iter().map(|walked_n| anchor(*walked_n, place(*walked_n), 0.2)).collect()
        };
        assert!(are_mirrored(&of(|[east, north]| [north, east])));
        assert!(!are_mirrored(&of(|[east, north]| [-north, east])));
    }
}
