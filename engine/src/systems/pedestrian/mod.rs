//! An inspector with a sensor on each foot (paper 1).
//!
//! The samples of each foot come down a `line` (health, standing start, stance); `start` turns the
//! standing starts into the filter's first state; `filter` is the joint error filter with both
//! strapdowns, one sample at a time, aided by `stance_aids` (a foot that stands), `two_feet` (what
//! they know of each other) and `visits` (markers), with `lost` for a foot of which nothing was
//! heard, `position` for what is told and `inside` for what is only looked at; `history` runs it over what has come, and goes back when
//! something applies to a past moment, on the `steps` that it keeps or puts away; `smoothing` keeps what is needed to go back over the whole walk,
//! stretch by stretch (`recording`). `foot` is what is kept of one foot, `walked` how far it
//! went, `tuning` every parameter.

pub mod tuning;

pub use self::steps::Attic;

pub(crate) mod filter;
pub(crate) mod foot;
pub(crate) mod history;
pub(crate) mod line;
pub(crate) mod slow_errors;
pub(crate) mod start;

mod inside;
mod kept_step;
mod lost;
mod numbered;
mod position;
mod recording;
mod smoothing;
mod stance_aids;
mod steps;
mod two_feet;
mod visits;
mod walked;
