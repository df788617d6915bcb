//! The rover in a session: a complete log is computed at its end, what comes in live is told at once.

use super::causes::RoverCause;
use super::computation::{self, Done, Means};
use super::declaration::DECLARATION;
use super::instrument::Instrument;
use super::live::Live;
use super::recording::{Recorder, Recording};
use super::streams::{RANGES, RANGING, ROVER};
use super::told::{self, Placement, Points};
use crate::anomaly::Cause as _;
use crate::event::{AidKind, Event, VisitOutcome};
use crate::geo::Geodetic;
use crate::gnss::satellite::Constellation;
use crate::replay::InputStore;
use crate::stream::{Reading, StreamId};
use crate::system::{
    ChartValue, ConfigError, Declaration, Progress, SessionConfig, Solution, System, SystemConfig,
};
use crate::visit::Visit;

/// What can be chosen.
#[derive(Clone, Debug)]
pub(super) struct Config {
    /// Whether ranges are used beside satellites.
    ranging: bool,
}

impl Default for Config {
    fn default() -> Config {
        Config { ranging: true }
    }
}

#[derive(Debug)]
struct Rover {
    means: Means,
    site: Option<Geodetic>,
    solution: Solution,
    recorder: Recorder,
    /// `None` for a log that is complete.
    live: Option<Live>,
    /// Whether satellites are among the streams.
    with_satellites: bool,
    progress: Progress,
    /// Values of charts that nobody has asked for yet.
    values: Vec<ChartValue>,
    /// What is still to be smoothed.
    to_be_smoothed: Option<Recording>,
}

impl Rover {
    fn placement(&self, done: &Done) -> Placement {
        Placement::new(done.base, self.site)
    }

    fn refused(&self, cause: &RoverCause, events: &mut Vec<Event>) {
        events.push(Event::Anomaly(cause.anomaly(None, [0; 2], 0)));
    }

    /// Tells a run with its charts.
    fn tell(&mut self, done: &Done, recording: &Recording, events: &mut Vec<Event>) {
        let mut points = Points::new(self.placement(done), recording.zero_ns());
        let surveyed = self.means.instrument.surveyed();
        told::with_charts(done, recording, &surveyed, &mut points, (events, &mut self.values));
        self.progress.distance_m = points.distance_m;
    }

    fn tell_anomalies(&self, done: &Done, zero_ns: i64, events: &mut Vec<Event>) {
        events.extend(told::anomalies(done, self.placement(done), zero_ns));
    }

    /// Works it out once more by all observations, and tells what that changes.
    fn smooth(&self, recording: &Recording, events: &mut Vec<Event>) {
        match computation::compute(recording, &self.means, true, false) {
            Ok(done) => {
                let points = told::points(&done, self.placement(&done), recording.zero_ns());
                events.push(Event::Revision { points });
                self.tell_anomalies(&done, recording.zero_ns(), events);
            }
            Err(cause) => self.refused(&cause, events),
        }
    }
}

impl System for Rover {
    fn push(&mut self, stream: StreamId, reading: Reading<'_>, events: &mut Vec<Event>) {
        let Reading::Values { values, .. } = reading else { return };
        let complete = self.recorder.take(stream, values);
        self.progress.late_samples = self.recorder.late;
        if let Some(live) = self.live.as_mut().filter(|_| complete) {
            live.go_on(&self.means, &self.recorder, self.with_satellites, events);
            self.progress.distance_m = live.distance_m();
        }
    }

    fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        let reason = "a rover is where satellites and ranges put it: a marker does not correct it";
        events.push(Event::Visit(VisitOutcome::turned_down(&visit, reason.to_owned())));
    }

    fn finish(&mut self, events: &mut Vec<Event>) {
        let recording = self.recorder.whole();
        if self.live.is_some() {
            return self.smooth(&recording, events);
        }
        let done = match computation::compute(&recording, &self.means, false, false) {
            Ok(done) => done,
            Err(cause) => return self.refused(&cause, events),
        };
        self.tell(&done, &recording, events);
        if self.solution == Solution::Smoothed {
            self.to_be_smoothed = Some(recording);
        } else {
            self.tell_anomalies(&done, recording.zero_ns(), events);
        }
    }

    fn smooth_next(&mut self, events: &mut Vec<Event>) -> bool {
        let Some(recording) = self.to_be_smoothed.take() else { return false };
        self.smooth(&recording, events);
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
        if self.ranging { vec![RANGING] } else { Vec::new() }
    }

    fn fields(&self) -> serde_json::Map<String, serde_json::Value> {
        serde_json::Map::from_iter([("ranging".to_owned(), self.ranging.into())])
    }

    fn use_aids(&mut self, aids: &[AidKind]) {
        self.ranging = aids.contains(&RANGING);
    }

    fn start(
        &self,
        session: &SessionConfig,
        _: Option<Box<dyn InputStore>>,
    ) -> Result<Box<dyn System>, ConfigError> {
        DECLARATION.check_streams(&session.streams)?;
        let has = |id: StreamId| session.streams.iter().any(|stream| stream.id == id);
        if !has(ROVER) && !has(RANGES) {
            return Err(ConfigError::Own(
                "expected the stream rover (with base and navigation), the stream ranges, or all of them, found neither rover nor ranges: name one".to_owned(),
            ));
        }
        let text = session.instrument.as_deref().unwrap_or_default();
        let instrument = Instrument::from_toml(text).map_err(|error| ConfigError::Own(error.to_string()))?;
        if has(RANGES) && instrument.anchors.is_empty() {
            return Err(ConfigError::Own(
                "expected the anchors as [[anchors]] with name, e_m, n_m and u_m in the rover's file (TOML), found none: list them, or leave out the stream ranges".to_owned(),
            ));
        }
        let site = session.origin.or_else(|| instrument.site.map(|site| site.geodetic()));
        let means = Means {
            instrument,
            systems: Constellation::ALL.to_vec(),
            initial_position_m: None,
            with_ranges: self.ranging,
        };
        let live = session.max_lead_ns.map(|_| Live::new(&means, site));
        Ok(Box::new(Rover {
            means,
            site,
            solution: session.solution,
            recorder: Recorder::default(),
            live,
            with_satellites: has(ROVER),
            progress: Progress::default(),
            values: Vec::new(),
            to_be_smoothed: None,
        }))
    }
}
