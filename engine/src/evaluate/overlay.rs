//! A track laid upon what is known of its walk, in plan: what a picture of it shows.

use crate::event::TrackPoint;
use crate::parse::truth_csv::KnownPlace;

use super::{ground_points, motion_capture};

/// A track and what is known, in one frame, m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    /// The track, point by point.
    pub track: Vec<[f64; 2]>,
    /// The true places, or ground points.
    pub known: Vec<[f64; 2]>,
}

impl Overlay {
    /// A track beside places in the same frame.
    pub fn in_one_frame(points: &[TrackPoint], known: &[KnownPlace]) -> Overlay {
        let plan = |[x, y, _]: [f64; 3]| [x, y];
        Overlay {
            track: points.iter().map(|point| plan(point.position_n_m)).collect(),
            known: known.iter().map(|place| plan(place.position_m)).collect(),
        }
    }

    /// As motion capture is compared: start, first heading and hand of the frame aligned.
    pub fn on_motion_capture(points: &[TrackPoint], known: &[KnownPlace]) -> Option<Overlay> {
        let alignment = motion_capture::Alignment::of(points, known)?;
        let plain = Overlay::in_one_frame(points, known);
        Some(Overlay {
            track: plain.track.into_iter().map(|place| alignment.track(place)).collect(),
            known: plain.known.into_iter().map(|place| alignment.known(place)).collect(),
        })
    }

    /// As ground points are compared: after a rigid fit in the frame's hand.
    pub fn on_ground_points(points: &[TrackPoint], known: &[KnownPlace]) -> Option<Overlay> {
        let (fit, hand) = ground_points::fit(points, known)?;
        let plain = Overlay::in_one_frame(points, known);
        Some(Overlay {
            track: plain.track.into_iter().map(|place| fit.apply(place)).collect(),
            known: plain.known.into_iter().map(|[x, y]| [x, hand * y]).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;

    /// A walk around a corner, and the same in a left-handed frame that is turned and shifted.
    fn corner() -> (Vec<TrackPoint>, Vec<KnownPlace>) {
        let path: Vec<[f64; 3]> =
            (0..60).map(|i| [0.1 * f64::from(i.min(30)), 0.1 * f64::from((i - 30).max(0)), 0.0]).collect();
        let known = points(path.iter().map(|[x, y, _]| [4.0 - y, 7.0 - x, 0.0]));
        let known = known.iter().map(|p| KnownPlace { t_ns: p.t_ns, position_m: p.position_n_m }).collect();
        (points(path), known)
    }

    #[track_caller]
    fn assert_one_upon_the_other(overlay: &Overlay) {
        assert_eq!(overlay.track.len(), overlay.known.len());
        for (a, b) in overlay.track.iter().zip(&overlay.known) {
            assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9, "{a:?} and {b:?}");
        }
    }

    #[test]
    fn the_same_walk_in_another_frame_lies_on_itself() {
        let (track, known) = corner();
        assert_one_upon_the_other(&Overlay::on_motion_capture(&track, &known).unwrap());
        assert_one_upon_the_other(&Overlay::on_ground_points(&track, &known).unwrap());
    }

    #[test]
    fn what_cannot_be_aligned_is_no_picture() {
        assert_eq!(Overlay::on_motion_capture(&[], &[]), None);
        assert_eq!(Overlay::on_ground_points(&[], &[]), None);
    }
}
