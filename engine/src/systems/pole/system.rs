//! The pole in a session: a complete log is computed at its end, what comes in live is filtered at once.

use nalgebra::Vector3;

use super::aids::{FIX, GNSS, IMU, SWITCH, TIP};
use super::declaration::{DECLARATION, POINT_SIGMA, QUALITY};
use super::live::Live;
use super::points::Point;
use super::pole_file;
use super::recorder::Recorder;
use super::recording::{Fix, Instrument, Quality, Stop};
use super::survey::{self, Options, Row, Survey};
use super::tuning::Tuning;
use crate::anomaly::Cause as _;
use crate::event::{AidKind, Event, Part, TrackPoint, VisitOutcome};
use crate::geo::LocalFrame;
use crate::replay::InputStore;
use crate::stream::{Reading, StreamId};
use crate::system::{
    ChartValue, ConfigError, Declaration, Progress, SessionConfig, Solution, System, SystemConfig,
};
use crate::visit::Visit;

/// Points of a track, a second.
pub(super) const RATE_HZ: f64 = 20.0;

/// What can be chosen.
#[derive(Clone, Debug)]
pub(super) struct Config {
    /// Whether landings are used.
    lands: bool,
}

impl Default for Config {
    fn default() -> Config {
        Config { lands: true }
    }
}

/// What a survey is computed with.
#[derive(Clone, Debug)]
pub(super) struct Means {
    pub(super) instrument: Instrument,
    pub(super) frame: LocalFrame,
    pub(super) options: Options,
}

#[derive(Debug)]
struct Pole {
    means: Means,
    solution: Solution,
    recorder: Recorder,
    visits: Vec<Visit>,
    /// `None` for a log that is complete.
    live: Option<Live>,
    /// A smoothed survey that is still to be told.
    smoothed: Option<Survey>,
    progress: Progress,
    /// Where the last half metre of the way ended.
    counted_n_m: Option<[f64; 3]>,
    /// Of the charts, until they are asked for.
    values: Vec<ChartValue>,
}

impl Pole {
    fn compute(&mut self, smoothed: bool, events: &mut Vec<Event>) -> Option<Survey> {
        let stop = |visit: &Visit| Stop {
            name: visit.marker.clone(),
            t_start_ns: visit.t_start_ns,
            t_end_ns: visit.t_end_ns,
        };
        let Means { instrument, frame, options } = &self.means;
        let recording = self.recorder.recording(frame, self.visits.iter().map(stop).collect());
        if self.live.is_none() {
            self.values = recording.fixes.iter().map(quality_of).collect();
        }
        match survey::compute(&recording, instrument, frame, &Options { smoothed, ..options.clone() }) {
            Ok(survey) => Some(survey),
            Err(cause) => {
                let ends = [recording.imu.first(), recording.imu.last()];
                let t_ns = ends.map(|sample| sample.map_or(0, |sample| sample.t_ns));
                events.push(Event::Anomaly(cause.anomaly(None, t_ns, 0)));
                for visit in &self.visits {
                    let outcome = VisitOutcome::turned_down(visit, cause.sentence());
                    events.push(Event::Visit(outcome));
                }
                None
            }
        }
    }

    /// What is told of a survey beside its points.
    fn tell(&mut self, survey: Survey, events: &mut Vec<Event>) {
        for visit in &self.visits {
            let of_visit = [visit.t_start_ns, visit.t_end_ns];
            let point = survey.points.iter().find(|point| point.name == visit.marker);
            let number = point.and_then(|point| point.visits.iter().position(|ends| *ends == of_visit));
            let outcome = match point.zip(number) {
                Some((point, number)) => {
                    self.values.extend(sigmas_of(visit, point));
                    held_against(visit, point, number)
                }
                None => VisitOutcome::turned_down(visit, "the track does not cover its time".to_owned()),
            };
            events.push(Event::Visit(outcome));
        }
        events.extend(survey.findings.into_iter().map(Event::Anomaly));
    }

    fn point(&mut self, point: TrackPoint, events: &mut Vec<Event>) {
        let [e, n, u] = point.position_n_m;
        let [e0, n0, u0] = *self.counted_n_m.get_or_insert([e, n, u]);
        let way_m = libm::hypot(libm::hypot(e - e0, n - n0), u - u0);
        // A pole that is leaned goes nowhere.
        if way_m > 0.5 {
            self.progress.distance_m += way_m;
            self.counted_n_m = Some([e, n, u]);
        }
        events.push(Event::Point(point));
    }
}

/// The quality of a fix as the chart has it: 1 fixed, 2 float, 3 single.
fn quality_of(fix: &Fix) -> ChartValue {
    let value = match fix.quality {
        Quality::Fixed => 1.0,
        Quality::Float => 2.0,
        Quality::Single => 3.0,
    };
    ChartValue { t_ns: fix.t_ns, chart: QUALITY, series: "antenna".to_owned(), value }
}

/// How sure a point is by all visits of it together, at the moment of each of them.
fn sigmas_of(visit: &Visit, point: &Point) -> [ChartValue; 3] {
    std::array::from_fn(|axis| ChartValue {
        t_ns: visit.moment_ns(),
        chart: POINT_SIGMA,
        series: ["east", "north", "up"][axis].to_owned(),
        value: point.covariance_n_m2[(axis, axis)].max(0.0).sqrt(),
    })
}

/// A surveyed point held against the marker that it is said to be: before as this visit alone has it, after as all visits of it
/// have it together. One that is no marker yet is told as it is from the frame's origin.
fn held_against(visit: &Visit, point: &Point, number: usize) -> VisitOutcome {
    if visit.is_of_a_new_point() {
        return found(visit, point, number);
    }
    let (e, n, u) = visit.position_n_m;
    let axes = if u.is_some() { 3 } else { 2 };
    let off_of = |p_n_m: &Vector3<f64>| {
        let off = p_n_m - Vector3::new(e, n, u.unwrap_or(p_n_m.z));
        if u.is_none() { Vector3::new(off.x, off.y, 0.0) } else { off }
    };
    let off = off_of(&point.p_n_m);
    let covariance = &point.covariance_n_m2;
    let mut of = *covariance;
    if u.is_none() {
        of.fixed_view_mut::<1, 3>(2, 0).fill(0.0);
        of.fixed_view_mut::<3, 1>(0, 2).fill(0.0);
        of[(2, 2)] = 1.0;
    }
    let sigma = |axis: usize| covariance[(axis, axis)].max(0.0).sqrt();
    VisitOutcome {
        marker: visit.marker.clone(),
        t_ns: visit.moment_ns(),
        before_minus_marker_n_m: off_of(&point.places_n_m[number]).into(),
        after_minus_marker_n_m: off.into(),
        nis: of.try_inverse().map_or(f64::NAN, |inverse| off.dot(&(inverse * off))),
        degrees_of_freedom: axes,
        accepted: false,
        reason: format!(
            "a survey is held against a marker, not corrected by it: the tip stood {:.3} m east, {:.3} m north and {:.3} m up of it, with sigmas of {:.3}, {:.3} and {:.3} m",
            off.x,
            off.y,
            off.z,
            sigma(0),
            sigma(1),
            sigma(2)
        ),
    }
}

/// A point that is no marker yet.
fn found(visit: &Visit, point: &Point, number: usize) -> VisitOutcome {
    let sigma = |axis: usize| point.covariance_n_m2[(axis, axis)].max(0.0).sqrt();
    VisitOutcome {
        marker: visit.marker.clone(),
        t_ns: visit.moment_ns(),
        before_minus_marker_n_m: point.places_n_m[number].into(),
        after_minus_marker_n_m: point.p_n_m.into(),
        nis: 0.0,
        degrees_of_freedom: 3,
        accepted: false,
        reason: format!(
            "there is no marker of this name: it is a new point at {:.3} m east, {:.3} m north and {:.3} m up, with sigmas of {:.3}, {:.3} and {:.3} m",
            point.p_n_m.x,
            point.p_n_m.y,
            point.p_n_m.z,
            sigma(0),
            sigma(1),
            sigma(2)
        ),
    }
}

/// A row of the track as a point.
pub fn track_point(row: &Row) -> TrackPoint {
    let tip = row.tip_n_m.map(|position_n_m| Part { position_n_m, stance: row.contact });
    TrackPoint {
        t_ns: row.t_ns,
        position_n_m: row.tip_n_m.unwrap_or(row.antenna_n_m),
        heading_rad: row.heading_rad,
        sigma_heading_rad: row.sigma_heading_rad,
        sigma_n_m: row.sigma_n_m,
        covariance_en_m2: row.covariance_en_m2,
        tilt: None,
        parts: [tip, Some(Part { position_n_m: row.antenna_n_m, stance: false })],
    }
}

impl System for Pole {
    fn push(&mut self, stream: StreamId, reading: Reading<'_>, events: &mut Vec<Event>) {
        let taken = match reading {
            Reading::Imu(sample) if stream == IMU => self.recorder.sample(sample),
            Reading::Values { t_ns, values } if stream == GNSS => {
                <&[f64; 7]>::try_from(values).is_ok_and(|values| self.recorder.position_row(t_ns, values))
            }
            Reading::Values { t_ns, values: &[contact] } if stream == SWITCH => {
                self.recorder.contact(t_ns, contact > 0.5);
                true
            }
            _ => false,
        };
        let Some(mut live) = self.live.take().filter(|_| taken) else { return };
        let mut told = Vec::new();
        live.go_on(&self.means, &self.recorder, stream, &mut told);
        self.live = Some(live);
        for event in told {
            match event {
                Event::Point(point) => self.point(point, events),
                other => events.push(other),
            }
        }
        if self.live.as_mut().is_some_and(Live::wants_to_be_smoothed) {
            // What is wrong is told at the end.
            if let Some(survey) = self.compute(true, &mut Vec::new()) {
                events.push(Event::Revision { points: survey.rows.iter().map(track_point).collect() });
            }
        }
    }

    fn visit(&mut self, visit: Visit, _: &mut Vec<Event>) {
        self.visits.push(visit);
    }

    fn finish(&mut self, events: &mut Vec<Event>) {
        if self.live.is_some() {
            if let Some(survey) = self.compute(true, events) {
                events.push(Event::Revision { points: survey.rows.iter().map(track_point).collect() });
                self.tell(survey, events);
            }
            return;
        }
        if self.solution == Solution::Smoothed {
            self.smoothed = self.compute(true, events);
            if self.smoothed.is_none() {
                return;
            }
        }
        let Some(survey) = self.compute(false, events) else { return };
        events.extend(survey.aids.iter().copied().map(Event::Aid));
        let points: Vec<TrackPoint> = survey.rows.iter().map(track_point).collect();
        points.into_iter().for_each(|point| self.point(point, events));
        if self.smoothed.is_none() {
            self.tell(survey, events);
        }
    }

    fn smooth_next(&mut self, events: &mut Vec<Event>) -> bool {
        let Some(survey) = self.smoothed.take() else { return false };
        events.push(Event::Revision { points: survey.rows.iter().map(track_point).collect() });
        self.tell(survey, events);
        true
    }

    fn progress(&self) -> Progress {
        self.progress
    }

    fn chart_values(&mut self) -> Vec<ChartValue> {
        std::mem::take(&mut self.values)
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

    fn aids(&self) -> Vec<AidKind> {
        if self.lands { vec![FIX, TIP] } else { vec![FIX] }
    }

    fn fields(&self) -> serde_json::Map<String, serde_json::Value> {
        serde_json::Map::from_iter([("lands".to_owned(), self.lands.into())])
    }

    /// Without fixes there is no place at all: they are always used.
    fn use_aids(&mut self, aids: &[AidKind]) {
        self.lands = aids.contains(&TIP);
    }

    fn start(
        &self,
        session: &SessionConfig,
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, ConfigError> {
        DECLARATION.check_streams(&session.streams)?;
        let text = session.instrument.as_deref().ok_or_else(|| {
            ConfigError::Own(
                "expected the pole's file as the instrument (TOML, [pole] with antenna_b_m and tip_b_m), found none: give it along".to_owned(),
            )
        })?;
        let (instrument, site) = pole_file::read(text).map_err(ConfigError::Own)?;
        let origin = session.origin.or_else(|| site.map(|site| site.local_frame().origin()));
        let origin = origin.ok_or_else(|| {
            ConfigError::Own(
                "expected a [site] with latitude_deg, longitude_deg and height_m in the pole's file, or a site of the session, found neither: add it".to_owned(),
            )
        })?;
        let options = Options {
            tuning: match instrument.tip_b_m {
                Some(_) => Tuning::default(),
                None => Tuning::handheld(),
            },
            smoothed: true,
            rate_hz: RATE_HZ,
            lands: self.lands,
        };
        let means = Means { instrument, frame: LocalFrame::new(origin), options };
        Ok(Box::new(Pole {
            live: session.max_lead_ns.map(|_| Live::default()),
            means,
            solution: session.solution,
            recorder: Recorder::default(),
            visits: Vec::new(),
            smoothed: None,
            progress: Progress::default(),
            counted_n_m: None,
            values: Vec::new(),
        }))
    }
}
