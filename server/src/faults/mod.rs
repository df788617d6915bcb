//! Findings on equipment: reported, placed by where their inspector was, closed.

mod candidates;
mod place;
mod report;

pub(crate) use report::{NewFault, report, reported};
