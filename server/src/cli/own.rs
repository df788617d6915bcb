//! Command lines of a system's own, where what it takes is more than a log for each stream: an instrument, several kinds of
//! files, a survey's points. Such a command stands in the place of the one that is made from the declaration.
//!
//! A system's commands are in a folder of its name beside this file, with a line in each list here.

use anyhow::Result;
use clap::{ArgMatches, Command};

use crate::cli::{cabin, pole, rover};

/// A command of one system: `lodestep process NAME`, or `lodestep simulate NAME`.
#[derive(Debug)]
pub(super) struct OwnCommand {
    /// The system's name.
    pub(super) name: &'static str,
    /// What the command takes, with its help.
    pub(super) command: fn() -> Command,
    /// Runs it.
    pub(super) run: fn(&ArgMatches) -> Result<()>,
}

/// `lodestep process NAME`.
pub(super) const PROCESS: &[OwnCommand] = &[
    OwnCommand { name: "cabin", command: cabin::process_command, run: cabin::run_process },
    pole::PROCESS,
    OwnCommand { name: "rover", command: rover::command, run: rover::run },
];

/// `lodestep simulate NAME`.
pub(super) const SIMULATE: &[OwnCommand] = &[
    OwnCommand { name: "cabin", command: cabin::simulate_command, run: cabin::run_simulate },
    pole::SIMULATE,
    OwnCommand { name: "rover", command: rover::simulate_command, run: rover::simulate },
];
