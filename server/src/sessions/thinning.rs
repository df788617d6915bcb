//! Which epochs of a track are kept: the first of each cell of a grid in time that is fixed by the
//! session's clock, so that every run and every door keeps the same ones.

/// A sample at 0.0999999 s belongs to 0.1 s, ns.
pub(crate) const SLACK_NS: i64 = 500;

/// The cell of a rate, ns.
pub(crate) fn cell_ns(rate_hz: f64) -> i64 {
    // A rate above 1 GHz keeps everything; one of zero or less cannot be asked for.
    ((1e9 / rate_hz).round() as i64).max(1)
}

/// The cell that a time lies in.
pub(crate) fn cell_of(t_ns: i64, cell_ns: i64) -> i64 {
    (t_ns + SLACK_NS).div_euclid(cell_ns)
}

/// Chooses among points that come by time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Thinning {
    cell_ns: i64,
    last_cell: Option<i64>,
}

impl Thinning {
    pub(crate) fn new(cell_ns: i64) -> Thinning {
        Thinning { cell_ns, last_cell: None }
    }

    /// Whether a point is the first of its cell.
    pub(crate) fn takes(&mut self, t_ns: i64) -> bool {
        let cell = cell_of(t_ns, self.cell_ns);
        let first = self.last_cell != Some(cell);
        self.last_cell = Some(cell);
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(times: &[i64], cell_ns: i64) -> Vec<i64> {
        let mut grid = Thinning::new(cell_ns);
        times.iter().copied().filter(|t| grid.takes(*t)).collect()
    }

    #[test]
    fn ten_of_a_hundred_are_kept_and_a_hole_shifts_nothing() {
        let times: Vec<i64> = (0..100).chain(137..200).map(|i| i * 10_000_000).collect();
        let kept = kept(&times, cell_ns(10.0));
        assert_eq!(kept[..3], [0, 100_000_000, 200_000_000]);
        assert_eq!(kept[10..13], [1_370_000_000, 1_400_000_000, 1_500_000_000]);
    }

    #[test]
    fn times_before_the_start_have_cells_of_their_own() {
        let us = |times: &[i64]| times.iter().map(|t| t * 1_000).collect::<Vec<_>>();
        assert_eq!(kept(&us(&[-150, -101, -100, -1, 0, 99, 100]), 100_000), us(&[-150, -100, 0, 100]));
    }

    #[test]
    fn the_command_line_keeps_the_same_ones() {
        use lodestep_engine::event::TrackPoint;
        let point = |t_ns| TrackPoint {
            t_ns,
            position_n_m: [0.0; 3],
            heading_rad: 0.0,
            sigma_heading_rad: 0.0,
            sigma_n_m: [0.0; 3],
            covariance_en_m2: 0.0,
            tilt: None,
            parts: [None; 2],
        };
        // A clock of 99.7 Hz that crosses the grid just before, on and just behind its lines.
        let points: Vec<_> =
            (0..5_000).map(|i| point(i * 10_030_090 - 700)).chain([point(50_199_999_600)]).collect();
        let times: Vec<_> = points.iter().map(|point| point.t_ns).collect();
        for rate_hz in [10.0, 3.0, 100.0] {
            let theirs: Vec<_> =
                lodestep_engine::track::decimate(&points, rate_hz).map(|point| point.t_ns).collect();
            assert_eq!(kept(&times, cell_ns(rate_hz)), theirs);
        }
    }

    #[test]
    fn a_rate_above_the_recorded_one_keeps_everything() {
        let times = [0, 1_000, 2_000, 3_000];
        assert_eq!(kept(&times, cell_ns(1e12)), times);
    }
}
