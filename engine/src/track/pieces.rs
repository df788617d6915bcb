//! A track in pieces: nothing is drawn where nothing was measured.

use crate::event::TrackPoint;

/// A silence that is longer than so many of the usual intervals parts two pieces …
const INTERVALS: i64 = 4;
/// … where it is longer than this, ns.
const LEAST_GAP_NS: i64 = 1_000_000_000;
/// Intervals by which the usual one is judged.
const JUDGED_BY: usize = 1_001;

/// The longest time between two points of one piece, ns.
fn longest_ns<'a>(points: impl Iterator<Item = &'a TrackPoint>) -> i64 {
    let times: Vec<i64> = points.take(JUDGED_BY).map(|point| point.t_ns).collect();
    let mut intervals: Vec<i64> = times.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    intervals.sort_unstable();
    let usual_ns = intervals.get(intervals.len() / 2).copied().unwrap_or_default();
    usual_ns.saturating_mul(INTERVALS).max(LEAST_GAP_NS)
}

/// The pieces of a track, in order.
pub(super) fn pieces<'a>(
    points: impl IntoIterator<Item = &'a TrackPoint> + Clone,
) -> Vec<Vec<&'a TrackPoint>> {
    let longest_ns = longest_ns(points.clone().into_iter());
    let mut pieces: Vec<Vec<&TrackPoint>> = Vec::new();
    for point in points {
        match pieces.last_mut() {
            Some(piece)
                if piece.last().is_some_and(|last| point.t_ns.saturating_sub(last.t_ns) <= longest_ns) =>
            {
                piece.push(point);
            }
            _ => pieces.push(vec![point]),
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::csv::tests::point;

    #[test]
    fn a_track_breaks_where_nothing_was_measured_and_nowhere_else() {
        let at = |tenths: i64| TrackPoint { t_ns: tenths * 100_000_000, ..point() };
        let points: Vec<_> = (0..100).chain(240..300).chain([309]).map(at).collect();
        assert_eq!(pieces(&points).iter().map(Vec::len).collect::<Vec<_>>(), [100, 61]);
        let slow: Vec<_> = (0..50).map(|k| at(50 * k)).collect();
        assert_eq!(pieces(&slow).len(), 1, "a point every five seconds is a rate");
        assert!(pieces(&Vec::new()).is_empty());
    }
}
