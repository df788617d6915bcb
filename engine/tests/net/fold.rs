//! Everything a session says, folded into three hashes. Field values are written out one by one and sides are spelt `left`
//! and `right`, so the hashes outlive a renaming of types: this is then the only file to adapt.

use lodestep_engine::event::{Event, Part, TrackPoint};
use lodestep_engine::session::Session;
use lodestep_engine::stream::StreamId;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::track::Track;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

/// The hashes of one session as it goes on.
#[derive(Default)]
pub(crate) struct Fold {
    /// Final points, visits and anomalies, for the hash that the product itself shows.
    track: Track,
    /// Every event, in the order in which it was emitted.
    events: Bits,
    /// Summaries and sensor states, whenever they were looked at.
    states: Bits,
    looks: u64,
}

impl Fold {
    /// Takes events in, oldest first.
    pub(crate) fn take(&mut self, events: &mut Vec<Event>) {
        for event in events.drain(..) {
            self.events.event(&event);
            self.track.take(event);
        }
    }

    /// Looks at the summary and at what the filter knows of the sensors.
    pub(crate) fn look(&mut self, session: &Session) {
        let bits = &mut self.states;
        let summary = session.summary();
        for count in [summary.samples, summary.epochs, summary.late_samples] {
            bits.word(count);
        }
        bits.numbers(&[summary.duration_s, summary.distance_m]);
        bits.numbers(&[summary.since_marker_s, summary.since_marker_m]);
        for sensor in session.sensors() {
            bits.text(sensor.stream.name());
            bits.time(sensor.t_ns);
            bits.flag(sensor.stance);
            bits.numbers(&sensor.gyro_bias_b_rad_s);
            bits.numbers(&sensor.sigma_gyro_bias_rad_s);
            bits.numbers(&sensor.accelerometer_bias_b_m_s2);
            bits.numbers(&sensor.sigma_accelerometer_bias_m_s2);
            bits.option(sensor.magnetic_minus_heading_rad);
        }
    }

    /// Looks at every thousandth call, about.
    pub(crate) fn look_at_times(&mut self, session: &Session) {
        self.looks += 1;
        if self.looks.is_multiple_of(997) {
            self.look(session);
        }
    }

    /// The hashes by name.
    pub(crate) fn hashes(self) -> Vec<(&'static str, String)> {
        let track = self.track.sha256();
        vec![("track", track), ("events", self.events.sha256()), ("states", self.states.sha256())]
    }
}

/// How a side is spelt, whatever its type is called.
pub(crate) fn side(foot: Side) -> &'static str {
    foot.name()
}

/// A hash that is fed value by value.
#[derive(Default)]
pub(crate) struct Bits(Sha256);

impl Bits {
    pub(crate) fn word(&mut self, word: u64) {
        self.0.update(word.to_le_bytes());
    }

    pub(crate) fn time(&mut self, t_ns: i64) {
        self.word(t_ns as u64);
    }

    pub(crate) fn flag(&mut self, flag: bool) {
        self.0.update([u8::from(flag)]);
    }

    pub(crate) fn numbers(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.word(value.to_bits()));
    }

    pub(crate) fn option(&mut self, value: Option<f64>) {
        self.flag(value.is_some());
        self.numbers(value.as_slice());
    }

    /// The length goes first, so that no two sequences of texts look alike.
    pub(crate) fn text(&mut self, text: &str) {
        self.word(text.len() as u64);
        self.0.update(text);
    }

    /// A value by its name on the wire.
    fn wire(&mut self, value: impl Serialize) {
        self.text(&serde_json::to_string(&value).expect("events can be written"));
    }

    pub(crate) fn sha256(self) -> String {
        self.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn point(&mut self, point: &TrackPoint) {
        self.time(point.t_ns);
        self.numbers(&point.position_n_m);
        self.numbers(&[point.heading_rad, point.sigma_heading_rad]);
        self.numbers(&point.sigma_n_m);
        self.numbers(&[point.covariance_en_m2]);
        for (name, part) in [("left", point.parts[0]), ("right", point.parts[1])] {
            if let Some(Part { position_n_m, stance }) = part {
                self.text(name);
                self.numbers(&position_n_m);
                self.flag(stance);
            }
        }
    }

    fn event(&mut self, event: &Event) {
        match event {
            Event::Aligned(alignment) => {
                self.text("aligned");
                self.text(alignment.stream.name());
                self.time(alignment.t_start_ns);
                self.time(alignment.t_end_ns);
                self.numbers(&[alignment.heading_rad, alignment.sigma_heading_rad]);
                self.wire(alignment.heading_source);
                self.numbers(&alignment.gyro_bias_b_rad_s);
                self.numbers(&[alignment.rest_specific_force_m_s2]);
            }
            Event::Point(point) => {
                self.text("point");
                self.point(point);
            }
            Event::Revision { points } => {
                self.text("revision");
                self.word(points.len() as u64);
                points.iter().for_each(|point| self.point(point));
            }
            Event::Visit(visit) => {
                self.text("visit");
                self.text(&visit.marker);
                self.time(visit.t_ns);
                self.numbers(&visit.before_minus_marker_n_m);
                self.numbers(&visit.after_minus_marker_n_m);
                self.numbers(&[visit.nis]);
                self.word(u64::from(visit.degrees_of_freedom));
                self.flag(visit.accepted);
            }
            Event::Anomaly(anomaly) => {
                self.text("anomaly");
                self.wire(anomaly.kind);
                self.text(anomaly.stream.as_ref().map_or("", StreamId::name));
                self.time(anomaly.t_start_ns);
                self.time(anomaly.t_end_ns);
                self.word(anomaly.samples);
                // Its sentence is held by the hash of the track.
                self.wire(&anomaly.figures);
            }
            Event::Aid(aid) => {
                self.text("aid");
                self.time(aid.t_ns);
                self.text(aid.stream.as_ref().map_or("", StreamId::name));
                self.wire(aid.aid);
                self.numbers(&[aid.nis]);
                self.word(u64::from(aid.degrees_of_freedom));
                self.word(u64::from(aid.updates));
                self.flag(aid.accepted);
            }
            Event::Stand(stand) => {
                self.text("stand");
                self.word(u64::from(stand.number));
                self.time(stand.t_start_ns);
                self.time(stand.t_end_ns);
                self.flag(stand.lasts);
                self.numbers(&stand.position_n_m);
                for candidate in &stand.candidates {
                    self.text(candidate.marker.as_deref().unwrap_or(""));
                    self.numbers(&[candidate.probability]);
                    self.option(candidate.distance_m);
                }
                if let Some(visit) = &stand.visit {
                    self.text(&visit.marker);
                    self.flag(visit.automatic);
                }
            }
        }
    }
}
