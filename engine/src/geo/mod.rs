//! The Earth and the site: ellipsoid, local frame, gravity, magnetic field, and FAST's reflector.

pub mod dome;
pub mod ellipsoid;
pub mod gravity;
pub mod gravity_field;
pub mod local_frame;
mod magnetic_coefficients;
pub mod magnetic_field;
pub mod site;
pub mod terrain;
pub mod transverse_mercator;

pub use ellipsoid::Geodetic;
pub use local_frame::LocalFrame;
pub use magnetic_field::MagneticField;
pub use site::{Site, SiteError, SiteField};
