//! Where is the tag? From the ranges of a second or so, without a position to begin with: every place that explains
//! them, for ranges bend and mirror.

use super::filter::Start;
use crate::sample::SurveyedAnchor;
use crate::systems::rover::anchors::{AntennaHeight, distance_m};
use crate::systems::rover::ranges;

/// A range of the window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heard {
    pub(super) t_s: f64,
    pub(super) anchor: usize,
    pub(super) range_m: f64,
}

/// A place that explains the ranges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) start: Start,
    /// Sum of the squared residuals in sigmas, each at most [`MOST`].
    pub(super) cost: f64,
    /// Anchors of which most ranges fit.
    pub(super) anchors: usize,
}

/// A residual that counts as one sigma, m: biases, and the way that the tag goes within the window.
const SIGMA_M: f64 = 0.7;
/// A residual beyond three sigmas says nothing.
const MOST: f64 = 9.0;
/// Places nearer to each other than this are one, m.
const SAME_M: f64 = 1.0;
/// Worse than the best by more than this, a place is not believed.
const WORSE: f64 = 12.0;
/// So many places are followed.
const MOST_PLACES: usize = 4;

/// The places that explain a window of ranges, the best first; empty where fewer than three anchors agree.
pub(super) fn places(
    heard: &[Heard],
    anchors: &[SurveyedAnchor],
    height: &AntennaHeight,
    bias_m: f64,
) -> Vec<Place> {
    let medians = medians(heard, anchors.len());
    let answering = medians.iter().flatten().count();
    if answering < 3 {
        return Vec::new();
    }
    let mut found: Vec<Place> = Vec::new();
    for seed in seeds(&medians, anchors, height, bias_m) {
        let place = refined(seed, heard, anchors, height, bias_m);
        if place.anchors < 3 {
            continue;
        }
        let near = |other: &Place| {
            let d = [place.start.p_n[0] - other.start.p_n[0], place.start.p_n[1] - other.start.p_n[1]];
            d[0] * d[0] + d[1] * d[1] < SAME_M * SAME_M
        };
        match found.iter_mut().find(|other| near(other)) {
            Some(other) if other.cost <= place.cost => {}
            Some(other) => *other = place,
            None => found.push(place),
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let best = found.first().map_or(0.0, |place| place.cost);
    found.retain(|place| place.cost < best + WORSE);
    found.truncate(MOST_PLACES);
    found
}

/// The cost of the best place by the median range of each anchor, for at least four that answer.
pub(super) fn least_cost(
    heard: &[Heard],
    anchors: &[SurveyedAnchor],
    height: &AntennaHeight,
    bias_m: f64,
) -> Option<f64> {
    let medians = medians(heard, anchors.len());
    let of_each: Vec<Heard> = medians
        .iter()
        .enumerate()
        .filter_map(|(anchor, median)| Some(Heard { t_s: 0.0, anchor, range_m: (*median)? }))
        .collect();
    if of_each.len() < 4 {
        return None;
    }
    seeds(&medians, anchors, height, bias_m)
        .into_iter()
        .map(|seed| refined(seed, &of_each, anchors, height, bias_m).cost)
        .min_by(f64::total_cmp)
}

fn medians(heard: &[Heard], anchors: usize) -> Vec<Option<f64>> {
    (0..anchors)
        .map(|anchor| {
            let mut all: Vec<f64> = heard.iter().filter(|h| h.anchor == anchor).map(|h| h.range_m).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied()
        })
        .collect()
}

/// Places on the circles about the nearest answering anchors, the cheapest of each circle.
fn seeds(
    medians: &[Option<f64>],
    anchors: &[SurveyedAnchor],
    height: &AntennaHeight,
    bias_m: f64,
) -> Vec<[f64; 3]> {
    const AZIMUTHS: u32 = 90;
    const CIRCLES: usize = 4;
    const OF_EACH: usize = 6;
    let cost = |p: &[f64; 3]| -> f64 {
        medians
            .iter()
            .zip(anchors)
            .filter_map(|(median, anchor)| Some((*median)? - bias_m - distance_m(p, &anchor.p_n)))
            .map(|e| (e * e / (SIGMA_M * SIGMA_M)).min(25.0))
            .sum()
    };
    let mut seeds = Vec::new();
    let mut circles: Vec<(f64, usize)> =
        medians.iter().enumerate().filter_map(|(k, median)| Some(((*median)?, k))).collect();
    circles.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (range_m, k) in circles.into_iter().take(CIRCLES) {
        let centre = anchors[k].p_n;
        let up = height.u_m - centre[2];
        let across = ((range_m - bias_m) * (range_m - bias_m) - up * up).max(0.01).sqrt();
        let mut circle: Vec<(f64, [f64; 3])> = (0..AZIMUTHS)
            .map(|step| {
                let azimuth = f64::from(step) / f64::from(AZIMUTHS) * std::f64::consts::TAU;
                let p = [
                    centre[0] + across * libm::sin(azimuth),
                    centre[1] + across * libm::cos(azimuth),
                    height.u_m,
                ];
                (cost(&p), p)
            })
            .collect();
        circle.sort_by(|a, b| a.0.total_cmp(&b.0));
        seeds.extend(circle.into_iter().take(OF_EACH).map(|(_, p)| p));
    }
    seeds
}

/// Gauss–Newton with residuals that are weighed down, from a seed.
fn refined(
    seed: [f64; 3],
    heard: &[Heard],
    anchors: &[SurveyedAnchor],
    height: &AntennaHeight,
    bias_m: f64,
) -> Place {
    const STEPS: usize = 15;
    const MOST_STEP_M: f64 = 5.0;
    let mut p = seed;
    let mut normal = [[0.0; 3]; 3];
    for _ in 0..STEPS {
        // A little stiffness, so that a direction that is not seen does not run away.
        normal = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1e-3 } else { 0.0 }));
        let mut right = [0.0; 3];
        let weight_up = 1.0 / (height.sigma_m * height.sigma_m);
        normal[2][2] += weight_up;
        right[2] += weight_up * (height.u_m - p[2]);
        for h in heard {
            let line = ranges::line(&p, &anchors[h.anchor].p_n);
            let residual = h.range_m - bias_m - line.range_m;
            let sigmas = residual.abs() / SIGMA_M;
            // Cauchy's weight: a gross error pulls less the larger it is.
            let weight = 1.0 / (SIGMA_M * SIGMA_M * (1.0 + sigmas * sigmas / 4.0));
            let u = line.unit_n;
            for i in 0..3 {
                for j in 0..3 {
                    normal[i][j] += weight * u[i] * u[j];
                }
                right[i] += weight * residual * u[i];
            }
        }
        let inverse = inverted(&normal);
        let step: [f64; 3] = std::array::from_fn(|i| (0..3).map(|j| inverse[i][j] * right[j]).sum());
        let length = step.iter().map(|x| x * x).sum::<f64>().sqrt();
        let factor = (MOST_STEP_M / length.max(1e-9)).min(1.0);
        for k in 0..3 {
            p[k] += factor * step[k];
        }
        if length < 1e-3 {
            break;
        }
    }
    let residual = |h: &Heard| h.range_m - bias_m - distance_m(&p, &anchors[h.anchor].p_n);
    let cost = heard.iter().map(|h| (residual(h) / SIGMA_M).powi(2).min(MOST)).sum::<f64>()
        + ((p[2] - height.u_m) / height.sigma_m).powi(2);
    let fits = (0..anchors.len())
        .filter(|anchor| {
            let of = || heard.iter().filter(|h| h.anchor == *anchor);
            let good = of().filter(|h| residual(h).abs() < 3.0 * SIGMA_M).count();
            good > 0 && 2 * good >= of().count()
        })
        .count();
    let covariance = inverted(&normal);
    // The window's ranges go into the filter again: what they told here is only where to linearise.
    let sigma = |k: usize| (9.0 * covariance[k][k]).sqrt().clamp(1.0, 10.0);
    let speed_m_s = 1.5;
    Place {
        start: Start { p_n: p, sigma_m: [sigma(0), sigma(1), height.sigma_m], speed_m_s },
        cost,
        anchors: fits,
    }
}

/// The inverse of a symmetric positive definite matrix, by its cofactors.
fn inverted(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let cofactor = |i: usize, j: usize| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (c, d) = ((j + 1) % 3, (j + 2) % 3);
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant))
}
