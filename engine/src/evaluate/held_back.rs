//! Markers that were visited and not told: how far the track is from them.

use crate::evaluate::{Spread, position_at};
use crate::event::TrackPoint;
use crate::session::Visit;

/// Distance in plan of the track from the markers of visits that it was not told of, at the moments of the
/// visits. It holds what the inspector stood beside the marker, too. `None` where no visit lies in the track.
pub fn held_back(points: &[TrackPoint], visits: &[Visit]) -> Option<Spread> {
    let distances: Vec<f64> = visits
        .iter()
        .filter_map(|visit| {
            let [east, north, _] = position_at(points, visit.moment_ns())?;
            Some(libm::hypot(east - visit.position_n_m.0, north - visit.position_n_m.1))
        })
        .collect();
    Spread::of(&distances)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;

    #[test]
    fn the_track_is_measured_at_the_middle_of_a_visit() {
        let track = points([[0.0; 3], [3.0, 0.0, 0.0], [6.0, 0.0, 0.0]]);
        let visit = |t_start_ns, t_end_ns| Visit {
            marker: "A1".to_owned(),
            t_start_ns,
            t_end_ns,
            position_n_m: (6.0, 4.0, None),
        };
        let spread =
            held_back(&track, &[visit(8_000_000, 12_000_000), visit(60_000_000, 70_000_000)]).unwrap();
        assert_eq!((spread.count, spread.max_m), (1, 5.0));
        assert_eq!(held_back(&track, &[]), None);
    }
}
