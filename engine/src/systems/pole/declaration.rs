//! The pole as a system of the house.

use super::aids::{FIX, TIP};
use super::causes::{self, SurveyCause};
use super::pole_file;
use super::system::Config;
use crate::anomaly::Cause as _;
use crate::cause::SensorCause;
use crate::parse::gnss_columns;
use crate::stream::Kind;
use crate::system::{AidRule, ChartRule, Column, Declaration, InstrumentRule, PartRule, StreamRule};

/// The chart of what each fix is: 1 fixed, 2 float, 3 single.
pub(super) const QUALITY: &str = "quality";
/// The chart of how sure surveyed points are: east, north and up, m, each by all visits of it, at the moment of each visit.
pub(super) const POINT_SIGMA: &str = "point_sigma";

/// A surveyor's pole with antenna, inertial sensor and tip.
pub const DECLARATION: Declaration = Declaration {
    name: "pole",
    title: "A surveyor's pole that carries fixes under a roof",
    source: "paper 4",
    carrier_kind: "instrument",
    former_keys: None,
    streams: &[
        StreamRule {
            role: "imu",
            name: "imu",
            title: "The inertial sensor on the pole",
            kind: Kind::Imu,
            columns: &[],
            least: 1,
            most: 1,
        },
        StreamRule {
            role: "gnss",
            name: "gnss",
            title: "Positions of the antenna: CSV, RTKLIB's .pos or NMEA",
            kind: Kind::Values,
            columns: gnss_columns::COLUMNS,
            least: 1,
            most: 1,
        },
        StreamRule {
            role: "switch",
            name: "switch",
            title: "Changes of the switch in the tip; without it landings are felt",
            kind: Kind::Values,
            columns: &[Column {
                name: "contact",
                required: true,
                about: "1 when the tip touches the ground from then on, 0 when it does not.",
            }],
            least: 0,
            most: 1,
        },
    ],
    instrument: Some(InstrumentRule {
        about: "lever arms from the sensor to the antenna's phase centre and to the tip, in the sensor's axes, m; without \
                tip_b_m the sensor is in the hand. [site] may be left out where the session has one",
        example: pole_file::EXAMPLE,
    }),
    parts: &[
        PartRule { name: "tip", title: "Tip", has_stance: true },
        PartRule { name: "antenna", title: "Antenna", has_stance: false },
    ],
    has_tilt: false,
    places_itself: true,
    aids: &[
        AidRule {
            kind: FIX,
            about: "A position of the antenna.",
            degrees_of_freedom: 3,
            gated: true,
            charted: true,
        },
        AidRule {
            kind: TIP,
            about: "A tip that stands where it has landed.",
            degrees_of_freedom: 3,
            gated: true,
            charted: true,
        },
    ],
    parameters: &[],
    parameter_groups: &[],
    charts: &[
        ChartRule { name: QUALITY, unit: "1", limits: &[] },
        ChartRule { name: POINT_SIGMA, unit: "m", limits: &[] },
    ],
    anomalies: || {
        let sensor =
            [SensorCause::NotFinite, SensorCause::RepeatedTime, SensorCause::TimeGoesBack { back_by_s: 0.5 }];
        let of_sensor = sensor.iter().map(|cause| cause.anomaly(None, [1, 2], 3));
        of_sensor.chain(causes::examples().iter().map(|cause| cause.anomaly(None, [1, 2], 0))).collect()
    },
    log_clocks: None,
    not_stored: |stream| {
        SurveyCause::NotStored { stream: stream.name().to_owned() }.anomaly(Some(stream), [0; 2], 0)
    },
    config: || Box::new(Config::default()),
    simulate: None,
};
