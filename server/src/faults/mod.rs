//! Findings on equipment: reported, placed by where their inspector was, and seen to until their repair is
//! verified.

mod candidates;
mod change;
mod clock;
mod nearest;
mod photos;
mod place;
mod place_again;
mod report;

pub(crate) use change::{FaultPatch, change, close};
pub(crate) use nearest::{Helper, nearest};
pub(crate) use photos::{MOST_BYTES, add_photo, remove_photo};
pub(crate) use place_again::place_again;
pub(crate) use report::{NewFault, report, reported};
