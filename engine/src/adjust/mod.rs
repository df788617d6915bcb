//! Adjustment: whole numbers by least squares, and how good observations are by their own residuals. It knows no sensor.

pub mod integers;
mod reduction;
mod search;
pub mod variance_components;
