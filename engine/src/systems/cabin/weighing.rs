//! What became of the rows of antennas and stations, told as one outcome a second: a night has millions of rows.

use serde::{Deserialize, Serialize};

use super::body::Weighed;
use super::declaration::{ANTENNAS, GNSS, RAYS, STATIONS};
use crate::event::{AidOutcome, Event};

/// One outcome stands for so long, ns.
const CELL_NS: i64 = 1_000_000_000;

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Sum {
    nis: f64,
    rows: u32,
}

/// The rows of the present second.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Weighing {
    cell: i64,
    /// By antennas and stations; refused and taken.
    sums: [[Sum; 2]; 2],
}

impl Weighing {
    /// Takes a row; those of the second before are told.
    pub(super) fn take(&mut self, weighed: &Weighed, station: bool, events: &mut Vec<Event>) {
        let cell = weighed.t_ns.div_euclid(CELL_NS);
        if cell > self.cell {
            self.tell(events);
            self.cell = cell;
        }
        let sum = &mut self.sums[usize::from(station)][usize::from(weighed.taken)];
        sum.rows += 1;
        sum.nis += weighed.nis;
    }

    /// Tells what has been gathered.
    pub(super) fn tell(&mut self, events: &mut Vec<Event>) {
        for (station, sums) in std::mem::take(&mut self.sums).into_iter().enumerate() {
            for (taken, sum) in sums.into_iter().enumerate().filter(|(_, sum)| sum.rows > 0) {
                events.push(Event::Aid(AidOutcome {
                    t_ns: self.cell * CELL_NS,
                    stream: Some(if station == 1 { RAYS } else { GNSS }),
                    aid: if station == 1 { STATIONS } else { ANTENNAS },
                    nis: sum.nis / f64::from(sum.rows),
                    degrees_of_freedom: 3,
                    updates: sum.rows,
                    accepted: taken == 1,
                }));
            }
        }
    }
}
