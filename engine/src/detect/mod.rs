//! When a measurement applies: whether a sensor can be believed, whether it stands still on the ground, when somebody stops.

pub mod sensor_health;
pub mod stance;
pub(crate) mod standing;
