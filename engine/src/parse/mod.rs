//! Bytes that people and devices give, made into samples, markers and visits. Everything here is
//! pure: bytes come as arguments, and what is wrong with them comes back as a [`ParseError`] that
//! says where, what was expected, what was found and what to do.

pub mod anchors_csv;
pub mod any_table;
pub mod batch;
mod clock_text;
mod encoding;
pub mod error;
pub mod frame;
pub mod gnss;
pub mod gnss_columns;
pub mod gnss_csv;
mod header;
pub mod imu_csv;
mod left_out;
mod lines;
pub mod live_message;
pub mod log_format;
pub mod log_reader;
pub mod log_survey;
mod mapped_csv;
pub mod mapping;
pub mod markers_csv;
mod microstrain;
pub mod name_number;
pub mod named_csv;
pub mod names;
pub mod nmea;
mod number;
pub mod ranges_csv;
mod records;
pub mod remark;
pub mod rtklib_pos;
pub mod stops_csv;
pub mod stream_reader;
mod suggestion;
pub mod surveyed;
pub mod switch_csv;
mod table;
pub mod table_head;
mod table_text;
pub mod times;
pub mod truth_csv;
mod units_check;
pub mod values_csv;
pub mod visits_csv;
mod wit_serial;
mod wit_table;
mod x_io;
mod xsens;

pub use batch::Batch;
pub use error::{ParseError, ParseErrorKind};
pub use imu_csv::ImuCsv;
pub use log_reader::{LogReader, Reading};
pub use stream_reader::StreamReader;
