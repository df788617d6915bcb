//! A track against the simulator's truth, in the same frame and without any fit.

use serde::Serialize;

use crate::evaluate::position_at;
use crate::evaluate::statistics::Spread;
use crate::event::TrackPoint;
use crate::parse::truth_csv::KnownPlace;

/// Errors against the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TruthErrors {
    /// Distance in plan over time.
    pub horizontal: Spread,
    /// Rms of the height error, m.
    pub height_rms_m: f64,
    /// Distance in plan at the end, m.
    pub end_error_m: f64,
    /// The same in percent of the true path.
    pub end_error_percent: f64,
    /// Height at the end, track minus truth, m.
    pub end_height_error_m: f64,
    /// Length of the true path in plan, m.
    pub path_m: f64,
}

/// Compares at every instant of the truth that lies inside the track; `None` when there is none.
pub fn against_truth(points: &[TrackPoint], truth: &[KnownPlace]) -> Option<TruthErrors> {
    let mut distances = Vec::new();
    let mut squared_height = 0.0;
    let mut last = [0.0; 3];
    for known in truth {
        let Some(found) = position_at(points, known.t_ns) else { continue };
        last = [0, 1, 2].map(|i| found[i] - known.position_m[i]);
        distances.push(libm::hypot(last[0], last[1]));
        squared_height += last[2] * last[2];
    }
    let path_m = truth
        .windows(2)
        .map(|w| {
            libm::hypot(w[1].position_m[0] - w[0].position_m[0], w[1].position_m[1] - w[0].position_m[1])
        })
        .sum();
    let end_error_m = *distances.last()?;
    Some(TruthErrors {
        horizontal: Spread::of(&distances)?,
        height_rms_m: (squared_height / distances.len() as f64).sqrt(),
        end_error_m,
        end_error_percent: 100.0 * end_error_m / path_m,
        end_height_error_m: last[2],
        path_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;

    #[test]
    fn no_fit_is_made() {
        let track = points((0..11).map(|i| [f64::from(i) + 3.0, 4.0, 1.0]));
        let truth: Vec<_> =
            (0..11).map(|i| KnownPlace { t_ns: i * 10_000_000, position_m: [i as f64, 0.0, 0.0] }).collect();
        let errors = against_truth(&track, &truth).unwrap();
        assert_eq!((errors.horizontal.rms_m, errors.end_error_m, errors.height_rms_m), (5.0, 5.0, 1.0));
        assert_eq!((errors.path_m, errors.end_error_percent), (10.0, 50.0));
        assert_eq!(against_truth(&[], &truth), None);
    }
}
