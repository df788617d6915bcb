//! `lodestep process rover`: what a rover and a base observed, and what a tag ranged, made into a track.

mod files;
mod process;
mod report;

pub(super) use process::{command, run};
