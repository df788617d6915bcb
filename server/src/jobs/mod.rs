//! Work that takes a while: asked for by a request, done one after the other beside it.
//!
//! The table is the queue, so that a killed server goes on where it was; only the progress of a
//! running job is kept in memory.

pub(crate) mod progress;
pub mod queue;
pub(crate) mod worker;

pub use queue::Queue;
