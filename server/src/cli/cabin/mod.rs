//! The feed cabin's own commands: an instrument, and a file for each kind of device.

mod aid_rows;
mod pose_csv;
mod process;
mod row_file;
mod simulate;

pub(super) use process::{command as process_command, run as run_process};
pub(super) use simulate::{command as simulate_command, run as run_simulate};
