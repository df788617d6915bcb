//! When a measurement applies: what a standing foot looks like, where a swing passes the other foot,
//! whether a sensor can be believed, when an inspector stands.

mod cadence;
pub mod sensor_health;
pub mod stance;
pub mod stance_magnetics;
pub(crate) mod standing;
pub mod swing;
