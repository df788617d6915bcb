//! Arcs: how long a receiver has counted one satellite's cycles without a break, and what is known of their whole number.

use std::collections::BTreeMap;

use crate::gnss::observations::Epoch;
use crate::gnss::satellite::{Constellation, Satellite};

/// A band of a satellite.
pub type Key = (Satellite, u8);

/// What is known of the whole cycles of an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ambiguity {
    /// A state at this index.
    Float(usize),
    /// Held, whole in the gauge of its system and band.
    Held(f64),
}

/// One arc.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    /// Which arc of the whole run it is, counted.
    pub id: u32,
    /// Whole cycles.
    pub ambiguity: Ambiguity,
    /// Epochs of it so far.
    pub epochs: u32,
    /// The count of the filter's epochs at which it was seen last.
    pub last_seen: u64,
    /// Its phases may be off by half a cycle.
    pub half_cycle: bool,
    /// The ways of tracking, rover and base.
    pub attributes: [u8; 2],
    /// The count of the filter's epochs at which it began.
    pub began: u64,
    /// Within which gauge its whole cycles are held, counted from 1; 0 while they are not.
    pub gauge: u32,
}

/// Whole cycles of arcs by where and when they began: gauge and cycles.
pub type Known = BTreeMap<(Key, u64), (u32, f64)>;

/// Which satellites a receiver lost since it was asked last.
#[derive(Clone, Debug, Default)]
pub struct Losses {
    lost: BTreeMap<Key, bool>,
    all: bool,
}

impl Losses {
    /// Takes the flags of one epoch.
    pub fn take(&mut self, epoch: &Epoch) {
        self.all |= epoch.power_failure;
        for tracked in &epoch.satellites {
            for signal in epoch.signals_of(tracked) {
                if signal.lost_lock {
                    self.lost.insert((tracked.satellite, signal.band), true);
                }
            }
        }
    }

    /// Whether this one was lost.
    pub fn has(&self, key: &Key) -> bool {
        self.all || self.lost.contains_key(key)
    }

    /// Begins anew.
    pub fn clear(&mut self) {
        self.lost.clear();
        self.all = false;
    }
}

/// A system and a band: ambiguities are whole relative to each other only within.
pub type Group = (Constellation, u8);

/// The group of an arc.
pub fn group(key: &Key) -> Group {
    (key.0.constellation, key.1)
}
