//! What a chart shows, whatever it is drawn on.

use super::axis::Axis;

/// One chart.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Chart {
    pub(in crate::cli) title: String,
    pub(in crate::cli) x: Axis,
    pub(in crate::cli) y: Axis,
    pub(in crate::cli) series: Vec<Series>,
}

/// Points that belong together; those that are no numbers, or not positive on a logarithmic axis, are
/// left out, and a line is broken there.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Series {
    pub(in crate::cli) name: String,
    pub(in crate::cli) mark: Mark,
    pub(in crate::cli) points: Vec<[f64; 2]>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) enum Mark {
    Line,
    Dashes,
    Points,
}

impl Chart {
    /// The chart's points with their place from 0 to 1 on both axes, line by line.
    pub(super) fn placed(&self) -> Vec<Vec<Vec<[f64; 2]>>> {
        let all = || self.series.iter().flat_map(|series| &series.points);
        let x = self.x.range(all().map(|point| point[0]));
        let y = self.y.range(all().map(|point| point[1]));
        let place = |point: &[f64; 2]| Some([self.x.place(point[0], x)?, self.y.place(point[1], y)?]);
        let lines = |series: &Series| {
            let mut lines = vec![Vec::new()];
            for point in &series.points {
                match place(point) {
                    Some(placed) => lines.last_mut().expect("there is always a last line").push(placed),
                    None => lines.push(Vec::new()),
                }
            }
            lines.retain(|line| !line.is_empty());
            lines
        };
        self.series.iter().map(lines).collect()
    }

    /// Ticks of the x and of the y axis: place from 0 to 1, and label.
    pub(super) fn ticks(&self) -> [Vec<(f64, String)>; 2] {
        let all = || self.series.iter().flat_map(|series| &series.points);
        [self.x.ticks(all().map(|point| point[0])), self.y.ticks(all().map(|point| point[1]))]
    }
}
