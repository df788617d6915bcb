//! The one strapdown and error-state core that every system shares.

pub(crate) mod adjoint;
pub mod alignment;
pub(crate) mod aside;
pub mod block_covariance;
pub mod error_model;
pub mod eskf;
pub mod imu_noise;
pub mod layout;
pub mod mechanization;
pub mod nav_state;
pub mod observation;
pub mod rows;
mod sensor_map;
pub(crate) mod tape;
