//! Whether devices contradict each other so much that nobody knows which are right.
//!
//! A gate shuts out one antenna, one make or one station that is off. Where half of the stations, or antennas of more than one make,
//! are shut out again and again, it is the pose that may be wrong: a clock that steps, an encoder that is off. The pose is then told
//! with as much more sigma as what was shut out is off.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::aids::Aids;
use super::output::Row;

/// What was weighed is forgotten by half in this time, s.
const HALF_S: f64 = 1.5;
/// A device is shut out when this share of its rows is.
const SHUT_OUT: f64 = 0.3;
/// So many rows, those of long ago counted less, say something of a device.
const FEWEST_ROWS: f64 = 1.0;
/// A contradiction is kept in mind for so long after it was seen last, ns: a slow station's next row may be that far.
const KEPT_NS: i64 = 3_000_000_000;
/// From the cabin's origin to its antennas, m: how an attitude shares an error of place.
const RING_M: f64 = 6.5;

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Tally {
    taken: f64,
    refused: f64,
    /// Squares of how far the refused rows were off, m², weighted as they are.
    square_m2: f64,
}

impl Tally {
    fn rows(&self) -> f64 {
        self.taken + self.refused
    }

    fn is_shut_out(&self) -> bool {
        self.refused > SHUT_OUT * self.rows() && self.refused > FEWEST_ROWS
    }
}

/// What each device's rows came to lately.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Doubt {
    tallies: Vec<Tally>,
    last_ns: Option<i64>,
    off_m: f64,
    seen_ns: i64,
}

/// Devices that contradict the pose together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contradiction {
    pub(super) stations: bool,
    pub(super) devices: usize,
    pub(super) off_m: f64,
}

impl Doubt {
    /// A row that was weighed, and how far off it was, m.
    pub(super) fn note(&mut self, aid: usize, taken: bool, off_m: f64) {
        if self.tallies.len() <= aid {
            self.tallies.resize(aid + 1, Tally::default());
        }
        let tally = &mut self.tallies[aid];
        if taken {
            tally.taken += 1.0;
        } else {
            tally.refused += 1.0;
            tally.square_m2 += off_m * off_m;
        }
    }

    /// The end of an epoch: who contradicts the pose. `makes` is the make of each antenna.
    pub(super) fn pass(&mut self, t_ns: i64, aids: &Aids, makes: &[usize]) -> Option<Contradiction> {
        let dt_s = self.last_ns.map_or(0.0, |last_ns| (t_ns - last_ns).max(0) as f64 * 1e-9);
        self.last_ns = Some(t_ns);
        let kept = libm::exp2(-dt_s / HALF_S);
        for tally in &mut self.tallies {
            *tally = Tally {
                taken: tally.taken * kept,
                refused: tally.refused * kept,
                square_m2: tally.square_m2 * kept,
            };
        }
        let found = [false, true].into_iter().filter_map(|stations| self.of(stations, aids, makes));
        let worst = found.max_by(|a, b| a.off_m.total_cmp(&b.off_m));
        if let Some(found) = worst {
            self.off_m = found.off_m;
            self.seen_ns = t_ns;
        } else if t_ns - self.seen_ns > KEPT_NS {
            self.off_m = 0.0;
        }
        worst
    }

    fn of(&self, stations: bool, aids: &Aids, makes: &[usize]) -> Option<Contradiction> {
        let group =
            self.tallies.iter().enumerate().skip(1).filter(|(aid, _)| aids.is_station(*aid) == stations);
        let seen: Vec<(usize, &Tally)> = group.filter(|(_, tally)| tally.rows() > FEWEST_ROWS).collect();
        let out: Vec<(usize, &Tally)> =
            seen.iter().copied().filter(|(_, tally)| tally.is_shut_out()).collect();
        let mut of_makes: Vec<Option<&usize>> = out.iter().map(|(aid, _)| makes.get(aid - 1)).collect();
        of_makes.dedup();
        let one_make = !stations && of_makes.windows(2).all(|two| two[0] == two[1]);
        if out.len() < 2 || 2 * out.len() < seen.len() || one_make {
            return None;
        }
        let worst = out.iter().map(|(_, tally)| libm::sqrt(tally.square_m2 / tally.refused));
        Some(Contradiction { stations, devices: out.len(), off_m: worst.fold(0.0, f64::max) })
    }

    /// Whether devices contradict the pose now.
    pub(super) fn is_there(&self) -> bool {
        self.off_m > 0.0
    }

    /// The row with as much more sigma.
    pub(super) fn widened(&self, mut row: Row) -> Row {
        if self.is_there() {
            let mut add = |at: usize, sigma: f64| {
                let mut block = row.covariance.fixed_view_mut::<3, 3>(at, at);
                block += Matrix3::identity() * (sigma * sigma);
            };
            add(0, self.off_m);
            add(3, self.off_m / RING_M);
        }
        row
    }
}
