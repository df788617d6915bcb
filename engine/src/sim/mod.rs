//! Simulation: truth first, in closed form, then what sensors make of it. Nothing here knows the filter.
//!
//! A carrier's truth is a [`Motion`]; a sensor samples it: an [`Imu`], a [`FixSource`], a magnetometer, a barometer. What is one
//! carrier's only, its courses and its set of sensors, has a folder of its own; the files beside the folders know none of
//! them.

mod barometer;
pub mod cabin;
mod earth;
pub mod faults;
mod fix;
mod gauss_markov;
mod imu;
mod jet;
mod jet_rotation;
mod magnetism;
mod magnetometer;
mod motion;
pub mod pedestrian;
pub mod pole;
mod random;
pub mod rover;
mod triad;

pub use barometer::BarometerModel;
pub use earth::Earth;
pub use fix::{Fix, FixModel, FixSource};
pub use imu::{Imu, ImuModel, ImuReading};
pub use jet::Jet;
pub use jet_rotation::JetRotation;
pub use magnetism::FieldAnomalies;
pub use magnetometer::MagnetometerModel;
pub use motion::{Kinematics, Motion, Mounting};
pub use random::white_noise;
