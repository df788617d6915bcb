//! The one strapdown and error-state core that every system shares.

pub(crate) mod adjoint;
pub mod alignment;
pub(crate) mod aside;
pub mod block_covariance;
#[cfg(test)]
pub(crate) mod differences;
pub mod earth;
mod earth_map;
mod earth_transition;
pub mod error_model;
pub mod eskf;
pub mod imu_noise;
pub mod layout;
pub mod lever_arm;
pub mod linear_maps;
pub mod mechanization;
pub mod nav_state;
pub mod observation;
pub mod process_noise;
mod sensor_map;
pub mod strapdown;
pub(crate) mod tape;
