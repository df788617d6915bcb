//! A real server, asked over HTTP and websockets.

mod faults;
mod inspectors;
mod live;
mod markers;
mod sessions;
mod surroundings;
mod upload;
