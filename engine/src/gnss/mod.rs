//! Satellites: what receivers wrote, where the satellites were, and what lies between.
//!
//! Files come as text ([`observation_reader`], [`navigation_reader`]), RINEX 2.10 to 4. Times are GPS time inside, whatever the
//! file's own time system. [`solution`] writes positions for other programs. It knows no estimator.

pub mod ephemeris;
#[cfg(test)]
mod ephemeris_tests;
pub mod fixed_columns;
pub mod geometry;
pub mod ionosphere;
pub mod navigation_reader;
pub mod observation_header;
pub mod observation_reader;
mod observation_reader_2;
mod observation_reader_3;
#[cfg(test)]
mod observation_reader_tests;
pub mod observations;
pub mod rinex_error;
pub mod rtcm;
pub mod satellite;
pub mod signal;
pub mod single_point;
pub mod solution;
pub mod time;
pub mod troposphere;
