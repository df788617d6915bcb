//! The paper's two sweeps: a table, and a chart over what is varied.

use lodestep_engine::systems::vertical::Setup;

use super::height::{Prediction, Sweep, metres};
use crate::cli::plot::{Axis, Chart, Mark, Series};
use crate::cli::text_columns::push_aligned;

const SIGMAS_M: [f64; 13] = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];
const RATES_HZ: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// The table and the chart of a sweep.
pub(super) fn sweep(base: &Setup, sweep: Sweep, start_sigma_m: f64, trials: u32) -> (String, Chart) {
    let (heads, title, label, setups): (_, _, _, Vec<(f64, Setup)>) = match sweep {
        Sweep::Sigma => (
            "altimeter_sigma_m",
            format!("Sigma of the height by the altimeter's sigma, at {} Hz", base.altimeter_rate_hz),
            "altimeter sigma, m",
            SIGMAS_M
                .map(|altimeter_sigma_m| (altimeter_sigma_m, Setup { altimeter_sigma_m, ..*base }))
                .into(),
        ),
        Sweep::Rate => (
            "altimeter_rate_hz",
            format!("Sigma of the height by the altimeter's rate, at {} m", base.altimeter_sigma_m),
            "altimeter rate, Hz",
            RATES_HZ
                .into_iter()
                .filter(|rate_hz| *rate_hz <= base.imu_rate_hz)
                .map(|altimeter_rate_hz| (altimeter_rate_hz, Setup { altimeter_rate_hz, ..*base }))
                .collect(),
        ),
    };
    let mut rows = vec![
        [
            heads,
            "closed_m",
            "filter_m",
            "drawn_rms_m",
            "printed_m",
            "closed_%",
            "printed_%",
            "settled_after_s",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    let (mut closed, mut filter, mut drawn, mut printed) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (varied, setup) in setups {
        let prediction = Prediction::of(&setup, start_sigma_m, trials);
        let filter_m = prediction.filter.map_or(f64::NAN, |settled| settled.rms_m);
        rows.push(vec![
            varied.to_string(),
            metres(prediction.closed_m),
            metres(filter_m),
            metres(prediction.drawn_m),
            metres(prediction.printed_m),
            percent(prediction.percent(prediction.closed_m), 1),
            percent(prediction.percent(prediction.printed_m), 0),
            metres(prediction.settled_after_s),
        ]);
        for (points, value) in [
            (&mut closed, prediction.closed_m),
            (&mut filter, filter_m),
            (&mut drawn, prediction.drawn_m),
            (&mut printed, prediction.printed_m),
        ] {
            points.push([varied, value]);
        }
    }
    let mut text = String::new();
    push_aligned(&rows, &mut text);
    let series = [
        ("closed form", Mark::Line, closed),
        ("filter, sample by sample", Mark::Points, filter),
        ("errors drawn, rms", Mark::Points, drawn),
        ("paper 2 as printed, √P₃₃", Mark::Dashes, printed),
    ];
    let chart = Chart {
        title,
        x: Axis::logarithmic(label),
        y: Axis::logarithmic("sigma of the height, m"),
        series: series
            .into_iter()
            .map(|(name, mark, points)| Series { name: name.to_owned(), mark, points })
            .filter(|series| series.points.iter().any(|point| point[1].is_finite()))
            .collect(),
    };
    (text, chart)
}

fn percent(value: f64, digits: usize) -> String {
    if value.is_finite() { format!("{value:+.digits$}") } else { "–".to_owned() }
}
