//! The lines that a chart's values are held against.

use lodestep_engine::session::SessionConfig;
use schemars::JsonSchema;
use serde::Serialize;

use super::recorder::innovation_chart;

/// A level in a chart.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "ChartLimit")]
pub(crate) struct Limit {
    /// Which chart.
    #[schemars(example = &"innovation_zupt")]
    pub(crate) chart: String,
    /// What it means: `expected_95` (19 of 20 lie below), `gate`, `weakest`, `strongest`, `usual`.
    #[schemars(example = &"expected_95")]
    pub(crate) name: &'static str,
    /// In the chart's unit.
    pub(crate) value: f64,
}

/// 95 % and 99.9 % of the sum of so many normal squares.
const QUANTILES: [(f64, f64); 3] = [(3.84, 10.83), (5.99, 13.82), (7.81, 16.27)];

/// Every level of a session that was computed with this configuration.
pub(crate) fn limits(config: &SessionConfig) -> Vec<Limit> {
    let system = config.system.declaration();
    let mut all = Vec::new();
    for aid in system.aids.iter().filter(|aid| aid.charted) {
        let Some(&(expected, gate)) = QUANTILES.get(aid.degrees_of_freedom.wrapping_sub(1)) else { continue };
        let chart = innovation_chart(aid.kind);
        all.push(Limit { chart: chart.clone(), name: "expected_95", value: expected });
        if aid.gated {
            all.push(Limit { chart, name: "gate", value: gate });
        }
    }
    for chart in system.charts {
        let levels = chart.limits.iter();
        all.extend(levels.map(|&(name, level)| Limit {
            chart: chart.name.to_owned(),
            name,
            value: level(config),
        }));
    }
    all
}
