//! `lodestep process pole`: a survey with a positioning pole, from its files to its points.

mod files;
mod instrument;
mod process;
mod report;
mod surveyed;
mod track;

use super::own::OwnCommand;

/// `lodestep process pole`.
pub(super) const PROCESS: OwnCommand =
    OwnCommand { name: "pole", command: process::command, run: process::run };
