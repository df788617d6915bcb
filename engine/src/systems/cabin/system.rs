//! The cabin in a session: rows of complete logs are put in order of their tags first, what is streamed is weighed as it comes.

use super::causes::{self, CabinCause};
use super::charts::Charts;
use super::declaration::{ENCODERS, GNSS, IMU, PLAN, PLATFORM_IMU, RAYS};
use super::instrument::Instrument;
use super::intake::{Device, Intake};
use super::lead::{Lead, Leads};
use super::order::{AnyRow, Order, SOURCES};
use super::output::Row;
use super::plan::Plan;
use super::points::{self, Pairs};
use super::rows::ImuRow;
use super::session::{CabinConfig, CabinError, CabinSession, Poses};
use super::watch::CabinAnomaly;
use super::weighing::Weighing;
use crate::anomaly::Anomaly;
use crate::event::{Event, TrackPoint, VisitOutcome};
use crate::sample::ImuSample;
use crate::stream::{Reading, StreamId};
use crate::system::{ChartValue, Pose, Progress, System};
use crate::visit::Visit;

/// Points that are told anew at once when a session has been smoothed.
const PIECE: usize = 1200;

#[derive(Debug)]
pub(super) struct Cabin {
    pub(super) instrument: Box<Instrument>,
    pub(super) config: CabinConfig,
    /// `None` when the rows turned out not to be those of the instrument.
    pub(super) filtered: Option<Box<CabinSession>>,
    /// The same rows once more, to be smoothed.
    pub(super) smoothed: Option<Smoothed>,
    pub(super) intakes: [Intake; 3],
    /// What of a streamed log was told to be wrong, by intake ([`Intake::troubles`]).
    pub(super) troubles_told: [[bool; 3]; 3],
    /// Where rows are weighed as they come: those that wait for the inertial sensor.
    pub(super) lead: Lead,
    /// `None` where rows are weighed as they come.
    pub(super) order: Option<Order>,
    pub(super) pairs: Pairs,
    pub(super) weighing: Weighing,
    pub(super) plan: Plan,
    /// Of complete logs, until it is certain that they are not refused.
    pub(super) held: Vec<Event>,
    pub(super) charts: Charts,
    pub(super) newest_ns: i64,
    pub(super) progress: Progress,
    pub(super) counted_n_m: Option<[f64; 3]>,
    /// A hash of what it was told at its start: its state is taken up by one that was told the same.
    pub(super) told: [u8; 32],
    /// When its state was saved last, ns.
    pub(super) saved_ns: Option<i64>,
}

#[derive(Debug)]
pub(super) struct Smoothed {
    pub(super) session: Option<Box<CabinSession>>,
    pub(super) pairs: Pairs,
    pub(super) points: Vec<TrackPoint>,
}

/// The devices by source, in the order in which rows of one tag go.
const SOURCE_NAMES: [&str; SOURCES] = ["imu", "platform_imu", "encoders", "antennas", "stations"];

pub(super) const DEVICES: [Device; 3] = [Device::Encoders, Device::Antennas, Device::Stations];

/// The stream of a device, or of devices or a make, by its name.
fn stream_of(source: &str, instrument: &Instrument) -> StreamId {
    match source {
        "imu" => IMU,
        "platform_imu" => PLATFORM_IMU,
        name if name == "encoders" || name.starts_with("leg_") => ENCODERS,
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
    pub(super) fn is_live(&self) -> bool {
        self.order.is_none()
    }

    fn refuse(&mut self, why: String, events: &mut Vec<Event>) {
        let found = CabinAnomaly::new("cabin", CabinCause::Refused { why }, [self.newest_ns; 2]);
        events.push(Event::Anomaly(anomaly(&found, &self.instrument)));
        self.filtered = None;
        self.smoothed = None;
        self.held.clear();
        self.charts.take();
    }

    /// A row of antennas, stations or encoders.
    fn take_values(&mut self, which: usize, t_ns: i64, values: &[f64], events: &mut Vec<Event>) {
        let taken = self.intakes[which].take(t_ns, values);
        let unknown = self.intakes[which].unknown().filter(|_| !self.is_live());
        if let Some(found) = unknown {
            let device = DEVICES[which].name();
            let why = format!(
                "expected {device} that the instrument has, found {found}: correct the name, or add it where the instrument is described"
            );
            return self.refuse(why, events);
        }
        if self.is_live() && self.intakes[which].troubles() != self.troubles_told[which] {
            self.tell_troubles(which, events);
        }
        match taken {
            Ok(Some(row)) => self.give(2 + which, AnyRow::Aid(row), events),
            Ok(None) => {}
            Err(impossible) => self.refuse(impossible.sentence(DEVICES[which]), events),
        }
    }

    /// What is wrong with a log that is streamed, the first time of each kind; how many rows there are in the end nobody knows yet.
    fn tell_troubles(&mut self, which: usize, events: &mut Vec<Event>) {
        let (before, now) = (self.troubles_told[which], self.intakes[which].troubles());
        let fresh = before.iter().zip(now).filter(|(_, now)| *now).map(|(before, _)| !before);
        let found = self.intakes[which].anomalies();
        let told = found.iter().zip(fresh).filter(|(_, fresh)| *fresh);
        events.extend(told.map(|(found, _)| Event::Anomaly(anomaly(found, &self.instrument))));
        self.troubles_told[which] = now;
    }

    fn give(&mut self, source: usize, row: AnyRow, events: &mut Vec<Event>) {
        match &mut self.order {
            None => self.give_live(source, &row, events),
            Some(order) => {
                order.push(source, row);
                self.feed_ordered(events);
            }
        }
    }

    fn give_live(&mut self, source: usize, row: &AnyRow, events: &mut Vec<Event>) {
        match self.lead.judge(source, row) {
            Leads::Waits | Leads::LeftOut { is_first: false, .. } => {}
            Leads::LeftOut { ahead_ns, is_first: true } => {
                let device = SOURCE_NAMES[source];
                let cause = CabinCause::Ahead { ahead_s: ahead_ns as f64 * 1e-9 };
                let found = CabinAnomaly::new(device, cause, [row.t_ns(); 2]);
                events.push(Event::Anomaly(anomaly(&found, &self.instrument)));
            }
            Leads::Goes => {
                for waited in self.lead.due(row.t_ns()) {
                    self.feed(&waited, events);
                }
                self.feed(row, events);
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
                session.forget_what_is_over();
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

    fn chart(&mut self, rows: &(Row, Option<Row>)) {
        self.plan.forget_before(rows.0.t_ns);
        if let (Some(session), false) = (&self.filtered, self.is_live()) {
            self.charts.add(rows, self.plan.at(rows.0.t_ns).as_ref(), session.aids());
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
        let [of_cabin, of_platform] = [0, 1].map(|body: usize| planned.as_ref().map(|both| &both[body]));
        let (aids, aid_states) = self.filtered.as_ref()?.aid_states(row.t_ns);
        Some(Pose {
            t_ns: row.t_ns,
            state: row.status.into(),
            aids,
            aid_states,
            bodies: [Some(now.cabin.pose(of_cabin)), now.platform.as_ref().map(|now| now.pose(of_platform))],
        })
    }

    fn aid_names(&self) -> Vec<String> {
        self.filtered.as_ref().map_or_else(Vec::new, |session| session.aids().all().to_vec())
    }

    fn chart_values(&mut self) -> Vec<ChartValue> {
        self.charts.take()
    }

    fn save(&mut self) -> Option<(i64, Vec<u8>)> {
        self.saved()
    }
}
