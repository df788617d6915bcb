//! Rows of complete logs in order of their tags, as far as a window of rows reaches, whatever the order in which they come.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use serde::{Deserialize, Serialize};

use super::rows::{AidRow, ImuRow};

/// Rows of antennas, stations and encoders are put in order of their tags within so many.
pub const WINDOW: usize = 20_000;

/// A row of any device.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) enum AnyRow {
    Imu(ImuRow),
    PlatformImu(ImuRow),
    Aid(AidRow),
}

impl AnyRow {
    pub(super) fn t_ns(&self) -> i64 {
        match self {
            AnyRow::Imu(row) | AnyRow::PlatformImu(row) => row.t_ns,
            AnyRow::Aid(row) => row.t_ns(),
        }
    }
}

/// In the order in which rows of one tag go: inertial sensors, encoders, antennas, stations.
pub(super) const SOURCES: usize = 5;

#[derive(Debug)]
struct Waiting {
    t_ns: i64,
    number: u64,
    row: AnyRow,
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Waiting) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Waiting) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The earliest is the greatest, as a heap gives that first.
impl Ord for Waiting {
    fn cmp(&self, other: &Waiting) -> Ordering {
        (other.t_ns, other.number).cmp(&(self.t_ns, self.number))
    }
}

#[derive(Debug, Default)]
struct Source {
    waiting: BinaryHeap<Waiting>,
    window: usize,
    is_there: bool,
    ended: bool,
}

/// Rows that wait for earlier ones.
#[derive(Debug, Default)]
pub(super) struct Order {
    sources: [Source; SOURCES],
    read: u64,
}

impl Order {
    /// Of the sources that the session has.
    pub(super) fn new(is_there: [bool; SOURCES]) -> Order {
        let mut order = Order::default();
        for (number, (source, is_there)) in order.sources.iter_mut().zip(is_there).enumerate() {
            source.is_there = is_there;
            source.window = if number < 2 { 0 } else { WINDOW };
        }
        order
    }

    pub(super) fn push(&mut self, source: usize, row: AnyRow) {
        self.sources[source].waiting.push(Waiting { t_ns: row.t_ns(), number: self.read, row });
        self.read += 1;
    }

    /// No more rows of this source.
    pub(super) fn end(&mut self, source: usize) {
        self.sources[source].ended = true;
    }

    /// No more rows at all.
    pub(super) fn end_all(&mut self) {
        self.sources.iter_mut().for_each(|source| source.ended = true);
    }

    /// The next row, once none earlier can come.
    pub(super) fn next(&mut self) -> Option<AnyRow> {
        let mut first: Option<(i64, usize)> = None;
        for (number, source) in self.sources.iter().enumerate().filter(|(_, source)| source.is_there) {
            if !source.ended && source.waiting.len() <= source.window {
                return None;
            }
            if let Some(waiting) = source.waiting.peek()
                && first.is_none_or(|(t_ns, _)| waiting.t_ns < t_ns)
            {
                first = Some((waiting.t_ns, number));
            }
        }
        let (_, number) = first?;
        self.sources[number].waiting.pop().map(|waiting| waiting.row)
    }
}
