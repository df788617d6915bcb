//! Paper 3: the feed cabin and its Stewart platform by antennas, inertial sensors, total stations and encoders.
//!
//! One filter for both: the cabin's strapdown, and beside its errors those of every device. The platform hangs on the cabin
//! by the encoders' geometry, so every ray of a station to it corrects the cabin, and every antenna corrects the platform.

pub mod instrument;
pub mod rows;
pub mod session;

mod aids;
mod body;
mod covariance;
mod filter;
mod gravity_alignment;
mod handover;
mod instrument_check;
mod joints;
mod measure;
mod output;
mod past;
mod rig;
mod start;
mod states;
mod tape;
mod tuning;
mod watch;

pub use aids::Aids;
pub use instrument::{Instrument, InstrumentError};
pub use output::{Row, Status};
pub use session::{CabinConfig, CabinError, CabinSession, Estimator, Poses};
pub use watch::CabinAnomaly;
