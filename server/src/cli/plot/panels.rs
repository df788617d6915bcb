//! Ways in plan as SVG, a panel each: one scale for both axes, with a bar that says how long a round length is.

use std::fmt::Write as _;

use quick_xml::escape::escape;

use super::chart::Mark;
use super::svg::STYLE;

const COLUMNS: usize = 5;
const PANEL: f64 = 190.0;
const GAP: f64 = 14.0;
const HEADING: f64 = 36.0;
/// Room above the ways for the title and below for the bar.
const TITLE: f64 = 34.0;
const FOOT: f64 = 22.0;
/// What moves by less than this on the picture is not drawn anew.
const STEP: f64 = 4.0;

/// One panel.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Panel {
    pub(in crate::cli) title: String,
    /// A second line, smaller.
    pub(in crate::cli) note: String,
    pub(in crate::cli) ways: Vec<Way>,
}

/// Places that belong together, east and north in m; the colour is by their number in the panel.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Way {
    pub(in crate::cli) mark: Mark,
    pub(in crate::cli) places: Vec<[f64; 2]>,
}

/// The panels as a file's content; `heading` says what the colours mean.
pub(in crate::cli) fn panels(heading: &str, panels: &[Panel]) -> String {
    let rows = panels.len().div_ceil(COLUMNS);
    let width = GAP + COLUMNS as f64 * (PANEL + GAP);
    let height = HEADING + rows as f64 * (TITLE + PANEL + FOOT + GAP);
    let heading = escape(heading);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" role=\"img\" aria-label=\"{heading}\">\n{STYLE}\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"var(--ground)\"/>\n<text class=\"t\" x=\"{GAP}\" y=\"22\">{heading}</text>\n"
    );
    for (number, panel) in panels.iter().enumerate() {
        let x = GAP + (number % COLUMNS) as f64 * (PANEL + GAP);
        let y = HEADING + (number / COLUMNS) as f64 * (TITLE + PANEL + FOOT + GAP);
        draw(panel, [x, y], &mut out).expect("writing to a string cannot fail");
    }
    out + "</svg>\n"
}

fn draw(panel: &Panel, [x, y]: [f64; 2], out: &mut String) -> std::fmt::Result {
    writeln!(
        out,
        "<g transform=\"translate({x} {y})\"><text y=\"12\">{}</text><text y=\"27\" opacity=\".75\">{}</text>",
        escape(&panel.title),
        escape(&panel.note)
    )?;
    let places = || panel.ways.iter().flat_map(|way| &way.places).filter(|place| is_finite(place));
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for place in places() {
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    if places().next().is_none() {
        return writeln!(out, "</g>");
    }
    let extent_m = (high[0] - low[0]).max(high[1] - low[1]).max(0.1);
    let scale = (PANEL - 8.0) / extent_m;
    let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    let at = |place: &[f64; 2]| {
        [0.5 * PANEL + (place[0] - middle[0]) * scale, TITLE + 0.5 * PANEL - (place[1] - middle[1]) * scale]
    };
    for (number, way) in panel.ways.iter().enumerate() {
        let drawn = thinned(way.places.iter().filter(|place| is_finite(place)).map(at));
        if way.mark == Mark::Points {
            for [x, y] in drawn {
                writeln!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\" fill=\"var(--s{number})\"/>")?;
            }
            continue;
        }
        let path: Vec<String> = drawn.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let dashes = if way.mark == Mark::Dashes { " stroke-dasharray=\"4 3\"" } else { "" };
        writeln!(
            out,
            "<polyline class=\"l\" style=\"stroke-width:1.3\" stroke=\"var(--s{number})\"{dashes} points=\"{}\"/>",
            path.join(" ")
        )?;
    }
    let bar_m = round_length_m(0.4 * extent_m);
    let below = TITLE + PANEL + 8.0;
    writeln!(
        out,
        "<path stroke=\"var(--ink)\" d=\"M4 {below}h{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\">{bar_m} m</text></g>",
        bar_m * scale,
        bar_m * scale + 10.0,
        below + 4.0
    )
}

fn is_finite(place: &[f64; 2]) -> bool {
    place.iter().all(|x| x.is_finite())
}

/// The places that are a step from the last one drawn, and the last of all.
fn thinned(places: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut drawn: Vec<[f64; 2]> = Vec::new();
    let mut last = None;
    for place in places {
        if drawn.last().is_none_or(|before| (before[0] - place[0]).hypot(before[1] - place[1]) >= STEP) {
            drawn.push(place);
            last = None;
        } else {
            last = Some(place);
        }
    }
    drawn.extend(last);
    drawn
}

/// The largest of 1, 2, 5 times a power of ten that is not above `most_m`.
fn round_length_m(most_m: f64) -> f64 {
    let unit = 10f64.powf(most_m.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|k| k * unit).find(|length| *length <= most_m).unwrap_or(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn well_formed(text: &str) {
        let mut reader = quick_xml::Reader::from_str(text);
        while !matches!(reader.read_event().unwrap(), quick_xml::events::Event::Eof) {}
    }

    #[test]
    fn a_square_is_drawn_in_one_scale_with_a_bar_that_fits() {
        let square = vec![[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [f64::NAN, 0.0], [0.0, 10.0]];
        let panel = Panel {
            title: "a & b".into(),
            note: "0.1 m".into(),
            ways: vec![
                Way { mark: Mark::Line, places: square },
                Way { mark: Mark::Points, places: vec![[10.0, 5.0]] },
            ],
        };
        let text = panels("track < truth", &[panel.clone(), panel]);
        well_formed(&text);
        assert!(text.contains("a &amp; b") && text.contains("track &lt; truth") && !text.contains("NaN"));
        // 182 of 190 units for 20 m: 91 for 10 m, about the middle of the panel.
        assert!(text.contains("points=\"4.0,174.5 186.0,174.5 186.0,83.5 4.0,83.5\""), "{text}");
        assert!(text.contains("5 m</text>"));
        assert_eq!(text.matches("<circle").count(), 2);
    }

    #[test]
    fn what_is_nowhere_is_an_empty_panel() {
        let empty = Panel { title: "x".into(), note: String::new(), ways: Vec::new() };
        well_formed(&panels("nothing", &[empty]));
    }

    #[test]
    fn what_lies_close_is_thinned_and_the_end_is_kept() {
        let drawn = thinned((0..=100).map(|k| [f64::from(k) * 0.1, 0.0]));
        assert!(drawn.len() < 10 && drawn.last() == Some(&[10.0, 0.0]), "{drawn:?}");
    }
}
