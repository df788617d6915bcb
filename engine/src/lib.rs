//! The navigation library of Lodestep: samples in, events out.

pub mod detect;
pub mod evaluate;
pub mod event;
pub mod geo;
pub mod ins;
pub mod measure;
pub mod parse;
pub mod rotation;
pub mod sample;
pub mod session;
pub mod sim;
pub mod systems;
pub mod track;
