//! What a system is to the rest of the house: what it declares, how it is configured, and what a session asks of it.
//!
//! A shared room knows of a system only what stands here. [`crate::systems::catalogue`] lists the systems that there are.

mod config;
mod declaration;
mod pose;
mod summary;

use std::fmt::Debug;

use crate::event::Event;
use crate::stream::{Reading, StreamId};
use crate::visit::Visit;

pub use crate::replay::Solution;
pub use config::{ConfigError, NotRestored, OfOneType, SessionConfig, SystemConfig};
pub use declaration::{
    AidRule, ChartRule, ClockAhead, Column, Declaration, InstrumentRule, Level, LogClocks, Parameter,
    PartRule, Simulated, SimulatedStream, StreamRule,
};
pub use pose::{AidState, BodyPose, ChartValue, Pose, PoseState};
pub use summary::{Progress, SensorState, Summary};

/// A system at work on one session. It does no input or output, and the same readings and visits give the same events to
/// the last bit, however they were cut into batches.
pub trait System: Debug + Send {
    /// Takes one reading; the readings of a stream come in the order of its log. Across streams they come as they
    /// arrive: a system decides what it does with a stream's readings before it merges them by time
    /// ([`crate::merge`]), as a detector may look ahead. Appends what became known to `events`.
    fn push(&mut self, stream: StreamId, reading: Reading<'_>, events: &mut Vec<Event>);

    /// Takes a visit, before or after its time; one that is older than what the system remembers is turned down with a
    /// reason.
    fn visit(&mut self, visit: Visit, events: &mut Vec<Event>);

    /// No more readings of this stream will come: others need not wait for it. A system that makes nothing wait has nothing
    /// to do here.
    fn end(&mut self, _stream: StreamId, _events: &mut Vec<Event>) {}

    /// No more readings will come: all that waits is processed, but for the smoothing.
    fn finish(&mut self, _events: &mut Vec<Event>) {}

    /// Smooths the next piece of a session that is finished, from its end to its start; says whether there was one.
    fn smooth_next(&mut self, _events: &mut Vec<Event>) -> bool {
        false
    }

    /// How far it has come.
    fn progress(&self) -> Progress;

    /// What it believes of its sensors now.
    fn sensors(&self) -> Vec<SensorState> {
        Vec::new()
    }

    /// Where it is at its newest reading, for a control loop; `None` for a system that has none, or does not know yet.
    fn pose(&self) -> Option<Pose> {
        None
    }

    /// What corrects its pose, by name, in the order of the bits of [`Pose::aids`].
    fn aid_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Values of its own charts that became known since the last time. Those of a session that is streamed are not kept.
    fn chart_values(&mut self) -> Vec<ChartValue> {
        Vec::new()
    }

    /// What is to be saved, when so much has come since the last time that it is worth it: the time from which on the
    /// state knows its past, ns, and the state.
    fn save(&mut self) -> Option<(i64, Vec<u8>)>;

    /// Whether it was restored, and a visit wanted to go back to before what was saved.
    fn lacks_past(&self) -> bool {
        false
    }

    /// The same system, to be looked into by its own tests.
    #[cfg(test)]
    fn as_any(&mut self) -> Option<&mut dyn std::any::Any> {
        None
    }
}
