//! A walker with a sensor on each shoe: courses, footholds and gaits, and the logs and truth of both feet.

pub mod contradictions;
mod foot_motion;
mod gait;
mod path;
mod plan;
mod rest;
mod sensors;
mod simulator;
mod spiral;
mod swing;
#[cfg(test)]
mod tests;
mod walk;

pub use sensors::SensorModel;
pub use simulator::{Epoch, FootTruth, MarkerVisit, Simulator, Walk, simulate};
pub use walk::{WalkKind, Walker};
