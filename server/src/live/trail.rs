//! The line that an inspector has walked, as the map draws it: revisable, thinned, cheap to send.

/// One vertex of a trail: time since the session's start in ns, east and north in m.
pub type TrailPoint = (i64, f64, f64);

/// Spacing in time of the vertices that the server keeps, ns. Clients see five a second; a
/// new client can do with one, since the line is simplified for it anyhow.
const SPACING_NS: i64 = 1_000_000_000;

/// How far a vertex may be off the simplified line before it has to stay, m.
const TOLERANCE_M: f64 = 0.3;

/// A trail, oldest vertex first, no two of the same time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trail {
    points: Vec<TrailPoint>,
}

impl Trail {
    /// A trail of these vertices, which come oldest first.
    pub fn from_points(points: impl IntoIterator<Item = TrailPoint>) -> Trail {
        let mut trail = Trail::default();
        for point in points {
            trail.push(point);
        }
        trail
    }

    /// Appends a vertex, unless the last one is of the same second.
    pub fn push(&mut self, point: TrailPoint) {
        let cell = |p: &TrailPoint| p.0.div_euclid(SPACING_NS);
        if self.points.last().is_none_or(|last| cell(last) < cell(&point)) {
            self.points.push(point);
        }
    }

    /// Replaces the trail from the first to the last time of these points by them; where they go
    /// beyond its end, they extend it.
    pub fn revise(&mut self, points: &[TrailPoint]) {
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return };
        let from = self.points.partition_point(|p| p.0 < first.0);
        let to = self.points.partition_point(|p| p.0 <= last.0);
        let rest = self.points.split_off(to);
        self.points.truncate(from);
        for point in points {
            self.push(*point);
        }
        for point in rest {
            self.push(point);
        }
    }

    /// Since when it has not left its last vertex by more than this, ns; `None` of an empty one.
    pub fn stays_since(&self, within_m: f64) -> Option<i64> {
        let last = self.points.last()?;
        let near = |p: &&TrailPoint| (p.1 - last.1).hypot(p.2 - last.2) <= within_m;
        self.points.iter().rev().take_while(near).last().map(|p| p.0)
    }

    /// The vertices that are needed to draw the line to within 0.3 m (Douglas and Peucker, 1973).
    pub fn simplified(&self) -> Vec<TrailPoint> {
        let points = &self.points;
        if points.len() < 3 {
            return points.clone();
        }
        let mut keep = vec![false; points.len()];
        keep[0] = true;
        keep[points.len() - 1] = true;
        let mut open = vec![(0, points.len() - 1)];
        while let Some((from, to)) = open.pop() {
            let farthest = (from + 1..to)
                .map(|i| (i, distance_to_segment_m(points[i], points[from], points[to])))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((middle, distance_m)) = farthest
                && distance_m > TOLERANCE_M
            {
                keep[middle] = true;
                open.push((from, middle));
                open.push((middle, to));
            }
        }
        points.iter().zip(keep).filter_map(|(point, kept)| kept.then_some(*point)).collect()
    }
}

fn distance_to_segment_m(p: TrailPoint, a: TrailPoint, b: TrailPoint) -> f64 {
    let (along_e, along_n) = (b.1 - a.1, b.2 - a.2);
    let (to_e, to_n) = (p.1 - a.1, p.2 - a.2);
    let length_squared = along_e * along_e + along_n * along_n;
    let fraction = if length_squared > 0.0 {
        ((to_e * along_e + to_n * along_n) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (to_e - fraction * along_e).hypot(to_n - fraction * along_n)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_second(s: i64, e: f64, n: f64) -> TrailPoint {
        (s * 1_000_000_000, e, n)
    }

    #[test]
    fn one_vertex_a_second_is_kept() {
        let trail = Trail::from_points((0..50).map(|i| (i * 200_000_000, i as f64, 0.0)));
        assert_eq!(trail.points.len(), 10);
        assert_eq!(trail.points[3], at_second(3, 15.0, 0.0));
    }

    #[test]
    fn a_correction_moves_its_own_stretch_and_no_other() {
        let mut trail = Trail::from_points((0..10).map(|s| at_second(s, s as f64, 0.0)));
        let corrected: Vec<_> = (15..=30).map(|i| (i * 200_000_000, i as f64 / 5.0, 7.0)).collect();
        trail.revise(&corrected);
        let north: Vec<f64> = trail.points.iter().map(|p| p.2).collect();
        assert_eq!(north, [0.0, 0.0, 0.0, 7.0, 7.0, 7.0, 7.0, 0.0, 0.0, 0.0]);
        assert!(trail.points.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn it_stays_since_it_came_near_for_the_last_time() {
        let walked = [(0, 0.0), (1, 1.0), (2, 40.0), (3, 2.0), (4, 0.5), (9, 1.5)];
        let trail = Trail::from_points(walked.map(|(s, e)| at_second(s, e, 0.0)));
        assert_eq!(trail.stays_since(3.0), Some(3_000_000_000));
        assert_eq!(trail.stays_since(0.1), Some(9_000_000_000));
        assert_eq!(Trail::default().stays_since(3.0), None);
    }

    #[test]
    fn points_beyond_the_end_extend_the_trail() {
        let mut trail = Trail::from_points((0..3).map(|s| at_second(s, s as f64, 0.0)));
        trail.revise(&(3..6).map(|s| at_second(s, s as f64, 1.0)).collect::<Vec<_>>());
        assert_eq!(
            trail,
            Trail::from_points((0..6).map(|s| at_second(s, s as f64, f64::from(u8::from(s > 2)))))
        );
    }

    #[test]
    fn a_simplified_line_stays_within_the_tolerance_and_keeps_its_corners() {
        let corner = (0..20).map(|s| at_second(s, s as f64, 0.1 * f64::from(s as i32 % 2)));
        let up = (20..40).map(|s| at_second(s, 19.0, (s - 19) as f64));
        let trail = Trail::from_points(corner.chain(up));
        let simple = trail.simplified();
        assert!(simple.len() <= 5, "{simple:?}");
        assert_eq!(simple.first(), trail.points.first());
        assert_eq!(simple.last(), trail.points.last());
        for point in &trail.points {
            let nearest = simple
                .windows(2)
                .map(|leg| distance_to_segment_m(*point, leg[0], leg[1]))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest <= TOLERANCE_M, "{point:?} is {nearest} m off");
        }
    }

    #[test]
    fn a_walk_back_over_the_same_line_keeps_its_turning_point() {
        let there = (0..10).map(|s| at_second(s, s as f64, 0.0));
        let back = (10..20).map(|s| at_second(s, (19 - s) as f64, 0.0));
        let simple = Trail::from_points(there.chain(back)).simplified();
        assert!(simple.iter().any(|p| p.1 == 9.0), "{simple:?}");
    }
}
