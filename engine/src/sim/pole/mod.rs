//! A surveyor with a positioning pole: the way, the landings, the motion of the pole, and the files of the survey.
//!
//! Truth first: where the tip stands and how the pole leans, then what the sensor, the receiver and the switch make of it.
//! The pole rings when it strikes the ground; it does not bend under its load: real ones do.

mod course;
mod motion;
mod survey;
mod trouble;

pub use course::Route;
pub use survey::{GnssEpoch, SimulatedSurvey, TruthRow, simulate};
pub use trouble::Trouble;
