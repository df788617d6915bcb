//! `process`, `simulate` and `evaluate` for every system of the catalogue, by what it declares.

mod declared;
mod evaluate;
mod named;
mod process;
mod simulate;

pub(super) use evaluate::evaluate;
pub(super) use named::{OfSystem, named};
pub(super) use process::{SessionArgs, process};
pub(super) use simulate::{SimulatedArgs, simulate};
