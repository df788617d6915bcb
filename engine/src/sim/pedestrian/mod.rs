//! A walker with a sensor on each shoe: courses, footholds and gaits, and the logs and truth of both feet.

mod gait;
mod path;
mod plan;
mod rest;
mod simulator;
mod spiral;
mod swing;
#[cfg(test)]
mod tests;
mod walk;

pub use crate::sim::sensors::SensorModel;
pub use simulator::{Epoch, FootTruth, MarkerVisit, Simulator, Walk, simulate};
pub use walk::{WalkKind, Walker};
