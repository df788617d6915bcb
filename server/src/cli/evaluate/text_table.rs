//! Scores as tables to read in a terminal: a table a set, its mean at the end.

use std::fmt::Write as _;

use lodestep_engine::evaluate::median;

use super::score::{Figures, Score};
use crate::cli::text_columns::push_aligned;

/// The tables of all sets, in the order in which they come.
pub(super) fn of_scores(scores: &[Score]) -> String {
    let mut out = String::new();
    for set in scores.chunk_by(|a, b| a.set == b.set && heads(&a.figures) == heads(&b.figures)) {
        let Some(first) = set.first() else { continue };
        let heads = heads(&first.figures);
        let mut rows = vec![
            [&["walk", "s", "m"], heads, &["anomalies"]].concat().into_iter().map(str::to_owned).collect(),
        ];
        let figures: Vec<Vec<f64>> = set.iter().map(|score| values(&score.figures)).collect();
        for (score, figures) in set.iter().zip(&figures) {
            let mut row = vec![
                score.name.clone(),
                format!("{:.0}", score.duration_s),
                format!("{:.1}", score.distance_m),
            ];
            row.extend(figures.iter().map(|value| number(*value)));
            row.push(score.anomalies.to_string());
            rows.push(row);
        }
        if set.len() > 1 {
            let column =
                |i: usize| figures.iter().map(|f| f[i]).filter(|v| v.is_finite()).collect::<Vec<_>>();
            let foot = |name: &str, of: &dyn Fn(&[f64]) -> Option<f64>| {
                let mut row = vec![name.to_owned(), String::new(), String::new()];
                row.extend((0..heads.len()).map(|i| number(of(&column(i)).unwrap_or(f64::NAN))));
                row.push(String::new());
                row
            };
            rows.push(foot("mean", &|v| (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64)));
            rows.push(foot("median", &median));
            rows.push(foot("largest", &|v| v.iter().copied().max_by(f64::total_cmp)));
        }
        writeln!(out, "{} ({})", first.set, title(&first.figures)).expect("writing to a string cannot fail");
        push_aligned(&rows, &mut out);
        out.push('\n');
    }
    out
}

fn title(figures: &Figures) -> &'static str {
    match figures {
        Figures::MotionCapture(_) => {
            "against motion capture: start, first heading and hand of the frame aligned"
        }
        Figures::GroundPoints(_) => "distance in plan to ground points after a rigid fit in the frame's hand",
        Figures::ClosedLoop(_) => "end against start",
        Figures::Feet(_) => "distance between the feet in plan",
        Figures::Simulated { .. } => "against the simulated truth; visits before correction",
        Figures::Nothing => "nothing known to compare with",
    }
}

fn heads(figures: &Figures) -> &'static [&'static str] {
    match figures {
        Figures::MotionCapture(_) => &["armse_m", "end_m", "end_up_m"],
        Figures::GroundPoints(_) => &["mean_m", "rms_m", "max_m"],
        Figures::ClosedLoop(_) => &["end_m", "end_%", "|up|_m"],
        Figures::Feet(_) => &["at_end_m", "largest_m"],
        Figures::Simulated { held_back: Some(_), .. } => &[
            "end_m",
            "end_%",
            "rms_m",
            "max_m",
            "up_rms_m",
            "visits_mean_m",
            "visits_max_m",
            "held_back_mean_m",
            "held_back_max_m",
        ],
        Figures::Simulated { .. } => {
            &["end_m", "end_%", "rms_m", "max_m", "up_rms_m", "visits_mean_m", "visits_max_m"]
        }
        Figures::Nothing => &[],
    }
}

fn values(figures: &Figures) -> Vec<f64> {
    const NONE: f64 = f64::NAN;
    match figures {
        Figures::MotionCapture(errors) => {
            errors.map_or(vec![NONE; 3], |e| vec![e.armse_m, e.end_error_m, e.end_height_error_m])
        }
        Figures::GroundPoints(errors) => {
            errors.map_or(vec![NONE; 3], |e| vec![e.distance.mean_m, e.distance.rms_m, e.distance.max_m])
        }
        Figures::ClosedLoop(closure) => closure
            .map_or(vec![NONE; 3], |c| vec![c.end_error_m, c.end_error_percent, c.height_error_m.abs()]),
        Figures::Feet(apart) => apart.map_or(vec![NONE; 2], |a| vec![a.at_end_m, a.largest_m]),
        Figures::Simulated { truth, visits, held_back } => {
            let mut row = truth.map_or(vec![NONE; 5], |t| {
                vec![
                    t.end_error_m,
                    t.end_error_percent,
                    t.horizontal.rms_m,
                    t.horizontal.max_m,
                    t.height_rms_m,
                ]
            });
            row.extend(visits.map_or([NONE; 2], |v| [v.horizontal.mean_m, v.horizontal.max_m]));
            row.extend(held_back.iter().flat_map(|spread| [spread.mean_m, spread.max_m]));
            row
        }
        Figures::Nothing => Vec::new(),
    }
}

fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:.3}") } else { "–".to_owned() }
}
