//! An inspector with a sensor on each foot (paper 1).
//!
//! The samples of each foot come down a `preprocess` (health, standing start, stance); `start` turns the
//! standing starts into the filter's first state; `filter` is the joint error filter with both
//! strapdowns, one sample at a time, aided by `stance_aids` (a foot that stands), `two_feet` (what
//! they know of each other) and `visits` (markers), with `north` (what they say of how a walk is turned), `lost` for a foot of which nothing was
//! heard, `position` for its points and `sensor_states` for what is only looked at. What sensors contradict (`contradictions` names it) is found at the
//! start by `start_field` and on the way by `doubts`, `field_turn` and, of the height, `ride`; `field_reach` learns how far a disturbance of the field reaches; `beyond` is what it adds to the sigmas. `replayed` is what late visits and smoothing ask of it
//! (`crate::replay`), on steps as `kept_step` keeps them. `foot` is what is kept of one foot, `odometer` how far it
//! went, `tuning` every parameter, `foot_noise` what its sensor adds to the truth. `system` joins them to what a session asks of a system; `declaration` says what that is to the
//! rest of the house, with `side` (the streams), `aids`, `parameters` and `causes` (what can be wrong).

pub mod aids;
pub mod causes;
pub mod contradictions;
pub mod feet_clocks;
pub mod foot_noise;
pub mod side;
pub mod tuning;

pub(crate) mod filter;
pub(crate) mod foot;
pub(crate) mod preprocess;
pub(crate) mod slow_errors;
pub(crate) mod spike;
pub(crate) mod system;

mod beyond;
mod both_feet_open;
mod cadence;
mod config;
mod contact;
mod declaration;
mod doubts;
mod field_reach;
mod field_turn;
pub mod foot_separation;
mod gyro_jump;
mod kept_step;
mod known_places;
mod lost;
mod north;
mod odometer;
mod parameters;
mod position;
mod replayed;
mod ride;
mod sensor_states;
mod stance_aids;
pub mod stance_magnetics;
mod start;
mod start_field;
pub mod swing;
mod two_feet;
mod visits;

pub use self::aids::Aids;
pub use self::config::{Config, two_feet};
pub use self::declaration::DECLARATION;
pub use self::side::{BOTH, LEFT, RIGHT, Side, stream};
