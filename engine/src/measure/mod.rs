//! One measurement model a file: nominal state in; innovation, Jacobian and noise out. Each is
//! checked against differences of the nonlinear model.

#[cfg(test)]
pub(crate) mod differences;
pub mod height;
pub mod magnetic_heading;
pub mod magnetic_rate;
pub mod marker_position;
pub mod zero_angular_rate;
pub mod zero_velocity;
