//! What corrects the pose, by name and bit, and when each did last.

use serde::{Deserialize, Serialize};

use super::instrument::Instrument;

/// An aid counts for so long after it has corrected, ns.
const FRESH_NS: i64 = 500_000_000;

/// All that may correct: the inertial sensor, antennas, stations, encoders.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Aids {
    names: Vec<String>,
    antennas: usize,
    stations: usize,
    last_ns: Vec<i64>,
}

impl Aids {
    pub(super) fn new(instrument: &Instrument) -> Aids {
        let (antennas, stations) = (&instrument.antennas.names, &instrument.stations.names);
        let mut names = vec!["imu".to_owned()];
        names.extend(antennas.iter().chain(stations).cloned());
        names.push("encoders".to_owned());
        Aids {
            last_ns: vec![i64::MIN / 2; names.len()],
            names,
            antennas: antennas.len(),
            stations: stations.len(),
        }
    }

    pub(super) const IMU: usize = 0;

    pub(super) fn antenna(&self, k: usize) -> usize {
        1 + k
    }

    pub(super) fn station(&self, k: usize) -> usize {
        1 + self.antennas + k
    }

    pub(super) fn encoders(&self) -> usize {
        1 + self.antennas + self.stations
    }

    pub(super) fn took(&mut self, aid: usize, t_ns: i64) {
        self.last_ns[aid] = self.last_ns[aid].max(t_ns);
    }

    /// The aids that are fresh, as bits.
    pub(super) fn fresh(&self, t_ns: i64) -> u64 {
        let bits = self.last_ns.iter().enumerate().filter(|(_, last_ns)| t_ns - **last_ns <= FRESH_NS);
        bits.fold(0, |mask, (aid, _)| mask | 1 << aid)
    }

    /// Whether antennas, and stations, are among them.
    pub(super) fn has_position(&self, mask: u64) -> [bool; 2] {
        let of = |from: usize, count: usize| (mask >> from) & ((1 << count) - 1) != 0;
        [of(1, self.antennas), of(1 + self.antennas, self.stations)]
    }

    /// The names of a mask's aids, joined by `+`.
    pub fn names(&self, mask: u64) -> String {
        let fresh = self.names.iter().enumerate().filter(|(aid, _)| mask >> aid & 1 == 1);
        fresh.map(|(_, name)| name.as_str()).collect::<Vec<_>>().join("+")
    }

    /// Whether an aid is a station; antennas and encoders are none.
    pub(super) fn is_station(&self, aid: usize) -> bool {
        (1 + self.antennas..=self.antennas + self.stations).contains(&aid)
    }

    /// All names, in the order of a mask's bits.
    pub(super) fn all(&self) -> &[String] {
        &self.names
    }

    pub(super) fn name(&self, aid: usize) -> &str {
        &self.names[aid]
    }
}
