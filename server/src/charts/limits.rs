//! The lines that a chart's values are held against.

use lodestep_engine::event::AidKind;
use lodestep_engine::systems::pedestrian::tuning::Tuning;
use serde::Serialize;

use super::recorder::innovation_chart;

/// A level in a chart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Limit {
    /// Which chart.
    pub(crate) chart: String,
    /// What it means: `expected_95` (19 of 20 lie below), `gate`, `weakest`, `strongest`, `usual`.
    pub(crate) name: &'static str,
    /// In the chart's unit.
    pub(crate) value: f64,
}

/// Of each aid: degrees of freedom and whether a measurement may be turned down.
const AIDS: [(AidKind, usize, bool); 5] = [
    (AidKind::Zupt, 3, false),
    (AidKind::Heading, 1, true),
    (AidKind::Maru, 3, true),
    (AidKind::Separation, 1, true),
    (AidKind::Altimeter, 1, true),
];
/// 95 % and 99.9 % of the sum of so many normal squares.
const QUANTILES: [(f64, f64); 3] = [(3.84, 10.83), (5.99, 13.82), (7.81, 16.27)];

/// Every level, by the filter's parameters.
pub(crate) fn limits(tuning: &Tuning) -> Vec<Limit> {
    let mut all = Vec::new();
    for (aid, degrees, gated) in AIDS {
        let (expected, gate) = QUANTILES[degrees - 1];
        let chart = innovation_chart(aid);
        all.push(Limit { chart: chart.clone(), name: "expected_95", value: expected });
        if gated {
            all.push(Limit { chart, name: "gate", value: gate });
        }
    }
    let mut push = |chart: &str, name, value| all.push(Limit { chart: chart.to_owned(), name, value });
    push("field", "weakest", tuning.weakest_field_ut);
    push("field", "strongest", tuning.strongest_field_ut);
    push("separation", "usual", tuning.separation_m);
    all
}
