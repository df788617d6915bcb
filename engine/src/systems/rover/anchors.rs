//! The anchors that a tag ranges to, and what is known of the tag's height among them.

use crate::sample::SurveyedAnchor;

/// Sigma of a height of which nothing is said, m.
const UNKNOWN_HEIGHT_SIGMA_M: f64 = 1.5;
/// Sigma of a height that somebody measured and gave no sigma for, m.
pub const KNOWN_HEIGHT_SIGMA_M: f64 = 0.1;

/// What is known of a UWB antenna's height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntennaHeight {
    /// The height itself, in the anchors' frame, m.
    pub u_m: f64,
    /// How sure, m.
    pub sigma_m: f64,
    /// Somebody said so; else it is only near the anchors.
    pub known: bool,
}

impl AntennaHeight {
    /// A height that somebody said, or that of the anchors as a beginning.
    pub fn of(said: Option<f64>, sigma_m: Option<f64>, anchors: &[SurveyedAnchor]) -> AntennaHeight {
        match said {
            Some(u_m) => AntennaHeight {
                u_m,
                sigma_m: sigma_m.unwrap_or(KNOWN_HEIGHT_SIGMA_M).max(0.005),
                known: true,
            },
            None => {
                let heights = || anchors.iter().map(|anchor| anchor.p_n[2]);
                let mean = heights().sum::<f64>() / anchors.len().max(1) as f64;
                let spread = heights().map(|u| (u - mean).abs()).fold(0.0, f64::max);
                AntennaHeight { u_m: mean, sigma_m: UNKNOWN_HEIGHT_SIGMA_M.max(spread), known: false }
            }
        }
    }
}

/// The greatest distance between two anchors, m.
pub fn extent_m(anchors: &[SurveyedAnchor]) -> f64 {
    let mut most = 0.0_f64;
    for (k, a) in anchors.iter().enumerate() {
        for b in &anchors[..k] {
            most = most.max(distance_m(&a.p_n, &b.p_n));
        }
    }
    most
}

/// The distance of two places, m.
pub fn distance_m(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    super::ranges::line(a, b).range_m
}
