//! The cabin in a session: rows of complete logs are put in order of their tags first, what is streamed is weighed as it comes.

use std::any::Any;

use super::causes::{self, CabinCause};
use super::declaration::{ANTENNAS, DECLARATION, ENCODERS, GNSS, IMU, PLAN, PLATFORM_IMU, RAYS, STATIONS};
use super::instrument::Instrument;
use super::intake::{Device, Intake};
use super::order::{AnyRow, Order};
use super::output::Row;
use super::plan::Plan;
use super::points::{self, Pairs};
use super::rows::ImuRow;
use super::session::{CabinConfig, CabinError, CabinSession, Estimator, Poses};
use super::watch::CabinAnomaly;
use super::weighing::Weighing;
use crate::anomaly::Anomaly;
use crate::event::{AidKind, Event, TrackPoint, VisitOutcome};
use crate::parse::name_number;
use crate::replay::InputStore;
use crate::sample::ImuSample;
use crate::stream::{Reading, StreamId};
use crate::system::{
    ChartValue, ConfigError, Declaration, NotRestored, Pose, Progress, SessionConfig, Solution, System,
    SystemConfig,
};
use crate::visit::Visit;

/// Points of a track, a second.
const RATE_HZ: f64 = 20.0;
/// Points that are told anew at once when a session has been smoothed.
const PIECE: usize = 1200;

/// What can be chosen.
#[derive(Clone, Debug)]
pub(super) struct Config {
    /// Whether the stations' rays are weighed.
    stations: bool,
}

impl Default for Config {
    fn default() -> Config {
        Config { stations: true }
    }
}

#[derive(Debug)]
struct Cabin {
    instrument: Box<Instrument>,
    config: CabinConfig,
    /// `None` when the rows turned out not to be those of the instrument.
    filtered: Option<Box<CabinSession>>,
    /// The same rows once more, to be smoothed.
    smoothed: Option<Smoothed>,
    intakes: [Intake; 3],
    /// Whether an unknown device was told of, by intake.
    unknown_told: [bool; 3],
    /// `None` where rows are weighed as they come.
    order: Option<Order>,
    pairs: Pairs,
    weighing: Weighing,
    plan: Plan,
    /// Of complete logs, until it is certain that they are not refused.
    held: Vec<Event>,
    charts: Vec<ChartValue>,
    newest_ns: i64,
    progress: Progress,
    counted_n_m: Option<[f64; 3]>,
}

#[derive(Debug)]
struct Smoothed {
    session: Option<Box<CabinSession>>,
    pairs: Pairs,
    points: Vec<TrackPoint>,
}

const DEVICES: [Device; 3] = [Device::Encoders, Device::Antennas, Device::Stations];

/// The stream of a device, or of devices or a make, by its name.
fn stream_of(source: &str, instrument: &Instrument) -> StreamId {
    match source {
        "imu" => IMU,
        "platform_imu" => PLATFORM_IMU,
        "encoders" => ENCODERS,
        "stations" => RAYS,
        name if instrument.stations.names.iter().any(|known| known == name) => RAYS,
        _ => GNSS,
    }
}

/// What was found out of a device, as a session tells it.
pub fn anomaly(found: &CabinAnomaly, instrument: &Instrument) -> Anomaly {
    let of_session = matches!(found.cause, CabinCause::Refused { .. });
    let stream = (!of_session).then(|| stream_of(&found.source, instrument));
    causes::told(found, stream)
}

fn imu_row(sample: &ImuSample) -> ImuRow {
    ImuRow { t_ns: sample.t_ns, w_s: sample.w_ib_b_rad_s, f_s: sample.f_b_m_s2 }
}

fn push(session: &mut CabinSession, row: &AnyRow, poses: &mut Poses) -> Result<(), CabinError> {
    match row {
        AnyRow::Imu(row) => session.push_imu(row, poses),
        AnyRow::PlatformImu(row) => session.push_platform_imu(row, poses),
        AnyRow::Aid(row) => session.push_aid(row, poses),
    }
}

impl Cabin {
    fn is_live(&self) -> bool {
        self.order.is_none()
    }

    fn refuse(&mut self, why: String, events: &mut Vec<Event>) {
        let found = CabinAnomaly::new("cabin", CabinCause::Refused { why }, [self.newest_ns; 2]);
        events.push(Event::Anomaly(anomaly(&found, &self.instrument)));
        self.filtered = None;
        self.smoothed = None;
        self.held.clear();
        self.charts.clear();
    }

    /// A row of antennas, stations or encoders.
    fn take_values(&mut self, which: usize, t_ns: i64, values: &[f64], events: &mut Vec<Event>) {
        let taken = self.intakes[which].take(t_ns, values);
        let unknown = self.intakes[which].unknown().map(str::to_owned);
        if let Some(found) = unknown.filter(|_| !self.unknown_told[which]) {
            self.unknown_told[which] = true;
            let device = DEVICES[which].name();
            if !self.is_live() {
                let why = format!(
                    "expected {device} that the instrument has, found {found}: correct the name, or add it where the instrument is described"
                );
                return self.refuse(why, events);
            }
            let cause = CabinCause::Unknown { rows: 1, found };
            let found = CabinAnomaly::new(device, cause, [t_ns; 2]);
            events.push(Event::Anomaly(anomaly(&found, &self.instrument)));
        }
        match taken {
            Ok(Some(row)) => self.give(2 + which, AnyRow::Aid(row), events),
            Ok(None) => {}
            Err(impossible) => self.refuse(impossible.sentence(DEVICES[which]), events),
        }
    }

    fn give(&mut self, source: usize, row: AnyRow, events: &mut Vec<Event>) {
        match &mut self.order {
            None => self.feed(&row, events),
            Some(order) => {
                order.push(source, row);
                self.feed_ordered(events);
            }
        }
    }

    fn feed_ordered(&mut self, events: &mut Vec<Event>) {
        while let Some(row) = self.order.as_mut().and_then(Order::next) {
            self.feed(&row, events);
        }
    }

    fn feed(&mut self, row: &AnyRow, events: &mut Vec<Event>) {
        let Some(session) = &mut self.filtered else { return };
        self.newest_ns = self.newest_ns.max(row.t_ns());
        let mut poses = Poses::default();
        if let Err(error) = push(session, row, &mut poses) {
            return self.refuse(error.to_string(), events);
        }
        self.pairs.take(&mut poses);
        if let Some(smoothed) = &mut self.smoothed
            && let Some(session) = &mut smoothed.session
        {
            if let Err(error) = push(session, row, &mut poses) {
                return self.refuse(error.to_string(), events);
            }
            smoothed.take(&mut poses, !self.config.platform);
        }
        self.tell(events);
    }

    /// What the filter has told since the last time.
    fn tell(&mut self, events: &mut Vec<Event>) {
        let mut told = Vec::new();
        while let Some(rows) = self.pairs.next(true) {
            self.chart(&rows);
            let point = points::of_rows(&rows);
            self.count(point.position_n_m);
            told.push(Event::Point(point));
        }
        if let Some(session) = &mut self.filtered {
            for weighed in session.weighed() {
                let station = session.aids().is_station(weighed.aid);
                self.weighing.take(&weighed, station, &mut told);
            }
            let fresh = session.fresh_anomalies();
            // Of complete logs they are told at the end, when it is known how long each lasted.
            if self.order.is_none() {
                told.extend(fresh.iter().map(|found| Event::Anomaly(anomaly(found, &self.instrument))));
            }
        }
        if self.is_live() {
            events.append(&mut told);
        } else {
            self.held.append(&mut told);
        }
    }

    fn count(&mut self, position_n_m: [f64; 3]) {
        let [e, n, u] = position_n_m;
        let [e0, n0, u0] = *self.counted_n_m.get_or_insert(position_n_m);
        let way_m = libm::hypot(libm::hypot(e - e0, n - n0), u - u0);
        // What swings on its cables goes nowhere.
        if way_m > 0.5 {
            self.progress.distance_m += way_m;
            self.counted_n_m = Some(position_n_m);
        }
    }

    fn chart(&mut self, (cabin, platform): &(Row, Option<Row>)) {
        let t_ns = cabin.t_ns;
        self.plan.forget_before(t_ns);
        if self.is_live() {
            return;
        }
        let planned = self.plan.at(t_ns);
        let charts = &mut self.charts;
        let mut add = |chart, series: &str, value: f64| {
            if value.is_finite() {
                charts.push(ChartValue { t_ns, chart, series: series.to_owned(), value });
            }
        };
        let bodies = [("cabin", Some(cabin)), ("platform", platform.as_ref())];
        for (name, row) in bodies.into_iter().filter_map(|(name, row)| Some((name, row?))) {
            add("protection_level", name, row.protection_level_m());
            add("sigma_body", name, row.largest_sigma_m());
            if let Some(left_s) = row.time_left_s {
                add("time_left", name, left_s);
            }
            let place =
                planned.map(|planned| if name == "cabin" { planned.cabin_n_m } else { planned.platform_n_m });
            for (axis, (letter, place_m)) in
                ["e", "n", "u"].iter().zip(place.unwrap_or([f64::NAN; 3])).enumerate()
            {
                add("off_plan", &format!("{name}_{letter}"), row.p_n[axis] - place_m);
            }
        }
        if let Some(planned) = planned {
            let off_rad = crate::rotation::wrap(cabin.angles().heading_rad - planned.yaw_rad);
            add("off_plan_yaw", "cabin", off_rad);
        }
        if let Some(platform) = platform {
            add("platform_yaw", "platform", platform.angles().heading_rad);
        }
        add("state", "cabin", f64::from(cabin.status as u8));
        if let Some(session) = &self.filtered {
            for (bit, name) in session.aids().all().iter().enumerate() {
                add("aids", name, f64::from((cabin.aids >> bit & 1) as u8));
            }
        }
    }
}

impl Smoothed {
    fn take(&mut self, poses: &mut Poses, all_came: bool) {
        self.pairs.take(poses);
        while let Some(rows) = self.pairs.next(all_came) {
            self.points.push(points::of_rows(&rows));
        }
    }
}

impl System for Cabin {
    fn push(&mut self, stream: StreamId, reading: Reading<'_>, events: &mut Vec<Event>) {
        match reading {
            Reading::Values { t_ns, values } if stream == PLAN => self.plan.push(t_ns, values),
            _ if self.filtered.is_none() => {}
            Reading::Imu(sample) if stream == IMU => self.give(0, AnyRow::Imu(imu_row(sample)), events),
            Reading::Imu(sample) if stream == PLATFORM_IMU => {
                self.give(1, AnyRow::PlatformImu(imu_row(sample)), events);
            }
            Reading::Values { t_ns, values } => {
                let which = [ENCODERS, GNSS, RAYS].iter().position(|known| *known == stream);
                let wanted = which.filter(|_| stream != RAYS || self.config.has_stations);
                if let Some(which) = wanted {
                    self.take_values(which, t_ns, values, events);
                }
            }
            Reading::Imu(_) => {}
        }
    }

    fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        let reason = "no markers hang in the air: a cabin says where it is by its own streams".to_owned();
        events.push(Event::Visit(VisitOutcome::turned_down(&visit, reason)));
    }

    fn end(&mut self, stream: StreamId, events: &mut Vec<Event>) {
        let source = [IMU, PLATFORM_IMU, ENCODERS, GNSS, RAYS].iter().position(|known| *known == stream);
        if let (Some(order), Some(source)) = (&mut self.order, source) {
            order.end(source);
            self.feed_ordered(events);
        }
    }

    fn finish(&mut self, events: &mut Vec<Event>) {
        if let Some(order) = &mut self.order {
            order.end_all();
            self.feed_ordered(events);
        }
        let Some(session) = self.filtered.take() else { return };
        let mut poses = Poses::default();
        let found = match session.finish(&mut poses) {
            Ok(found) => found,
            Err(error) => return self.refuse(error.to_string(), events),
        };
        self.pairs.take(&mut poses);
        self.tell(events);
        self.weighing.tell(if self.order.is_some() { &mut self.held } else { events });
        if let Some(smoothed) = &mut self.smoothed
            && let Some(session) = smoothed.session.take()
        {
            if let Err(error) = session.finish(&mut poses) {
                return self.refuse(error.to_string(), events);
            }
            smoothed.take(&mut poses, true);
        }
        if self.is_live() {
            return;
        }
        events.append(&mut self.held);
        let of_logs = self.intakes.iter().flat_map(Intake::anomalies);
        let all = of_logs.chain(found);
        events.extend(all.map(|found| Event::Anomaly(anomaly(&found, &self.instrument))));
    }

    fn smooth_next(&mut self, events: &mut Vec<Event>) -> bool {
        let Some(smoothed) = &mut self.smoothed else { return false };
        let points = smoothed.points.split_off(smoothed.points.len().saturating_sub(PIECE));
        if points.is_empty() {
            return false;
        }
        events.push(Event::Revision { points });
        true
    }

    fn progress(&self) -> Progress {
        self.progress
    }

    fn pose(&self) -> Option<Pose> {
        let now = self.filtered.as_ref()?.now()?;
        let row = &now.cabin.row;
        let planned = self.plan.at(row.t_ns);
        Some(Pose {
            t_ns: row.t_ns,
            state: row.status.into(),
            aids: row.aids,
            bodies: [
                Some(now.cabin.pose(planned.map(|planned| planned.cabin_n_m))),
                now.platform.as_ref().map(|now| now.pose(planned.map(|planned| planned.platform_n_m))),
            ],
        })
    }

    fn aid_names(&self) -> Vec<String> {
        self.filtered.as_ref().map_or_else(Vec::new, |session| session.aids().all().to_vec())
    }

    fn chart_values(&mut self) -> Vec<ChartValue> {
        // They count only where the logs are not refused in the end.
        if self.filtered.is_some() { Vec::new() } else { std::mem::take(&mut self.charts) }
    }

    /// Nothing: a server that starts anew gives the session its readings again, in the order in which they came.
    fn save(&mut self) -> Option<(i64, Vec<u8>)> {
        None
    }
}

impl SystemConfig for Config {
    fn declaration(&self) -> &'static Declaration {
        &DECLARATION
    }

    fn boxed(&self) -> Box<dyn SystemConfig> {
        Box::new(self.clone())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn aids(&self) -> Vec<AidKind> {
        if self.stations { vec![ANTENNAS, STATIONS] } else { vec![ANTENNAS] }
    }

    fn fields(&self) -> serde_json::Map<String, serde_json::Value> {
        serde_json::Map::from_iter([("stations".to_owned(), self.stations.into())])
    }

    /// Without antennas there is no place to start from: they are always used.
    fn use_aids(&mut self, aids: &[AidKind]) {
        self.stations = aids.contains(&STATIONS);
    }

    fn start(
        &self,
        session: &SessionConfig,
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, ConfigError> {
        DECLARATION.check_streams(&session.streams)?;
        let text = session.instrument.as_deref().ok_or_else(|| {
            ConfigError::Own(
                "expected the cabin's file as the instrument (TOML: where antennas, stations, prisms and joints are), found none: give it along".to_owned(),
            )
        })?;
        let instrument = Instrument::from_toml(text).map_err(|error| ConfigError::Own(error.to_string()))?;
        check_names(&instrument)?;
        let has = |id: StreamId| session.streams.iter().any(|stream| stream.id == id);
        let has_stations = has(RAYS) && self.stations;
        let config = CabinConfig {
            estimator: Estimator::Own,
            smoothed: false,
            rate_hz: RATE_HZ,
            has_stations,
            has_encoders: has(ENCODERS),
            has_platform_imu: has(PLATFORM_IMU),
            platform: has(ENCODERS) || has_stations,
        };
        let begin = |smoothed| {
            CabinSession::new(&instrument, CabinConfig { smoothed, ..config.clone() })
                .map(Box::new)
                .map_err(|error| ConfigError::Own(error.to_string()))
        };
        let is_live = session.max_lead_ns.is_some();
        let smoothed = session.solution == Solution::Smoothed && !is_live;
        let smoothed = if smoothed { Some(begin(true)?) } else { None };
        let sources =
            [IMU, PLATFORM_IMU, ENCODERS, GNSS, RAYS].map(|id| has(id) && (id != RAYS || has_stations));
        Ok(Box::new(Cabin {
            filtered: Some(begin(false)?),
            smoothed: smoothed.map(|session| Smoothed {
                session: Some(session),
                pairs: Pairs::default(),
                points: Vec::new(),
            }),
            intakes: DEVICES.map(|device| Intake::new(device, &instrument)),
            unknown_told: [false; 3],
            order: (!is_live).then(|| Order::new(sources)),
            pairs: Pairs::default(),
            weighing: Weighing::default(),
            plan: Plan::default(),
            held: Vec::new(),
            charts: Vec::new(),
            newest_ns: 0,
            progress: Progress::default(),
            counted_n_m: None,
            config,
            instrument: Box::new(instrument),
        }))
    }

    fn restore(
        &self,
        _: &SessionConfig,
        _: &[u8],
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, NotRestored> {
        Err(NotRestored("a cabin, which is computed from all of its readings".to_owned()))
    }
}

/// A stream's rows name devices by numbers that hold so many letters.
fn check_names(instrument: &Instrument) -> Result<(), ConfigError> {
    let targets = instrument.target_names();
    let lists = [&instrument.antennas.names, &instrument.stations.names, &targets];
    match lists.into_iter().flatten().find(|name| name_number::number(name).is_none()) {
        None => Ok(()),
        Some(name) => Err(ConfigError::Own(format!(
            "expected names of antennas, stations and prisms of 1 to {} letters, digits and underscores, found {name:?}: rename it here and in the logs",
            name_number::MOST_LETTERS
        ))),
    }
}
