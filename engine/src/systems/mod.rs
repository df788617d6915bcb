//! The systems that the core serves; each reads as its paper.

pub mod pedestrian;
pub mod vertical;
