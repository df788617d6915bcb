//! `lodestep stream`: what receivers send, brought to a server as one live session.

mod link;
mod observed;
mod rover;

use anyhow::Result;
use clap::{Args, Subcommand};

/// The arguments of `lodestep stream`.
#[derive(Debug, Args)]
pub(super) struct StreamCommand {
    #[command(subcommand)]
    system: System,
}

#[derive(Debug, Subcommand)]
enum System {
    /// A rover and its base by RTCM 3 from casters or receivers, and the ranges of its tag
    Rover(Box<rover::RoverArgs>),
}

/// Streams until it is asked to stop.
pub(super) fn stream(command: StreamCommand) -> Result<()> {
    let System::Rover(args) = command.system;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(rover::run(*args))
}
