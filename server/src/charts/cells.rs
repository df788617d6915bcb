//! The smallest and the largest value in each cell of a grid in time.

use crate::store::charts::Series;

/// Length of a cell of what is known at every sample, ns.
pub(super) const CELL_NS: i64 = 100_000_000;

/// A recording longer than this many cells is not drawn to its end: eleven hours by [`CELL_NS`]. A broken
/// clock that jumps by a year must not ask for the memory of a year.
const MOST_CELLS: i64 = 400_000;

/// Values gathered by the cell that their time lies in. What is not a number is left out.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    cell_ns: i64,
    first_cell: i64,
    low: Vec<f32>,
    high: Vec<f32>,
}

impl Cells {
    pub(super) fn new(cell_ns: i64) -> Cells {
        Cells { cell_ns, first_cell: 0, low: Vec::new(), high: Vec::new() }
    }

    /// Takes one value in; times may go back a little.
    #[inline]
    pub(super) fn take(&mut self, t_ns: i64, value: f64) {
        let value = value as f32;
        if !value.is_finite() {
            return;
        }
        let cell = t_ns.div_euclid(self.cell_ns);
        if self.low.is_empty() {
            self.first_cell = cell;
        }
        if cell < self.first_cell {
            let missing = self.first_cell.saturating_sub(cell);
            if missing.saturating_add(self.low.len() as i64) > MOST_CELLS {
                return;
            }
            let front = || std::iter::repeat_n(f32::NAN, missing as usize);
            self.low.splice(0..0, front());
            self.high.splice(0..0, front());
            self.first_cell = cell;
        }
        let place = cell.saturating_sub(self.first_cell);
        if place >= MOST_CELLS {
            return;
        }
        let place = place as usize;
        if place >= self.low.len() {
            self.low.resize(place + 1, f32::NAN);
            self.high.resize(place + 1, f32::NAN);
        }
        // Of a NaN and a number, these give the number.
        self.low[place] = self.low[place].min(value);
        self.high[place] = self.high[place].max(value);
    }

    /// As a line of a chart; `None` where there is not one value.
    pub(super) fn into_series(self, chart: &str, name: &str) -> Option<Series> {
        (!self.low.is_empty()).then(|| Series {
            chart: chart.to_owned(),
            name: name.to_owned(),
            cell_ns: self.cell_ns,
            first_cell: self.first_cell,
            low: self.low,
            high: self.high,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_cell_has_its_extremes_and_a_hole_stays_one() {
        let mut cells = Cells::new(100);
        for (t_ns, value) in [(250, 2.0), (299, -1.0), (210, 0.5), (520, 7.0), (310, f64::NAN), (-1, 3.0)] {
            cells.take(t_ns, value);
        }
        let series = cells.into_series("a", "b").unwrap();
        assert_eq!(series.first_cell, -1);
        let known = |values: &[f32]| values.iter().map(|v| v.is_finite().then_some(*v)).collect::<Vec<_>>();
        assert_eq!(known(&series.low), [Some(3.0), None, None, Some(-1.0), None, None, Some(7.0)]);
        assert_eq!(known(&series.high), [Some(3.0), None, None, Some(2.0), None, None, Some(7.0)]);
    }

    #[test]
    fn a_clock_that_jumps_by_a_year_takes_no_memory() {
        let mut cells = Cells::new(CELL_NS);
        for t_ns in [0, 31_557_600_000_000_000, i64::MIN, i64::MAX] {
            cells.take(t_ns, 1.0);
        }
        assert_eq!(cells.into_series("a", "b").unwrap().low.len(), 1);
    }

    #[test]
    fn nothing_is_no_line() {
        assert_eq!(Cells::new(1).into_series("a", "b"), None);
    }
}
