//! One measurement model a file: nominal state in; innovation, Jacobian and noise out. Each is
//! checked against differences of the nonlinear model.

pub mod antenna_position;
pub mod antenna_velocity;
pub mod height;
pub mod magnetic_heading;
pub mod magnetic_rate;
pub mod marker_position;
pub mod tip_position;
pub mod tip_velocity;
pub mod zero_angular_rate;
pub mod zero_velocity;
