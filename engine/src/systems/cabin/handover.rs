//! The platform's pose from one source after another: by the encoders where they join it to the cabin, else by its own sensor
//! and the stations, else as it was last. From source to source it does not leap.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::now::BodyNow;
use super::output::Row;

/// Most that it moves from row to row beyond its own motion, m.
const STEP_M: f64 = 0.001;

/// Which source a row is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Source {
    Joined,
    Alone,
    Held,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Handover {
    smoothed: bool,
    waiting: BTreeMap<i64, (Source, Row)>,
    last: Option<(Source, Row)>,
    behind_n: Vector3<f64>,
}

impl Handover {
    pub(super) fn new(smoothed: bool) -> Handover {
        Handover { smoothed, waiting: BTreeMap::new(), last: None, behind_n: Vector3::zeros() }
    }

    /// Rows of both sources.
    pub(super) fn take(&mut self, joined: Vec<Row>, alone: Vec<Row>) {
        for row in alone {
            self.waiting.entry(row.t_ns).or_insert((Source::Alone, row));
        }
        for row in joined {
            if row.is_held {
                self.waiting.entry(row.t_ns).or_insert((Source::Held, row));
            } else {
                self.waiting.insert(row.t_ns, (Source::Joined, row));
            }
        }
    }

    /// The platform's rows up to a time, ns, which are all known.
    pub(super) fn give(&mut self, until_ns: i64, out: &mut Vec<Row>) {
        let later =
            if until_ns == i64::MAX { BTreeMap::new() } else { self.waiting.split_off(&(until_ns + 1)) };
        for (_, (source, row)) in std::mem::replace(&mut self.waiting, later) {
            out.push(self.told(source, row));
        }
    }

    /// The newest row of whichever source says where the platform is, so far off as what is told is now.
    pub(super) fn now(&self, joined: Option<BodyNow>, alone: Option<BodyNow>) -> Option<BodyNow> {
        let told = match (joined, alone) {
            (Some(joined), Some(alone)) => Some(if joined.row.is_held { alone } else { joined }),
            (joined, alone) => joined.or(alone),
        };
        told.map(|now| BodyNow { row: now.row.behind(&self.behind_n), ..now })
    }

    fn told(&mut self, source: Source, row: Row) -> Row {
        if let Some((before, last)) = &self.last {
            let dt_s = (row.t_ns - last.t_ns) as f64 * 1e-9;
            if *before != source && !self.smoothed && dt_s < 0.5 {
                self.behind_n = last.p_n + last.v_n * dt_s - row.p_n;
            }
            let length = self.behind_n.norm();
            self.behind_n = if length <= STEP_M || length > 0.2 {
                Vector3::zeros()
            } else {
                self.behind_n * (1.0 - STEP_M / length)
            };
        }
        let row = row.behind(&self.behind_n);
        self.last = Some((source, row.clone()));
        row
    }
}
