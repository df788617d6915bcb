//! What replay asks of a filter: to go on by one input, to weigh a visit, to say where it is and how its errors show in that.

use std::fmt::Debug;

use nalgebra::{Vector3, Vector4};

use crate::event::{Event, TrackPoint, VisitOutcome};
use crate::ins::eskf::Eskf;
use crate::ins::linear_maps::Rows;
use crate::visit::Visit;

/// What a filter takes one at a time: a reading with all that was decided about it before. Small, of a fixed size, and the same to
/// the bit when it comes back from where it was put.
pub(crate) trait Input: Copy + Debug {
    /// Its length where it is put away, bytes.
    const BYTES: usize;
    /// Time, ns.
    fn t_ns(&self) -> i64;
    /// Number of the epoch that it belongs to.
    fn epoch(&self) -> u64;
    /// Whether it is the first of its epoch.
    fn opens_epoch(&self) -> bool;
    /// Appends it as [`BYTES`](Self::BYTES) bytes.
    fn write(&self, out: &mut Vec<u8>);
    /// Reads what [`write`](Self::write) has written.
    fn read(bytes: &[u8]) -> Self;
}

/// A filter of `B` three-vectors of error that can be run again. A copy of it is a checkpoint: the same inputs and visits
/// after it give the same bits.
pub(crate) trait Replayed<const B: usize>: Clone + Debug {
    /// What it takes.
    type Input: Input;
    /// What it needs to know beside its inputs, the same all along.
    type Setting: Debug;
    /// What is kept of a point so that it can be smoothed later.
    type AtPoint: Copy + Debug;

    /// How far back a late visit can be applied, s.
    fn history_s(setting: &Self::Setting) -> f64;
    /// Whether visits correct the track, or are only compared with it.
    fn uses_visits(setting: &Self::Setting) -> bool;

    /// Its time, ns.
    fn t_ns(&self) -> i64;
    /// Goes on by one input; outcomes are appended to `events`.
    fn step(&mut self, setting: &Self::Setting, input: &Self::Input, events: &mut Vec<Event>);
    /// Weighs a visit at its moment; what else it shows is appended to `events`.
    fn weigh(&mut self, setting: &Self::Setting, visit: &Visit, events: &mut Vec<Event>) -> VisitOutcome;
    /// Puts into `start`, itself at an earlier moment, what it has found out since that no correction can bring back there; says
    /// whether there was anything. Smoothing then runs on from there again.
    fn teach(&self, setting: &Self::Setting, start: &mut Self) -> bool;
    /// How many of the session's visits have been weighed.
    fn visits_weighed(&self) -> usize;
    /// Sets that number.
    fn set_visits_weighed(&mut self, number: usize);
    /// Where it is at `t_ns`, the time of its last input.
    fn point(&self, setting: &Self::Setting, t_ns: i64) -> TrackPoint;
    /// What smoothing that point will need.
    fn at_point(&self, t_ns: i64) -> Self::AtPoint;
    /// The covariance with all errors of what a point says (east, north, up, heading), and with the one set aside.
    fn point_with_errors(&self) -> (Rows<4, B>, Vector4<f64>);
    /// The point with estimated errors taken off; its sigmas stay.
    fn smoothed(
        setting: &Self::Setting,
        point: &TrackPoint,
        at: &Self::AtPoint,
        errors: &[Vector3<f64>; B],
    ) -> TrackPoint;
    /// The error filter.
    fn eskf(&self) -> &Eskf<B>;
    /// The error filter, to take what it has recorded.
    fn eskf_mut(&mut self) -> &mut Eskf<B>;
    /// Whether all numbers are finite and no variance negative.
    fn is_sound(&self) -> bool;
    /// It goes on from an older state than its inputs: what its sensors did in between is unknown.
    fn lose_all(&mut self);
}
