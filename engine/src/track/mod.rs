//! The track of a session: events folded into final points, and these written for others to read.

pub mod csv;
mod decimate;
mod digest;
mod fold;
pub mod geojson;
pub mod gpx;
pub mod kml;
mod pieces;
mod place;

pub use decimate::decimate;
pub use fold::{AidTally, Track};
pub use place::TrackPlace;
