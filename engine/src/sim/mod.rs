//! Simulation: truth first, in closed form, then the sensors. Nothing here knows the filter.

pub mod faults;
mod jet;
mod magnetism;
pub mod pedestrian;
mod random;
mod sensors;

pub use random::white_noise;
