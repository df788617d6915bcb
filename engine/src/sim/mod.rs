//! Simulated walks: truth first, in closed form, then the sensors. Nothing here knows the filter.

pub mod faults;
mod gait;
mod jet;
mod magnetism;
mod path;
mod plan;
mod random;
mod rest;
pub mod sensors;
mod simulator;
mod spiral;
mod swing;
#[cfg(test)]
mod tests;
pub mod walk;

pub use random::white_noise;
pub use sensors::SensorModel;
pub use simulator::{Epoch, FootTruth, MarkerVisit, Simulator, Walk, simulate};
pub use walk::{WalkKind, Walker};
