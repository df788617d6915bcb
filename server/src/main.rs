//! `lodestep`: the server and the command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    lodestep_server::cli::run(std::env::args_os())
}
