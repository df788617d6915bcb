//! Simulated walks: truth first, in closed form, then the sensors. Nothing here knows the filter.
