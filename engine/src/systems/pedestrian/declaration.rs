//! The pedestrian as a system.

use super::config::Config;
use super::feet_clocks::FeetLogClocks;
use super::side::{ROLES, Side};
use super::{aids, causes, parameters};
use crate::anomaly::Cause;
use crate::stream::{FormerKeys, Kind};
use crate::system::{ChartRule, Declaration, PartRule, StreamRule};

/// An inspector with a sensor on each foot, as a system.
pub const DECLARATION: Declaration = Declaration {
    name: "pedestrian",
    title: "An inspector with an inertial sensor on each foot",
    source: "Research on IMU-based positioning system for FAST inspection, 2025 (paper 1)",
    carrier_kind: "person",
    former_keys: Some(FormerKeys { stream: "foot", streams: "feet" }),
    streams: &[
        foot(ROLES[0], Side::Left.name(), "The sensor on the left foot"),
        foot(ROLES[1], Side::Right.name(), "The sensor on the right foot"),
    ],
    instrument: None,
    parts: &[
        PartRule { name: Side::Left.name(), title: "The sensor on the left foot", has_stance: true },
        PartRule { name: Side::Right.name(), title: "The sensor on the right foot", has_stance: true },
    ],
    has_tilt: false,
    places_itself: false,
    aids: aids::RULES,
    parameters: parameters::TABLE,
    parameter_groups: parameters::GROUPS,
    charts: &[
        ChartRule {
            name: "field",
            unit: "µT",
            limits: &[
                ("weakest", |session| Config::of(session).tuning.weakest_field_ut),
                ("strongest", |session| Config::of(session).tuning.strongest_field_ut),
            ],
        },
        ChartRule {
            name: "separation",
            unit: "m",
            limits: &[("usual", |session| Config::of(session).tuning.separation_m)],
        },
    ],
    anomalies: causes::examples,
    log_clocks: Some(|| Box::<FeetLogClocks>::default()),
    not_stored: |stream| {
        let side = Side::of(stream).unwrap_or(Side::Left);
        causes::WalkCause::FootNotStored { side }.anomaly(Some(stream), [0; 2], 0)
    },
    config: || Box::new(Config::default()),
    simulate: None,
};

const fn foot(role: &'static str, name: &'static str, title: &'static str) -> StreamRule {
    StreamRule { role, name, title, kind: Kind::Imu, columns: &[], least: 0, most: 1 }
}
