//! Bytes that people and devices give, made into samples, markers and visits. Everything here is
//! pure: bytes come as arguments, and what is wrong with them comes back as a [`ParseError`] that
//! says where, what was expected, what was found and what to do.

pub mod batch;
pub mod error;
pub mod frame;
mod header;
pub mod imu_csv;
pub mod live_message;
pub mod markers_csv;
mod number;
mod records;
mod table;
pub mod truth_csv;
mod units_check;
pub mod visits_csv;

pub use batch::Batch;
pub use error::{ParseError, ParseErrorKind};
pub use imu_csv::ImuCsv;
