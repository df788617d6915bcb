//! The cabin as a system of the house: its streams, parts and charts.

use super::cause_examples;
use super::causes::{self, CabinCause};
use super::config::Config;
use super::intake::{ANTENNA_COLUMNS, ENCODER_COLUMNS, STATION_COLUMNS};
use super::plan;
use super::watch::CabinAnomaly;
use crate::event::AidKind;
use crate::stream::{Kind, StreamId};
use crate::system::{AidRule, ChartRule, Column, Declaration, InstrumentRule, PartRule, StreamRule};
use crate::word::Word;

/// Fixes of the antennas.
pub(super) const ANTENNAS: AidKind = AidKind(Word::declared("antennas", 40));
/// Rays of the stations.
pub(super) const STATIONS: AidKind = AidKind(Word::declared("stations", 41));

/// The cabin's inertial sensor.
pub(super) const IMU: StreamId = StreamId::named("imu");
/// The platform's.
pub(super) const PLATFORM_IMU: StreamId = StreamId::named("platform_imu");
/// The antennas' fixes.
pub(super) const GNSS: StreamId = StreamId::named("gnss");
/// The stations' rays.
pub(super) const RAYS: StreamId = StreamId::named("stations");
/// Rotator and legs.
pub(super) const ENCODERS: StreamId = StreamId::named("encoders");
/// Where both should be.
pub(super) const PLAN: StreamId = StreamId::named("plan");

const fn stream(
    name: &'static str,
    title: &'static str,
    kind: Kind,
    columns: &'static [Column],
    least: usize,
) -> StreamRule {
    StreamRule { role: name, name, title, kind, columns, least, most: 1 }
}

/// The feed cabin with its Stewart platform.
pub const DECLARATION: Declaration = Declaration {
    name: "cabin",
    title: "The feed cabin and its platform, by antennas, stations, encoders and inertial sensors",
    source: "paper 3",
    carrier_kind: "cabin",
    former_keys: None,
    streams: &[
        stream("imu", "The cabin's inertial sensor", Kind::Imu, &[], 1),
        stream("platform_imu", "The platform's inertial sensor", Kind::Imu, &[], 0),
        stream("gnss", "Fixes of the cabin's antennas", Kind::Values, ANTENNA_COLUMNS, 1),
        stream("stations", "Rays of the total stations to prisms", Kind::Values, STATION_COLUMNS, 0),
        stream("encoders", "Rotator and legs of the platform", Kind::Values, ENCODER_COLUMNS, 0),
        stream("plan", "Where cabin and platform should be", Kind::Values, plan::COLUMNS, 0),
    ],
    instrument: Some(InstrumentRule {
        about: "where antennas, prisms, stations, joints and inertial sensors are fixed, what each device delays, and the makers' \
                sigmas; names of at most 8 letters",
        example: include_str!("example.toml"),
    }),
    parts: &[
        PartRule { name: "cabin", title: "Cabin", has_stance: false },
        PartRule { name: "platform", title: "Platform", has_stance: false },
    ],
    has_tilt: true,
    places_itself: true,
    aids: &[
        AidRule {
            kind: ANTENNAS,
            about: "A fix of one antenna.",
            degrees_of_freedom: 3,
            gated: true,
            charted: true,
        },
        AidRule {
            kind: STATIONS,
            about: "A ray of one station to a prism: azimuth, zenith angle and distance.",
            degrees_of_freedom: 3,
            gated: true,
            charted: true,
        },
    ],
    parameters: &[],
    parameter_groups: &[],
    charts: &[
        ChartRule { name: "off_plan", unit: "m", limits: &[("cabin", |_| 0.015), ("platform", |_| 0.003)] },
        ChartRule { name: "off_plan_angles", unit: "rad", limits: &[] },
        ChartRule {
            name: "protection_level",
            unit: "m",
            limits: &[("cabin", |_| 0.015), ("platform", |_| 0.003)],
        },
        ChartRule { name: "sigma_body", unit: "m", limits: &[] },
        ChartRule { name: "sigma_angles", unit: "rad", limits: &[] },
        ChartRule { name: "platform_angles", unit: "rad", limits: &[] },
        ChartRule { name: "state", unit: "1", limits: &[] },
        ChartRule { name: "source", unit: "1", limits: &[] },
        ChartRule { name: "time_left", unit: "s", limits: &[] },
        ChartRule { name: "aids", unit: "1", limits: &[] },
    ],
    anomalies: cause_examples::examples,
    log_clocks: None,
    not_stored: |stream| {
        causes::told(&CabinAnomaly::new(stream.name(), CabinCause::NotStored, [0; 2]), Some(stream))
    },
    config: || Box::new(Config::default()),
    simulate: None,
};
