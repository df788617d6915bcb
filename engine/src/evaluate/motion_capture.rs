//! A track against motion capture, by the measure of the pyshoe data set.
//!
//! That set's cameras give x and y in a frame that is left-handed with up, as its inertial frame has z
//! down. Which hand a frame has is not in the files, so both are tried and the better one is told.

use serde::Serialize;

use crate::evaluate::position_at;
use crate::event::TrackPoint;
use crate::parse::truth_csv::KnownPlace;

/// The first stretch in plan on which the headings are aligned, m.
const ALIGNMENT_M: f64 = 0.8;

/// Errors against motion capture, start and first heading aligned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MotionCaptureErrors {
    /// Mean over time of √(mean of the squared axis errors in x and y), m: pyshoe's ARMSE.
    pub armse_m: f64,
    /// Distance in plan at the last instant, m.
    pub end_error_m: f64,
    /// Height at the last instant, track minus truth, m.
    pub end_height_error_m: f64,
    /// Length of the true path in plan, m.
    pub path_m: f64,
    /// Whether the truth's frame was found to be left-handed.
    pub mirrored: bool,
}

/// Compares at every instant of the truth that lies inside the track; `None` when the two have no
/// time in common or one never leaves its place by 0.8 m.
pub fn motion_capture(points: &[TrackPoint], truth: &[KnownPlace]) -> Option<MotionCaptureErrors> {
    let (mut track, mut true_track): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
        truth.iter().filter_map(|known| Some((position_at(points, known.t_ns)?, known.position_m))).unzip();
    start_at_zero(&mut track);
    start_at_zero(&mut true_track);
    let right_handed = compare(&track, &true_track)?;
    for [_, y, _] in &mut true_track {
        *y = -*y;
    }
    let left_handed = compare(&track, &true_track)?;
    Some(if left_handed.armse_m < right_handed.armse_m {
        MotionCaptureErrors { mirrored: true, ..left_handed }
    } else {
        right_handed
    })
}

/// How a track is laid upon its truth: both from their start, the track turned, the truth mirrored where
/// its frame is left-handed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alignment {
    from: [f64; 2],
    known_from: [f64; 2],
    turn_rad: f64,
    hand: f64,
}

impl Alignment {
    /// The one by which [`motion_capture`] compares.
    pub(super) fn of(points: &[TrackPoint], truth: &[KnownPlace]) -> Option<Alignment> {
        let hand = if motion_capture(points, truth)?.mirrored { -1.0 } else { 1.0 };
        let (mut track, mut known): (Vec<[f64; 3]>, Vec<[f64; 3]>) = truth
            .iter()
            .filter_map(|place| Some((position_at(points, place.t_ns)?, place.position_m)))
            .unzip();
        let ([from, known_from], flip) =
            ([*track.first()?, *known.first()?], |[x, y, z]: [f64; 3]| [x, hand * y, z]);
        start_at_zero(&mut track);
        start_at_zero(&mut known);
        let known: Vec<[f64; 3]> = known.into_iter().map(flip).collect();
        let turn_rad = first_direction_rad(&known)? - first_direction_rad(&track)?;
        Some(Alignment {
            from: [from[0], from[1]],
            known_from: [known_from[0], known_from[1]],
            turn_rad,
            hand,
        })
    }

    /// Where a place of the track lies.
    pub(super) fn track(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.turn_rad);
        let (x, y) = (x - self.from[0], y - self.from[1]);
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Where a place of the truth lies.
    pub(super) fn known(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x - self.known_from[0], self.hand * (y - self.known_from[1])]
    }
}

/// Turns the track into the truth's heading and compares; both start at zero.
fn compare(track: &[[f64; 3]], true_track: &[[f64; 3]]) -> Option<MotionCaptureErrors> {
    let turn_rad = first_direction_rad(true_track)? - first_direction_rad(track)?;
    let (sin, cos) = libm::sincos(turn_rad);
    let mut sum_m = 0.0;
    let mut last_m = [0.0; 3];
    for (found, known) in track.iter().zip(true_track) {
        let dx = cos * found[0] - sin * found[1] - known[0];
        let dy = sin * found[0] + cos * found[1] - known[1];
        sum_m += ((dx * dx + dy * dy) / 2.0).sqrt();
        last_m = [dx, dy, found[2] - known[2]];
    }
    Some(MotionCaptureErrors {
        armse_m: sum_m / track.len() as f64,
        end_error_m: libm::hypot(last_m[0], last_m[1]),
        end_height_error_m: last_m[2],
        path_m: true_track.windows(2).map(|w| libm::hypot(w[1][0] - w[0][0], w[1][1] - w[0][1])).sum(),
        mirrored: false,
    })
}

fn start_at_zero(track: &mut [[f64; 3]]) {
    let Some(&first) = track.first() else { return };
    for position in track {
        for (value, start) in position.iter_mut().zip(first) {
            *value -= start;
        }
    }
}

/// The direction in plan of the first position that is farther than 0.8 m from the start.
fn first_direction_rad(track: &[[f64; 3]]) -> Option<f64> {
    let [x, y, _] = track.iter().find(|p| libm::hypot(p[0], p[1]) > ALIGNMENT_M)?;
    Some(libm::atan2(*y, *x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;

    fn truth(positions: impl IntoIterator<Item = [f64; 3]>) -> Vec<KnownPlace> {
        points(positions).iter().map(|p| KnownPlace { t_ns: p.t_ns, position_m: p.position_n_m }).collect()
    }

    #[test]
    fn a_shifted_and_turned_track_has_no_error() {
        let path = |i: usize| [i as f64 * 0.1, (i as f64 * 0.05).sin(), 0.3];
        let turned = (0..100).map(|i| {
            let [x, y, z] = path(i);
            [-y + 7.0, x - 3.0, z + 1.0]
        });
        let errors = motion_capture(&points(turned), &truth((0..100).map(path))).unwrap();
        assert!(errors.armse_m < 1e-12, "{errors:?}");
        assert!(errors.end_height_error_m.abs() < 1e-12);
    }

    #[test]
    fn a_left_handed_truth_is_found_out() {
        let path: Vec<_> = (0..100).map(|i| [f64::from(i) * 0.1, (f64::from(i) * 0.1).sin(), 0.0]).collect();
        let mirrored = truth(path.iter().map(|p| [p[0], -p[1], p[2]]));
        let errors = motion_capture(&points(path.clone()), &mirrored).unwrap();
        assert!(errors.mirrored && errors.armse_m < 1e-12, "{errors:?}");
        assert!(!motion_capture(&points(path.clone()), &truth(path)).unwrap().mirrored);
    }

    #[test]
    fn a_known_error_is_measured_as_pyshoe_does() {
        // Straight and right for 1 m, then 0.2 m aside: √(0.2²/2) on 10 of 20 instants.
        let known: Vec<_> = (0..20).map(|i| [i as f64 * 0.1, 0.0, 0.0]).collect();
        let found = known.iter().enumerate().map(|(i, p)| [p[0], if i >= 10 { 0.2 } else { 0.0 }, 0.0]);
        let errors = motion_capture(&points(found), &truth(known.clone())).unwrap();
        assert!((errors.armse_m - 0.5 * 0.2 / 2.0_f64.sqrt()).abs() < 1e-12);
        assert!((errors.end_error_m - 0.2).abs() < 1e-12);
        assert!((errors.path_m - 1.9).abs() < 1e-12);
    }

    #[test]
    fn nothing_to_compare_is_no_figure() {
        assert_eq!(motion_capture(&[], &[]), None);
        let still = points([[0.0; 3]; 5]);
        assert_eq!(motion_capture(&still, &truth([[0.0; 3]; 5])), None);
    }
}
