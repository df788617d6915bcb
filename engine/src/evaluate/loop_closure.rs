//! A walk that ended where it began: how far apart the track puts the two.

use serde::Serialize;

use crate::event::TrackPoint;

/// The error at the end of a closed walk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LoopClosure {
    /// Distance between end and start in plan, m.
    pub end_error_m: f64,
    /// The same in percent of the path.
    pub end_error_percent: f64,
    /// End minus start in height, m.
    pub height_error_m: f64,
    /// Length of the path, m.
    pub path_m: f64,
}

/// Judges a closed walk; `path_m` is its length, stance by stance. `None` of a track without points
/// or length.
pub fn loop_closure(points: &[TrackPoint], path_m: f64) -> Option<LoopClosure> {
    let (first, last) = (points.first()?, points.last()?);
    let [e, n, u] = [0, 1, 2].map(|i| last.position_n_m[i] - first.position_n_m[i]);
    let end_error_m = libm::hypot(e, n);
    (path_m > 0.0).then(|| LoopClosure {
        end_error_m,
        end_error_percent: 100.0 * end_error_m / path_m,
        height_error_m: u,
        path_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;

    #[test]
    fn the_end_is_measured_from_the_start() {
        let track = points([[1.0, 1.0, 0.0], [50.0, 1.0, 0.0], [1.3, 1.4, -0.2]]);
        let closure = loop_closure(&track, 100.0).unwrap();
        assert!((closure.end_error_m - 0.5).abs() < 1e-12);
        assert!((closure.end_error_percent - 0.5).abs() < 1e-12);
        assert_eq!(closure.height_error_m, -0.2);
        assert_eq!(loop_closure(&[], 100.0), None);
        assert_eq!(loop_closure(&track, 0.0), None);
    }
}
