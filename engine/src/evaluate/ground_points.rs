//! A track against surveyed ground points in a frame of their own, which may be left-handed with up:
//! files do not say, so both hands are tried and the better one is told.

use serde::Serialize;

use crate::evaluate::position_at;
use crate::evaluate::rigid_fit::RigidFit;
use crate::evaluate::statistics::Spread;
use crate::event::TrackPoint;
use crate::parse::truth_csv::KnownPlace;

/// Distances in plan to ground points after a rigid fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GroundPointErrors {
    /// Of the points inside the track.
    pub distance: Spread,
    /// Whether the points' frame was found to be left-handed.
    pub mirrored: bool,
}

/// Lays the track upon the points by a turn and a shift and measures what is left; `None` when fewer
/// than two points lie inside the track.
pub fn ground_points(points: &[TrackPoint], known: &[KnownPlace]) -> Option<GroundPointErrors> {
    let right_handed = what_is_left(&pairs(points, known, 1.0))?;
    let left_handed = what_is_left(&pairs(points, known, -1.0))?;
    let mirrored = left_handed.mean_m < right_handed.mean_m;
    Some(GroundPointErrors { distance: if mirrored { left_handed } else { right_handed }, mirrored })
}

/// The fit by which [`ground_points`] measures, and the sign that the points' y takes before it.
pub(super) fn fit(points: &[TrackPoint], known: &[KnownPlace]) -> Option<(RigidFit, f64)> {
    let hand = if ground_points(points, known)?.mirrored { -1.0 } else { 1.0 };
    Some((RigidFit::new(&pairs(points, known, hand))?, hand))
}

/// The track at each point's time, and the point.
fn pairs(points: &[TrackPoint], known: &[KnownPlace], hand: f64) -> Vec<([f64; 2], [f64; 2])> {
    let pair = |place: &KnownPlace| {
        let [e, n, _] = position_at(points, place.t_ns)?;
        Some(([e, n], [place.position_m[0], hand * place.position_m[1]]))
    };
    known.iter().filter_map(pair).collect()
}

fn what_is_left(pairs: &[([f64; 2], [f64; 2])]) -> Option<Spread> {
    let fit = RigidFit::new(pairs)?;
    let distances: Vec<f64> = pairs
        .iter()
        .map(|(found, place)| {
            let [x, y] = fit.apply(*found);
            libm::hypot(x - place[0], y - place[1])
        })
        .collect();
    Spread::of(&distances)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;

    fn known(positions: &[[f64; 2]]) -> Vec<KnownPlace> {
        (0..)
            .zip(positions)
            .map(|(i, p)| KnownPlace { t_ns: i * 10_000_000, position_m: [p[0], p[1], 0.0] })
            .collect()
    }

    #[test]
    fn a_turn_and_a_shift_are_no_error() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let (sin, cos) = 2.0_f64.sin_cos();
        let turned = square.map(|[x, y]| [cos * x - sin * y + 9.0, sin * x + cos * y - 5.0, 1.0]);
        let errors = ground_points(&points(turned), &known(&square)).unwrap();
        assert!(errors.distance.max_m < 1e-12, "{errors:?}");
    }

    #[test]
    fn a_wrong_scale_is_an_error_and_a_mirror_is_told() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let scaled =
            ground_points(&points(square.map(|[x, y]| [1.5 * x, 1.5 * y, 0.0])), &known(&square)).unwrap();
        assert!((scaled.distance.mean_m - 2.0_f64.sqrt()).abs() < 1e-12);
        let kite = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 9.0]];
        let mirrored = ground_points(&points(kite.map(|[x, y]| [-x, y, 0.0])), &known(&kite)).unwrap();
        assert!(mirrored.mirrored && mirrored.distance.max_m < 1e-12, "{mirrored:?}");
        let same = ground_points(&points(kite.map(|[x, y]| [x, y, 0.0])), &known(&kite)).unwrap();
        assert!(!same.mirrored);
        assert_eq!(ground_points(&points([[0.0; 3]]), &known(&[[0.0, 0.0]])), None);
    }
}
