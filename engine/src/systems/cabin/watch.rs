//! What is wrong with which device, from when to when.

use serde::{Deserialize, Serialize};

use super::causes::CabinCause;
use crate::anomaly::AnomalyKind;

/// Something that was wrong with a device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CabinAnomaly {
    /// The device by its name, or `imu`, `encoders`, `stations`, `antennas`, a make.
    pub source: String,
    /// What kind of trouble, in snake case.
    pub kind: &'static str,
    /// From when, s.
    pub t_start_s: f64,
    /// Until when, s.
    pub t_end_s: f64,
    /// In a sentence.
    pub detail: String,
    /// The same with its figures.
    #[serde(skip)]
    pub cause: CabinCause,
    /// From when to when, ns.
    #[serde(skip)]
    pub ends_ns: [i64; 2],
}

impl CabinAnomaly {
    /// Of a device, from when to when, ns.
    pub fn new(source: &str, cause: CabinCause, ends_ns: [i64; 2]) -> CabinAnomaly {
        let [t_start_s, t_end_s] = ends_ns.map(|t_ns| t_ns as f64 * 1e-9);
        CabinAnomaly {
            source: source.to_owned(),
            kind: cause.word(),
            t_start_s,
            t_end_s,
            detail: cause.sentence(),
            cause,
            ends_ns,
        }
    }
}

/// A run of refused rows is over after so long without one, ns.
const OVER_NS: i64 = 2_000_000_000;

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Open {
    source: String,
    cause: CabinCause,
    start_ns: i64,
    last_ns: i64,
    count: usize,
    /// So many within a second make an anomaly of it.
    needed: usize,
    told: bool,
}

/// Keeps what is open, and what has been.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Watch {
    open: Vec<Open>,
    closed: Vec<Known>,
    /// What has become an anomaly since somebody asked.
    fresh: Vec<Known>,
}

/// An anomaly's own part: the rest is made of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Known {
    source: String,
    cause: CabinCause,
    ends_ns: [i64; 2],
}

impl Known {
    fn anomaly(self) -> CabinAnomaly {
        CabinAnomaly::new(&self.source, self.cause, self.ends_ns)
    }
}

impl Watch {
    /// A device's row was wrong, or it is silent: one more for this kind of trouble.
    pub(super) fn wrong(&mut self, source: &str, cause: CabinCause, t_ns: i64, needed: usize) {
        self.wrong_since(source, cause, t_ns, t_ns, needed);
    }

    /// The same, known to have begun before.
    pub(super) fn wrong_since(
        &mut self,
        source: &str,
        cause: CabinCause,
        since_ns: i64,
        t_ns: i64,
        needed: usize,
    ) {
        let kind = cause.word();
        let known = self.open.iter().position(|open| open.cause.word() == kind && open.source == source);
        let at = known.unwrap_or(self.open.len());
        if known.is_none() {
            self.open.push(Open {
                source: source.to_owned(),
                cause: cause.clone(),
                start_ns: since_ns,
                last_ns: t_ns,
                count: 0,
                needed: needed.max(1),
                told: false,
            });
        }
        let open = &mut self.open[at];
        if !open.told && t_ns - open.start_ns > 1_500_000_000 && known.is_some() {
            open.start_ns = t_ns;
            open.count = 0;
        }
        if matches!(cause, CabinCause::SensorSilent { .. }) {
            open.cause = cause;
        }
        open.last_ns = open.last_ns.max(t_ns);
        open.count += 1;
        if !open.told && open.count >= open.needed {
            open.told = true;
            self.fresh.push(open.known());
        }
    }

    /// What is wrong now: the device, devices or make, and the kind.
    pub(super) fn open(&self) -> impl Iterator<Item = (&str, AnomalyKind)> {
        self.open.iter().filter(|open| open.told).map(|open| (open.source.as_str(), open.cause.kind()))
    }

    /// Whether a device has an open anomaly of the kind.
    pub(super) fn is_open(&self, source: &str, kind: &str) -> bool {
        self.open.iter().any(|open| open.told && open.source == source && open.cause.word() == kind)
    }

    /// Closes what has not come again.
    pub(super) fn pass(&mut self, t_ns: i64) {
        let closed = &mut self.closed;
        self.open.retain(|open| {
            let over = t_ns - open.last_ns > OVER_NS;
            if over && open.told {
                closed.push(open.known());
            }
            !over
        });
    }

    /// What has become an anomaly since the last time, as far as it is known.
    pub(super) fn fresh(&mut self) -> Vec<CabinAnomaly> {
        std::mem::take(&mut self.fresh).into_iter().map(Known::anomaly).collect()
    }

    /// Lets go of what is over: of a session that goes on for a night nobody asks for it in the end.
    pub(super) fn forget_what_is_over(&mut self) {
        self.closed.clear();
    }

    /// All there has been, in order of their beginning.
    pub(super) fn finish(mut self) -> Vec<CabinAnomaly> {
        self.closed.extend(self.open.iter().filter(|open| open.told).map(Open::known));
        self.closed.sort_by_key(|known| known.ends_ns[0]);
        self.closed.into_iter().map(Known::anomaly).collect()
    }
}

impl Open {
    fn known(&self) -> Known {
        let ends_ns = [self.start_ns, self.last_ns];
        Known { source: self.source.clone(), cause: self.cause.clone(), ends_ns }
    }
}
