//! Places that were known and not told: how far the track is from them.

use crate::evaluate::{Spread, position_at};
use crate::event::TrackPoint;
use crate::parse::truth_csv::KnownPlace;

/// Distance in plan of the track from the markers of visits that it was not told of, each at the middle of
/// its visit. How far the inspector stood beside the marker is in it, too. `None` where none lies in the
/// track.
pub fn held_back(points: &[TrackPoint], places: &[KnownPlace]) -> Option<Spread> {
    let distances: Vec<f64> = places
        .iter()
        .filter_map(|place| {
            let [east, north, _] = position_at(points, place.t_ns)?;
            Some(libm::hypot(east - place.position_m[0], north - place.position_m[1]))
        })
        .collect();
    Spread::of(&distances)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::points;

    #[test]
    fn the_track_is_measured_where_it_was_at_that_time() {
        let track = points([[0.0; 3], [3.0, 0.0, 0.0], [6.0, 0.0, 0.0]]);
        let place = |t_ns| KnownPlace { t_ns, position_m: [6.0, 4.0, 0.0] };
        let spread = held_back(&track, &[place(10_000_000), place(60_000_000)]).unwrap();
        assert_eq!((spread.count, spread.max_m), (1, 5.0));
        assert_eq!(held_back(&track, &[]), None);
    }
}
