//! How good a track is, by the figures that the field uses.

mod against_truth;
mod chi_square;
mod ground_points;
mod held_back;
mod loop_closure;
mod markers;
mod motion_capture;
mod overlay;
pub mod pedestrian;
mod rigid_fit;
mod session_report;
mod statistics;
mod visits;

pub use against_truth::{TruthErrors, against_truth};
pub use chi_square::chi_square_bounds_95;
pub use ground_points::{GroundPointErrors, ground_points};
pub use held_back::held_back;
pub use loop_closure::{LoopClosure, loop_closure};
pub use markers::{CalibrationBin, MarkerScore};
pub use motion_capture::{MotionCaptureErrors, motion_capture};
pub use overlay::Overlay;
pub use session_report::{AidReport, RejectedVisit, SessionReport};
pub use statistics::{Spread, median, percentile};
pub use visits::{VisitErrors, visits};

use crate::event::TrackPoint;

/// The position at a time, on the straight line between the neighbouring points; `None` outside of
/// the track.
fn position_at(points: &[TrackPoint], t_ns: i64) -> Option<[f64; 3]> {
    let after = points.partition_point(|point| point.t_ns < t_ns);
    let b = points.get(after)?;
    if b.t_ns == t_ns {
        return Some(b.position_n_m);
    }
    let a = &points[after.checked_sub(1)?];
    let share = (t_ns - a.t_ns) as f64 / (b.t_ns - a.t_ns) as f64;
    let mut position = a.position_n_m;
    for (from, to) in position.iter_mut().zip(b.position_n_m) {
        *from += share * (to - *from);
    }
    Some(position)
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn points(positions: impl IntoIterator<Item = [f64; 3]>) -> Vec<TrackPoint> {
        (0..)
            .zip(positions)
            .map(|(i, position_n_m)| TrackPoint {
                t_ns: i * 10_000_000,
                position_n_m,
                heading_rad: 0.0,
                sigma_heading_rad: 0.0,
                sigma_n_m: [0.0; 3],
                covariance_en_m2: 0.0,
                tilt: None,
                parts: [None; 2],
            })
            .collect()
    }

    #[test]
    fn positions_lie_on_the_line_between_neighbours() {
        let track = points([[0.0; 3], [1.0, 2.0, 3.0]]);
        assert_eq!(position_at(&track, 2_500_000), Some([0.25, 0.5, 0.75]));
        assert_eq!(position_at(&track, 10_000_000), Some([1.0, 2.0, 3.0]));
        assert_eq!(position_at(&track, -1), None);
        assert_eq!(position_at(&track, 10_000_001), None);
    }
}
