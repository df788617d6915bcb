//! Paper 3: the feed cabin and its Stewart platform by antennas, inertial sensors, total stations and encoders.
//!
//! One filter for both: the cabin's strapdown, and beside its errors those of every device. The platform hangs on the cabin
//! by the encoders' geometry, so every ray of a station to it corrects the cabin, and every antenna corrects the platform.

pub mod instrument;
pub mod intake;
pub mod rows;
pub mod scores;
mod sensor_watch;
mod session;

mod aids;
mod between;
mod body;
mod cause_examples;
mod causes;
mod charts;
mod config;
mod covariance;
mod declaration;
mod doubt;
mod encoder_watch;
mod filter;
mod gravity_alignment;
mod handover;
mod instrument_check;
mod joints;
mod lead;
mod leg_doubt;
mod legs;
mod measure;
mod now;
mod opening;
mod order;
mod output;
mod past;
mod plan;
mod points;
mod rig;
mod saved;
mod start;
mod states;
mod steady;
mod system;
mod tape;
mod tuning;
mod watch;
mod weighing;

pub use aids::Aids;
pub use causes::CabinCause;
pub use declaration::DECLARATION;
pub use instrument::{Instrument, InstrumentError};
pub use now::{BodyNow, Now};
pub use order::WINDOW;
pub use output::{Row, Status};
pub use points::track_points;
pub use session::{CabinConfig, CabinError, CabinSession, Estimator, Poses};
pub use system::anomaly;
pub use watch::CabinAnomaly;
