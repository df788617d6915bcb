//! The navigation library of Lodestep: samples in, events out.

pub mod event;
pub mod sample;
pub mod session;
