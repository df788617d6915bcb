//! A chart in characters: dots of Braille, two by four in each, and a letter for each point.

use super::chart::{Chart, Mark};

const COLUMNS: usize = 64;
const ROWS: usize = 14;
/// The bit of each dot of a Braille character, row by row.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
/// What stands for the points of each series.
const POINTS: [char; 4] = ['●', '○', '×', '+'];

/// The chart as lines of text.
pub(in crate::cli) fn terminal(chart: &Chart) -> String {
    let mut dots = [[0_u32; COLUMNS]; ROWS];
    let mut marks = [[None; COLUMNS]; ROWS];
    let (wide, high) = ((2 * COLUMNS - 1) as f64, (4 * ROWS - 1) as f64);
    for (k, (series, lines)) in chart.series.iter().zip(chart.placed()).enumerate() {
        for line in lines {
            let at: Vec<(f64, f64)> = line.into_iter().map(|[x, y]| (x * wide, (1.0 - y) * high)).collect();
            if series.mark == Mark::Points {
                for (x, y) in at {
                    marks[y.round() as usize / 4][x.round() as usize / 2] = Some(POINTS[k % POINTS.len()]);
                }
                continue;
            }
            for ends in at.windows(2) {
                let (from, to) = (ends[0], ends[1]);
                let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0) as usize;
                for step in 0..=steps {
                    let share = step as f64 / steps as f64;
                    let x = (from.0 + share * (to.0 - from.0)).round() as usize;
                    let y = (from.1 + share * (to.1 - from.1)).round() as usize;
                    // A dashed line is there in every other four dots.
                    if series.mark == Mark::Line || (x / 4).is_multiple_of(2) {
                        dots[y / 4][x / 2] |= DOTS[y % 4][x % 2];
                    }
                }
            }
        }
    }
    let [x_ticks, y_ticks] = chart.ticks();
    let margin = y_ticks.iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0);
    let mut out = format!("{}   (up: {})\n", chart.title, chart.y.label);
    for row in 0..ROWS {
        let label = y_ticks
            .iter()
            .find(|(place, _)| ((1.0 - place) * high).round() as usize / 4 == row)
            .map_or("", |(_, label)| label);
        out += &format!("{label:>margin$} {}", if label.is_empty() { '│' } else { '┤' });
        let line: String = (0..COLUMNS)
            .map(|column| {
                marks[row][column]
                    .unwrap_or_else(|| char::from_u32(0x2800 + dots[row][column]).unwrap_or(' '))
            })
            .map(|c| if c == '\u{2800}' { ' ' } else { c })
            .collect();
        out += line.trim_end();
        out.push('\n');
    }
    out += &format!("{:margin$} └{}\n", "", "─".repeat(COLUMNS));
    let mut labels = String::new();
    for (place, label) in x_ticks {
        let centre = margin + 2 + (place * wide).round() as usize / 2;
        let start = centre.saturating_sub(label.chars().count() / 2);
        let there = labels.chars().count();
        if start > there || there == 0 {
            labels += &" ".repeat(start - there);
            labels += &label;
        }
    }
    out += &format!("{labels}   {}\n", chart.x.label);
    for (k, series) in chart.series.iter().enumerate() {
        let sample = match series.mark {
            Mark::Line => '─',
            Mark::Dashes => '╌',
            Mark::Points => POINTS[k % POINTS.len()],
        };
        out += &format!("{:margin$}   {sample} {}\n", "", series.name);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Series};
    use super::*;

    #[test]
    fn a_rising_line_goes_from_corner_to_corner() {
        let chart = Chart {
            title: "rise".into(),
            x: Axis::linear("x"),
            y: Axis::linear("y"),
            series: vec![
                Series { name: "line".into(), mark: Mark::Line, points: vec![[0.0, 0.0], [4.0, 2.0]] },
                Series { name: "end".into(), mark: Mark::Points, points: vec![[4.0, 2.0]] },
            ],
        };
        let text = terminal(&chart);
        let rows: Vec<&str> = text.lines().collect();
        assert!(rows[1].starts_with("  2 ┤") && rows[1].ends_with('○'), "{text}");
        assert!(rows[ROWS].starts_with("  0 ┤") && rows[ROWS].chars().nth(5) != Some(' '), "{text}");
        assert!(rows[ROWS + 2].trim_end().ends_with('x'), "{text}");
    }
}
