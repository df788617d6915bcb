//! The rover as a system of the house.

use super::causes::{self, RoverCause};
use super::instrument;
use super::streams::{MOST_NAVIGATION, NAVIGATION, RANGING};
use super::system::Config;
use crate::anomaly::Cause as _;
use crate::parse::{navigation_rows, observation_rows, range_rows};
use crate::stream::Kind;
use crate::system::{AidRule, ChartRule, Column, Declaration, InstrumentRule, StreamRule};

/// A rover with a satellite receiver and a UWB tag.
pub const DECLARATION: Declaration = Declaration {
    name: "rover",
    title: "A satellite receiver and a UWB tag, from the open sky into the hall",
    source: "paper 5",
    carrier_kind: "instrument",
    former_keys: None,
    streams: &[
        rows("rover", "The rover's observations: RINEX 2.10 to 4", observation_rows::COLUMNS, 1),
        rows("base", "The base's observations: RINEX 2.10 to 4", observation_rows::COLUMNS, 1),
        rows(NAVIGATION, "Orbits and clocks: RINEX navigation", navigation_rows::COLUMNS, MOST_NAVIGATION),
        rows("ranges", "Ranges of the tag: t_s, anchor, range_m", range_rows::COLUMNS, 1),
    ],
    instrument: Some(InstrumentRule {
        about: "the surveyed anchors in metres from the base's antenna, where the base is unless its file says it, and the UWB \
                antenna as seen from the satellite antenna",
        example: instrument::EXAMPLE,
    }),
    parts: &[],
    has_tilt: false,
    places_itself: true,
    aids: &[AidRule {
        kind: RANGING,
        about: "Ranges of the tag, beside satellites.",
        degrees_of_freedom: 1,
        gated: true,
        charted: false,
    }],
    parameters: &[],
    parameter_groups: &[],
    charts: &[
        ChartRule { name: "quality", unit: "1", limits: &[] },
        ChartRule { name: "satellites", unit: "1", limits: &[] },
        ChartRule { name: "anchors", unit: "1", limits: &[] },
        ChartRule { name: "ratio", unit: "1", limits: &[("enough", |_| 3.0)] },
        ChartRule { name: "base_age", unit: "s", limits: &[] },
        ChartRule { name: "elevation", unit: "°", limits: &[] },
        ChartRule { name: "azimuth", unit: "°", limits: &[] },
        ChartRule { name: "anchor_bias", unit: "m", limits: &[] },
        ChartRule { name: "anchor_bias_sigma", unit: "m", limits: &[] },
        ChartRule { name: "anchor_used", unit: "1", limits: &[] },
        ChartRule { name: "anchor_east", unit: "m", limits: &[] },
        ChartRule { name: "anchor_north", unit: "m", limits: &[] },
    ],
    anomalies: || causes::examples().iter().map(|cause| cause.anomaly(None, [1, 2], 0)).collect(),
    log_clocks: None,
    not_stored: |stream| {
        RoverCause::NotStored { stream: stream.name().to_owned() }.anomaly(Some(stream), [0; 2], 0)
    },
    config: || Box::new(Config::default()),
    simulate: None,
};

const fn rows(
    name: &'static str,
    title: &'static str,
    columns: &'static [Column],
    most: usize,
) -> StreamRule {
    StreamRule { role: name, name, title, kind: Kind::Values, columns, least: 0, most }
}
