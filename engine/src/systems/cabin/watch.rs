//! What is wrong with which device, from when to when.

use serde::Serialize;

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
}

/// A run of refused rows is over after so long without one, ns.
const OVER_NS: i64 = 2_000_000_000;

#[derive(Clone, Debug)]
struct Open {
    source: String,
    kind: &'static str,
    detail: String,
    start_ns: i64,
    last_ns: i64,
    count: usize,
    /// So many within a second make an anomaly of it.
    needed: usize,
    told: bool,
}

/// Keeps what is open, and what has been.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    open: Vec<Open>,
    closed: Vec<CabinAnomaly>,
}

impl Watch {
    /// A device's row was wrong, or it is silent: one more for this kind of trouble.
    pub(super) fn wrong(
        &mut self,
        source: &str,
        kind: &'static str,
        t_ns: i64,
        needed: usize,
        detail: impl FnOnce() -> String,
    ) {
        self.wrong_since(source, kind, t_ns, t_ns, needed, detail);
    }

    /// The same, known to have begun before.
    pub(super) fn wrong_since(
        &mut self,
        source: &str,
        kind: &'static str,
        since_ns: i64,
        t_ns: i64,
        needed: usize,
        detail: impl FnOnce() -> String,
    ) {
        let found = self.open.iter_mut().find(|open| open.kind == kind && open.source == source);
        match found {
            Some(open) => {
                if !open.told && t_ns - open.start_ns > 1_500_000_000 {
                    open.start_ns = t_ns;
                    open.count = 0;
                }
                open.last_ns = open.last_ns.max(t_ns);
                open.count += 1;
                open.told |= open.count >= open.needed;
            }
            None => self.open.push(Open {
                source: source.to_owned(),
                kind,
                detail: detail(),
                start_ns: since_ns,
                last_ns: t_ns,
                count: 1,
                needed,
                told: needed <= 1,
            }),
        }
    }

    /// Whether a device has an open anomaly of the kind.
    pub(super) fn is_open(&self, source: &str, kind: &str) -> bool {
        self.open.iter().any(|open| open.told && open.source == source && open.kind == kind)
    }

    /// Closes what has not come again.
    pub(super) fn pass(&mut self, t_ns: i64) {
        let closed = &mut self.closed;
        self.open.retain(|open| {
            let over = t_ns - open.last_ns > OVER_NS;
            if over && open.told {
                closed.push(open.anomaly());
            }
            !over
        });
    }

    /// All there has been, in order of their beginning.
    pub(super) fn finish(mut self) -> Vec<CabinAnomaly> {
        self.closed.extend(self.open.iter().filter(|open| open.told).map(Open::anomaly));
        self.closed.sort_by(|a, b| a.t_start_s.total_cmp(&b.t_start_s));
        self.closed
    }
}

impl Open {
    fn anomaly(&self) -> CabinAnomaly {
        CabinAnomaly {
            source: self.source.clone(),
            kind: self.kind,
            t_start_s: self.start_ns as f64 * 1e-9,
            t_end_s: self.last_ns as f64 * 1e-9,
            detail: self.detail.clone(),
        }
    }
}
