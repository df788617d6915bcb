//! Surveys under a roof: an inertial sensor on a positioning pole that is used as a walking stick. Paper 4, and what is
//! better than it.

mod aids;
mod alignment;
pub mod causes;
mod checks;
mod contact;
mod coupling;
mod declaration;
mod filter;
mod findings;
mod gnss_rows;
mod landing;
mod learnt;
mod live;
mod outcome;
mod pass;
pub mod points;
pub mod pole_file;
pub mod recorder;
pub mod recording;
mod refusals;
mod sensor_class;
mod smoothing;
mod start;
mod states;
pub mod survey;
mod system;
pub mod tuning;

pub use declaration::DECLARATION;
pub use system::track_point;
