//! One number for a whole track: equal where upload, stream and command line agree to the last bit.

use sha2::{Digest as _, Sha256};

use crate::event::{Part, Tilt, TrackPoint};
use crate::stream::StreamId;
use crate::track::Track;

impl Track {
    /// SHA-256 over the exact bits of the final points, visits and anomalies, in hexadecimal.
    pub fn sha256(&self) -> String {
        let mut bits = Bits { hash: Sha256::new(), buffer: Vec::with_capacity(1 << 16) };
        bits.text("lodestep track 1");
        bits.word(self.points.len() as u64);
        for point in &self.points {
            bits.point(point);
        }
        bits.word(self.visits.len() as u64);
        for visit in &self.visits {
            bits.text(&visit.marker);
            bits.word(visit.t_ns as u64);
            bits.numbers(&visit.before_minus_marker_n_m);
            bits.numbers(&visit.after_minus_marker_n_m);
            bits.numbers(&[visit.nis]);
            bits.byte(visit.degrees_of_freedom);
            bits.byte(u8::from(visit.accepted));
            bits.text(&visit.reason);
        }
        bits.word(self.anomalies.len() as u64);
        for anomaly in &self.anomalies {
            bits.text(anomaly.kind.as_str());
            bits.text(anomaly.stream.as_ref().map_or("", StreamId::name));
            bits.word(anomaly.t_start_ns as u64);
            bits.word(anomaly.t_end_ns as u64);
            bits.word(anomaly.samples);
            // Its figures stand in it.
            bits.text(&anomaly.detail);
        }
        bits.finish()
    }
}

struct Bits {
    hash: Sha256,
    buffer: Vec<u8>,
}

impl Bits {
    fn bytes(&mut self, bytes: &[u8]) {
        if self.buffer.len() + bytes.len() > self.buffer.capacity() {
            self.hash.update(&self.buffer);
            self.buffer.clear();
        }
        self.buffer.extend_from_slice(bytes);
    }

    fn byte(&mut self, byte: u8) {
        self.bytes(&[byte]);
    }

    fn word(&mut self, word: u64) {
        self.bytes(&word.to_le_bytes());
    }

    fn numbers(&mut self, values: &[f64]) {
        for value in values {
            self.word(value.to_bits());
        }
    }

    /// The length goes first, so that no two lists of texts look alike.
    fn text(&mut self, text: &str) {
        self.word(text.len() as u64);
        self.bytes(text.as_bytes());
    }

    fn point(&mut self, point: &TrackPoint) {
        self.word(point.t_ns as u64);
        self.numbers(&point.position_n_m);
        self.numbers(&[point.heading_rad, point.sigma_heading_rad]);
        self.numbers(&point.sigma_n_m);
        self.numbers(&[point.covariance_en_m2]);
        if let Some(Tilt { roll_rad, pitch_rad, sigma_roll_rad, sigma_pitch_rad }) = &point.tilt {
            self.numbers(&[*roll_rad, *pitch_rad, f64::from(*sigma_roll_rad), f64::from(*sigma_pitch_rad)]);
        }
        for part in &point.parts {
            match part {
                None => self.byte(0),
                Some(Part { position_n_m, stance }) => {
                    self.byte(1 + u8::from(*stance));
                    self.numbers(position_n_m);
                }
            }
        }
    }

    fn finish(mut self) -> String {
        self.hash.update(&self.buffer);
        self.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anomaly::{Anomaly, AnomalyKind};
    use crate::event::{Event, VisitOutcome};
    use crate::track::csv::tests::point;

    fn track() -> Track {
        let mut track = Track::default();
        track.take(Event::Point(point()));
        track.take(Event::Visit(VisitOutcome {
            marker: "A17".into(),
            t_ns: 5,
            before_minus_marker_n_m: [1.0, 2.0, 3.0],
            after_minus_marker_n_m: [0.1, 0.2, 0.3],
            nis: 2.0,
            degrees_of_freedom: 3,
            accepted: true,
            reason: String::new(),
        }));
        track.take(Event::Anomaly(Anomaly {
            kind: AnomalyKind::GAP,
            stream: Some(StreamId::named("left")),
            t_start_ns: 1,
            t_end_ns: 2,
            samples: 0,
            detail: "a gap".into(),
            figures: None,
        }));
        track
    }

    #[test]
    fn the_last_bit_of_anything_changes_it() {
        let sha256 = track().sha256();
        assert_eq!(sha256.len(), 64);
        assert_eq!(sha256, track().sha256());
        let changes: [fn(&mut Track); 6] = [
            |t| t.points[0].position_n_m[2] = t.points[0].position_n_m[2].next_up(),
            |t| t.points[0].heading_rad = -0.0,
            |t| t.points[0].parts[1] = None,
            |t| t.visits[0].nis = t.visits[0].nis.next_down(),
            |t| t.anomalies[0].stream = None,
            |t| t.anomalies[0].kind = AnomalyKind::STUCK_AXIS,
        ];
        for (i, change) in changes.iter().enumerate() {
            let mut changed = track();
            changed.points[0].heading_rad = 0.0;
            let before = changed.sha256();
            change(&mut changed);
            assert_ne!(changed.sha256(), before, "change {i}");
        }
    }
}
