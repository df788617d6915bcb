//! Surveys under a roof: an inertial sensor on a positioning pole that is used as a walking stick. Paper 4, and what is
//! better than it.

mod alignment;
mod checks;
mod contact;
mod coupling;
mod filter;
pub mod findings;
mod pass;
pub mod points;
pub mod recording;
mod smoothing;
mod states;
pub mod survey;
pub mod tuning;
