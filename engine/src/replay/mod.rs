//! Running a filter again: late visits, smoothing, and saved states, for every system.
//!
//! `filter` says what is asked of a filter. `history` runs it over what has come and goes back when something applies to a
//! past moment, on the `inputs` that it keeps or puts away; `smoothing` keeps what is needed to go back over the whole
//! session, stretch by stretch (`recording`); `saved` is what of this outlives a restart.

pub(crate) mod filter;
pub(crate) mod history;

mod inputs;
mod numbered_queue;
mod recording;
mod smoothing;
mod solution;

pub(crate) use self::history::LOOKS_BACK_NS;
pub use self::inputs::InputStore;
pub use self::solution::Solution;
