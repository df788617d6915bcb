//! The systems that there are, as they declare themselves.

use lodestep_engine::parse::imu_csv;
use lodestep_engine::stream::Kind;
use lodestep_engine::system::{AidRule, Declaration, StreamRule};
use lodestep_engine::systems::catalogue;
use schemars::JsonSchema;
use serde::Serialize;

use crate::http::{Json, Routes};
use crate::rights::Right;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/systems", Right::Read, list)
        .about("list_systems", "The systems with their streams, aids, charts and anomalies")
}

/// All systems; the first is that of a session of which nothing is said.
#[derive(Debug, Serialize, JsonSchema)]
struct SystemsView {
    systems: Vec<SystemView>,
}

/// A system as it declares itself.
#[derive(Debug, Serialize, JsonSchema)]
struct SystemView {
    #[schemars(example = &"fixes")]
    name: &'static str,
    #[schemars(example = &"Positions that another system has worked out")]
    title: &'static str,
    /// What it positions.
    #[schemars(example = &"instrument")]
    carrier_kind: &'static str,
    streams: Vec<StreamView>,
    /// What has to be said of the instrument when a session is begun; null where nothing has.
    instrument: Option<InstrumentView>,
    /// The parts of its points, beside the position.
    parts: Vec<PartView>,
    /// Whether its points have roll and pitch.
    has_tilt: bool,
    /// Whether its streams say where it is: then a session needs no start, no first heading and no visits.
    places_itself: bool,
    aids: Vec<AidView>,
    /// Charts of its own.
    charts: Vec<ChartView>,
    /// How many parameters it has; `GET /lab/parameters?system=` lists them.
    parameters: usize,
    /// The kinds of anomalies that it reports.
    #[schemars(example = ["gap"])]
    anomalies: Vec<String>,
    /// Whether `lodestep simulate` knows it by its name.
    simulated: bool,
}

/// What a system is told of its instrument.
#[derive(Debug, Serialize, JsonSchema)]
struct InstrumentView {
    #[schemars(example = &"The antenna: where it is on the carrier")]
    about: &'static str,
    /// A document that is complete, TOML.
    #[schemars(example = &"lever_arm_m = [0.1, 0.0, 1.2]")]
    example: &'static str,
}

/// Streams of one role.
#[derive(Debug, Serialize, JsonSchema)]
struct StreamView {
    /// The number of its first stream within a session, as binary frames carry it.
    number: usize,
    /// Its name; where there may be several, followed by `_1`, `_2` and so on.
    #[schemars(example = &"antenna")]
    name: &'static str,
    #[schemars(example = &"antenna")]
    role: &'static str,
    #[schemars(example = &"Antenna")]
    title: &'static str,
    /// `imu`, or `values` for rows of numbers.
    #[schemars(example = &"values")]
    kind: &'static str,
    /// The columns of its log beside `t_s`, in the order of a row's numbers.
    columns: Vec<ColumnView>,
    least: usize,
    most: usize,
}

/// A column of a stream's log.
#[derive(Debug, Serialize, JsonSchema)]
struct ColumnView {
    /// Its name, with the unit at its end.
    #[schemars(example = &"e_m")]
    name: &'static str,
    /// Whether every row needs a value.
    required: bool,
    #[schemars(example = &"East of the site's origin")]
    about: &'static str,
}

/// A part of a system's points.
#[derive(Debug, Serialize, JsonSchema)]
struct PartView {
    number: usize,
    #[schemars(example = &"antenna")]
    name: &'static str,
    #[schemars(example = &"Antenna")]
    title: &'static str,
    /// Whether it can stand, and says so.
    has_stance: bool,
}

/// A measurement that a system uses.
#[derive(Debug, Serialize, JsonSchema)]
struct AidView {
    #[schemars(example = &"fix")]
    name: &'static str,
    #[schemars(example = &"Position from GNSS")]
    about: &'static str,
    degrees_of_freedom: usize,
    /// Whether an update can be turned down by its normalised innovation.
    gated: bool,
}

/// A chart of a system's own.
#[derive(Debug, Serialize, JsonSchema)]
struct ChartView {
    #[schemars(example = &"speed")]
    name: &'static str,
    #[schemars(example = &"m/s")]
    unit: &'static str,
}

/// Columns of an inertial sensor's log that every row needs: beside the time, rate and specific force.
const IMU_REQUIRED: usize = 6;

impl StreamView {
    fn of(number: usize, rule: &'static StreamRule) -> StreamView {
        let columns = match rule.kind {
            Kind::Imu => imu_csv::COLUMNS[1..]
                .iter()
                .enumerate()
                .map(|(place, name)| ColumnView { name, required: place < IMU_REQUIRED, about: "" })
                .collect(),
            Kind::Values => rule
                .columns
                .iter()
                .map(|column| ColumnView {
                    name: column.name,
                    required: column.required,
                    about: column.about,
                })
                .collect(),
        };
        StreamView {
            number,
            name: rule.name,
            role: rule.role,
            title: rule.title,
            kind: rule.kind.word(),
            columns,
            least: rule.least,
            most: rule.most,
        }
    }
}

impl SystemView {
    fn of(system: &'static Declaration) -> SystemView {
        let mut number = 0;
        let streams = system.streams.iter().map(|rule| {
            let view = StreamView::of(number, rule);
            number += rule.most;
            view
        });
        let parts = system.parts.iter().enumerate().map(|(number, part)| PartView {
            number,
            name: part.name,
            title: part.title,
            has_stance: part.has_stance,
        });
        let mut anomalies: Vec<String> = Vec::new();
        for anomaly in (system.anomalies)() {
            let kind = anomaly.kind.0.as_str();
            if !anomalies.iter().any(|known| known == kind) {
                anomalies.push(kind.to_owned());
            }
        }
        SystemView {
            name: system.name,
            title: system.title,
            carrier_kind: system.carrier_kind,
            streams: streams.collect(),
            instrument: system
                .instrument
                .map(|rule| InstrumentView { about: rule.about, example: rule.example }),
            parts: parts.collect(),
            has_tilt: system.has_tilt,
            places_itself: system.places_itself,
            aids: system.aids.iter().map(aid).collect(),
            charts: system
                .charts
                .iter()
                .map(|chart| ChartView { name: chart.name, unit: chart.unit })
                .collect(),
            parameters: system.parameters.len(),
            anomalies,
            simulated: system.simulate.is_some(),
        }
    }
}

fn aid(rule: &'static AidRule) -> AidView {
    AidView {
        name: rule.kind.as_str(),
        about: rule.about,
        degrees_of_freedom: rule.degrees_of_freedom,
        gated: rule.gated,
    }
}

async fn list() -> Json<SystemsView> {
    Json(SystemsView { systems: catalogue::SYSTEMS.iter().map(|system| SystemView::of(system)).collect() })
}
