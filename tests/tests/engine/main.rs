//! The engine as a whole: walks with a known truth, told to sessions in every way they may come,
//! with sensors that break; recorded walks; and whether the filter knows how wrong it is.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod bad_data;
mod damaged_files;
mod dense_reference;
mod height;
mod honesty;
mod instruments;
mod memory;
mod north;
mod order_of_arrival;
mod pole;
mod recorded_walks;
mod rtcm;
mod saved_state;
mod scenario;
mod simulated_walks;
mod smoothed;
mod told;
mod visits;
mod which_marker;
