//! Fewer points, on a grid of time that does not depend on where a reader starts.

use crate::event::TrackPoint;

/// The first point in each interval of `1/rate_hz` s, counted from the session's start. The rate is
/// positive; one above the track's own keeps every point.
pub fn decimate<'a>(
    points: impl IntoIterator<Item = &'a TrackPoint>,
    rate_hz: f64,
) -> impl Iterator<Item = &'a TrackPoint> {
    let interval_ns = ((1e9 / rate_hz).round() as i64).max(1);
    let mut last = None;
    points.into_iter().filter(move |point| {
        // Half a microsecond of slack: a sample at 0.0999999 s belongs to 0.1 s.
        let cell = (point.t_ns + 500).div_euclid(interval_ns);
        let is_new = last != Some(cell);
        last = Some(cell);
        is_new
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::csv::tests::point;

    #[test]
    fn a_point_an_interval_wherever_the_reader_starts() {
        let points: Vec<_> = (0..1000).map(|i| TrackPoint { t_ns: i * 10_000_000, ..point() }).collect();
        let times: Vec<_> = decimate(&points, 10.0).map(|p| p.t_ns / 10_000_000).collect();
        assert_eq!(times, (0..100).map(|i| i * 10).collect::<Vec<_>>());
        let later: Vec<_> = decimate(&points[35..], 10.0).map(|p| p.t_ns / 10_000_000).collect();
        assert_eq!(later[1..], times[4..]);
        assert_eq!(decimate(&points, 1e6).count(), 1000);
        assert_eq!(decimate(&points, 0.05).count(), 1);
    }
}
