//! `lodestep process rover`: what a rover and a base observed, and what a tag ranged, made into a track; and
//! `lodestep simulate rover`: the same of a world that never was.

mod files;
mod process;
mod report;
mod simulate;
mod track_file;

pub(super) use process::{command, parse_place, run};
pub(super) use simulate::{command as simulate_command, run as simulate};
