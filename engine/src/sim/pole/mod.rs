//! A surveyor with a positioning pole: the way, the landings, the motion of the pole, and the files of the survey.
//!
//! Truth first: where the tip stands and how the pole leans, then what the sensor, the receiver and the switch make of it.
//! The pole rings when it strikes the ground. In the usual world it does not bend under its load; in drawn ones it does, as
//! real ones do.

mod course;
mod drawn;
mod gnss;
mod motion;
mod survey;
mod trouble;
mod world;

pub use course::Route;
pub use gnss::GnssEpoch;
pub use survey::{SimulatedSurvey, TruthRow, simulate, simulate_in};
pub use trouble::Trouble;
pub use world::{Worlds, described};
