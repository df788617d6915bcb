//! The systems that the core serves; each reads as its paper. [`catalogue`] lists them.

pub mod cabin;
pub mod catalogue;
pub mod fixes;
pub mod pedestrian;
pub mod pole;
pub mod rover;
pub mod vertical;
