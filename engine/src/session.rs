//! One walk: samples in, events out. The one type behind the upload, the stream and the command line.

use serde::{Deserialize, Serialize};

use crate::event::Event;
use crate::sample::{Foot, ImuSample};

/// What a session is told before its first sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SessionConfig {
    /// The feet that will send samples, left first.
    pub feet: Vec<Foot>,
    /// Where the middle of the feet stands at the start, east-north-up, m.
    pub initial_position_n_m: [f64; 3],
    /// Heading of the first sensor's x axis at the start, clockwise from true north, rad; `None`
    /// takes it from the magnetometer, or else lets that axis point east.
    pub initial_heading_rad: Option<f64>,
    /// Magnetic declination, east of north positive, rad.
    pub declination_rad: f64,
    /// Local gravity, m/s².
    pub gravity_m_s2: f64,
    /// The aids to use, as far as the data allow them.
    pub aids: Aids,
    /// How far one foot's samples may run ahead of the other's before the session goes on without
    /// it, ns; `None` waits for ever, as is right for logs that are complete.
    pub max_lead_ns: Option<i64>,
}

impl Default for SessionConfig {
    fn default() -> Self {
        SessionConfig {
            feet: vec![Foot::Left, Foot::Right],
            initial_position_n_m: [0.0; 3],
            initial_heading_rad: None,
            declination_rad: 0.0,
            gravity_m_s2: 9.80665,
            aids: Aids::default(),
            max_lead_ns: None,
        }
    }
}

/// Which aids to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Aids {
    /// Zero velocity in stance.
    pub zupt: bool,
    /// Magnetic heading.
    pub heading: bool,
    /// Magnetic angular rate.
    pub maru: bool,
    /// Smallest separation of the feet.
    pub separation: bool,
    /// Marker positions.
    pub markers: bool,
    /// Height by the barometer.
    pub altimeter: bool,
}

impl Default for Aids {
    fn default() -> Self {
        Aids { zupt: true, heading: true, maru: true, separation: true, markers: true, altimeter: true }
    }
}

/// An inspector stood at a marker from `t_start_ns` to `t_end_ns`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Visit {
    /// The marker's name.
    pub marker: String,
    /// When the inspector arrived, ns.
    pub t_start_ns: i64,
    /// When the inspector left, ns.
    pub t_end_ns: i64,
    /// The marker's position, east-north-up, m; `None` for a height that was never surveyed.
    pub position_n_m: (f64, f64, Option<f64>),
}

/// What a session amounts to so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Samples taken in, both feet.
    pub samples: u64,
    /// Epochs told as points.
    pub epochs: u64,
    /// From the first to the last point, s.
    pub duration_s: f64,
    /// Length of the path of the middle of the feet, stance by stance, m.
    pub distance_m: f64,
    /// Seconds since the last accepted visit (since the start before the first).
    pub since_marker_s: f64,
    /// Metres walked since the last accepted visit (since the start before the first).
    pub since_marker_m: f64,
    /// Samples that came too late to be merged by time; a run over the stored log puts them right.
    pub late_samples: u64,
}

/// One walk in progress.
#[derive(Clone, Debug)]
pub struct Session {
    config: SessionConfig,
    summary: Summary,
}

impl Session {
    /// A session that waits for its first samples.
    pub fn new(config: SessionConfig) -> Session {
        Session { config, summary: Summary::default() }
    }

    /// What it was told at the start.
    pub fn config(&self) -> &SessionConfig {
        &self.config
    }

    /// Takes one sample of one foot; the samples of a foot come in the order of its log. Appends
    /// what became known to `events`.
    pub fn push(&mut self, foot: Foot, sample: &ImuSample, events: &mut Vec<Event>) {
        let _ = (foot, sample, events);
        self.summary.samples += 1;
    }

    /// Tells of a visit, before or after its time; one that is older than the history is turned
    /// down with a reason, and a run over the stored log will use it.
    pub fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        let _ = (visit, events);
    }

    /// No more samples of this foot will come: the other need not wait for it.
    pub fn end_foot(&mut self, foot: Foot, events: &mut Vec<Event>) {
        let _ = (foot, events);
    }

    /// No more samples will come: what waits is processed and told.
    pub fn finish(&mut self, events: &mut Vec<Event>) {
        let _ = events;
    }

    /// What it amounts to so far.
    pub fn summary(&self) -> Summary {
        self.summary
    }
}
