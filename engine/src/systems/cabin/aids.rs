//! What corrects the poses, by name and bit, when each did last, and what is wrong with it.

use serde::{Deserialize, Serialize};

use super::instrument::Instrument;
use super::watch::Watch;
use crate::system::AidState;

/// An aid counts for so long after it has corrected, ns.
const FRESH_NS: i64 = 500_000_000;
const NEVER_NS: i64 = i64::MIN / 2;

/// All that may correct: the inertial sensor, antennas, stations, encoders, and the platform's inertial sensor where it is read.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Aids {
    names: Vec<String>,
    /// The make of each antenna.
    makes: Vec<String>,
    antennas: usize,
    stations: usize,
    last_ns: Vec<i64>,
}

impl Aids {
    pub(super) fn new(instrument: &Instrument, with_platform_imu: bool) -> Aids {
        let (antennas, stations) = (&instrument.antennas.names, &instrument.stations.names);
        let mut names = vec!["imu".to_owned()];
        names.extend(antennas.iter().chain(stations).cloned());
        names.push("encoders".to_owned());
        names.extend(with_platform_imu.then(|| "platform_imu".to_owned()));
        Aids {
            last_ns: vec![NEVER_NS; names.len()],
            names,
            makes: instrument.antennas.make.clone(),
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

    /// The platform's inertial sensor, where it is read.
    pub(super) fn platform_imu(&self) -> Option<usize> {
        (self.names.len() > self.encoders() + 1).then_some(self.encoders() + 1)
    }

    pub(super) fn took(&mut self, aid: usize, t_ns: i64) {
        self.last_ns[aid] = self.last_ns[aid].max(t_ns);
    }

    /// Those of them that correct the cabin, and the platform by the encoders.
    pub(super) fn fresh_of_cabin(&self, t_ns: i64) -> u64 {
        self.fresh(t_ns) & !self.platform_imu().map_or(0, |aid| 1 << aid)
    }

    /// Those of them that correct the platform by itself: stations and its own sensor.
    pub(super) fn fresh_of_platform(&self, t_ns: i64) -> u64 {
        let stations: u64 = ((1 << self.stations) - 1) << (1 + self.antennas);
        self.fresh(t_ns) & (stations | self.platform_imu().map_or(0, |aid| 1 << aid))
    }

    /// How long ago each has corrected a pose, and what is known to be wrong with it.
    pub(super) fn states(&self, t_ns: i64, watch: &Watch) -> Vec<AidState> {
        let of = |(aid, last_ns): (usize, &i64)| {
            let troubles = watch.open().filter_map(|(source, kind)| Some((self.rank(aid, source)?, kind)));
            AidState {
                since_s: if *last_ns == NEVER_NS {
                    f64::INFINITY
                } else {
                    (t_ns - last_ns).max(0) as f64 * 1e-9
                },
                // What is known of the device itself says more than what is known of all like it.
                trouble: troubles.min_by_key(|(rank, _)| *rank).map(|(_, kind)| kind),
            }
        };
        self.last_ns.iter().enumerate().map(of).collect()
    }

    /// How closely a source of trouble concerns an aid: 0 by its own name, more for a part or a group of it; `None` if not at all.
    fn rank(&self, aid: usize, source: &str) -> Option<u8> {
        let antenna = aid.checked_sub(1).filter(|antenna| *antenna < self.antennas);
        let groups = match antenna {
            Some(antenna) => [self.makes[antenna].as_str(), "antennas"],
            None if self.is_station(aid) => ["stations"; 2],
            None => [""; 2],
        };
        if source == self.names[aid] {
            Some(0)
        } else if source == groups[0] || (aid == self.encoders() && source.starts_with("leg_")) {
            Some(1)
        } else {
            (source == groups[1]).then_some(2)
        }
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
