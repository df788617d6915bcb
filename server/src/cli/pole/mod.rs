//! `lodestep process pole`: a survey with a positioning pole, from its files to its points; `lodestep simulate pole`: one that
//! never was.

mod files;
mod process;
mod report;
mod simulate;
mod surveyed;
mod track;

use super::own::OwnCommand;

/// `lodestep process pole`.
pub(super) const PROCESS: OwnCommand =
    OwnCommand { name: "pole", command: process::command, run: process::run };

/// `lodestep simulate pole`.
pub(super) const SIMULATE: OwnCommand =
    OwnCommand { name: "pole", command: simulate::command, run: simulate::run };
