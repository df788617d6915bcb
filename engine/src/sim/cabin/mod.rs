//! The feed cabin of a telescope: its motion in closed form, then what antennas, inertial sensors, total stations and encoders
//! make of it.
//!
//! A seed draws a whole world: the instrument's geometry, the source that is tracked, the cables' modes, every device's errors.

mod course;
mod devices;
mod fault;
mod geometry;
mod rows;
mod sightings;
mod swing;

pub use fault::{Fault, FaultKind};
pub use geometry::{Geometry, PRISMS_ON_CABIN};
pub use rows::{AntennaReading, EncoderReading, PoseTruth, Ray, SimulatedRun};

use self::course::Course;
use self::devices::Devices;

/// What a run is to be.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPlan {
    /// Parked, s.
    pub hold_s: f64,
    /// Change of source, s.
    pub slew_s: f64,
    /// Tracking, s.
    pub track_s: f64,
    /// Whether stations look at the platform's prisms, or else at the cabin's.
    pub stations_on_platform: bool,
    /// What goes wrong.
    pub faults: Vec<Fault>,
}

impl Default for RunPlan {
    /// As in the paper: three minutes to the source, ten on it.
    fn default() -> RunPlan {
        RunPlan {
            hold_s: 40.0,
            slew_s: 180.0,
            track_s: 600.0,
            stations_on_platform: true,
            faults: Vec::new(),
        }
    }
}

/// A run of this seed.
pub fn simulate(plan: &RunPlan, seed: u64) -> SimulatedRun {
    let geometry = Geometry::drawn(seed);
    let course = Course::drawn(plan, &geometry, seed);
    Devices::new(plan, &geometry, &course, seed).run()
}

#[cfg(test)]
mod tests;
