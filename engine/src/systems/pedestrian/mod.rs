//! An inspector with a sensor on each foot (paper 1).
//!
//! The samples of each foot come down a `line` (health, standing start, stance); `start` turns the
//! standing starts into the filter's first state; `filter` is the joint error filter with both
//! strapdowns, one sample at a time, aided by `stance_aids` (a foot that stands), `two_feet` (what
//! they know of each other) and `visits` (markers), with `lost` for a foot of which nothing was
//! heard, `position` for its points and `inside` for what is only looked at. `replayed` is what late visits and smoothing ask of it
//! (`crate::replay`), on steps as `kept_step` keeps them. `foot` is what is kept of one foot, `walked` how far it
//! went, `tuning` every parameter.

pub mod tuning;

pub(crate) mod filter;
pub(crate) mod foot;
pub(crate) mod kept_step;
pub(crate) mod line;
pub(crate) mod slow_errors;
pub(crate) mod start;

mod inside;
mod lost;
mod position;
mod replayed;
mod stance_aids;
mod two_feet;
mod visits;
mod walked;
