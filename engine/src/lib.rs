//! The navigation library of Lodestep: samples in, events out.

pub mod evaluate;
pub mod event;
pub mod geo;
pub mod parse;
pub mod sample;
pub mod session;
pub mod sim;
pub mod track;
