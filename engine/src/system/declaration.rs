//! What a system declares of itself, once and for all: command line, API, upload form, laboratory, charts and documentation
//! are made from it.

use super::{ConfigError, SessionConfig, SystemConfig};
use crate::anomaly::Anomaly;
use crate::event::AidKind;
use crate::geo::Site;
use crate::identify::Identification;
use crate::stream::{FormerKeys, Kind, Reading, Stream, StreamId};

/// A system as it declares itself.
#[derive(Debug)]
pub struct Declaration {
    /// Its name, as commands, tables and messages spell it: `pedestrian`.
    pub name: &'static str,
    /// What it is, in a line.
    pub title: &'static str,
    /// Where it is described.
    pub source: &'static str,
    /// What it positions: the kind of carrier.
    pub carrier_kind: &'static str,
    /// What clients that know no streams call them; `None` for a system that is not older than streams.
    pub former_keys: Option<FormerKeys>,
    /// Its streams.
    pub streams: &'static [StreamRule],
    /// What has to be said of the instrument; `None` for a system that is the same for all.
    pub instrument: Option<InstrumentRule>,
    /// The parts of its points, beside the position.
    pub parts: &'static [PartRule],
    /// Whether its points have roll and pitch.
    pub has_tilt: bool,
    /// Whether its streams say where it is. Then nobody is asked for a start, a first heading or visits of markers.
    pub places_itself: bool,
    /// What it measures with beside the strapdown.
    pub aids: &'static [AidRule],
    /// What an engineer may turn.
    pub parameters: &'static [Parameter],
    /// The groups of these, in the order in which a session meets them.
    pub parameter_groups: &'static [&'static str],
    /// Charts of its own.
    pub charts: &'static [ChartRule],
    /// An example of every anomaly and sentence that it can report.
    pub anomalies: fn() -> Vec<Anomaly>,
    /// The anomaly of a stream that a stored session should have and has not.
    pub not_stored: fn(StreamId) -> Anomaly,
    /// Compares the clocks of its streams' logs, where these can show by what they hold that they differ.
    pub log_clocks: Option<fn() -> Box<dyn LogClocks>>,
    /// Its configuration by default.
    pub config: fn() -> Box<dyn SystemConfig>,
    /// A session that never was, with its truth: from a seed, at a site.
    pub simulate: Option<fn(u64, &Site) -> Simulated>,
}

/// Takes the readings of logs, stream by stream, and tells how far their clocks are apart.
pub trait LogClocks {
    /// Takes the next reading of a stream.
    fn take(&mut self, stream: StreamId, reading: Reading<'_>);

    /// Whether more of this stream would not say more.
    fn has_enough(&self, stream: StreamId) -> bool;

    /// The clock that is ahead of the others, where one is.
    fn ahead(&self) -> Option<ClockAhead>;
}

/// A log whose clock is ahead of that of the other logs of its session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockAhead {
    /// Its stream.
    pub stream: StreamId,
    /// By how much, s; less than zero: behind.
    pub ahead_by_s: f64,
    /// How sure that is, s.
    pub sigma_s: f64,
}

/// A rule for streams of one role.
#[derive(Clone, Copy, Debug)]
pub struct StreamRule {
    /// What it is to the system.
    pub role: &'static str,
    /// Its name; where there may be several, followed by `_1`, `_2` and so on.
    pub name: &'static str,
    /// What it is, in a line.
    pub title: &'static str,
    /// What its readings are.
    pub kind: Kind,
    /// The columns of its readings beside the time; those of an inertial sensor are always the same.
    pub columns: &'static [Column],
    /// At least so many of them in a session.
    pub least: usize,
    /// At most so many.
    pub most: usize,
}

/// What a system is told of its instrument: a document in TOML, [`SessionConfig::instrument`], that is read when the session
/// starts.
#[derive(Clone, Copy, Debug)]
pub struct InstrumentRule {
    /// What it says, in a line.
    pub about: &'static str,
    /// One that is complete.
    pub example: &'static str,
}

/// A column of a stream's readings.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Its name in files, with the unit at its end: `e_m`.
    pub name: &'static str,
    /// Whether every row needs a value.
    pub required: bool,
    /// What it means.
    pub about: &'static str,
}

/// A part of a system's points.
#[derive(Clone, Copy, Debug)]
pub struct PartRule {
    /// Its name: the beginning of its columns.
    pub name: &'static str,
    /// What it is, in a line.
    pub title: &'static str,
    /// Whether it can stand, and says so.
    pub has_stance: bool,
}

/// A measurement that a system uses.
#[derive(Clone, Copy, Debug)]
pub struct AidRule {
    /// Its word.
    pub kind: AidKind,
    /// What it says, in a sentence.
    pub about: &'static str,
    /// Degrees of freedom of one update.
    pub degrees_of_freedom: usize,
    /// Whether an update can be turned down by its normalised innovation.
    pub gated: bool,
    /// Whether its innovations have a chart.
    pub charted: bool,
}

/// Reads a level from the configuration that a session was computed with, in the chart's unit.
pub type Level = fn(&SessionConfig) -> f64;

/// A chart of a system's own.
#[derive(Clone, Copy, Debug)]
pub struct ChartRule {
    /// Its name.
    pub name: &'static str,
    /// The unit of its values.
    pub unit: &'static str,
    /// Levels that its values are held against, by the configuration that a session was computed with.
    pub limits: &'static [(&'static str, Level)],
}

/// A parameter that an engineer may turn.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its path in the configuration, with the unit at its end: `stance.half_window_s`.
    pub key: &'static str,
    /// Its unit as people write it; `1` for a number without one.
    pub unit: &'static str,
    /// Which part of the system it belongs to.
    pub group: &'static str,
    /// What it means, in a sentence.
    pub about: &'static str,
    /// The smallest value that is taken.
    pub least: f64,
    /// The largest.
    pub most: f64,
    /// Its value in a configuration of its system.
    pub read: fn(&SessionConfig) -> f64,
    /// Writes it there.
    pub write: fn(&mut SessionConfig, f64),
}

/// A session that never was.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// Its streams with their readings.
    pub streams: Vec<SimulatedStream>,
    /// The truth at its epochs: time, ns, and position, east-north-up, m.
    pub truth: Vec<(i64, [f64; 3])>,
    /// Where it starts, east-north-up, m.
    pub start_n_m: [f64; 3],
}

/// The readings of a simulated stream of numbers.
#[derive(Clone, Debug)]
pub struct SimulatedStream {
    /// The stream.
    pub stream: Stream,
    /// Rows: time, ns, and the values of the stream's columns.
    pub rows: Vec<(i64, Vec<f64>)>,
}

impl Declaration {
    /// Whether it finds places by standing on them: then a visit may be of a point that is no marker yet.
    pub fn surveys(&self) -> bool {
        self.places_itself && self.parts.iter().any(|part| part.has_stance)
    }

    /// The stream of this name in a session of the system; `None` where the system has none such.
    pub fn stream(&self, id: StreamId) -> Option<Stream> {
        let mut number = 0;
        for rule in self.streams {
            for nth in 0..rule.most {
                if rule.nth(nth) == Some(id) {
                    return Some(Stream {
                        id,
                        number: u8::try_from(number).ok()?,
                        role: rule.role.to_owned(),
                        kind: rule.kind,
                        lever_arm_b_m: None,
                    });
                }
                number += 1;
            }
        }
        None
    }

    /// The rule of a stream's role.
    pub fn rule_of(&self, stream: &Stream) -> Option<&'static StreamRule> {
        self.streams.iter().find(|rule| rule.role == stream.role)
    }

    /// The streams of a session of which nothing else is said: of each role as many as it needs at least, or one.
    pub fn usual_streams(&self) -> Vec<Stream> {
        let names =
            self.streams.iter().flat_map(|rule| (0..rule.least.max(1)).filter_map(|nth| rule.nth(nth)));
        names.filter_map(|id| self.stream(id)).collect()
    }

    /// The aid of this word.
    pub fn aid(&self, word: &str) -> Option<&'static AidRule> {
        self.aids.iter().find(|aid| aid.kind.as_str() == word)
    }

    /// The parameter of this key.
    pub fn parameter(&self, key: &str) -> Option<&'static Parameter> {
        self.parameters.iter().find(|parameter| parameter.key == key)
    }

    /// Whether a session may have these streams.
    ///
    /// # Errors
    ///
    /// Where one is unknown, or there are too few or too many of a role.
    pub fn check_streams(&self, streams: &[Stream]) -> Result<(), ConfigError> {
        if let Some(unknown) = streams.iter().find(|stream| self.rule_of(stream).is_none()) {
            let names: Vec<&str> = self.streams.iter().map(|rule| rule.name).collect();
            return Err(ConfigError::UnknownStream {
                system: self.name,
                expected: names.join(", "),
                found: unknown.id.name().to_owned(),
            });
        }
        for rule in self.streams {
            let found = streams.iter().filter(|stream| stream.role == rule.role).count();
            if !(rule.least..=rule.most).contains(&found) {
                return Err(ConfigError::StreamCount {
                    role: rule.role,
                    least: rule.least,
                    most: rule.most,
                    found,
                });
            }
        }
        Ok(())
    }
}

impl StreamRule {
    /// The name of stream number `nth` of this role, counted from 0.
    pub fn nth(&self, nth: usize) -> Option<StreamId> {
        if self.most == 1 {
            return StreamId::read(self.name).filter(|_| nth == 0);
        }
        StreamId::read(&format!("{}_{}", self.name, nth + 1)).filter(|_| nth < self.most)
    }
}

impl Parameter {
    /// What every session is computed with unless somebody says otherwise.
    pub fn default_of(&self, declaration: &Declaration) -> f64 {
        (self.read)(&SessionConfig {
            identification: Some(Identification::default()),
            ..SessionConfig::by_default(declaration)
        })
    }
}
