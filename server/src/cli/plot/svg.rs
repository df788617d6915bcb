//! A chart as SVG that stands alone and can be read on light and dark ground.

use std::fmt::Write as _;

use quick_xml::escape::escape;

use super::chart::{Chart, Mark};

const WIDTH: f64 = 640.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 34.0;
const PLOT_HEIGHT: f64 = 270.0;
const LEGEND_ROW: f64 = 20.0;

/// The colours of up to four series; dark ground has its own.
pub(super) const STYLE: &str = "<style>\
    svg{--ground:#fff;--ink:#222;--faint:#ddd;--s0:#0b62a4;--s1:#c2410c;--s2:#15803d;--s3:#7e22ce}\
    @media (prefers-color-scheme:dark){svg{--ground:#16191d;--ink:#e6e6e6;--faint:#3a4048;--s0:#6cb6ff;--s1:#ff9a5c;--s2:#6fdc8c;--s3:#d2a8ff}}\
    text{font:12px system-ui,sans-serif;fill:var(--ink)}.t{font-size:14px;font-weight:600}\
    .g{stroke:var(--faint)}.l{fill:none;stroke-width:2}</style>";

/// The chart as a file's content.
pub(in crate::cli) fn svg(chart: &Chart) -> String {
    let height = TOP + PLOT_HEIGHT + 46.0 + LEGEND_ROW * chart.series.len() as f64 + 6.0;
    let plot_width = WIDTH - LEFT - RIGHT;
    let at = |[x, y]: [f64; 2]| (LEFT + x * plot_width, TOP + (1.0 - y) * PLOT_HEIGHT);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" role=\"img\" aria-label=\"{title}\">\n{STYLE}\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"var(--ground)\"/>\n<text class=\"t\" x=\"{LEFT}\" y=\"20\">{title}</text>\n",
        title = escape(&chart.title)
    );
    let mut push = |line: std::fmt::Arguments<'_>| {
        out.write_fmt(line).expect("writing to a string cannot fail");
        out.push('\n');
    };
    let [x_ticks, y_ticks] = chart.ticks();
    let bottom = TOP + PLOT_HEIGHT;
    for (place, label) in x_ticks {
        let (x, _) = at([place, 0.0]);
        push(format_args!(
            "<line class=\"g\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{bottom}\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
            bottom + 17.0
        ));
    }
    for (place, label) in y_ticks {
        let (_, y) = at([0.0, place]);
        push(format_args!(
            "<line class=\"g\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            LEFT + plot_width,
            LEFT - 7.0,
            y + 4.0
        ));
    }
    push(format_args!(
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n<text transform=\"translate(16 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        LEFT + 0.5 * plot_width,
        bottom + 36.0,
        escape(&chart.x.label),
        TOP + 0.5 * PLOT_HEIGHT,
        escape(&chart.y.label)
    ));
    for (k, (series, lines)) in chart.series.iter().zip(chart.placed()).enumerate() {
        let colour = format!("var(--s{})", k % 4);
        for line in lines {
            if series.mark == Mark::Points {
                for point in line {
                    let (x, y) = at(point);
                    push(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{colour}\"/>"));
                }
            } else {
                let path: Vec<String> =
                    line.into_iter().map(at).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
                push(format_args!(
                    "<polyline class=\"l\" stroke=\"{colour}\"{} points=\"{}\"/>",
                    dashes(series.mark),
                    path.join(" ")
                ));
            }
        }
        let y = bottom + 58.0 + LEGEND_ROW * k as f64;
        let sample = if series.mark == Mark::Points {
            format!("<circle cx=\"{}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{colour}\"/>", LEFT + 12.0, y - 4.0)
        } else {
            format!(
                "<polyline class=\"l\" stroke=\"{colour}\"{} points=\"{LEFT},{:.1} {},{:.1}\"/>",
                dashes(series.mark),
                y - 4.0,
                LEFT + 24.0,
                y - 4.0
            )
        };
        push(format_args!(
            "{sample}<text x=\"{}\" y=\"{y:.1}\">{}</text>",
            LEFT + 32.0,
            escape(&series.name)
        ));
    }
    out + "</svg>\n"
}

fn dashes(mark: Mark) -> &'static str {
    if mark == Mark::Dashes { " stroke-dasharray=\"7 5\"" } else { "" }
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Series};
    use super::*;

    #[test]
    fn it_is_well_formed_and_breaks_a_line_where_a_number_is_missing() {
        let chart = Chart {
            title: "a < b & c".into(),
            x: Axis::linear("t, s"),
            y: Axis::logarithmic("sigma, m"),
            series: vec![
                Series {
                    name: "line".into(),
                    mark: Mark::Line,
                    points: vec![[0.0, 0.1], [1.0, 1.0], [2.0, f64::NAN], [3.0, 0.5]],
                },
                Series { name: "points".into(), mark: Mark::Points, points: vec![[0.5, 0.3]] },
            ],
        };
        let text = svg(&chart);
        let mut reader = quick_xml::Reader::from_str(&text);
        loop {
            if let quick_xml::events::Event::Eof = reader.read_event().unwrap() {
                break;
            }
        }
        assert!(text.contains("a &lt; b &amp; c") && !text.contains("NaN"), "{text}");
        // Two pieces of the line, and its sample in the legend.
        assert_eq!(text.matches("<polyline").count(), 3);
        assert_eq!(text.matches("<circle").count(), 2);
    }
}
