//! Mean, rms, largest, spread.

use serde::Serialize;

/// What a list of distances amounts to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "DistanceSpread"))]
pub struct Spread {
    /// How many.
    pub count: usize,
    /// Mean, m.
    pub mean_m: f64,
    /// Root of the mean square, m.
    pub rms_m: f64,
    /// Standard deviation about the mean (n − 1), m.
    pub std_m: f64,
    /// Largest, m.
    pub max_m: f64,
    /// Not exceeded by 95 %, m.
    pub p95_m: f64,
}

impl Spread {
    /// Of distances in metres; `None` of none.
    pub fn of(distances_m: &[f64]) -> Option<Spread> {
        let n = distances_m.len() as f64;
        let p95_m = percentile(distances_m, 0.95)?;
        let mean_m = distances_m.iter().sum::<f64>() / n;
        let squares: f64 = distances_m.iter().map(|d| d * d).sum();
        let about_mean: f64 = distances_m.iter().map(|d| (d - mean_m) * (d - mean_m)).sum();
        Some(Spread {
            count: distances_m.len(),
            mean_m,
            rms_m: (squares / n).sqrt(),
            std_m: if n > 1.0 { (about_mean / (n - 1.0)).sqrt() } else { 0.0 },
            max_m: distances_m.iter().copied().fold(0.0, f64::max),
            p95_m,
        })
    }
}

/// The value that a share of the values does not exceed, on the straight line between neighbours in
/// order of size; `None` of none.
pub fn percentile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (place - below as f64) * (sorted[above] - sorted[below]))
}

/// The middle value; `None` of none.
pub fn median(values: &[f64]) -> Option<f64> {
    percentile(values, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        let spread = Spread::of(&[3.0, 4.0, 5.0]).unwrap();
        assert_eq!((spread.count, spread.mean_m, spread.max_m, spread.std_m), (3, 4.0, 5.0, 1.0));
        assert!((spread.rms_m - (50.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((spread.p95_m - 4.9).abs() < 1e-12);
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[2.0]).unwrap().std_m, 0.0);
        assert_eq!(median(&[5.0, 1.0, 3.0, 4.0]), Some(3.5));
    }
}
